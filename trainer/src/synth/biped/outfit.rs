//! Clothes, hair and shoes of bipeds: solids around those of the body, each with a hem.

use rand::Rng;

use super::super::loft::{Loft, Station};
use super::super::math::{Vec3, lerp};
use super::super::mirror::on_side;
use super::super::random::{chance, uniform};
use super::super::recipe::{Girth, Join};
use super::extras::Extras;
use super::{FOOT_MAGNIFIED, HEAD_MAGNIFIED, Sculptor, bone};
use fmnet::mesh::vec3;

/// Roundness of the ends of garments, relative to their girth.
const HEM: f64 = 0.12;
/// Height of the hem of a skirt below which it goes with the shins as well.
const LONG: f64 = 0.4;
/// Height of the hem of a shirt below which it goes with the thighs as well, as a coat.
const COAT: f64 = 0.84;

/// What a biped wears.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Outfit {
    /// Volume of the hair, and how far it falls, both in metres.
    hair: Option<[f64; 2]>,
    /// Width of the brim, relative to the head.
    hat: Option<f64>,
    /// Looseness in metres, length of the sleeves relative to the arm, and height of the hem.
    shirt: Option<[f64; 3]>,
    /// Height of the hem, and its girth relative to the hips.
    skirt: Option<[f64; 2]>,
    /// Looseness in metres, length relative to the leg, and girth at the hem.
    trousers: Option<[f64; 3]>,
    /// Thickness in metres, and height of the shaft relative to the shin.
    shoes: Option<[f64; 2]>,
    extras: Extras,
}

impl Outfit {
    /// A random outfit; some are only hair or shoes.
    pub(super) fn random(rng: &mut impl Rng) -> Self {
        let dressed = chance(rng, 0.75);
        let skirted = dressed && chance(rng, 0.3);
        let mut draw = |probability: f64, ranges: &[[f64; 2]]| -> Option<Vec<f64>> {
            let worn = chance(rng, probability);
            let values = ranges.iter().map(|&[low, high]| uniform(rng, low, high)).collect();
            worn.then_some(values)
        };
        let two = |values: Vec<f64>| [values[0], values[1]];
        let three = |values: Vec<f64>| [values[0], values[1], values[2]];
        let (shirt, trousers) = if dressed { (0.9, if skirted { 0.0 } else { 0.9 }) } else { (0.0, 0.0) };
        Self {
            hair: draw(0.75, &[[0.008, 0.03], [-0.05, 0.2]]).map(two),
            hat: draw(0.2, &[[1.25, 2.0]]).map(|values| values[0]),
            shirt: draw(shirt, &[[0.008, 0.03], [0.2, 1.6], [0.66, 1.0]]).map(three),
            skirt: draw(if skirted { 1.0 } else { 0.0 }, &[[0.08, 0.75], [1.1, 2.0]]).map(two),
            trousers: draw(trousers, &[[0.008, 0.025], [0.35, 1.0], [0.05, 0.085]]).map(three),
            shoes: draw(0.7, &[[0.006, 0.02], [0.05, 0.6]]).map(two),
            extras: Extras::random(rng),
        }
    }

    /// This one on a toy.
    pub(super) fn of_toy(self, rng: &mut impl Rng) -> Self {
        Self { extras: self.extras.of_toy(rng), ..self }
    }
}

impl Sculptor {
    /// Adds what `outfit` holds.
    pub(super) fn wear(&mut self, outfit: &Outfit) {
        if let Some(trousers) = outfit.trousers {
            self.trousers(trousers);
        }
        if let Some(skirt) = outfit.skirt {
            self.skirt(skirt);
        }
        if let Some(shirt) = outfit.shirt {
            self.shirt(shirt);
        }
        if let Some(shoes) = outfit.shoes {
            (0..2).for_each(|side| self.shoe(shoes, side));
        }
        if let Some(hair) = outfit.hair {
            self.hair(hair);
        }
        if let Some(brim) = outfit.hat {
            self.hat(brim);
        }
        self.adorn(&outfit.extras);
    }

