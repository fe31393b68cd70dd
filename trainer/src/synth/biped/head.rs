//! The head of a biped.

use super::super::math::{Vec3, lerp};
use super::super::recipe::{Girth, Join};
use super::{HEAD_MAGNIFIED, Sculptor, bone};
use fmnet::mesh::vec3;

impl Sculptor {
    pub(super) fn head(&mut self) {
        use bone::*;
        let to = self.to;
        let size = HEAD_MAGNIFIED * to.head;
        let join = |blend: f64| Join { bones: &[HEAD], blend: blend * size };
        let at = |x: f64, y: f64, z: f64| self.skull([x, y, z]);
        let by = |r: Vec3| vec3::scale(r, size);
        let (cranium, face) = (at(0.0, 0.098, 0.004), at(0.0, 0.045, 0.042));
        // Lips and nose are at the tip of the jaws.
        let jut = 0.06 * to.muzzle + 0.07 * to.snout;
        let share = 0.4 + 0.6 * to.snout.min(1.0);
        let (chin, jaw) = (
            at(0.0, -0.012, 0.074 + 0.5 * jut - 0.02 * to.snout),
            [at(0.058, 0.03, 0.012), at(-0.058, 0.03, 0.012)],
        );
        let brow = [at(-0.038, 0.086, 0.078), at(0.038, 0.086, 0.078)];
        let nose = [at(0.0, 0.078, 0.094), at(0.0, 0.043, 0.112 + share * jut)];
        let lips = at(0.0, 0.016, 0.09 + jut);
        let eyes = [at(0.032, 0.07, 0.103), at(-0.032, 0.07, 0.103)];
        let cheeks = [at(0.042, 0.045, 0.066), at(-0.042, 0.045, 0.066)];
        // From the sides to the top of the head.
        let ears = [1.0, -1.0].map(|s| {
            let low = lerp([0.078, 0.05, -0.008], [0.056, 0.15, 0.0], to.ear_rise);
            let rise = vec3::scale(lerp([0.008, 0.04, -0.008], [0.016, 0.05, -0.004], to.ear_rise), to.ear);
            let high = vec3::add(low, rise);
            (at(s * low[0], low[1], low[2]), at(s * high[0], high[1], high[2]))
        });
        let nostrils = [at(0.013, 0.044, 0.098 + share * jut), at(-0.013, 0.044, 0.098 + share * jut)];
        let muzzle = at(0.0, 0.02, 0.06 + 0.042 * to.muzzle);
        let snout = [at(0.0, 0.03, 0.055), at(0.0, 0.03 - 0.006 * to.snout, 0.09 + 0.075 * to.snout)];
        let recipe = &mut self.recipe;
        recipe.ellipsoid(join(0.0), cranium, by([0.077 * to.head_width, 0.088, 0.097]));
        recipe.ellipsoid(join(0.03), face, by([0.06 * to.head_width, 0.075, 0.056]));
        for (corner, cheek) in jaw.into_iter().zip(cheeks) {
            recipe.spindle(join(0.025), corner, chin, Girth(0.021 * size, 0.02 * size, 0.0));
            recipe.ellipsoid(join(0.02), cheek, by([0.024, 0.022, 0.02]));
        }
        let jaws = 0.7 + 0.3 * to.muzzle.min(1.0);
        recipe.ellipsoid(join(0.03), muzzle, by([0.05 * jaws, 0.042 * jaws, 0.024 + 0.07 * to.muzzle]));
        let long = to.snout.min(1.0);
        let girth = Girth((0.024 + 0.02 * long) * size, (0.008 + 0.018 * long) * size, 0.0);
        recipe.spindle(join(0.012 + 0.03 * long), snout[0], snout[1], girth);
        for eye in eyes {
            recipe.carve(join(0.014), eye, by([0.02, 0.013, 0.02]));
        }
        recipe.spindle(join(0.016), brow[0], brow[1], Girth(0.012 * size, 0.012 * size, 0.006 * size));
        recipe.spindle(join(0.014), nose[0], nose[1], Girth(0.009 * size, 0.013 * size, 0.0));
        for nostril in nostrils {
            recipe.ellipsoid(join(0.01), nostril, by([0.009, 0.008, 0.01]));
        }
        recipe.ellipsoid(join(0.012), lips, by([0.024, 0.012, 0.012]));
        for (low, high) in ears {
            let wide = size * to.ear.sqrt();
            let girth = Girth(
                (0.012 + 0.016 * to.ear_rise) * wide,
                (0.019 + 0.008 * to.ear_rise) * wide,
                0.003 * wide,
            );
            let facing = [1.0 - to.ear_rise, 0.0, 0.3 + to.ear_rise];
            recipe.flat_spindle(join(0.008), low, high, girth, facing, 0.5);
        }
    }
}
