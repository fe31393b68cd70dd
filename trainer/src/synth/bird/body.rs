//! The solids of a bird.

use fmnet::mesh::vec3;

use super::super::math::{Vec3, lerp};
use super::super::mirror::on_side;
use super::super::recipe::{FeatureKind, Girth, Join};
use super::{FOOT_MAGNIFIED, HEAD_MAGNIFIED, Sculptor, bone};

/// Half the thickness of wings and tail.
const BLADE: f64 = 0.0085;

impl Sculptor {
    pub(super) fn trunk(&mut self) {
        use bone::*;
        let to = self.to;
        let trunk = Join { bones: &[PELVIS, CHEST], blend: 0.05 };
        let at = |y: f64, z: f64| self.at([0.0, y, z]);
        let (rump, chest) = (at(0.0, -0.09), at(0.0, 0.05));
        let (breast, belly) = (at(-0.02, 0.055), at(-0.014, -0.04));
        let (root, tip) = (at(0.012, -0.11), self.tail_tip());
        let neck = self.neck(0.1);
        let up = self.raised([0.0, 1.0, 0.0]);
        let girth = |a: f64, b: f64, c: f64| Girth(a * to.girth, b * to.girth, c * to.girth);
        let recipe = &mut self.recipe;
        recipe.spindle(trunk, rump, chest, girth(0.042, 0.062, 0.014));
        let deep = 0.5 + 0.5 * to.breast;
        recipe.spindle(trunk, breast, belly, girth(0.062 * deep, 0.056 * deep, 0.002));
        let shoulders = Join { bones: &[CHEST, NECK], blend: 0.05 };
        let thin = 0.034 * to.neck_girth;
        recipe.spindle(shoulders, chest, neck, Girth(0.056 * to.girth, thin, 0.0));
        let tail = Join { bones: &[TAIL], blend: 0.035 };
        let wide = [0.028 * to.girth, 0.024 + 0.02 * to.fan];
        let flatten = BLADE / wide[1];
        recipe.flat_spindle(tail, root, tip, Girth(wide[0], wide[1], 0.0), up, flatten);
        recipe.spindle(tail, rump, lerp(root, tip, 0.35), girth(0.036, 0.012, 0.0));
    }

    pub(super) fn neck_and_head(&mut self) {
        use bone::*;
        let to = self.to;
        let size = HEAD_MAGNIFIED * to.head;
        let necks = [NECK, NECK_MIDDLE, NECK_END];
        // The neck is thick at its base and where it meets the head.
        let thin = 0.034 * to.neck_girth;
        let meets = lerp([0.026 * to.neck_girth, 0.0, 0.0], [0.03 * size, 0.0, 0.0], 0.35)[0];
        let (base, middle, top) = (self.neck(0.0), self.neck(0.5), self.neck(1.03));
        let at = |x: f64, y: f64, z: f64| self.skull([x, y, z]);
        let (nape, brow) = (at(0.0, 0.008, 0.0), at(0.0, 0.01, 0.03));
        let (long, hook) = (0.05 * to.beak, 0.05 * to.beak * to.hook);
        let (face, bend) = (at(0.0, 0.002, 0.045), at(0.0, 0.0, 0.056 + 0.6 * long));
        let tip = at(0.0, -0.006 - hook, 0.056 + long);
        let (jaw, chin) = (at(0.0, -0.008, 0.04), at(0.0, -0.008, 0.052 + 0.6 * long));
        let eyes = [1.0, -1.0].map(|s| at(s * 0.028, 0.012, 0.026));
        let recipe = &mut self.recipe;
        let neck = Join { bones: &necks, blend: 0.04 };
        let slim = 0.5 * (thin + meets) * 0.92;
        recipe.spindle(neck, base, middle, Girth(thin * 1.1, slim, 0.0));
        let upper = Join { blend: 0.008, ..neck };
        recipe.spindle(upper, middle, top, Girth(slim, meets, 0.0));
        let join = |blend: f64| Join { bones: &[HEAD], blend: blend * size };
        recipe.spindle(join(0.03), nape, brow, Girth(0.031 * size, 0.027 * size, 0.002 * size));
        let thick = to.beak_girth * size;
        recipe.spindle(join(0.016), face, bend, Girth(0.0165 * thick, 0.0085 * thick, 0.0));
        recipe.spindle(join(0.004), bend, tip, Girth(0.0085 * thick, 0.0055 * thick, 0.0));
        recipe.spindle(join(0.008), jaw, chin, Girth(0.012 * thick, 0.006 * thick, 0.0));
        for eye in eyes {
            recipe.ellipsoid(join(0.004), eye, vec3::scale([0.005, 0.008, 0.008], size));
        }
    }

