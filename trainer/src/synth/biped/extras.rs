//! What some bipeds wear beside clothes: hoods, collars, mittens, bags, buns and beards.

use fmnet::mesh::vec3;
use rand::Rng;

use super::super::math::{Vec3, lerp};
use super::super::mirror::on_side;
use super::super::random::{chance, uniform};
use super::super::recipe::{Girth, Join};
use super::{BACK_OF_HAND, HAND_MAGNIFIED, HEAD_MAGNIFIED, Sculptor, bone};

/// Sizes of what is worn, relative to what they are worn on.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Extras {
    /// Volume of a hood, in metres.
    hood: Option<f64>,
    /// Girth of a collar or scarf, relative to the neck.
    collar: Option<f64>,
    /// Thickness of mittens.
    mittens: Option<f64>,
    bag: Option<f64>,
    /// Size of a knot of hair, and how high it sits, from the nape (0) to the crown (1).
    bun: Option<[f64; 2]>,
    beard: Option<f64>,
    /// Size of eyeballs that stand out, as in a cartoon.
    eyeballs: Option<f64>,
    /// Size of round ears, and how high they sit, from the sides of the head (0) to its top (1).
    discs: Option<[f64; 2]>,
}

impl Extras {
    pub(super) fn random(rng: &mut impl Rng) -> Self {
        let mut draw = |probability: f64, low: f64, high: f64| {
            let (worn, value) = (chance(rng, probability), uniform(rng, low, high));
            worn.then_some(value)
        };
        let hood = draw(0.12, 0.012, 0.03);
        let collar = draw(0.2, 1.15, 1.7);
        let mittens = draw(0.15, 0.9, 1.25);
        let bag = draw(0.12, 0.8, 1.3);
        let bun = draw(0.2, 0.7, 1.3);
        let beard = draw(0.12, 0.5, 1.4);
        let bun = bun.map(|size| [size, uniform(rng, 0.0, 1.0)]);
        Self { hood, collar, mittens, bag, bun, beard, ..Self::default() }
    }

    /// These, and what toys have of their own.
    pub(super) fn of_toy(self, rng: &mut impl Rng) -> Self {
        let eyeballs = chance(rng, 0.35).then(|| uniform(rng, 0.7, 1.6));
        let discs = chance(rng, 0.35).then(|| [uniform(rng, 0.6, 2.6), uniform(rng, 0.0, 1.0)]);
        Self { eyeballs, discs, ..self }
    }
}

impl Sculptor {
    /// Adds what `extras` holds.
    pub(super) fn adorn(&mut self, extras: &Extras) {
        if let Some(volume) = extras.hood {
            self.hood(volume);
        }
        if let Some(girth) = extras.collar {
            self.collar(girth);
        }
        if let Some(thick) = extras.mittens {
            (0..2).for_each(|side| self.mittens(thick, side));
        }
        if let Some(size) = extras.bag {
            self.bag(size);
        }
        if let Some(bun) = extras.bun {
            self.bun(bun);
        }
        if let Some(size) = extras.beard {
            self.beard(size);
        }
        if let Some(size) = extras.eyeballs {
            (0..2).for_each(|side| self.eyeball(size, side));
        }
        if let Some(ears) = extras.discs {
            (0..2).for_each(|side| self.disc(ears, side));
        }
    }

    fn eyeball(&mut self, large: f64, side: usize) {
        let size = HEAD_MAGNIFIED * self.to.head;
        let join = Join { bones: &[bone::HEAD], blend: 0.005 * size };
        let center = on_side(self.skull([0.03, 0.08, 0.088]), side);
        self.recipe.ellipsoid(join, center, [0.026 * large * size; 3]);
    }

    /// A round ear that faces to the front.
    fn disc(&mut self, [large, rise]: [f64; 2], side: usize) {
        let size = HEAD_MAGNIFIED * self.to.head;
        let join = Join { bones: &[bone::HEAD], blend: 0.008 * size };
        let radius = 0.045 * large;
        let root = lerp([0.074, 0.09, 0.0], [0.052, 0.165, 0.0], rise);
        let out = lerp([0.8 * radius, 0.25 * radius, 0.0], [0.45 * radius, 0.7 * radius, 0.0], rise);
        let center = on_side(self.skull(vec3::add(root, out)), side);
        self.recipe.ellipsoid(join, center, vec3::scale([radius, radius, 0.016 + 0.12 * radius], size));
    }

