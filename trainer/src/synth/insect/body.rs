//! The solids of an insect.

use fmnet::mesh::vec3;

use super::super::math::{Vec3, lerp};
use super::super::mirror::on_side;
use super::super::recipe::{FeatureKind, Girth, Join};
use super::{Sculptor, bone};

const UP: Vec3 = [0.0, 1.0, 0.0];

impl Sculptor {
    pub(super) fn trunk(&mut self) {
        use bone::*;
        let to = self.to;
        let [front, rear] = self.thorax();
        let [joint, root, tip] = self.abdomen();
        let recipe = &mut self.recipe;
        let thorax = Join { bones: &[THORAX], blend: 0.02 };
        let girth = |r: f64| r * to.thorax_girth;
        recipe.spindle(
            thorax,
            lerp(front, rear, 0.15),
            lerp(front, rear, 0.5),
            Girth(girth(0.034), girth(0.036), 0.002),
        );
        recipe.spindle(
            thorax,
            lerp(front, rear, 0.5),
            lerp(front, rear, 0.88),
            Girth(girth(0.036), girth(0.029), 0.002),
        );
        let waist = Join { bones: &[WAIST], blend: 0.018 };
        let thin = 0.0155 * to.waist_girth;
        recipe.spindle(waist, joint, root, Girth(thin, thin, 0.0));
        // A knot, as an ant's.
        let knot = lerp(joint, root, 0.55);
        recipe.spindle(
            waist,
            vec3::add(knot, [0.0, 0.004, 0.0]),
            vec3::add(knot, [0.0, 0.016, -0.004]),
            Girth(1.15 * thin, 0.8 * thin, 0.0),
        );
        let abdomen = Join { bones: &[ABDOMEN], blend: 0.02 };
        let (wide, tall) = (to.abdomen_width, to.abdomen_height);
        let flatten = tall / wide;
        let (near, middle) = (lerp(root, tip, 0.12), lerp(root, tip, 0.5));
        recipe.flat_spindle(
            abdomen,
            near,
            middle,
            Girth(0.03 * wide, 0.05 * wide, 0.006 * wide),
            UP,
            flatten,
        );
        recipe.flat_spindle(
            abdomen,
            middle,
            lerp(root, tip, 0.95),
            Girth(0.05 * wide, 0.014 * wide, 0.008 * wide),
            UP,
            flatten,
        );
    }

    pub(super) fn head(&mut self) {
        use bone::*;
        let to = self.to;
        let at = |x: f64, y: f64, z: f64| self.skull([x, y, z]);
        let size = to.head;
        let (crown, face) = (at(0.0, 0.004, -0.012), at(0.0, -0.008, 0.03));
        let eyes = [1.0, -1.0].map(|s| at(s * 0.032, 0.012, 0.012));
        let neck = (self.thorax()[0], at(0.0, 0.0, -0.02));
        let flatten = 0.85 / to.head_width;
        let recipe = &mut self.recipe;
        let join = |blend: f64| Join { bones: &[HEAD], blend };
        recipe.spindle(join(0.015), neck.0, neck.1, Girth(0.018, 0.016 * size, 0.0));
        let girth = Girth(0.04 * size * to.head_width, 0.026 * size * to.head_width, 0.003);
        recipe.flat_spindle(join(0.015), crown, face, girth, UP, flatten);
        for eye in eyes {
            recipe.ellipsoid(join(0.006), eye, vec3::scale([0.012, 0.016, 0.017], size * to.eye));
        }
    }

