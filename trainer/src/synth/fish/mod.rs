//! The body of a fish at rest: stretched out, facing +z, its left at +x.
//!
//! Lengths are those of a fish 1 long; a species stretches it along, up and sideways.

mod body;
mod pose;
mod species;

use super::math::Vec3;
use super::proportions::proportions;
use super::recipe::Recipe;
use super::species::Plan;

/// Fish, and those that look like fish.
pub(super) static PLAN: Plan = Plan {
    name: "fish",
    species: species::NAMES,
    held_out: None,
    base: || recipe(&Proportions::default()),
    breed: |breed, rng| recipe(&species::proportions(breed, rng)),
    pose: |_, rng| pose::random(rng),
    rest: |_, rng| pose::resting(rng),
};

/// Indices of the bones of a fish. Those of a side are to be passed to [`bone::limb`].
mod bone {
    super::super::bones::bones! {
        MIDDLE FRONT HEAD REAR REAR_MIDDLE REAR_END TAIL DORSAL ANAL;
        PECTORAL PELVIC;
    }
}

proportions! {
    /// Size of everything.
    size = 1.0, 0.05;
    length = 1.0, 0.05;
    girth = 1.0, 0.07;
    height = 1.0, 0.06;
    /// Flesh under the belly.
    belly = 0.0, 0.012;
    /// Girth before the tail.
    peduncle = 1.0, 0.06;
    head = 1.0, 0.05;
    /// Length of what tapers before the eyes.
    snout = 1.0, 0.1;
    /// Length of a narrow beak, as a dolphin's.
    beak = 0.0, 0.0;
    tail = 1.0, 0.08;
    tail_width = 1.0, 0.08;
    /// How far the lobes of the tail are apart.
    fork = 1.0, 0.12;
    /// How much longer the upper lobe is than the lower one.
    skew = 0.0, 0.06;
    /// Size of flat lobes instead of the upright ones.
    fluke = 0.0, 0.0;
    dorsal = 1.0, 0.12;
    dorsal_length = 1.0, 0.1;
    anal = 1.0, 0.12;
    anal_length = 1.0, 0.1;
    pectoral = 1.0, 0.1;
    pectoral_width = 1.0, 0.1;
    pelvic = 1.0, 0.12;
}

fn recipe(proportions: &Proportions) -> Recipe {
    let mut sculptor = Sculptor { recipe: Recipe::new(0.0045), to: *proportions };
    sculptor.bones();
    sculptor.trunk();
    sculptor.head();
    sculptor.tail();
    sculptor.upright_fins();
    (0..2).for_each(|side| sculptor.paired_fins(side));
    sculptor.beak();
    sculptor.fluke();
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
        let at = |z: f64| self.at([0.0, 0.0, z]);
        let [dorsal, anal] = [self.dorsal(), self.anal()];
        let spine = [
            ("middle", None, at(-0.05), at(0.08), 1.0),
            ("front", Some(MIDDLE), at(0.08), at(0.22), 1.0),
            ("head", Some(FRONT), at(0.22), at(0.4), 0.5),
            ("rear_1", Some(MIDDLE), at(-0.05), at(-0.16), 1.0),
            ("rear_2", Some(REAR), at(-0.16), at(-0.26), 1.0),
            ("rear_3", Some(REAR_MIDDLE), at(-0.26), at(-0.36), 1.0),
            ("tail", Some(REAR_END), at(-0.36), at(-0.5), 0.6),
            ("dorsal", Some(MIDDLE), dorsal[0], dorsal[2], 0.5),
            ("anal", Some(REAR), anal[0], anal[2], 0.5),
        ];
        self.recipe.skeleton.add_all(&spine);
        let [pectoral, pelvic] = [self.pectoral(), self.pelvic()];
        let fins = [
            ("pectoral", FRONT, pectoral[0], pectoral[1], 0.4),
            ("pelvic", MIDDLE, pelvic[0], pelvic[1], 0.4),
        ];
        self.recipe.skeleton.add_pairs(&fins);
        self.recipe.magnified = vec![1.0; COUNT];
    }

    fn at(&self, [x, y, z]: Vec3) -> Vec3 {
        [x * self.to.girth, y * self.to.height, z * self.to.length]
    }

    /// Front and rear of the base of the dorsal fin, and its tip.
    fn dorsal(&self) -> [Vec3; 3] {
        let (size, half) = (self.to.dorsal, 0.09 * self.to.dorsal_length);
        let (front, rear) = (self.at([0.0, 0.105, half - 0.01]), self.at([0.0, 0.088, -half - 0.02]));
        let tip = [0.0, front[1] + 0.085 * size, rear[2] + 0.04 - 0.05 * size];
        [front, rear, tip]
    }

    /// Front and rear of the base of the anal fin, and its tip.
    fn anal(&self) -> [Vec3; 3] {
        let (size, half) = (self.to.anal, 0.045 * self.to.anal_length);
        let (front, rear) =
            (self.at([0.0, -0.07, half - 0.19]), self.at([0.0, -0.045, -half.min(0.1) - 0.21]));
        [front, rear, [0.0, rear[1] - 0.07 * size, rear[2] - 0.02 * size]]
    }

    /// Root and tip of the left pectoral fin.
    fn pectoral(&self) -> [Vec3; 2] {
        let (root, size) = (self.at([0.062, -0.045, 0.2]), self.to.pectoral);
        [root, [root[0] + 0.085 * size, root[1] - 0.045 * size, root[2] - 0.1 * size]]
    }

    /// Root and tip of the left pelvic fin.
    fn pelvic(&self) -> [Vec3; 2] {
        let (root, size) = (self.at([0.026, -0.095, 0.02]), self.to.pelvic);
        [root, [root[0] + 0.025 * size, root[1] - 0.055 * size, root[2] - 0.06 * size]]
    }
}