    /// A hood around the back of the head, down to the shoulders.
    fn hood(&mut self, volume: f64) {
        let (to, size) = (self.to, HEAD_MAGNIFIED * self.to.head);
        let join = Join { bones: &[bone::HEAD], blend: 0.008 * size };
        let crown = self.skull([0.0, 0.095, -0.012]);
        let radii = [(0.082 + volume) * to.head_width, 0.095 + volume, 0.092 + volume];
        self.recipe.ellipsoid(join, crown, vec3::scale(radii, size));
        let (nape, base) = (self.skull([0.0, 0.03, -0.022]), self.torso([0.0, 1.44, -0.045]));
        let neck = Join { bones: &[bone::NECK, bone::HEAD], blend: 0.01 };
        let girth = Girth((0.076 + volume) * size, 0.09 * to.neck + volume, 0.0);
        self.recipe.spindle(neck, nape, base, girth);
    }

    fn collar(&mut self, wide: f64) {
        let (base, top) = (self.torso([0.0, 1.455, -0.025]), self.skull_base());
        let join = Join { bones: &[bone::NECK], blend: 0.008 };
        let radius = 0.062 * self.to.neck * wide;
        let girth = Girth(1.1 * radius, radius, 0.0);
        self.recipe.spindle(join, lerp(base, top, 0.1), lerp(base, top, 0.55), girth);
    }

    fn mittens(&mut self, thick: f64, side: usize) {
        use bone::*;
        let size = HAND_MAGNIFIED * self.to.hand;
        let at = |along: f64, across: f64| on_side(self.palm(along, across, 0.0), side);
        let (wrist, middle, end) = (at(0.01, 0.0), at(0.09, 0.0), at(0.145, 0.0));
        let (root, thumb) = (at(0.035, 0.03), at(0.088, 0.07));
        let (low, high) = (at(-0.035, 0.0), at(0.005, 0.0));
        let back = on_side(BACK_OF_HAND, side);
        let (hand, fingers) = ([limb(HAND, side)], [limb(FINGERS, side)]);
        let join = |bones| Join { bones, blend: 0.012 * size };
        let radius = |r: f64| r * thick * size;
        let recipe = &mut self.recipe;
        recipe.flat_spindle(join(&hand), wrist, middle, Girth(radius(0.036), radius(0.047), 0.0), back, 0.62);
        recipe.flat_spindle(join(&fingers), middle, end, Girth(radius(0.047), radius(0.038), 0.0), back, 0.6);
        let bones = [limb(THUMB, side)];
        recipe.spindle(join(&bones), root, thumb, Girth(radius(0.02), radius(0.018), 0.0));
        // The cuff.
        recipe.spindle(join(&hand), low, high, Girth(radius(0.033), radius(0.03), 0.0));
    }

    /// A bag on the back.
    fn bag(&mut self, size: f64) {
        let back = 0.1 * self.to.chest;
        let (low, high) = (self.torso([0.0, 1.1, 0.0]), self.torso([0.0, 1.36, 0.0]));
        let behind = |p: Vec3| vec3::add(p, [0.0, 0.0, -back - 0.035 * size]);
        let join = Join { bones: &[bone::CHEST], blend: 0.015 };
        let girth = Girth(0.12 * size, 0.11 * size, 0.01);
        self.recipe.flat_spindle(join, behind(low), behind(high), girth, [0.0, 0.0, 1.0], 0.55);
    }

    fn bun(&mut self, [share, rise]: [f64; 2]) {
        let size = HEAD_MAGNIFIED * self.to.head;
        let join = Join { bones: &[bone::HEAD], blend: 0.006 * size };
        let place = lerp([0.0, 0.07, -0.115], [0.0, 0.205, -0.035], rise);
        let center = self.skull(place);
        self.recipe.ellipsoid(join, center, vec3::scale([0.036, 0.034, 0.036], share * size));
    }

    fn beard(&mut self, long: f64) {
        let size = HEAD_MAGNIFIED * self.to.head;
        let join = Join { bones: &[bone::HEAD], blend: 0.012 * size };
        let jut = 0.06 * self.to.muzzle + 0.07 * self.to.snout;
        let (chin, end) =
            (self.skull([0.0, -0.005, 0.06 + jut]), self.skull([0.0, -0.02 - 0.07 * long, 0.07 + jut]));
        let girth = Girth(0.042 * size, 0.022 * size, 0.0);
        self.recipe.flat_spindle(join, chin, end, girth, [0.0, 0.0, 1.0], 0.7);
    }
}