    pub(super) fn feeler_and_jaw(&mut self, side: usize) {
        use bone::*;
        let to = self.to;
        let [root, elbow, end] = self.feeler().map(|p| on_side(p, side));
        let [hinge, point] = self.jaw().map(|p| on_side(p, side));
        let (lower, upper) = ([limb(FEELER, side)], [limb(FEELER + 1, side)]);
        let r = 0.0085 * to.leg_girth.sqrt();
        let recipe = &mut self.recipe;
        recipe.spindle(Join { bones: &lower, blend: 0.008 }, root, elbow, Girth(r, 0.9 * r, 0.0));
        recipe.spindle(Join { bones: &upper, blend: 0.004 }, elbow, end, Girth(0.95 * r, 0.9 * r, 0.001));
        let jaw = [limb(JAW, side)];
        let middle = vec3::add(lerp(hinge, point, 0.55), on_side([0.012 * to.jaw, 0.0, 0.0], side));
        let thick = to.head.sqrt();
        recipe.spindle(
            Join { bones: &jaw, blend: 0.006 },
            hinge,
            middle,
            Girth(0.0095 * thick, 0.009 * thick, 0.0),
        );
        recipe.spindle(
            Join { bones: &jaw, blend: 0.004 },
            middle,
            point,
            Girth(0.009 * thick, 0.0068 * thick, 0.0),
        );
    }

    pub(super) fn leg(&mut self, pair: usize, side: usize) {
        let [hip, knee, ankle, end] = self.leg_joints(pair).map(|p| on_side(p, side));
        // The hind thigh of those that leap is thick.
        let strong = if pair == 2 { self.to.hind.sqrt() } else { 1.0 };
        let girth = self.to.leg_girth;
        let mut rod = |i: usize, blend: f64, a: Vec3, b: Vec3, [ra, rb]: [f64; 2]| {
            let bones = [bone::limb(bone::LEG + 3 * pair + i, side)];
            self.recipe.spindle(Join { bones: &bones, blend }, a, b, Girth(ra * girth, rb * girth, 0.0));
        };
        rod(0, 0.012, hip, lerp(hip, knee, 0.3), [0.0155, 0.0135 * strong]);
        rod(0, 0.006, lerp(hip, knee, 0.2), knee, [0.0135 * strong, 0.0105]);
        rod(1, 0.005, knee, ankle, [0.0108, 0.0085]);
        rod(2, 0.005, ankle, end, [0.0088, 0.0078]);
    }

    /// The shell of those that have one.
    pub(super) fn shell(&mut self) {
        let (to, shell) = (self.to, self.to.shell);
        if shell <= 0.0 {
            return;
        }
        let [_, root, tip] = self.abdomen();
        let (front, rear) =
            (vec3::add(root, [0.0, 0.012, 0.03]), vec3::add(lerp(root, tip, 0.6), [0.0, 0.01, 0.0]));
        let bones = [bone::ABDOMEN, bone::WAIST];
        let join = Join { bones: &bones[..1], blend: 0.008 };
        let wide = 0.054 * to.abdomen_width * shell;
        self.recipe.flat_spindle(
            join,
            front,
            rear,
            Girth(0.85 * wide, wide, 0.004),
            UP,
            0.8 * to.abdomen_height / to.abdomen_width,
        );
    }

    pub(super) fn features(&mut self) {
        use FeatureKind::*;
        let [front, rear] = self.thorax();
        let [_, root, tip] = self.abdomen();
        let (thorax, belly) = (lerp(front, rear, 0.5), lerp(root, tip, 0.5));
        let mut places = vec![
            (Belly, vec3::add(belly, [0.0, 0.05, 0.0]), 0.06, UP),
            (Belly, vec3::add(belly, [0.0, -0.05, 0.0]), 0.06, [0.0, -1.0, 0.0]),
            (Chest, vec3::add(thorax, [0.0, 0.035, 0.0]), 0.04, UP),
            (Face, self.skull([0.0, 0.035, 0.0]), 0.03, UP),
        ];
        for side in 0..2 {
            let out = on_side([1.0, 0.0, 0.0], side);
            places.push((Belly, vec3::add(belly, vec3::scale(out, 0.05)), 0.06, out));
        }
        for (kind, center, radius, direction) in places {
            self.recipe.feature(kind, center, radius, direction);
        }
    }
}
