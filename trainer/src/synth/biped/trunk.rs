//! Trunk, neck and tail of a biped, and where individuals differ.

use super::super::loft::Station;
use super::super::math::{Vec3, lerp};
use super::super::mirror::on_side;
use super::super::recipe::{FeatureKind, Girth, Join};
use super::{HEAD_MAGNIFIED, Sculptor, bone};
use fmnet::mesh::vec3;

impl Sculptor {
    pub(super) fn trunk(&mut self) {
        use bone::*;
        let to = self.to;
        let trunk = [PELVIS, LUMBAR, CHEST];
        let wide = |blend| Join { bones: &trunk, blend };
        let mix = |a: f64, b: f64| 0.5 * (a + b);
        let loin = mix(to.hips, to.waist);
        // Height, centre in depth, half-width, and extents to the front and to the back.
        let sections = [
            (0.865, -0.01, 0.11 * to.hips, 0.06, 0.06),
            (0.93, 0.0, 0.16 * to.hips, 0.09, 0.092 * to.buttocks),
            (1.0, 0.0, 0.154 * loin, 0.094 * loin + 0.7 * to.belly, 0.088 * loin),
            (1.07, 0.002, 0.14 * to.waist, 0.096 * to.waist + to.belly, 0.078 * to.waist),
            (1.13, 0.002, 0.134 * to.waist, 0.093 * to.waist + 0.9 * to.belly, 0.076 * to.waist),
            (1.2, 0.0, 0.139 * mix(to.waist, to.chest), 0.096 * to.chest + 0.45 * to.belly, 0.086 * to.chest),
            (1.28, -0.005, 0.151 * to.chest, 0.106 * to.chest, 0.099 * to.chest),
            (1.35, -0.012, 0.154 * to.chest, 0.1 * to.chest, 0.105 * to.chest),
            (1.41, -0.022, 0.13 * to.chest, 0.074 * to.chest, 0.083 * to.chest),
            (1.45, -0.03, 0.085 * to.neck, 0.055 * to.neck, 0.058 * to.neck),
        ];
        let stations = sections.map(|(y, z, side, front, back)| Station {
            center: [0.0, self.height(y), z],
            side,
            front,
            back,
        });
        self.recipe.tube(wide(0.06), stations.to_vec(), true);
        for side in 0..2 {
            self.trunk_side(side);
        }
        let spine = Join { bones: &trunk, blend: 0.035 };
        let (tail, nape) = (self.height(1.05), self.height(1.34));
        let back = 0.08 * to.waist;
        self.recipe.carve(
            spine,
            [0.0, 0.5 * (tail + nape), -back - 0.012],
            [0.012, 0.5 * (nape - tail), 0.02],
        );
        let neck_base = self.torso([0.0, 1.44, -0.035]);
        let skull = vec3::add(self.skull_base(), [0.0, 0.03, 0.002]);
        let neck = Join { bones: &[NECK], blend: 0.035 };
        self.recipe.spindle(neck, neck_base, skull, Girth(0.062 * to.neck, 0.056 * to.neck, -0.002));
    }

    /// The tail of those that have one.
    pub(super) fn tail(&mut self) {
        if self.to.tail <= 0.0 {
            return;
        }
        let axis: Vec<Vec3> = (0..=5).map(|i| self.tail_axis(f64::from(i) / 5.0)).collect();
        for (i, ends) in axis.windows(2).enumerate() {
            let bones = [bone::TAIL, bone::TAIL + 1];
            let join = Join { bones: &bones, blend: if i == 0 { 0.05 } else { 0.006 } };
            let radius = |i: usize| self.to.tail_girth * (0.045 - 0.006 * i as f64);
            let girth = Girth(radius(i), radius(i + 1), 0.0);
            self.recipe.spindle(join, ends[0], ends[1], girth);
        }
    }

