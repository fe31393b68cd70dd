//! The body of a bird at rest: facing +z, its left at +x, the wings stretched out, the legs down.
//!
//! The trunk is modelled lying, then raised by the pitch of the species. Lengths are those of a bird with a trunk
//! 0.25 long.

mod body;
mod pose;
mod species;

use fmnet::mesh::vec3;

use super::math::{Quat, Vec3};
use super::proportions::proportions;
use super::recipe::Recipe;
use super::species::Plan;

/// Birds.
pub(super) static PLAN: Plan = Plan {
    name: "bird",
    species: species::NAMES,
    held_out: None,
    base: || recipe(&Proportions::default()),
    breed: |breed, rng| recipe(&species::proportions(breed, rng)),
    pose: |skeleton, rng| pose::random(skeleton, rng),
    rest: |skeleton, rng| pose::resting(skeleton, rng),
};

/// Indices of the bones of a bird. Those of a side are to be passed to [`bone::limb`].
mod bone {
    super::super::bones::bones! {
        PELVIS CHEST NECK NECK_MIDDLE NECK_END HEAD TAIL;
        WING WING_MIDDLE WING_END THIGH SHIN FOOT TOES;
    }
}

proportions! {
    /// Size of everything.
    size = 1.0, 0.04;
    /// Rise of the trunk above the horizontal, in degrees.
    pitch = 25.0, 0.12;
    trunk = 1.0, 0.05;
    girth = 1.0, 0.06;
    /// Depth of the breast.
    breast = 1.0, 0.07;
    neck = 1.0, 0.08;
    neck_girth = 1.0, 0.08;
    /// Rise of the neck above the horizontal, in degrees.
    neck_rise = 55.0, 0.1;
    head = 1.0, 0.05;
    beak = 1.0, 0.1;
    beak_girth = 1.0, 0.1;
    /// How far the beak's tip bends down, relative to its length.
    hook = 0.0, 0.05;
    wing = 1.0, 0.07;
    /// Width of the wings, from front to back.
    chord = 1.0, 0.08;
    tail = 1.0, 0.1;
    /// How wide the tail fans out.
    fan = 1.0, 0.15;
    legs = 1.0, 0.08;
    leg_girth = 1.0, 0.1;
    foot = 1.0, 0.07;
    /// Whether skin joins the toes.
    web = 0.0, 0.0;
}

const HEAD_MAGNIFIED: f64 = 1.3;
const FOOT_MAGNIFIED: f64 = 1.35;

fn recipe(proportions: &Proportions) -> Recipe {
    let mut sculptor = Sculptor { recipe: Recipe::new(0.0034), to: *proportions };
    sculptor.bones();
    sculptor.trunk();
    sculptor.neck_and_head();
    for side in 0..2 {
        sculptor.wing(side);
        sculptor.leg(side);
    }
    sculptor.webs();
    sculptor.features();
    sculptor.recipe.scaled(proportions.size)
}

struct Sculptor {
    recipe: Recipe,
    to: Proportions,
}

impl Sculptor {
    fn bones(&mut self) {
        use bone::*;
        let at = |y: f64, z: f64| self.at([0.0, y, z]);
        let spine = [
            ("pelvis", None, at(0.0, -0.09), at(0.0, -0.01), 1.0),
            ("chest", Some(PELVIS), at(0.0, -0.01), at(0.0, 0.09), 1.0),
            ("neck_1", Some(CHEST), self.neck(0.0), self.neck(0.34), 0.7),
            ("neck_2", Some(NECK), self.neck(0.34), self.neck(0.67), 0.7),
            ("neck_3", Some(NECK_MIDDLE), self.neck(0.67), self.neck(1.0), 0.6),
            ("head", Some(NECK_END), self.neck(1.0), self.skull([0.0, 0.0, 0.04]), 0.3),
            ("tail", Some(PELVIS), at(0.01, -0.135), self.tail_tip(), 0.5),
        ];
        self.recipe.skeleton.add_all(&spine);
        let [shoulder, elbow, wrist, tip] = self.wing_joints();
        let [hip, knee, hock, ball] = self.leg_joints();
        let limbs = [
            ("wing_1", CHEST, shoulder, elbow, 0.6),
            ("wing_2", WING, elbow, wrist, 0.6),
            ("wing_3", WING_MIDDLE, wrist, tip, 0.6),
            ("thigh", PELVIS, hip, knee, 0.6),
            ("shin", THIGH, knee, hock, 0.35),
            ("foot", SHIN, hock, ball, 0.12),
            ("toes", FOOT, ball, vec3::add(ball, [0.0, 0.0, 0.04]), 0.12),
        ];
        self.recipe.skeleton.add_pairs(&limbs);
        let magnified = |index: usize| match left(index) {
            HEAD => HEAD_MAGNIFIED,
            TOES => FOOT_MAGNIFIED,
            _ => 1.0,
        };
        self.recipe.magnified = (0..COUNT).map(magnified).collect();
    }

    /// A point of the lying trunk, once it is raised.
    fn at(&self, [x, y, z]: Vec3) -> Vec3 {
        let girth = self.to.girth;
        self.raised([x * girth, y * girth, z * self.to.trunk])
    }

    fn raised(&self, p: Vec3) -> Vec3 {
        Quat::x(-self.to.pitch).rotate(p)
    }

    fn tail_tip(&self) -> Vec3 {
        vec3::add(self.at([0.0, 0.01, -0.135]), self.raised([0.0, 0.0, -0.15 * self.to.tail]))
    }

    /// A point of the neck's axis, from its base (0) to the skull (1).
    fn neck(&self, t: f64) -> Vec3 {
        let rise = self.to.neck_rise.to_radians();
        let base = self.at([0.0, 0.025, 0.085]);
        vec3::add(base, vec3::scale([0.0, rise.sin(), rise.cos()], 0.1 * self.to.neck * t))
    }

    /// A point of the head, relative to the base of the skull, as modelled (enlarged).
    fn skull(&self, p: Vec3) -> Vec3 {
        vec3::add(self.neck(1.0), vec3::scale(p, HEAD_MAGNIFIED * self.to.head))
    }

    /// Shoulder, elbow, wrist and tip of the left wing.
    fn wing_joints(&self) -> [Vec3; 4] {
        let shoulder = [0.06 * self.to.girth, 0.03 * self.to.girth, 0.055 * self.to.trunk];
        let steps = [[0.0, 0.0, 0.0], [0.085, 0.008, -0.008], [0.17, 0.01, 0.006], [0.33, 0.004, -0.05]];
        let place = |step: Vec3| self.raised(vec3::add(shoulder, vec3::scale(step, self.to.wing)));
        steps.map(place)
    }

    /// Hip, knee, hock and ball of the left leg.
    fn leg_joints(&self) -> [Vec3; 4] {
        let (hip, legs) = (self.at([0.034, -0.018, -0.035]), self.to.legs);
        let thigh = 0.6 + 0.4 * legs.min(1.4);
        // Large feet must not touch each other.
        let apart = 0.03 * (self.to.foot - 1.0).max(0.0);
        let knee = vec3::add(hip, vec3::add(vec3::scale([0.01, -0.045, 0.03], thigh), [apart, 0.0, 0.0]));
        let hock = vec3::add(knee, [0.0, -0.055 * legs, -0.035 * legs.sqrt()]);
        let ball = vec3::add(hock, [0.004, -0.07 * legs, 0.014 * legs.sqrt()]);
        [hip, knee, hock, ball]
    }
}
