//! A left hand at rest: the fingers up, slightly spread, the palm at +z, so the thumb at -x. Of the forearm there is
//! a stump.
//!
//! Lengths are those of an adult's hand in metres.

mod pose;
mod species;

use fmnet::mesh::vec3;

use super::math::{Vec3, lerp, unit};
use super::mirror::Symmetry;
use super::proportions::proportions;
use super::recipe::{FeatureKind, Girth, Join, Recipe};
use super::species::Plan;

/// Hands with a part of the forearm. All are left ones: a network that sees orientation tells them from right ones.
pub(super) static PLAN: Plan = Plan {
    name: "hand",
    species: species::NAMES,
    held_out: None,
    base: || recipe(&Proportions::default()),
    breed: |breed, rng| recipe(&species::proportions(breed, rng)),
    pose: |skeleton, rng| pose::random(skeleton, rng),
    rest: |skeleton, rng| pose::resting(skeleton, rng),
};

/// Indices of the bones of a hand.
mod bone {
    pub(super) const FOREARM: usize = 0;
    pub(super) const PALM: usize = 1;
    /// The first of three bones of the thumb; those of index, middle, ring and little finger follow.
    pub(super) const THUMB: usize = 2;
    pub(super) const COUNT: usize = THUMB + 15;

    /// Joint `joint` (0 to 2) of digit `digit` (0, the thumb, to 4).
    pub(super) fn of_digit(digit: usize, joint: usize) -> usize {
        THUMB + 3 * digit + joint
    }
}

proportions! {
    /// Size of everything.
    size = 1.0, 0.05;
    palm_length = 1.0, 0.05;
    palm_width = 1.0, 0.06;
    /// Thickness of the palm.
    palm_depth = 1.0, 0.08;
    fingers = 1.0, 0.07;
    girth = 1.0, 0.08;
    /// Girth of the finger tips, relative to the fingers'.
    tip = 1.0, 0.08;
    knuckle = 1.0, 0.15;
    thumb = 1.0, 0.07;
    /// Flesh at the root of the thumb.
    ball = 1.0, 0.12;
    /// How far the fingers are apart.
    spread = 1.0, 0.2;
    little = 1.0, 0.06;
    forearm = 1.0, 0.25;
    forearm_girth = 1.0, 0.08;
    /// Width of the cuff of a glove, relative to the wrist.
    cuff = 0.0, 0.0;
    /// Length of the finger nails.
    nail = 0.0, 0.25;
}

/// Of each finger: how far across its knuckle is (towards the thumb), its height, its length, its lean and its girth.
const FINGERS: [[f64; 5]; 4] = [
    [0.0275, 0.09, 0.082, 7.0, 0.0088],
    [0.006, 0.094, 0.092, 1.0, 0.009],
    [-0.0155, 0.09, 0.086, -5.0, 0.0086],
    [-0.036, 0.081, 0.067, -13.0, 0.0076],
];
/// Shares of the length of a finger that its bones have.
const JOINTS: [f64; 4] = [0.0, 0.46, 0.74, 0.93];

fn recipe(proportions: &Proportions) -> Recipe {
    let mut recipe = Recipe::new(0.0014);
    recipe.symmetry = Symmetry::None;
    let mut sculptor = Sculptor { recipe, to: *proportions };
    sculptor.bones();
    sculptor.palm();
    sculptor.thumb();
    (0..4).for_each(|finger| sculptor.finger(finger));
    sculptor.cuff();
    sculptor.features();
    sculptor.recipe.scaled(proportions.size)
}

struct Sculptor {
    recipe: Recipe,
    to: Proportions,
}

impl Sculptor {
    fn bones(&mut self) {
        let mut bones = vec![
            ("forearm", None, self.stump(), [0.0; 3], 0.8),
            ("palm", Some(bone::FOREARM), [0.0; 3], self.palm_point([0.0, 0.05, 0.0]), 0.6),
        ];
        let names = [
            ["thumb_1", "thumb_2", "thumb_3"],
            ["index_1", "index_2", "index_3"],
            ["middle_1", "middle_2", "middle_3"],
            ["ring_1", "ring_2", "ring_3"],
            ["little_1", "little_2", "little_3"],
        ];
        for (digit, names) in names.into_iter().enumerate() {
            let joints = if digit == 0 { self.thumb_joints() } else { self.finger_joints(digit - 1) };
            for (joint, name) in names.into_iter().enumerate() {
                let parent = if joint == 0 { bone::PALM } else { bone::of_digit(digit, joint - 1) };
                let softness = if digit == 0 && joint == 0 { 0.3 } else { 0.16 };
                bones.push((name, Some(parent), joints[joint], joints[joint + 1], softness));
            }
        }
        self.recipe.skeleton.add_all(&bones);
        self.recipe.magnified = vec![1.0; bone::COUNT];
    }

