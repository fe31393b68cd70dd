//! The solids of a fish.

use fmnet::mesh::vec3;

use super::super::loft::Station;
use super::super::math::{Vec3, lerp};
use super::super::mirror::on_side;
use super::super::recipe::{FeatureKind, Girth, Join};
use super::{Sculptor, bone};

/// Half the thickness of a fin.
const BLADE: f64 = 0.0105;
const SIDEWAYS: Vec3 = [1.0, 0.0, 0.0];

impl Sculptor {
    pub(super) fn trunk(&mut self) {
        use bone::*;
        let to = self.to;
        let join = Join { bones: &[HEAD, FRONT, MIDDLE, REAR, REAR_MIDDLE, REAR_END], blend: 0.03 };
        let thin = to.peduncle;
        // Place along the body, half-width, and extents upwards and downwards.
        let sections = [
            (-0.39, 0.016 * thin, 0.022 * thin, 0.022 * thin),
            (-0.33, 0.022 * thin, 0.03 * thin, 0.03 * thin),
            (-0.24, 0.036 * thin.sqrt(), 0.055 * thin.sqrt(), 0.052 * thin.sqrt()),
            (-0.12, 0.055, 0.088, 0.085),
            (0.02, 0.07, 0.11, 0.108 + to.belly),
            (0.14, 0.073, 0.11, 0.108 + to.belly),
            (0.25, 0.066 * to.head, 0.092 * to.head, 0.09 * to.head + 0.4 * to.belly),
            (0.34, 0.05 * to.head, 0.064 * to.head, 0.064 * to.head),
            (0.4, 0.034 * to.head, 0.038 * to.head, 0.04 * to.head),
        ];
        let stations = sections.map(|(z, side, front, back)| Station {
            center: self.at([0.0, 0.0, z]),
            side: side * to.girth,
            front: front * to.height,
            back: back * to.height,
        });
        self.recipe.tube(join, stations.to_vec(), false);
    }

    pub(super) fn head(&mut self) {
        use bone::*;
        let to = self.to;
        let size = to.head * to.girth.min(to.height);
        let at = |p: Vec3| self.at(p);
        let (face, nose) = (at([0.0, 0.0, 0.37]), self.nose());
        let (jaw, chin) = (at([0.0, -0.028, 0.35]), vec3::add(nose, [0.0, -0.018 * size, -0.012]));
        let eyes = [1.0, -1.0].map(|s| at([s * 0.047 * to.head, 0.022 * to.head, 0.335]));
        let gills = [1.0, -1.0].map(|s| at([s * 0.052 * to.head, -0.012, 0.255]));
        let join = |blend: f64| Join { bones: &[HEAD], blend };
        let recipe = &mut self.recipe;
        recipe.spindle(join(0.04), face, nose, Girth(0.036 * size, 0.018 * size, 0.0));
        recipe.spindle(join(0.012), jaw, chin, Girth(0.024 * size, 0.012 * size, 0.0));
        for (eye, gill) in eyes.into_iter().zip(gills) {
            recipe.ellipsoid(join(0.008), eye, vec3::scale([0.01, 0.015, 0.015], to.head));
            recipe.ellipsoid(join(0.012), gill, [0.018 * size, 0.05 * size, 0.03 * to.head]);
        }
    }

    /// The end of the head, without a beak.
    fn nose(&self) -> Vec3 {
        vec3::add(self.at([0.0, 0.0, 0.4]), [0.0, -0.008, 0.035 * self.to.snout])
    }

    /// The beak of those that have one.
    pub(super) fn beak(&mut self) {
        let long = self.to.beak;
        if long <= 0.0 {
            return;
        }
        let ends = [[0.0, 0.0, -0.02], [0.0, -0.012, 0.075 * long]].map(|by| vec3::add(self.nose(), by));
        let join = Join { bones: &[bone::HEAD], blend: 0.015 };
        self.recipe.spindle(join, ends[0], ends[1], Girth(0.022 * long, 0.015 * long, 0.0));
    }

    /// A fin between its base and its tip.
    fn fin(&mut self, join: Join, from: Vec3, to: Vec3, wide: [f64; 2], across: Vec3) {
        let [a, b] = wide;
        let flatten = (BLADE / a.max(b)).min(1.0);
        self.recipe.flat_spindle(join, from, to, Girth(a, b, 0.0), across, flatten);
    }

