//! Trunk, neck and tail of a quadruped, and where individuals differ.

use super::super::loft::Station;
use super::super::math::{Vec3, lerp, unit};
use super::super::mirror::on_side;
use super::super::recipe::{FeatureKind, Girth, Join};
use super::{HEAD_MAGNIFIED, Sculptor, bone};
use fmnet::mesh::vec3;

impl Sculptor {
    pub(super) fn trunk(&mut self) {
        use bone::*;
        let to = self.to;
        let join = Join { bones: &[PELVIS, LUMBAR, CHEST], blend: 0.07 };
        let (chest, loin, rump) = (to.chest, to.loin, to.rump);
        let (middle, belly, hump) = (0.5 * (loin + chest), to.belly, to.hump);
        // Place along the body, height, half-width, and extents upwards and downwards.
        let sections = [
            (-0.345, 0.505, 0.055 * rump, 0.055 * rump, 0.06 * rump),
            (-0.29, 0.502, 0.082 * rump, 0.078 * rump, 0.088 * rump),
            (-0.21, 0.5, 0.088 * rump, 0.084 * rump, 0.1 * rump),
            (-0.1, 0.49, 0.082 * loin + 0.6 * belly, 0.08 * loin, 0.085 * loin + belly),
            (0.0, 0.48, 0.088 * middle + 0.8 * belly, 0.088 * middle, 0.108 * middle + 1.1 * belly),
            (
                0.1,
                0.465,
                0.097 * chest + 0.6 * belly,
                0.112 * chest + 0.5 * hump,
                0.138 * chest + 0.8 * belly,
            ),
            (0.18, 0.46, 0.096 * chest + 0.2 * belly, 0.12 * chest + hump, 0.138 * chest + 0.3 * belly),
            (0.255, 0.455, 0.076 * chest, 0.098 * chest + 0.7 * hump, 0.105 * chest),
            (0.31, 0.45, 0.045 * chest, 0.05 * chest, 0.06 * chest),
        ];
        let stations = sections.map(|(z, y, side, front, back)| Station {
            center: self.at([0.0, y, z]),
            side,
            front,
            back,
        });
        self.recipe.tube(join, stations.to_vec(), false);
    }

    pub(super) fn neck_and_tail(&mut self) {
        use bone::*;
        let to = self.to;
        let join = Join { bones: &[LOW_NECK, NECK], blend: 0.07 };
        let (base, middle, top) = (self.neck(-0.15), self.neck(0.5), self.neck(1.05));
        let throat = (self.at([0.0, 0.45, 0.24]), self.neck(0.6));
        let tail: Vec<Vec3> = (0..=6).map(|i| self.tail((f64::from(i) - 0.5) / 5.5)).collect();
        let recipe = &mut self.recipe;
        let side = [1.0, 0.0, 0.0];
        let (thick, thin) = (0.092 * to.neck_girth, 0.06 * to.neck_girth.sqrt() * to.head);
        recipe.flat_spindle(join, base, middle, Girth(thick, 0.5 * (thick + thin), 0.0), side, 0.85);
        recipe.flat_spindle(join, middle, top, Girth(0.5 * (thick + thin), thin, 0.0), side, 0.88);
        recipe.spindle(
            join,
            throat.0,
            throat.1,
            Girth(0.06 * to.neck_girth * to.throat, 0.035 * to.neck_girth * to.throat, 0.0),
        );
        for (i, ends) in tail.windows(2).enumerate() {
            let join = Join { bones: &[TAIL, TAIL + 1, TAIL + 2], blend: if i == 0 { 0.04 } else { 0.004 } };
            let bushy = |i: usize| to.brush * (std::f64::consts::PI * i as f64 / 6.5).sin().max(0.0);
            let radius = |i: usize| to.tail_girth * (0.027 - 0.0021 * i as f64) * (1.0 + bushy(i));
            recipe.spindle(join, ends[0], ends[1], Girth(radius(i), radius(i + 1), 0.0));
        }
    }

    pub(super) fn features(&mut self) {
        use FeatureKind::*;
        let at = |x: f64, y: f64, z: f64| self.at([x, y, z]);
        let mut places = vec![
            (Belly, at(0.0, 0.41, -0.06), 0.13, [0.0, -1.0, 0.0]),
            (Chest, at(0.0, 0.36, 0.17), 0.11, [0.0, -1.0, 0.3]),
            (Muscle, at(0.0, 0.59, 0.16), 0.09, [0.0, 1.0, 0.0]),
            (Face, self.skull([0.0, 0.075, 0.04]), 0.05, [0.0, 1.0, 0.0]),
            (Face, self.skull([0.0, 0.0, 0.11]), 0.04, [0.0, 1.0, 0.3]),
        ];
        for side in 0..2 {
            let on = |p: Vec3| on_side(p, side);
            let [shoulder, elbow, wrist, _] = self.front();
            let [hip, knee, hock, _] = self.hind();
            let out = on([1.0, 0.0, 0.0]);
            let along = |a: Vec3, b: Vec3, t: f64, by: Vec3| on(vec3::add(lerp(a, b, t), by));
            places.extend([
                (Belly, on(at(0.08, 0.46, -0.06)), 0.11, out),
                (Hips, along(hip, knee, 0.3, [0.05, 0.0, 0.0]), 0.1, out),
                (Hips, along(hip, knee, 0.3, [0.0, 0.0, -0.07]), 0.08, on([0.3, 0.0, -1.0])),
                (Chest, on(at(0.09, 0.46, 0.1)), 0.1, out),
                (Muscle, along(shoulder, elbow, 0.2, [0.04, 0.0, 0.02]), 0.07, on(unit([1.0, 0.0, 0.5]))),
                (Muscle, along(elbow, wrist, 0.3, [0.0, 0.0, 0.03]), 0.05, [0.0, 0.0, 1.0]),
                (Muscle, along(knee, hock, 0.3, [0.0, 0.0, -0.03]), 0.05, [0.0, 0.0, -1.0]),
                (Face, on_side(self.skull([0.06, -0.01, 0.05]), side), 0.04, out),
            ]);
        }
        for (kind, center, radius, direction) in places {
            let radius = if kind == Face { radius * HEAD_MAGNIFIED * self.to.head } else { radius };
            self.recipe.feature(kind, center, radius, direction);
        }
    }
}
