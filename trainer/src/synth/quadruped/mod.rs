//! The body of a quadruped at rest: standing, facing +z, its left at +x.
//!
//! Lengths are those of a dog 0.6 high at the withers; a species scales regions of it, then the whole.

mod head;
mod legs;
mod species;
mod stylise;
mod trunk;

use super::gait;
use super::math::Vec3;
use super::proportions::proportions;
use super::random::chance;
use super::recipe::Recipe;
use super::species::Plan;
use fmnet::mesh::vec3;

/// Indices of the bones of a quadruped. Those of a side are to be passed to [`bone::limb`].
pub(in crate::synth) mod bone {
    super::super::bones::bones! {
        PELVIS LUMBAR CHEST LOW_NECK NECK HEAD TAIL TAIL_MIDDLE TAIL_END;
        BLADE UPPER_ARM FOREARM HAND FORE_TOES THIGH SHIN FOOT HIND_TOES;
        PROBOSCIS PROBOSCIS_END
    }
}

proportions! {
    /// Size of everything.
    size = 1.0, 0.03;
    legs = 1.0, 0.07;
    leg_girth = 1.0, 0.08;
    /// Length of the trunk.
    trunk = 1.0, 0.05;
    chest = 1.0, 0.07;
    loin = 1.0, 0.08;
    rump = 1.0, 0.07;
    /// Flesh under the belly, in units of a dog's withers.
    belly = 0.0, 0.012;
    /// Height of a hump over the shoulders.
    hump = 0.0, 0.006;
    neck = 1.0, 0.1;
    neck_girth = 1.0, 0.08;
    /// Rise of the neck above the horizontal, in degrees.
    neck_rise = 48.0, 0.12;
    /// Depth of the throat below the neck, as of a bull or a maned lion.
    throat = 1.0, 0.2;
    head = 1.0, 0.05;
    head_width = 1.0, 0.05;
    muzzle = 1.0, 0.1;
    muzzle_girth = 1.0, 0.08;
    ear = 1.0, 0.15;
    ear_width = 1.0, 0.12;
    /// How far the ears hang, from erect (0) over sideways (1) to down (2).
    ear_drop = 0.0, 0.08;
    tail = 1.0, 0.12;
    tail_girth = 1.0, 0.12;
    /// Direction of the tail below the horizontal, in degrees.
    tail_drop = 35.0, 0.2;
    /// How bushy the tail is.
    brush = 0.0, 0.1;
    paw = 1.0, 0.08;
    /// One round hoof (1) instead of toes (0).
    hoof = 0.0, 0.0;
    /// Length of horns, and how far they branch (0 for a cow's, 1 for antlers).
    horn = 0.0, 0.0;
    antler = 0.0, 0.0;
    /// Length of a trunk on the nose.
    proboscis = 0.0, 0.0;
    /// Hair around neck and cheeks.
    mane = 0.0, 0.0;
}

/// Animals on four legs.
pub(super) static PLAN: Plan = Plan {
    name: "quadruped",
    species: species::NAMES,
    held_out: Some("panther"),
    base: || recipe(&Proportions::default()),
    breed: |breed, rng| {
        let proportions = species::proportions(breed, rng);
        let toy = breed.varies && chance(rng, TOYS);
        recipe(&if toy { proportions.as_toy(rng) } else { proportions })
    },
    pose: |_, rng| gait::random_quadruped(rng),
    rest: |_, rng| gait::resting_quadruped(rng),
};

/// Share of the breeds in proportions that nothing alive has.
const TOYS: f64 = 0.25;
const HEAD_MAGNIFIED: f64 = 1.25;
const PAW_MAGNIFIED: f64 = 1.25;
/// Height of the elbow region, below which legs are stretched.
const LEG: f64 = 0.36;