    pub(super) fn wing(&mut self, side: usize) {
        use bone::*;
        let to = self.to;
        let joints = self.wing_joints();
        let on = |p: Vec3| on_side(p, side);
        let up = self.raised([0.0, 1.0, 0.0]);
        let back = self.raised([0.0, 0.0, -1.0]);
        // Half-widths at the joints: the blade narrows towards its tip.
        let wide = [0.05, 0.05, 0.046, 0.02].map(|w| w * to.chord * to.wing.sqrt());
        let within =
            |i: usize| on(vec3::add(joints[i], vec3::scale(back, [0.75, 0.72, 0.6, 0.0][i] * wide[i])));
        for i in 0..3 {
            let bones = [limb(WING + i, side)];
            let (a, b) = (within(i), within(i + 1));
            let (ra, rb) = (wide[i], wide[i + 1]);
            let join = Join { bones: &bones, blend: if i == 0 { 0.02 } else { 0.008 } };
            self.recipe.flat_spindle(join, a, b, Girth(ra, rb, 0.0), up, BLADE / ra);
            // The arm along the front of the blade.
            if i < 2 {
                let thick = [0.017, 0.0135, 0.0105].map(|r| r * to.girth.sqrt());
                let join = Join { bones: &bones, blend: 0.015 };
                self.recipe.spindle(
                    join,
                    on(joints[i]),
                    on(joints[i + 1]),
                    Girth(thick[i], thick[i + 1], 0.0),
                );
            }
        }
    }

    pub(super) fn leg(&mut self, side: usize) {
        use bone::*;
        let girth = self.to.leg_girth;
        let [hip, knee, hock, ball] = self.leg_joints().map(|p| on_side(p, side));
        let mut rod = |name: usize, blend: f64, a: Vec3, b: Vec3, radii: [f64; 2]| {
            let [ra, rb] = radii.map(|r| r * girth);
            self.recipe.spindle(Join { bones: &[limb(name, side)], blend }, a, b, Girth(ra, rb, 0.0));
        };
        rod(THIGH, 0.03, hip, knee, [0.034, 0.022]);
        rod(SHIN, 0.02, knee, hock, [0.021, 0.0095]);
        rod(FOOT, 0.008, hock, ball, [0.0092, 0.0085]);
        let size = FOOT_MAGNIFIED * self.to.foot;
        let bones = [limb(TOES, side)];
        let join = Join { bones: &bones, blend: 0.006 };
        let toes = [([-0.022, -0.004, 0.036], 0.0062), ([0.0, -0.004, 0.043], 0.0066)];
        for (toe, r) in
            toes.into_iter().chain([([0.022, -0.004, 0.036], 0.0062), ([0.0, -0.004, -0.022], 0.006)])
        {
            let tip = vec3::add(ball, on_side(vec3::scale(toe, size), side));
            self.recipe.spindle(join, ball, tip, Girth(1.1 * r * size, 0.85 * r * size, 0.0));
        }
    }

    /// Skin between the toes, of those that have it.
    pub(super) fn webs(&mut self) {
        if self.to.web <= 0.5 {
            return;
        }
        let size = FOOT_MAGNIFIED * self.to.foot;
        for side in 0..2 {
            let ball = on_side(self.leg_joints()[3], side);
            let bones = [bone::limb(bone::TOES, side)];
            let join = Join { bones: &bones, blend: 0.006 };
            let (from, to) = ([0.0, -0.003, 0.008], [0.0, -0.004, 0.024]);
            let at = |p: Vec3| vec3::add(ball, vec3::scale(p, size));
            let girth = Girth(0.009 * size, 0.02 * size, 0.0);
            self.recipe.flat_spindle(join, at(from), at(to), girth, [0.0, 1.0, 0.0], 0.3);
        }
    }

    pub(super) fn features(&mut self) {
        use FeatureKind::*;
        let at = |x: f64, y: f64, z: f64| self.at([x, y, z]);
        let down = self.raised([0.0, -1.0, 0.0]);
        let mut places = vec![
            (Belly, at(0.0, -0.07, -0.02), 0.07, down),
            (Chest, at(0.0, -0.06, 0.07), 0.06, self.raised([0.0, -0.7, 0.7])),
            (Hips, at(0.0, 0.05, -0.08), 0.06, self.raised([0.0, 1.0, 0.0])),
            (Face, self.skull([0.0, 0.035, 0.02]), 0.03, [0.0, 1.0, 0.0]),
        ];
        for side in 0..2 {
            let out = on_side([1.0, 0.0, 0.0], side);
            let [hip, knee, ..] = self.leg_joints();
            places.extend([
                (Belly, on_side(at(0.06, -0.02, -0.02), side), 0.06, out),
                (Muscle, on_side(lerp(hip, knee, 0.5), side), 0.04, out),
                (Face, on_side(self.skull([0.03, 0.0, 0.02]), side), 0.025, out),
            ]);
        }
        for (kind, center, radius, direction) in places {
            let radius = if kind == Face { radius * HEAD_MAGNIFIED * self.to.head } else { radius };
            self.recipe.feature(kind, center, radius, direction);
        }
    }
}
