//! The body of a biped at rest: facing +z, its left at +x, arms lowered by 40 degrees, legs slightly apart.
//!
//! Lengths are those of an adult 1.75 tall; a species scales regions of it.

use std::ops::Range;

use outfit::Outfit;

mod extras;
mod head;
mod limbs;
mod outfit;
mod species;
mod stylise;
mod trunk;

use super::math::Vec3;
use super::pose;
use super::proportions::proportions;
use super::random::{chance, uniform};
use super::recipe::Recipe;
use super::species::Plan;
use fmnet::mesh::vec3;

/// Indices of the bones of a biped. Those of a side are to be passed to [`bone::limb`].
pub(in crate::synth) mod bone {
    super::super::bones::bones! {
        PELVIS LUMBAR CHEST NECK HEAD;
        CLAVICLE UPPER_ARM FOREARM HAND FINGERS THUMB THIGH SHIN FOOT TOES;
        TAIL TAIL_END
    }
}

proportions! {
    /// Height, in metres, before the other factors.
    height = 1.75, 0.03;
    head = 1.0, 0.05;
    head_width = 1.0, 0.04;
    /// Size of the ears, and how high they sit: 0 at the sides as a human's, 1 on top as a bear's.
    ear = 1.0, 0.12;
    ear_rise = 0.0, 0.0;
    /// Girth and length of the neck.
    neck = 1.0, 0.07;
    neck_length = 1.0, 0.1;
    /// Length of the trunk.
    trunk = 1.0, 0.04;
    shoulders = 1.0, 0.05;
    chest = 1.0, 0.06;
    waist = 1.0, 0.09;
    hips = 1.0, 0.06;
    /// Flesh in front of the abdomen, in metres.
    belly = 0.0, 0.018;
    /// Flesh in front of the chest, in metres.
    breast = 0.0, 0.006;
    buttocks = 1.0, 0.08;
    /// Size of muscles.
    muscle = 1.0, 0.12;
    arm_length = 1.0, 0.04;
    arm_girth = 1.0, 0.1;
    hand = 1.0, 0.06;
    /// How far the fingers are apart.
    spread = 1.0, 0.25;
    /// 1 where the fingers are grown together.
    mitten = 0.0, 0.0;
    leg_length = 1.0, 0.05;
    leg_girth = 1.0, 0.08;
    foot = 1.0, 0.06;
    /// 1 where the toes are grown together.
    sock = 0.0, 0.0;
    /// How far the jaws stand out, 0 for humans, 1 for an ape.
    muzzle = 0.0, 0.0;
    /// Length of a narrow snout, 0 for humans, 1 for a bear.
    snout = 0.0, 0.0;
    /// Length of the tail, relative to a leg's, and its girth.
    tail = 0.0, 0.0;
    tail_girth = 1.0, 0.15;
}

/// Bipeds: people, apes, stylised figures.
pub(super) static PLAN: Plan = Plan {
    name: "biped",
    species: species::NAMES,
    held_out: Some("slender"),
    base: || recipe(&Proportions::default(), &Outfit::default()),
    breed: |breed, rng| {
        let proportions = species::proportions(breed, rng);
        let dressed = breed.varies && chance(rng, DRESSED);
        let outfit = if dressed { Outfit::random(rng) } else { Outfit::default() };
        let style = if breed.varies { uniform(rng, 0.0, 1.0) } else { 1.0 };
        if STYLISED.contains(&style) {
            recipe(&proportions.stylised(rng), &outfit)
        } else if TOYS.contains(&style) {
            recipe(&proportions.as_toy(rng), &outfit.of_toy(rng))
        } else {
            recipe(&proportions, &outfit)
        }
    },
    pose: |skeleton, rng| pose::random_biped(skeleton, rng),
    rest: |skeleton, rng| pose::resting_biped(skeleton, rng),
};

/// Share of the breeds that wear something.
const DRESSED: f64 = 0.3;
/// Of numbers drawn from 0 to 1, those of breeds in proportions that nobody has.
const STYLISED: Range<f64> = 0.0..0.15;
/// Those of toys, still farther from what lives.
const TOYS: Range<f64> = 0.45..0.7;
const HEAD_MAGNIFIED: f64 = 1.3;
const HAND_MAGNIFIED: f64 = 1.65;
const FOOT_MAGNIFIED: f64 = 1.2;
const HIP_HEIGHT: f64 = 0.925;
/// Direction of the arm at rest, and across the palm towards the thumb and out of its back.
const ARM: Vec3 = [0.766, -0.643, 0.0];
const BACK_OF_HAND: Vec3 = [0.643, 0.766, 0.0];

/// The body of a biped with the given proportions, and what it wears. Bodies of all proportions have the same first
/// parts.
fn recipe(proportions: &Proportions, outfit: &Outfit) -> Recipe {
    let mut sculptor = Sculptor { recipe: Recipe::new(0.0092), to: *proportions };
    sculptor.bones();
    sculptor.trunk();
    sculptor.head();
    for side in 0..2 {
        sculptor.arm(side);
        sculptor.hand(side);
        sculptor.leg(side);
        sculptor.foot(side);
    }
    sculptor.tail();
    sculptor.wear(outfit);
    sculptor.features();
    sculptor.recipe.scaled(proportions.height / 1.75)
}

struct Sculptor {
    recipe: Recipe,
    to: Proportions,
}