    pub(super) fn tail(&mut self) {
        use bone::*;
        let to = self.to;
        let root = self.at([0.0, 0.0, -0.375]);
        let size = to.tail;
        let join = Join { bones: &[TAIL], blend: 0.02 * size.min(1.0) };
        let wide = [0.034 * to.tail_width * size, 0.026 * to.tail_width * size];
        for (sign, long) in [(1.0, 1.0 + to.skew), (-1.0, 1.0 - 0.5 * to.skew)] {
            let reach = size * long;
            let tip = vec3::add(root, [0.0, sign * 0.125 * to.fork * reach, -0.125 * reach]);
            self.fin(join, root, tip, wide, SIDEWAYS);
        }
        // Skin between the lobes.
        let middle = vec3::add(root, [0.0, 0.0, -0.07 * size]);
        self.fin(join, root, middle, [1.0 * wide[0], 1.1 * wide[0]], SIDEWAYS);
    }

    /// The fins of the back and of the belly.
    pub(super) fn upright_fins(&mut self) {
        use bone::*;
        for (bones, [front, rear, tip], size) in
            [([DORSAL, MIDDLE], self.dorsal(), self.to.dorsal), ([ANAL, REAR], self.anal(), self.to.anal)]
        {
            let join = Join { bones: &bones[..1], blend: 0.018 * size.min(1.0) };
            // Low fins are wide enough to leave no hole between their ends.
            let wide = 0.03 * (1.75 * size).min(1.0);
            self.fin(join, lerp(front, rear, 0.3), tip, [1.2 * wide, 0.75 * wide], SIDEWAYS);
            let low = lerp(rear, tip, 0.35);
            self.fin(join, lerp(front, rear, 0.1), low, [wide, 0.8 * wide], SIDEWAYS);
            self.fin(join, low, lerp(tip, low, 0.15), [0.85 * wide, 0.7 * wide], SIDEWAYS);
        }
    }

    pub(super) fn paired_fins(&mut self, side: usize) {
        use bone::*;
        let to = self.to;
        let on = |p: Vec3| on_side(p, side);
        let [root, tip] = self.pectoral().map(on);
        let wide = 0.034 * to.pectoral_width * to.pectoral.sqrt();
        let bones = [limb(PECTORAL, side)];
        let join = Join { bones: &bones, blend: 0.018 };
        self.fin(join, root, tip, [0.9 * wide, 0.8 * wide], on([0.35, 1.0, 0.1]));
        let [root, tip] = self.pelvic().map(on);
        let wide = 0.026 * to.pelvic.min(1.0);
        let bones = [limb(PELVIC, side)];
        let join = Join { bones: &bones, blend: 0.015 * to.pelvic.min(1.0) };
        self.fin(join, root, tip, [wide, 0.8 * wide], on([1.0, 0.4, 0.0]));
    }

    /// The flat tail of those that have one.
    pub(super) fn fluke(&mut self) {
        let size = self.to.fluke;
        if size <= 0.0 {
            return;
        }
        let join = Join { bones: &[bone::TAIL], blend: 0.02 };
        let root = self.at([0.0, 0.0, -0.38]);
        for sign in [1.0, -1.0] {
            let tip = vec3::add(root, [sign * 0.13 * size, 0.0, -0.09 * size]);
            self.fin(join, root, tip, [0.04 * size, 0.024 * size], [0.0, 1.0, 0.0]);
        }
    }

    pub(super) fn features(&mut self) {
        use FeatureKind::*;
        let at = |p: Vec3| self.at(p);
        let mut places = vec![
            (Belly, at([0.0, -0.11, 0.06]), 0.12, [0.0, -1.0, 0.0]),
            (Hips, at([0.0, 0.1, 0.12]), 0.1, [0.0, 1.0, 0.0]),
            (Face, at([0.0, 0.05, 0.34]), 0.05, [0.0, 1.0, 0.2]),
        ];
        for side in 0..2 {
            let out = on_side(SIDEWAYS, side);
            places.extend([
                (Belly, on_side(at([0.07, -0.03, 0.06]), side), 0.1, out),
                (Muscle, on_side(at([0.05, 0.0, -0.14]), side), 0.09, out),
            ]);
        }
        for (kind, center, radius, direction) in places {
            self.recipe.feature(kind, center, radius, direction);
        }
    }
}