    fn stump(&self) -> Vec3 {
        [0.0, -0.06 * self.to.forearm, 0.0]
    }

    /// A point of the palm: across towards the thumb, up, and out of the palm.
    fn palm_point(&self, [across, up, out]: Vec3) -> Vec3 {
        [-across * self.to.palm_width, up * self.to.palm_length, out * self.to.palm_depth]
    }

    /// Joints of a finger from its knuckle to its tip.
    fn finger_joints(&self, finger: usize) -> [Vec3; 4] {
        let [across, up, length, lean, _] = FINGERS[finger];
        let knuckle = self.palm_point([across, up, 0.0]);
        let (sin, cos) = (self.to.spread * lean).to_radians().sin_cos();
        let along = unit([-sin, cos, 0.04]);
        let little = if finger == 3 { self.to.little } else { 1.0 };
        JOINTS.map(|share| vec3::add(knuckle, vec3::scale(along, share * length * little * self.to.fingers)))
    }

    /// Joints of the thumb from its root near the wrist to its tip.
    fn thumb_joints(&self) -> [Vec3; 4] {
        let root = self.palm_point([0.02, 0.018, 0.008]);
        let steps = [[0.0; 3], [-0.024, 0.034, 0.008], [-0.042, 0.062, 0.012], [-0.053, 0.086, 0.013]];
        steps.map(|step| vec3::add(root, vec3::scale(step, self.to.thumb)))
    }

    fn palm(&mut self) {
        let to = self.to;
        let (wide, deep) = (to.palm_width, to.palm_depth);
        let arm = Join { bones: &[bone::FOREARM], blend: 0.02 };
        let girth = to.forearm_girth;
        let (stump, wrist) = (self.stump(), self.palm_point([0.0, 0.006, 0.0]));
        let front = [0.0, 0.0, 1.0];
        self.recipe.flat_spindle(arm, stump, wrist, Girth(0.034 * girth, 0.0275 * girth, 0.0), front, 0.78);
        let join = Join { bones: &[bone::PALM], blend: 0.014 };
        for [across, up, ..] in FINGERS {
            let (root, knuckle) =
                (self.palm_point([0.45 * across, 0.012, 0.0]), self.palm_point([across, up - 0.006, 0.0]));
            let girth = Girth(0.018 * wide.sqrt(), 0.0125 * wide.sqrt(), 0.001);
            self.recipe.flat_spindle(join, root, knuckle, girth, front, 0.8 * deep / wide.sqrt());
        }
        // Flesh below the little finger, and pads below all.
        let (low, high) = (self.palm_point([-0.022, 0.022, 0.008]), self.palm_point([-0.034, 0.06, 0.005]));
        self.recipe.spindle(join, low, high, Girth(0.013 * to.ball, 0.0105, 0.0015));
        let (left, right) = (self.palm_point([0.024, 0.078, 0.006]), self.palm_point([-0.03, 0.07, 0.005]));
        self.recipe.spindle(join, left, right, Girth(0.009, 0.008, 0.0));
    }

    fn thumb(&mut self) {
        use bone::of_digit;
        let (to, joints) = (self.to, self.thumb_joints());
        let radius = |r: f64| r * to.girth;
        let root = Join { bones: &[of_digit(0, 0), bone::PALM], blend: 0.014 };
        let ball = Girth(0.0145 * to.ball, 0.012 * to.girth.sqrt() * to.ball.sqrt(), 0.0015);
        self.recipe.spindle(root, joints[0], joints[1], ball);
        let second = Join { bones: &[of_digit(0, 1)], blend: 0.008 };
        self.recipe.spindle(second, joints[1], joints[2], Girth(radius(0.0112), radius(0.0098), -0.0004));
        let third = Join { bones: &[of_digit(0, 2)], blend: 0.005 };
        let tip = Girth(radius(0.0102), radius(0.0082 * to.tip), 0.0004);
        self.recipe.flat_spindle(third, joints[2], joints[3], tip, self.back(&joints), 0.85);
        self.nail(&joints, 0, radius(0.0082 * to.tip));
        // The web between thumb and index finger.
        let web = Join { bones: &[of_digit(0, 0), bone::PALM], blend: 0.012 };
        let (from, onto) = (lerp(joints[0], joints[1], 0.7), self.palm_point([0.024, 0.058, 0.002]));
        self.recipe.flat_spindle(web, from, onto, Girth(0.009, 0.009, 0.0), [0.0, 0.0, 1.0], 0.75);
    }