impl Sculptor {
    fn bones(&mut self) {
        use bone::*;
        let skeleton = [
            ("pelvis", None, self.torso([0.0, 0.96, 0.0]), self.torso([0.0, 1.05, -0.005]), 1.0),
            ("lumbar", Some(PELVIS), self.torso([0.0, 1.05, -0.01]), self.torso([0.0, 1.2, -0.015]), 1.0),
            ("chest", Some(LUMBAR), self.torso([0.0, 1.2, -0.015]), self.torso([0.0, 1.43, -0.03]), 1.0),
            ("neck", Some(CHEST), self.torso([0.0, 1.46, -0.03]), self.skull_base(), 0.4),
            ("head", Some(NECK), self.skull_base(), self.skull([0.0, 0.12, 0.0]), 0.3),
        ];
        let magnified = |name: usize| match name {
            HEAD => HEAD_MAGNIFIED,
            HAND | FINGERS | THUMB => HAND_MAGNIFIED,
            FOOT | TOES => FOOT_MAGNIFIED,
            _ => 1.0,
        };
        self.recipe.skeleton.add_all(&skeleton);
        let (shoulder, elbow, wrist) = (self.shoulder(), self.elbow(), self.wrist());
        let (knee, ankle) = (self.knee(), self.ankle());
        let limbs = [
            ("clavicle", CHEST, self.torso([0.03, 1.43, 0.0]), shoulder, 0.8),
            ("upper_arm", CLAVICLE, shoulder, elbow, 0.55),
            ("forearm", UPPER_ARM, elbow, wrist, 0.22),
            ("hand", FOREARM, wrist, self.palm(0.095, 0.0, 0.0), 0.3),
            ("fingers", HAND, self.palm(0.095, 0.0, 0.0), self.palm(0.18, 0.0, 0.0), 0.06),
            ("thumb", HAND, self.palm(0.03, 0.026, 0.0), self.palm(0.085, 0.07, -0.01), 0.06),
            ("thigh", PELVIS, self.hip(), knee, 0.9),
            ("shin", THIGH, knee, ankle, 0.4),
            ("foot", SHIN, ankle, self.sole([0.0, -0.06, 0.125]), 0.2),
            ("toes", FOOT, self.sole([0.0, -0.06, 0.125]), self.sole([0.0, -0.06, 0.19]), 0.15),
        ];
        self.recipe.skeleton.add_pairs(&limbs);
        for (name, parent, from) in [("tail_1", PELVIS, 0.0), ("tail_2", TAIL, 0.5)] {
            let (head, tail) = (self.tail_axis(from), self.tail_axis(from + 0.5));
            self.recipe.skeleton.add(name, Some(parent), head, tail, 0.3);
        }
        self.recipe.magnified = (0..COUNT).map(|index| magnified(left(index))).collect();
    }

    /// Height of a point of the adult body after the trunk and legs are stretched.
    fn height(&self, y: f64) -> f64 {
        y.min(HIP_HEIGHT) * self.to.leg_length + (y - HIP_HEIGHT).max(0.0) * self.to.trunk
    }

    /// A point of the trunk: widened by the shoulders above, the hips below.
    fn torso(&self, [x, y, z]: Vec3) -> Vec3 {
        let up = ((y - 1.0) / 0.35).clamp(0.0, 1.0);
        let width = self.to.hips + up * (self.to.shoulders - self.to.hips);
        [x * width, self.height(y), z]
    }

    fn skull_base(&self) -> Vec3 {
        let rise = 0.095 * self.to.neck_length;
        vec3::add(self.torso([0.0, 1.46, -0.03]), [0.0, rise, 0.03 + 0.05 * self.to.muzzle])
    }

    /// A point of the head, relative to the base of the skull, as modelled (enlarged).
    fn skull(&self, [x, y, z]: Vec3) -> Vec3 {
        let p = [x * self.to.head_width, y, z];
        vec3::add(self.skull_base(), vec3::scale(p, HEAD_MAGNIFIED * self.to.head))
    }

    /// A point of the tail's axis, from its root (0) to its tip (1): an arc that comes down and rises again.
    fn tail_axis(&self, t: f64) -> Vec3 {
        let root = self.torso([0.0, 0.99, -0.06 - 0.03 * self.to.buttocks]);
        let reach = 0.8 * self.to.tail.max(0.1) * t;
        vec3::add(root, [0.0, -0.75 * reach + 0.35 * reach * t, -0.6 * reach])
    }

    fn shoulder(&self) -> Vec3 {
        self.torso([0.172, 1.415, -0.02])
    }

    fn elbow(&self) -> Vec3 {
        vec3::add(self.shoulder(), vec3::scale(ARM, 0.29 * self.to.arm_length))
    }

    fn wrist(&self) -> Vec3 {
        vec3::add(self.shoulder(), vec3::scale(ARM, 0.545 * self.to.arm_length))
    }

    /// A point of the hand, as modelled (enlarged): `along` it from the wrist, `across` towards the thumb, `up` out
    /// of its back.
    fn palm(&self, along: f64, across: f64, up: f64) -> Vec3 {
        let offset: Vec3 =
            std::array::from_fn(|i| along * ARM[i] + up * BACK_OF_HAND[i] + [0.0, 0.0, across][i]);
        vec3::add(self.wrist(), vec3::scale(offset, HAND_MAGNIFIED * self.to.hand))
    }

    fn hip(&self) -> Vec3 {
        self.torso([0.09, HIP_HEIGHT, 0.0])
    }

    fn knee(&self) -> Vec3 {
        vec3::add(self.hip(), [0.04, self.height(0.5) - self.height(HIP_HEIGHT), 0.012])
    }

    fn ankle(&self) -> Vec3 {
        vec3::add(self.hip(), [0.072, self.height(0.085) - self.height(HIP_HEIGHT), -0.022])
    }

    /// A point of the foot, relative to the ankle, as modelled (enlarged).
    fn sole(&self, p: Vec3) -> Vec3 {
        vec3::add(self.ankle(), vec3::scale(p, FOOT_MAGNIFIED * self.to.foot))
    }
}