    fn hair(&mut self, [volume, fall]: [f64; 2]) {
        let (to, size) = (self.to, HEAD_MAGNIFIED * self.to.head);
        let join = Join { bones: &[bone::HEAD], blend: 0.006 * size };
        let radii = [(0.079 + volume) * to.head_width, 0.088 + volume, 0.095 + volume];
        let (crown, nape) = (self.skull([0.0, 0.112, -0.014]), self.skull([0.0, 0.06, -0.06]));
        let end = self.skull([0.0, 0.03 - fall.max(0.0), -0.075 - 0.1 * volume]);
        self.recipe.ellipsoid(join, crown, vec3::scale(radii, size));
        let girth = Girth((0.055 + volume) * size, (0.045 + 0.5 * volume) * size, 0.0);
        self.recipe.flat_spindle(join, nape, end, girth, [0.0, 0.0, 1.0], 0.6);
    }

    fn hat(&mut self, brim: f64) {
        let (to, size) = (self.to, HEAD_MAGNIFIED * self.to.head);
        let join = Join { bones: &[bone::HEAD], blend: 0.006 * size };
        let (rim, dome) = (self.skull([0.0, 0.135, -0.005]), self.skull([0.0, 0.16, -0.008]));
        let wide = |x: f64, y: f64, z: f64| vec3::scale([x * to.head_width, y, z], size);
        self.recipe.ellipsoid(join, rim, wide(0.085 * brim, 0.017, 0.1 * brim));
        self.recipe.ellipsoid(join, dome, wide(0.085, 0.075, 0.1));
    }

    /// A tube around the trunk through sections of height, half-width, front and back, widened by `loose`.
    fn garment(&mut self, bones: &[usize], sections: &[[f64; 4]], loose: f64) {
        let station = |&[y, side, front, back]: &[f64; 4]| Station {
            center: [0.0, self.height(y), 0.0],
            side: side + loose,
            front: front + loose,
            back: back + loose,
        };
        let stations = sections.iter().map(station).collect();
        self.recipe.loft(Join { bones, blend: 0.008 }, Loft { stations, upright: true, cap: HEM });
    }

    fn shirt(&mut self, [loose, sleeve, hem]: [f64; 3]) {
        use bone::*;
        let to = self.to;
        let belly = to.belly;
        // A coat is wider the longer it is.
        let fall = 0.25 * (0.86 - hem).max(0.0);
        let waist = [0.142 * to.waist, 0.1 * to.waist + belly, 0.086 * to.waist];
        let chest = [0.16 * to.chest, 0.115 * to.chest + 0.9 * to.breast, 0.112 * to.chest];
        let sections = [
            [hem, 0.165 * to.hips + fall, 0.1 + 0.5 * belly + fall, 0.105 * to.buttocks + fall],
            [1.06, waist[0], waist[1], waist[2]],
            [1.2, 0.5 * (waist[0] + chest[0]), 0.5 * (waist[1] + chest[1]), 0.5 * (waist[2] + chest[2])],
            [1.31, chest[0], chest[1], chest[2]],
            [1.4, 0.135 * to.chest, 0.08 * to.chest, 0.11 * to.chest],
            [1.455, 0.07 * to.neck, 0.035 * to.neck, 0.1 * to.neck],
        ];
        let mut bones = vec![PELVIS, LUMBAR, CHEST];
        if hem < COAT {
            let thighs = [limb(THIGH, 0), limb(THIGH, 1)];
            bones.extend(thighs);
            self.recipe.bound.extend(thighs);
        }
        self.garment(&bones, &sections, loose);
        for side in 0..2 {
            let on = |p: Vec3| on_side(p, side);
            let (shoulder, elbow, wrist) = (self.shoulder(), self.elbow(), self.wrist());
            let (upper, lower) = (sleeve.min(1.0), (sleeve - 1.0).max(0.0));
            let radius = |t: f64| (0.056 - 0.014 * t) * to.arm_girth + loose;
            let join = |name: usize| [limb(name, side)];
            let (start, end) = (on(lerp(shoulder, elbow, 0.04)), on(lerp(shoulder, elbow, upper)));
            let girth = Girth(radius(0.0), radius(upper), 0.0);
            self.recipe.spindle(Join { bones: &join(UPPER_ARM), blend: 0.012 }, start, end, girth);
            if lower > 0.1 {
                let end = on(lerp(elbow, wrist, (1.55 * lower).min(0.95)));
                let girth = Girth(radius(1.0), 0.9 * radius(1.0), 0.0);
                self.recipe.spindle(Join { bones: &join(FOREARM), blend: 0.012 }, on(elbow), end, girth);
            }
        }
    }