/// The body of a quadruped with the given proportions. Bodies of all proportions have the same first parts.
fn recipe(proportions: &Proportions) -> Recipe {
    let mut sculptor = Sculptor { recipe: Recipe::new(0.0068), to: *proportions };
    sculptor.bones();
    sculptor.trunk();
    sculptor.neck_and_tail();
    sculptor.head();
    for side in 0..2 {
        sculptor.front_leg(side);
        sculptor.hind_leg(side);
    }
    (0..2).for_each(|side| sculptor.hooves(side));
    sculptor.extras();
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
            ("pelvis", None, at(0.53, -0.24), at(0.545, -0.12), 1.0),
            ("lumbar", Some(PELVIS), at(0.54, -0.12), at(0.535, 0.06), 1.0),
            ("chest", Some(LUMBAR), at(0.53, 0.06), at(0.53, 0.24), 1.0),
            ("low_neck", Some(CHEST), self.neck(0.0), self.neck(0.5), 0.8),
            ("neck", Some(LOW_NECK), self.neck(0.5), self.neck(1.0), 0.6),
            ("head", Some(NECK), self.neck(1.0), self.skull([0.0, 0.0, 0.1]), 0.3),
            ("tail_1", Some(PELVIS), self.tail(0.0), self.tail(0.33), 0.3),
            ("tail_2", Some(TAIL), self.tail(0.33), self.tail(0.66), 0.3),
            ("tail_3", Some(TAIL + 1), self.tail(0.66), self.tail(1.0), 0.3),
        ];
        self.recipe.skeleton.add_all(&spine);
        let [shoulder, elbow, wrist, pad] = self.front();
        let [hip, knee, hock, ball] = self.hind();
        let blade = self.at([0.05, 0.56, 0.19]);
        let (claws, nails) = (self.paw(pad, 0.05), self.paw(ball, 0.05));
        let limbs = [
            ("blade", CHEST, blade, shoulder, 0.8),
            ("upper_arm", BLADE, shoulder, elbow, 0.6),
            ("forearm", UPPER_ARM, elbow, wrist, 0.35),
            ("hand", FOREARM, wrist, pad, 0.15),
            ("fore_toes", HAND, pad, claws, 0.12),
            ("thigh", PELVIS, hip, knee, 0.8),
            ("shin", THIGH, knee, hock, 0.4),
            ("foot", SHIN, hock, ball, 0.15),
            ("hind_toes", FOOT, ball, nails, 0.12),
        ];
        self.recipe.skeleton.add_pairs(&limbs);
        for (name, parent, from) in [("proboscis_1", HEAD, 0.0), ("proboscis_2", PROBOSCIS, 0.5)] {
            let (head, tail) = (self.proboscis(from), self.proboscis(from + 0.5));
            self.recipe.skeleton.add(name, Some(parent), head, tail, 0.5);
        }
        self.recipe.magnified = (0..COUNT)
            .map(|index| match left(index) {
                HEAD | PROBOSCIS | PROBOSCIS_END => HEAD_MAGNIFIED,
                FORE_TOES | HIND_TOES => PAW_MAGNIFIED,
                _ => 1.0,
            })
            .collect();
    }

    /// A point of trunk or legs: legs are stretched below the elbow, the trunk lengthwise.
    fn at(&self, [x, y, z]: Vec3) -> Vec3 {
        [x, y.min(LEG) * self.to.legs + (y - LEG).max(0.0), z * self.to.trunk]
    }

    /// A point of a leg's axis relative to its root, so that its lengthwise bends keep their size.
    fn leg(&self, root: Vec3, [x, y, z]: Vec3) -> Vec3 {
        let [_, y, _] = self.at([x, y, z]);
        [x, y, self.at(root)[2] + (z - root[2])]
    }

    /// Shoulder, elbow, wrist, ball of the left front leg.
    fn front(&self) -> [Vec3; 4] {
        let wide = 0.078 + 0.03 * (self.to.chest - 1.0);
        let points =
            [[wide, 0.40, 0.265], [wide + 0.006, 0.325, 0.165], [wide, 0.13, 0.19], [wide, 0.036, 0.198]];
        points.map(|p| self.leg([0.0, 0.4, 0.265], p))
    }

    /// Hip, knee, hock, ball of the left hind leg.
    fn hind(&self) -> [Vec3; 4] {
        let wide = 0.068 + 0.04 * (self.to.rump - 1.0);
        let points = [[wide, 0.49, -0.235], [wide + 0.02, 0.335, -0.155], [wide + 0.012, 0.17, -0.295]];
        let [hip, knee, hock] = points.map(|p| self.leg([0.0, 0.49, -0.235], p));
        [hip, knee, hock, self.leg([0.0, 0.49, -0.235], [wide + 0.012, 0.036, -0.265])]
    }

    /// A point of the neck's axis, from its base (0) to the skull (1).
    fn neck(&self, t: f64) -> Vec3 {
        let rise = self.to.neck_rise.to_radians();
        let base = self.at([0.0, 0.51, 0.22]);
        vec3::add(base, vec3::scale([0.0, rise.sin(), rise.cos()], 0.26 * self.to.neck * t))
    }

    /// A point of the tail's axis, from its root (0) to its tip (1), as an arc that turns downwards.
    fn tail(&self, t: f64) -> Vec3 {
        let root = self.at([0.0, 0.515 + 0.022 * self.to.rump, -0.28 - 0.035 * self.to.rump]);
        let drop = self.to.tail_drop.to_radians();
        let length = 0.32 * self.to.tail * t;
        vec3::add(root, [0.0, -drop.sin() * length, -drop.cos() * length])
    }

    /// A point of the proboscis' axis, from the nose (0) to its tip (1), hanging down.
    fn proboscis(&self, t: f64) -> Vec3 {
        let [y, z] = [-0.03 - 0.42 * self.to.proboscis.max(0.1) * t, 0.088 + 0.105 * self.to.muzzle];
        self.skull([0.0, y, z + 0.05 * (1.0 - (1.0 - t) * (1.0 - t))])
    }

    /// A point of the head, relative to the base of the skull, as modelled (enlarged).
    fn skull(&self, [x, y, z]: Vec3) -> Vec3 {
        let p = [x * self.to.head_width, y, z];
        vec3::add(self.neck(1.0), vec3::scale(p, HEAD_MAGNIFIED * self.to.head))
    }

    /// A point `reach` ahead of the ball of a foot, as modelled (enlarged).
    fn paw(&self, ball: Vec3, reach: f64) -> Vec3 {
        vec3::add(ball, vec3::scale([0.0, -0.012, reach], PAW_MAGNIFIED * self.to.paw))
    }
}