    fn trunk_side(&mut self, side: usize) {
        use bone::*;
        let to = self.to;
        let on = |p: Vec3| on_side(p, side);
        let chest = Join { bones: &[CHEST], blend: 0.04 };
        let pectoral = on(self.torso([0.075, 1.315, 0.062 * to.chest]));
        self.recipe.tilted_ellipsoid(chest, pectoral, [0.08, 0.058, 0.038 * to.muscle], on([0.3, 1.0, 0.15]));
        let center = on(self.torso([0.078, 1.285, 0.065 * to.chest + 0.45 * to.breast]));
        let radius = 0.045 + 0.55 * to.breast;
        self.recipe.ellipsoid(chest, center, [radius, radius, 0.025 + to.breast]);
        let blade = on(self.torso([0.08, 1.33, -0.082 * to.chest]));
        self.recipe.tilted_ellipsoid(chest, blade, [0.058, 0.085, 0.03 * to.muscle], on([-0.2, 1.0, 0.1]));
        let lat = (on(self.torso([0.12, 1.34, -0.035])), on(self.torso([0.095, 1.16, -0.02])));
        self.recipe.spindle(
            chest,
            lat.0,
            lat.1,
            Girth(0.05 * to.chest * to.muscle.sqrt(), 0.035 * to.chest, 0.0),
        );
        let trapezius = Join { bones: &[CHEST, limb(CLAVICLE, side)], blend: 0.04 };
        let (nape, shoulder) = (on(self.torso([0.025, 1.475, -0.035])), on(self.torso([0.15, 1.43, -0.022])));
        self.recipe.spindle(
            trapezius,
            nape,
            shoulder,
            Girth(0.042 * to.neck * to.muscle.sqrt(), 0.042 * to.arm_girth, 0.0),
        );
        let pelvis = Join { bones: &[PELVIS], blend: 0.045 };
        let buttock = on(self.torso([0.072, 0.9, -0.06]));
        let size = 0.078 * to.buttocks;
        self.recipe.ellipsoid(pelvis, buttock, [size, 1.12 * size, size]);
        let flank = on(self.torso([0.105, 0.99, -0.005]));
        self.recipe.ellipsoid(pelvis, flank, [0.06 * to.hips, 0.075, 0.07]);
    }

    pub(super) fn features(&mut self) {
        use FeatureKind::*;
        let at = |x: f64, y: f64, z: f64| self.torso([x, y, z]);
        let mut places = vec![
            (Belly, at(0.0, 1.05, 0.1), 0.13, [0.0, -0.1, 1.0]),
            (Face, self.skull([0.0, 0.05, 0.115]), 0.022, [0.0, -0.3, 1.0]),
            (Face, self.skull([0.0, -0.015, 0.08]), 0.03, [0.0, -0.4, 1.0]),
            (Face, self.skull([0.0, 0.085, 0.09]), 0.04, [0.0, 0.0, 1.0]),
            (Face, self.skull([0.0, 0.12, -0.09]), 0.08, [0.0, 0.0, -1.0]),
        ];
        for side in 0..2 {
            let on = |p: Vec3| on_side(p, side);
            let along = |a: Vec3, b: Vec3, t: f64, out: Vec3| on(vec3::add(lerp(a, b, t), out));
            let (shoulder, elbow, wrist) = (self.shoulder(), self.elbow(), self.wrist());
            let (hip, knee, ankle) = (self.hip(), self.knee(), self.ankle());
            places.extend([
                (Belly, on(at(0.13, 1.08, 0.0)), 0.1, on([1.0, 0.0, 0.2])),
                (Hips, on(at(0.15, 0.93, 0.0)), 0.1, on([1.0, 0.0, 0.0])),
                (Hips, on(at(0.075, 0.9, -0.13)), 0.09, on([0.2, 0.0, -1.0])),
                (Chest, on(at(0.08, 1.3, 0.1)), 0.07, on([0.1, -0.1, 1.0])),
                (Muscle, along(shoulder, elbow, 0.15, [0.04, 0.03, 0.0]), 0.07, on([0.8, 0.6, 0.0])),
                (Muscle, along(shoulder, elbow, 0.55, [0.0, 0.0, 0.04]), 0.06, [0.0, 0.0, 1.0]),
                (Muscle, along(shoulder, elbow, 0.5, [0.0, 0.0, -0.04]), 0.07, [0.0, 0.0, -1.0]),
                (Muscle, along(elbow, wrist, 0.25, [0.0, 0.03, 0.02]), 0.06, on([0.5, 0.7, 0.4])),
                (Muscle, along(hip, knee, 0.5, [0.02, 0.0, 0.07]), 0.12, on([0.3, 0.0, 1.0])),
                (Muscle, along(knee, ankle, 0.3, [0.0, 0.0, -0.06]), 0.08, [0.0, 0.0, -1.0]),
                (Face, on_side(self.skull([0.05, 0.04, 0.07]), side), 0.035, on([1.0, 0.0, 0.6])),
            ]);
        }
        for (kind, center, radius, direction) in places {
            let radius = if kind == Face { radius * HEAD_MAGNIFIED * self.to.head } else { radius };
            self.recipe.feature(kind, center, radius, direction);
        }
    }
}