    fn skirt(&mut self, [hem, flare]: [f64; 2]) {
        use bone::*;
        let to = self.to;
        let wide = 0.185 * to.hips.max(to.waist);
        let deep = 0.115 * to.buttocks.max(to.waist);
        let sections = [
            [hem, wide * flare, deep * flare * 1.15, deep * flare * 1.15],
            [
                0.5 * (hem + 0.92),
                wide * (0.5 + 0.5 * flare),
                deep * (0.55 + 0.5 * flare),
                deep * (0.55 + 0.5 * flare),
            ],
            [0.92, wide, deep + 0.4 * to.belly, deep],
            [1.07, 0.148 * to.waist, 0.1 * to.waist + to.belly, 0.09 * to.waist],
        ];
        let mut bones = vec![PELVIS, limb(THIGH, 0), limb(THIGH, 1)];
        if hem < LONG {
            bones.extend([limb(SHIN, 0), limb(SHIN, 1)]);
        }
        self.garment(&bones, &sections, 0.008);
        self.recipe.bound.extend(&bones[1..]);
    }

    fn trousers(&mut self, [loose, length, hem]: [f64; 3]) {
        use bone::*;
        let to = self.to;
        let sections = [
            [0.86, 0.14 * to.hips, 0.085, 0.085 * to.buttocks],
            [0.93, 0.172 * to.hips, 0.1 + 0.3 * to.belly, 0.12 * to.buttocks],
            [1.05, 0.15 * to.waist, 0.1 * to.waist + 0.9 * to.belly, 0.088 * to.waist],
        ];
        self.garment(&[PELVIS], &sections, loose);
        for side in 0..2 {
            let on = |p: Vec3| on_side(p, side);
            let (hip, knee, ankle) = (self.hip(), self.knee(), self.ankle());
            let join = |name: usize| [limb(name, side)];
            let thigh = (2.0 * length).min(1.0);
            let (start, end) = (on(lerp(hip, knee, 0.06)), on(lerp(hip, knee, thigh)));
            let radius = |t: f64| (0.1 - 0.036 * t) * to.leg_girth + loose;
            let girth = Girth(radius(0.0), radius(thigh), 0.0);
            self.recipe.spindle(Join { bones: &join(THIGH), blend: 0.015 }, start, end, girth);
            if length > 0.55 {
                let end = on(lerp(knee, ankle, (2.0 * length - 1.0).min(0.93)));
                let girth = Girth(radius(1.0), hem * to.leg_girth + loose, 0.0);
                self.recipe.spindle(Join { bones: &join(SHIN), blend: 0.015 }, on(knee), end, girth);
            }
        }
    }

    fn shoe(&mut self, [thick, shaft]: [f64; 2], side: usize) {
        use bone::*;
        let size = FOOT_MAGNIFIED * self.to.foot;
        let at = |x: f64, y: f64, z: f64| on_side(self.sole([x, y, z]), side);
        let (ankle, shin) = (at(0.0, -0.01, -0.006), [limb(SHIN, side), limb(FOOT, side)]);
        let (heel, ball, toe) = (at(0.0, -0.05, -0.036), at(0.0, -0.058, 0.1), at(0.002, -0.064, 0.16));
        let up = [0.0, 1.0, 0.0];
        let (foot, toes) = ([limb(FOOT, side)], [limb(TOES, side)]);
        let join = Join { bones: &foot, blend: 0.012 * size };
        let girth = |a: f64, b: f64| Girth((a + thick) * size, (b + thick) * size, 0.0);
        self.recipe.flat_spindle(join, heel, ball, girth(0.038, 0.05), up, 0.8);
        self.recipe.flat_spindle(Join { bones: &toes, ..join }, ball, toe, girth(0.05, 0.04), up, 0.6);
        let top = on_side(lerp(self.ankle(), self.knee(), shaft), side);
        let wide = (0.036 + 0.014 * shaft) * self.to.leg_girth + thick;
        self.recipe.spindle(Join { bones: &shin, ..join }, ankle, top, Girth(0.042 * size, wide, 0.0));
    }
}
