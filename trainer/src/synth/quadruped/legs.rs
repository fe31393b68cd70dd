//! The legs of a quadruped.

use super::super::math::{Vec3, lerp};
use super::super::mirror::on_side;
use super::super::recipe::{Girth, Join};
use super::{PAW_MAGNIFIED, Sculptor, bone};
use fmnet::mesh::vec3;

impl Sculptor {
    pub(super) fn front_leg(&mut self, side: usize) {
        use bone::*;
        let girth = self.to.leg_girth;
        let [shoulder, elbow, wrist, ball] = self.front().map(|p| on_side(p, side));
        let blade = on_side(self.at([0.055, 0.54, 0.19]), side);
        let mut rod = |name: usize, blend: f64, a: Vec3, b: Vec3, radii: [f64; 3]| {
            let [ra, rb, bulge] = radii.map(|r| r * girth);
            self.recipe.spindle(Join { bones: &[limb(name, side)], blend }, a, b, Girth(ra, rb, bulge));
        };
        rod(BLADE, 0.06, blade, shoulder, [0.036, 0.042, 0.006]);
        rod(UPPER_ARM, 0.05, shoulder, elbow, [0.04, 0.037, 0.004]);
        rod(FOREARM, 0.03, elbow, wrist, [0.034, 0.0215, 0.001]);
        rod(FOREARM, 0.02, lerp(elbow, wrist, 0.05), lerp(elbow, wrist, 0.45), [0.036, 0.028, 0.0]);
        let point = vec3::add(elbow, [0.0, 0.014, -0.024]);
        rod(UPPER_ARM, 0.03, elbow, point, [0.018, 0.014, 0.0]);
        rod(HAND, 0.02, wrist, ball, [0.0235, 0.0205, -0.002]);
        self.toes(side, FORE_TOES, ball);
    }

    pub(super) fn hind_leg(&mut self, side: usize) {
        use bone::*;
        let girth = self.to.leg_girth;
        let [hip, knee, hock, ball] = self.hind().map(|p| on_side(p, side));
        let mut rod = |name: usize, blend: f64, a: Vec3, b: Vec3, radii: [f64; 3]| {
            let [ra, rb, bulge] = radii.map(|r| r * girth);
            self.recipe.spindle(Join { bones: &[limb(name, side)], blend }, a, b, Girth(ra, rb, bulge));
        };
        rod(THIGH, 0.055, hip, knee, [0.07, 0.044, 0.008]);
        let ham = vec3::add(hip, [0.0, -0.02, -0.035]);
        rod(THIGH, 0.045, ham, lerp(knee, hock, 0.22), [0.055, 0.026, 0.006]);
        rod(SHIN, 0.035, knee, hock, [0.038, 0.019, 0.003]);
        rod(SHIN, 0.03, lerp(knee, hock, 0.1), lerp(knee, hock, 0.55), [0.036, 0.024, 0.0]);
        let heel = vec3::add(hock, [0.0, 0.018, -0.016]);
        rod(SHIN, 0.02, lerp(knee, hock, 0.6), heel, [0.014, 0.0125, 0.0]);
        rod(FOOT, 0.018, heel, hock, [0.0135, 0.018, 0.0]);
        rod(FOOT, 0.02, hock, ball, [0.0215, 0.0185, -0.001]);
        self.toes(side, HIND_TOES, ball);
    }

    fn toes(&mut self, side: usize, name: usize, ball: Vec3) {
        let size = PAW_MAGNIFIED * self.to.paw;
        let bones = [bone::limb(name, side)];
        let join = |blend: f64| Join { bones: &bones, blend: blend * size };
        let hoof = self.to.hoof;
        let pad = vec3::add(ball, vec3::scale([0.0, -0.008, 0.012], size));
        self.recipe.ellipsoid(
            join(0.02),
            pad,
            vec3::scale([0.027 - 0.006 * hoof, 0.02, 0.03 - 0.01 * hoof], size),
        );
        for (x, reach) in [(-0.022, 0.038), (-0.0075, 0.048), (0.0075, 0.048), (0.022, 0.038)] {
            let root = vec3::add(ball, vec3::scale([0.6 * x, 0.0, 0.008], size));
            // Toes are drawn into the hoof.
            let tip = vec3::add(
                ball,
                vec3::scale([(1.0 - 0.6 * hoof) * x, -0.015, (1.0 - 0.55 * hoof) * reach], size),
            );
            self.recipe.spindle(join(0.006), root, tip, Girth(0.011 * size, 0.0105 * size, 0.0015 * size));
        }
    }

    /// The hooves of one side, of those that have them.
    pub(super) fn hooves(&mut self, side: usize) {
        if self.to.hoof <= 0.5 {
            return;
        }
        let size = PAW_MAGNIFIED * self.to.paw;
        for (name, [.., ball]) in [(bone::FORE_TOES, self.front()), (bone::HIND_TOES, self.hind())] {
            let at = |y: f64, z: f64| on_side(vec3::add(ball, vec3::scale([0.0, y, z], size)), side);
            let join = Join { bones: &[bone::limb(name, side)], blend: 0.014 * size };
            let (top, sole) = (at(0.02, 0.004), at(-0.016, 0.016));
            self.recipe.spindle(join, top, sole, Girth(0.018 * size, 0.026 * size, 0.0));
        }
    }
}