    fn finger(&mut self, finger: usize) {
        use bone::of_digit;
        let (to, joints) = (self.to, self.finger_joints(finger));
        let [_, _, _, _, girth] = FINGERS[finger];
        let radius = |share: f64| share * girth * to.girth;
        let digit = finger + 1;
        let root = Join { bones: &[of_digit(digit, 0)], blend: 0.007 };
        self.recipe.spindle(root, joints[0], joints[1], Girth(radius(1.06), radius(0.95), 0.0));
        let middle = Join { bones: &[of_digit(digit, 1)], blend: 0.004 };
        self.recipe.spindle(middle, joints[1], joints[2], Girth(radius(0.98), radius(0.88), 0.0));
        let last = Join { bones: &[of_digit(digit, 2)], blend: 0.004 };
        let tip = Girth(radius(0.9), radius(0.78 * to.tip), 0.0002);
        self.recipe.flat_spindle(last, joints[2], joints[3], tip, self.back(&joints), 0.88);
        let back = self.back(&joints);
        for (joint, size) in [(0, 0.0068), (1, 0.006), (2, 0.005)] {
            let bones = [of_digit(digit, joint)];
            let place = vec3::add(joints[joint], vec3::scale(back, radius(0.55)));
            let r = size * to.girth * to.knuckle.sqrt();
            self.recipe.ellipsoid(Join { bones: &bones, blend: 0.005 }, place, [r, r, 0.9 * r]);
        }
        self.nail(&joints, digit, radius(0.78 * to.tip));
    }

    /// Direction out of the back of a digit.
    fn back(&self, joints: &[Vec3; 4]) -> Vec3 {
        let along = unit(vec3::sub(joints[3], joints[2]));
        super::math::perpendicular(along, [0.0, 0.0, -1.0])
    }

    fn nail(&mut self, joints: &[Vec3; 4], digit: usize, radius: f64) {
        let along = unit(vec3::sub(joints[3], joints[2]));
        let back = self.back(joints);
        let at = |ahead: f64, up: f64| {
            vec3::add(joints[3], vec3::add(vec3::scale(along, ahead), vec3::scale(back, up)))
        };
        let (from, to) = (at(-0.2 * radius, 0.35 * radius), at((0.5 + self.to.nail) * radius, 0.25 * radius));
        let join = Join { bones: &[bone::of_digit(digit, 2)], blend: 0.004 };
        self.recipe.flat_spindle(join, from, to, Girth(0.6 * radius, 0.5 * radius, 0.0), back, 0.7);
    }

    /// The cuff of a glove.
    fn cuff(&mut self) {
        let wide = self.to.cuff;
        if wide <= 0.0 {
            return;
        }
        let join = Join { bones: &[bone::FOREARM], blend: 0.006 };
        let (low, high) = ([0.0, -0.03, 0.0], [0.0, -0.008, 0.0]);
        let girth = |factor: f64| 0.034 * self.to.forearm_girth * factor;
        self.recipe.flat_spindle(
            join,
            low,
            high,
            Girth(girth(wide), girth(0.9 * wide), 0.0),
            [0.0, 0.0, 1.0],
            0.85,
        );
    }

    fn features(&mut self) {
        use FeatureKind::*;
        let at = |p: Vec3| self.palm_point(p);
        let stump = self.stump();
        let places = [
            (Belly, at([0.03, 0.035, 0.022]), 0.025, [-0.3, 0.0, 1.0]),
            (Belly, at([-0.032, 0.04, 0.014]), 0.025, [0.5, 0.0, 1.0]),
            (Hips, at([0.0, 0.055, -0.014]), 0.035, [0.0, 0.0, -1.0]),
            (Hips, at([-0.045, 0.05, 0.0]), 0.02, [1.0, 0.0, 0.0]),
            (Muscle, lerp(stump, [0.0; 3], 0.4), 0.03, [1.0, 0.0, 0.2]),
            (Muscle, lerp(stump, [0.0; 3], 0.4), 0.03, [-1.0, 0.0, 0.2]),
            (Face, at([0.006, 0.094, -0.01]), 0.015, [0.0, 0.0, -1.0]),
        ];
        for (kind, center, radius, direction) in places {
            self.recipe.feature(kind, center, radius, direction);
        }
    }
}
