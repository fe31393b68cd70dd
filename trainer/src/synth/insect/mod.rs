//! The body of an insect at rest: standing, facing +z, its left at +x.
//!
//! Lengths are those of an ant 0.4 long; a species stretches head, thorax, abdomen and legs.

mod body;
mod pose;
mod species;

use fmnet::mesh::vec3;

use super::math::{Vec3, unit};
use super::proportions::proportions;
use super::recipe::Recipe;
use super::species::Plan;

/// Insects, and figures like spiders on six legs.
pub(super) static PLAN: Plan = Plan {
    name: "insect",
    species: species::NAMES,
    held_out: None,
    base: || recipe(&Proportions::default()),
    breed: |breed, rng| recipe(&species::proportions(breed, rng)),
    pose: |_, rng| pose::random(rng),
    rest: |_, rng| pose::resting(rng),
};

/// Indices of the bones of an insect. Those of a side are to be passed to [`bone::limb`].
mod bone {
    super::super::bones::bones! {
        THORAX HEAD WAIST ABDOMEN;
        FEELER FEELER_END JAW
        LEG FRONT_SHIN FRONT_FOOT MIDDLE_THIGH MIDDLE_SHIN MIDDLE_FOOT HIND_THIGH HIND_SHIN HIND_FOOT;
    }
}

proportions! {
    /// Size of everything.
    size = 1.0, 0.05;
    head = 1.0, 0.08;
    head_width = 1.0, 0.07;
    eye = 1.0, 0.15;
    jaw = 1.0, 0.15;
    /// Length of the neck.
    neck = 1.0, 0.1;
    thorax = 1.0, 0.06;
    thorax_girth = 1.0, 0.08;
    waist = 1.0, 0.1;
    waist_girth = 1.0, 0.12;
    abdomen = 1.0, 0.08;
    abdomen_width = 1.0, 0.08;
    abdomen_height = 1.0, 0.08;
    feeler = 1.0, 0.1;
    legs = 1.0, 0.07;
    leg_girth = 1.0, 0.08;
    /// Length of the hind legs, relative to the others.
    hind = 1.0, 0.07;
    /// Rise of the thighs above the horizontal, in degrees.
    knee_rise = 38.0, 0.15;
    /// Shell over thorax and abdomen, as a beetle's, relative to the abdomen.
    shell = 0.0, 0.0;
}

const LEG_NAMES: [[&str; 3]; 3] = [
    ["front_thigh", "front_shin", "front_foot"],
    ["middle_thigh", "middle_shin", "middle_foot"],
    ["hind_thigh", "hind_shin", "hind_foot"],
];

fn recipe(proportions: &Proportions) -> Recipe {
    let mut sculptor = Sculptor { recipe: Recipe::new(0.0032), to: *proportions };
    sculptor.bones();
    sculptor.trunk();
    sculptor.head();
    for side in 0..2 {
        sculptor.feeler_and_jaw(side);
        (0..3).for_each(|pair| sculptor.leg(pair, side));
    }
    sculptor.shell();
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
        let [front, rear] = self.thorax();
        let [waist, root, tip] = self.abdomen();
        let spine = [
            ("thorax", None, rear, front, 0.6),
            ("head", Some(THORAX), self.skull([0.0, 0.0, -0.04]), self.skull([0.0, 0.0, 0.04]), 0.35),
            ("waist", Some(THORAX), waist, root, 0.45),
            ("abdomen", Some(WAIST), root, tip, 0.5),
        ];
        self.recipe.skeleton.add_all(&spine);
        let [low, elbow, end] = self.feeler();
        let [hinge, point] = self.jaw();
        let mut limbs = vec![
            ("feeler_1", HEAD, low, elbow, 0.15),
            ("feeler_2", FEELER, elbow, end, 0.15),
            ("jaw", HEAD, hinge, point, 0.15),
        ];
        for (pair, names) in LEG_NAMES.into_iter().enumerate() {
            let joints = self.leg_joints(pair);
            for (i, name) in names.into_iter().enumerate() {
                let parent = if i == 0 { THORAX } else { LEG + 3 * pair + i - 1 };
                limbs.push((name, parent, joints[i], joints[i + 1], 0.18));
            }
        }
        self.recipe.skeleton.add_pairs(&limbs);
        self.recipe.magnified = vec![1.0; COUNT];
    }

    /// Front and rear end of the thorax.
    fn thorax(&self) -> [Vec3; 2] {
        [[0.0, 0.0, 0.055 * self.to.thorax], [0.0, 0.0, -0.055 * self.to.thorax]]
    }

    /// Joint of the waist, root and tip of the abdomen.
    fn abdomen(&self) -> [Vec3; 3] {
        let [_, rear] = self.thorax();
        let root = vec3::add(rear, [0.0, 0.004, -0.055 * self.to.waist]);
        [rear, root, vec3::add(root, [0.0, -0.008, -0.16 * self.to.abdomen])]
    }

    /// A point of the head, relative to its centre.
    fn skull(&self, [x, y, z]: Vec3) -> Vec3 {
        let [front, _] = self.thorax();
        let size = self.to.head;
        let center = vec3::add(front, [0.0, 0.004, 0.03 * self.to.neck + 0.038 * size]);
        vec3::add(center, vec3::scale([x * self.to.head_width, y, z], size))
    }

    /// Root, elbow and end of the left feeler.
    fn feeler(&self) -> [Vec3; 3] {
        let (root, long) = (self.skull([0.018, 0.022, 0.03]), self.to.feeler);
        let elbow = vec3::add(root, vec3::scale([0.03, 0.045, 0.035], long));
        [root, elbow, vec3::add(elbow, vec3::scale([0.03, -0.005, 0.085], long))]
    }

    /// Hinge and point of the left jaw.
    fn jaw(&self) -> [Vec3; 2] {
        let hinge = self.skull([0.02, -0.018, 0.036]);
        [hinge, vec3::add(hinge, vec3::scale([-0.002, -0.006, 0.045], self.to.jaw * self.to.head))]
    }

    /// Hip, knee, ankle and end of the left leg of a pair: 0 in front, 2 behind.
    fn leg_joints(&self, pair: usize) -> [Vec3; 4] {
        let to = self.to;
        let hip = [0.03 * to.thorax_girth, -0.02 * to.thorax_girth, [0.042, 0.0, -0.042][pair] * to.thorax];
        let turn = [42.0_f64, -4.0, -48.0][pair].to_radians();
        let long = to.legs * [0.95, 1.0, 1.15 * to.hind][pair];
        let out = [turn.cos(), 0.0, turn.sin()];
        let rise = to.knee_rise.to_radians();
        let thigh = vec3::add(vec3::scale(out, rise.cos()), [0.0, rise.sin(), 0.0]);
        let knee = vec3::add(hip, vec3::scale(thigh, 0.125 * long));
        let shin = unit(vec3::add(vec3::scale(out, 0.42), [0.0, -1.0, 0.0]));
        let ankle = vec3::add(knee, vec3::scale(shin, 0.15 * long));
        let foot = unit(vec3::add(out, [0.0, -0.35, 0.0]));
        [hip, knee, ankle, vec3::add(ankle, vec3::scale(foot, 0.055 * long))]
    }
}
