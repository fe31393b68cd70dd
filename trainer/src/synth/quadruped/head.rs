//! The head of a quadruped, with ears, horns and proboscis.

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
        let reach = 0.088 + 0.105 * to.muzzle;
        let wide = to.muzzle_girth;
        let (cranium, stop) = (at(0.0, 0.022, 0.032), at(0.0, 0.0, 0.082));
        let tip = at(0.0, -0.028 - 0.018 * to.muzzle, reach);
        let (jaw, chin) = (at(0.0, -0.032, 0.055), at(0.0, -0.055 - 0.018 * to.muzzle, reach - 0.014));
        let nose = at(0.0, -0.012 - 0.018 * to.muzzle, reach + 0.014 * wide);
        let sides = [1.0, -1.0];
        let (eyes, brows) =
            (sides.map(|s| at(s * 0.042, 0.02, 0.083)), sides.map(|s| at(s * 0.03, 0.042, 0.07)));
        let (cheeks, lips) = (
            sides.map(|s| at(s * 0.038, -0.02, 0.045)),
            sides.map(|s| at(s * 0.016 * wide, -0.038 - 0.018 * to.muzzle, reach - 0.008)),
        );
        let ears = sides.map(|s| {
            let tall = 0.055 * to.ear;
            let angle = 0.5 * std::f64::consts::PI * to.ear_drop;
            let out = 0.01 + 0.2 * tall + (tall + 0.012) * angle.sin();
            let low = [0.042, 0.06 - 0.012 * to.ear_drop.min(1.0), 0.012];
            (
                at(s * low[0], low[1], low[2]),
                at(s * (low[0] + out), low[1] + (tall + 0.012) * angle.cos(), 0.004),
            )
        });
        let recipe = &mut self.recipe;
        recipe.ellipsoid(join(0.05), cranium, by([0.06 * to.head_width, 0.06, 0.072]));
        for cheek in cheeks {
            recipe.ellipsoid(
                join(0.025),
                cheek,
                by([0.027 + 0.012 * to.mane, 0.036 + 0.02 * to.mane, 0.045]),
            );
        }
        recipe.spindle(join(0.035), stop, tip, Girth(0.04 * wide.sqrt() * size, 0.025 * wide * size, 0.0));
        recipe.spindle(join(0.012), jaw, chin, Girth(0.03 * size, 0.015 * wide * size, 0.0));
        for lip in lips {
            recipe.ellipsoid(join(0.014), lip, by([0.016 * wide, 0.016, 0.022]));
        }
        for (eye, brow) in eyes.into_iter().zip(brows) {
            recipe.carve(join(0.016), eye, by([0.009, 0.009, 0.012]));
            recipe.ellipsoid(join(0.016), brow, by([0.016, 0.013, 0.016]));
        }
        recipe.ellipsoid(join(0.008), nose, by([0.013 * wide, 0.01, 0.011]));
        for (low, high) in ears {
            let girth = Girth(0.026 * to.ear_width * size, 0.009 * size, 0.004 * size);
            recipe.flat_spindle(join(0.016), low, high, girth, [0.3, 0.0, 1.0], 0.45);
        }
    }

    /// Horns or antlers, proboscis and mane, of those that have them.
    pub(super) fn extras(&mut self) {
        let to = self.to;
        if to.horn > 0.0 {
            (0..2).for_each(|side| self.horn(side));
        }
        if to.proboscis > 0.0 {
            let axis: Vec<Vec3> = (0..=6).map(|i| self.proboscis(f64::from(i) / 6.0)).collect();
            let size = HEAD_MAGNIFIED * to.head;
            for (i, ends) in axis.windows(2).enumerate() {
                let bones = if i == 0 {
                    [bone::HEAD, bone::PROBOSCIS]
                } else {
                    [bone::PROBOSCIS, bone::PROBOSCIS + 1]
                };
                let join = Join { bones: &bones, blend: if i == 0 { 0.04 } else { 0.008 } };
                let radius = |i: usize| size * (0.034 - 0.0034 * i as f64);
                self.recipe.spindle(join, ends[0], ends[1], Girth(radius(i), radius(i + 1), 0.0));
            }
        }
        if to.mane > 0.0 {
            let bones = [bone::LOW_NECK, bone::NECK];
            let girth = Girth(0.1 * to.neck_girth * to.mane, 0.092 * to.head * to.mane, 0.0);
            let (base, top) = (self.neck(0.1), self.neck(0.95));
            self.recipe.spindle(Join { bones: &bones, blend: 0.03 }, base, top, girth);
        }
    }

    fn horn(&mut self, side: usize) {
        let (to, size) = (self.to, HEAD_MAGNIFIED * self.to.head);
        let s = [1.0, -1.0][side];
        let at = |[x, y, z]: Vec3| self.skull([s * x, y, z]);
        let join = Join { bones: &[bone::HEAD], blend: 0.006 * size };
        let root = [0.03, 0.07, 0.03];
        let grown = |x: f64, y: f64, z: f64| vec3::add(root, vec3::scale([x, y, z], to.horn));
        // A cow's horns go out and up, antlers up and back.
        let middle = lerp(grown(0.06, 0.025, 0.0), grown(0.03, 0.07, -0.03), to.antler);
        let tip = lerp(grown(0.075, 0.09, 0.015), grown(0.075, 0.15, -0.02), to.antler);
        let thick = 0.5 + 0.5 * to.horn.min(1.2);
        let girth = |a: f64, b: f64| Girth(a * thick * size, b * thick * size, 0.0);
        let mut spindles = vec![(root, middle, girth(0.017, 0.013)), (middle, tip, girth(0.013, 0.008))];
        if to.antler > 0.5 {
            let branch =
                |from: Vec3, by: Vec3| (from, vec3::add(from, vec3::scale(by, to.horn)), girth(0.01, 0.007));
            spindles.push(branch(lerp(root, middle, 0.5), [0.01, 0.03, 0.05]));
            spindles.push(branch(middle, [0.0, 0.045, 0.05]));
            spindles.push(branch(lerp(middle, tip, 0.6), [0.03, 0.03, -0.04]));
        }
        let placed: Vec<_> =
            spindles.into_iter().map(|(start, end, girth)| (at(start), at(end), girth)).collect();
        for (start, end, girth) in placed {
            self.recipe.spindle(join, start, end, girth);
        }
    }
}
