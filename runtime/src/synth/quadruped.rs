//! The body of a quadruped at rest: standing, facing +z, its left at +x.
//!
//! Lengths are those of a dog 0.6 high at the withers; a species scales regions of it, then the whole.

use super::loft::Station;
use super::math::{Vec3, lerp, unit};
use super::recipe::{FeatureKind, Girth, Join, Recipe};
use crate::mesh::vec3;

/// Indices of the bones of a quadruped. Those of a limb are offsets to be passed to [`limb`].
pub(super) mod bone {
    pub(in super::super) const PELVIS: usize = 0;
    pub(in super::super) const LUMBAR: usize = 1;
    pub(in super::super) const CHEST: usize = 2;
    pub(in super::super) const LOW_NECK: usize = 3;
    pub(in super::super) const NECK: usize = 4;
    pub(in super::super) const HEAD: usize = 5;
    /// The first of three bones of the tail.
    pub(in super::super) const TAIL: usize = 6;
    pub(in super::super) const BLADE: usize = 9;
    pub(in super::super) const UPPER_ARM: usize = 10;
    pub(in super::super) const FOREARM: usize = 11;
    pub(in super::super) const HAND: usize = 12;
    pub(in super::super) const FORE_TOES: usize = 13;
    pub(in super::super) const THIGH: usize = 14;
    pub(in super::super) const SHIN: usize = 15;
    pub(in super::super) const FOOT: usize = 16;
    pub(in super::super) const HIND_TOES: usize = 17;
    /// Bones of one side.
    pub(in super::super) const PER_SIDE: usize = 9;
    pub(in super::super) const COUNT: usize = 9 + 2 * PER_SIDE;

    /// Bone `name` of the left (`side` 0) or right (1) limb.
    pub(in super::super) fn limb(name: usize, side: usize) -> usize {
        name + side * PER_SIDE
    }
}

/// Proportions of a species, relative to a dog's (1) unless said otherwise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Proportions {
    /// Size of everything.
    pub(super) size: f64,
    pub(super) legs: f64,
    pub(super) leg_girth: f64,
    /// Length of the trunk.
    pub(super) trunk: f64,
    pub(super) chest: f64,
    pub(super) loin: f64,
    pub(super) rump: f64,
    pub(super) neck: f64,
    pub(super) neck_girth: f64,
    /// Rise of the neck above the horizontal, in degrees.
    pub(super) neck_rise: f64,
    pub(super) head: f64,
    pub(super) muzzle: f64,
    pub(super) muzzle_girth: f64,
    pub(super) ear: f64,
    pub(super) ear_width: f64,
    pub(super) tail: f64,
    pub(super) tail_girth: f64,
    /// Direction of the tail below the horizontal, in degrees.
    pub(super) tail_drop: f64,
    pub(super) paw: f64,
    /// One round hoof instead of toes.
    pub(super) hoofed: bool,
}

impl Default for Proportions {
    fn default() -> Self {
        Self {
            size: 1.0,
            legs: 1.0,
            leg_girth: 1.0,
            trunk: 1.0,
            chest: 1.0,
            loin: 1.0,
            rump: 1.0,
            neck: 1.0,
            neck_girth: 1.0,
            neck_rise: 48.0,
            head: 1.0,
            muzzle: 1.0,
            muzzle_girth: 1.0,
            ear: 1.0,
            ear_width: 1.0,
            tail: 1.0,
            tail_girth: 1.0,
            tail_drop: 35.0,
            paw: 1.0,
            hoofed: false,
        }
    }
}

impl Proportions {
    pub(super) fn cat() -> Self {
        Self {
            size: 0.5,
            legs: 0.86,
            leg_girth: 0.95,
            trunk: 1.05,
            chest: 0.82,
            loin: 0.98,
            rump: 0.92,
            neck: 0.72,
            neck_girth: 0.86,
            neck_rise: 42.0,
            head: 1.06,
            muzzle: 0.42,
            muzzle_girth: 0.86,
            ear: 0.9,
            ear_width: 1.45,
            tail: 1.75,
            tail_girth: 0.85,
            tail_drop: 25.0,
            paw: 1.08,
            ..Self::default()
        }
    }

    pub(super) fn horse() -> Self {
        Self {
            size: 2.15,
            legs: 1.34,
            leg_girth: 0.98,
            trunk: 1.06,
            chest: 1.06,
            loin: 1.24,
            rump: 1.22,
            neck: 1.5,
            neck_girth: 1.22,
            neck_rise: 52.0,
            head: 1.02,
            muzzle: 1.45,
            muzzle_girth: 1.5,
            ear: 0.75,
            ear_width: 0.7,
            tail: 1.25,
            tail_girth: 1.35,
            tail_drop: 72.0,
            paw: 1.02,
            hoofed: true,
        }
    }

    pub(super) fn bear() -> Self {
        Self {
            size: 1.7,
            legs: 0.84,
            leg_girth: 1.62,
            trunk: 1.06,
            chest: 1.26,
            loin: 1.6,
            rump: 1.42,
            neck: 0.82,
            neck_girth: 1.45,
            neck_rise: 22.0,
            head: 1.22,
            muzzle: 0.85,
            muzzle_girth: 1.15,
            ear: 0.5,
            ear_width: 1.25,
            tail: 0.22,
            tail_girth: 1.3,
            tail_drop: 50.0,
            paw: 1.6,
            hoofed: false,
        }
    }
}

const HEAD_MAGNIFIED: f64 = 1.25;
const PAW_MAGNIFIED: f64 = 1.25;
/// Height of the elbow region, below which legs are stretched.
const LEG: f64 = 0.36;

/// The body of a quadruped with the given proportions.
pub(super) fn recipe(proportions: &Proportions) -> Recipe {
    let mut sculptor = Sculptor { recipe: Recipe { cell: 0.0068, ..Recipe::default() }, to: *proportions };
    sculptor.bones();
    sculptor.trunk();
    sculptor.neck_and_tail();
    sculptor.head();
    for side in 0..2 {
        sculptor.front_leg(side);
        sculptor.hind_leg(side);
    }
    sculptor.features();
    sculptor.recipe.scaled(proportions.size)
}

struct Sculptor {
    recipe: Recipe,
    to: Proportions,
}

fn mirror(p: Vec3, side: usize) -> Vec3 {
    if side == 0 { p } else { [-p[0], p[1], p[2]] }
}

impl Sculptor {
    fn bones(&mut self) {
        use bone::*;
        let at = |y: f64, z: f64| self.at([0.0, y, z]);
        let spine = [
            ("pelvis", None, at(0.53, -0.24), at(0.545, -0.12), 1.0),
            ("lumbar", Some(PELVIS), at(0.54, -0.12), at(0.535, 0.06), 1.0),
            ("chest", Some(LUMBAR), at(0.53, 0.06), at(0.53, 0.24), 1.0),
            ("low_neck", Some(CHEST), self.neck(0.0), self.neck(0.5), 0.8),
            ("neck", Some(LOW_NECK), self.neck(0.5), self.neck(1.0), 0.6),
            ("head", Some(NECK), self.neck(1.0), self.skull([0.0, 0.0, 0.1]), 0.3),
            ("tail_1", Some(PELVIS), self.tail(0.0), self.tail(0.33), 0.3),
            ("tail_2", Some(TAIL), self.tail(0.33), self.tail(0.66), 0.3),
            ("tail_3", Some(TAIL + 1), self.tail(0.66), self.tail(1.0), 0.3),
        ];
        for (name, parent, head, tail, softness) in spine {
            self.recipe.skeleton.add(name, parent, head, tail, softness);
        }
        for side in 0..2 {
            let on = |p: Vec3| mirror(p, side);
            let [shoulder, elbow, wrist, pad] = self.front().map(on);
            let [hip, knee, hock, ball] = self.hind().map(on);
            let blade = on(self.at([0.05, 0.56, 0.19]));
            let (claws, nails) = (on(self.paw(self.front()[3], 0.05)), on(self.paw(self.hind()[3], 0.05)));
            let limbs = [
                ("blade", CHEST, blade, shoulder, 0.8),
                ("upper_arm", BLADE, shoulder, elbow, 0.6),
                ("forearm", UPPER_ARM, elbow, wrist, 0.35),
                ("hand", FOREARM, wrist, pad, 0.15),
                ("fore_toes", HAND, pad, claws, 0.12),
                ("thigh", PELVIS, hip, knee, 0.8),
                ("shin", THIGH, knee, hock, 0.4),
                ("foot", SHIN, hock, ball, 0.15),
                ("hind_toes", FOOT, ball, nails, 0.12),
            ];
            for (name, parent, head, tail, softness) in limbs {
                let name = format!("{name}_{}", ["left", "right"][side]);
                let parent = if parent < BLADE { parent } else { limb(parent, side) };
                self.recipe.skeleton.add(&name, Some(parent), head, tail, softness);
            }
        }
        let kind = |index: usize| if index < BLADE { index } else { BLADE + (index - BLADE) % PER_SIDE };
        self.recipe.magnified = (0..COUNT)
            .map(|index| match kind(index) {
                HEAD => HEAD_MAGNIFIED,
                FORE_TOES | HIND_TOES => PAW_MAGNIFIED,
                _ => 1.0,
            })
            .collect();
    }

    /// A point of trunk or legs: legs are stretched below the elbow, the trunk lengthwise.
    fn at(&self, [x, y, z]: Vec3) -> Vec3 {
        [x, y.min(LEG) * self.to.legs + (y - LEG).max(0.0), z * self.to.trunk]
    }

    /// A point of a leg's axis relative to its root, so that its lengthwise bends keep their size.
    fn leg(&self, root: Vec3, [x, y, z]: Vec3) -> Vec3 {
        let [_, y, _] = self.at([x, y, z]);
        [x, y, self.at(root)[2] + (z - root[2])]
    }

    /// Shoulder, elbow, wrist, ball of the left front leg.
    fn front(&self) -> [Vec3; 4] {
        let wide = 0.078 + 0.03 * (self.to.chest - 1.0);
        let points =
            [[wide, 0.40, 0.265], [wide + 0.006, 0.325, 0.165], [wide, 0.13, 0.19], [wide, 0.036, 0.198]];
        points.map(|p| self.leg([0.0, 0.4, 0.265], p))
    }

    /// Hip, knee, hock, ball of the left hind leg.
    fn hind(&self) -> [Vec3; 4] {
        let wide = 0.068 + 0.04 * (self.to.rump - 1.0);
        let points = [[wide, 0.49, -0.235], [wide + 0.02, 0.335, -0.155], [wide + 0.012, 0.17, -0.295]];
        let [hip, knee, hock] = points.map(|p| self.leg([0.0, 0.49, -0.235], p));
        [hip, knee, hock, self.leg([0.0, 0.49, -0.235], [wide + 0.012, 0.036, -0.265])]
    }

    /// A point of the neck's axis, from its base (0) to the skull (1).
    fn neck(&self, t: f64) -> Vec3 {
        let rise = self.to.neck_rise.to_radians();
        let base = self.at([0.0, 0.51, 0.22]);
        vec3::add(base, vec3::scale([0.0, rise.sin(), rise.cos()], 0.26 * self.to.neck * t))
    }

    /// A point of the tail's axis, from its root (0) to its tip (1), as an arc that turns downwards.
    fn tail(&self, t: f64) -> Vec3 {
        let root = self.at([0.0, 0.515 + 0.022 * self.to.rump, -0.28 - 0.035 * self.to.rump]);
        let drop = self.to.tail_drop.to_radians();
        let length = 0.32 * self.to.tail * t;
        vec3::add(root, [0.0, -drop.sin() * length, -drop.cos() * length])
    }

    /// A point of the head, relative to the base of the skull, as modelled (enlarged).
    fn skull(&self, p: Vec3) -> Vec3 {
        vec3::add(self.neck(1.0), vec3::scale(p, HEAD_MAGNIFIED * self.to.head))
    }

    /// A point `reach` ahead of the ball of a foot, as modelled (enlarged).
    fn paw(&self, ball: Vec3, reach: f64) -> Vec3 {
        vec3::add(ball, vec3::scale([0.0, -0.012, reach], PAW_MAGNIFIED * self.to.paw))
    }

    fn trunk(&mut self) {
        use bone::*;
        let to = self.to;
        let join = Join { bones: &[PELVIS, LUMBAR, CHEST], blend: 0.07 };
        let (chest, loin, rump) = (to.chest, to.loin, to.rump);
        let mix = |a: f64, b: f64| 0.5 * (a + b);
        // Place along the body, height, half-width, and extents upwards and downwards.
        let sections = [
            (-0.345, 0.505, 0.055 * rump, 0.055 * rump, 0.06 * rump),
            (-0.29, 0.502, 0.082 * rump, 0.078 * rump, 0.088 * rump),
            (-0.21, 0.5, 0.088 * rump, 0.084 * rump, 0.1 * rump),
            (-0.1, 0.49, 0.082 * loin, 0.08 * loin, 0.085 * loin),
            (0.0, 0.48, 0.088 * mix(loin, chest), 0.088 * mix(loin, chest), 0.108 * mix(loin, chest)),
            (0.1, 0.465, 0.097 * chest, 0.112 * chest, 0.138 * chest),
            (0.18, 0.46, 0.096 * chest, 0.12 * chest, 0.138 * chest),
            (0.255, 0.455, 0.076 * chest, 0.098 * chest, 0.105 * chest),
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

    fn neck_and_tail(&mut self) {
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
        recipe.spindle(join, throat.0, throat.1, Girth(0.06 * to.neck_girth, 0.035 * to.neck_girth, 0.0));
        for (i, ends) in tail.windows(2).enumerate() {
            let join = Join { bones: &[TAIL, TAIL + 1, TAIL + 2], blend: if i == 0 { 0.04 } else { 0.004 } };
            let radius = |i: usize| to.tail_girth * (0.027 - 0.0021 * i as f64);
            recipe.spindle(join, ends[0], ends[1], Girth(radius(i), radius(i + 1), 0.0));
        }
    }

    fn head(&mut self) {
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
            (at(s * 0.042, 0.06, 0.012), at(s * (0.052 + 0.2 * tall), 0.072 + tall, 0.004))
        });
        let recipe = &mut self.recipe;
        recipe.ellipsoid(join(0.05), cranium, by([0.06, 0.06, 0.072]));
        for cheek in cheeks {
            recipe.ellipsoid(join(0.025), cheek, by([0.027, 0.036, 0.045]));
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

    fn front_leg(&mut self, side: usize) {
        use bone::*;
        let girth = self.to.leg_girth;
        let [shoulder, elbow, wrist, ball] = self.front().map(|p| mirror(p, side));
        let blade = mirror(self.at([0.055, 0.54, 0.19]), side);
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

    fn hind_leg(&mut self, side: usize) {
        use bone::*;
        let girth = self.to.leg_girth;
        let [hip, knee, hock, ball] = self.hind().map(|p| mirror(p, side));
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
        if self.to.hoofed {
            let sole = vec3::add(ball, vec3::scale([0.0, -0.016, 0.016], size));
            let top = vec3::add(ball, vec3::scale([0.0, 0.02, 0.004], size));
            self.recipe.spindle(join(0.014), top, sole, Girth(0.018 * size, 0.026 * size, 0.0));
            return;
        }
        let pad = vec3::add(ball, vec3::scale([0.0, -0.008, 0.012], size));
        self.recipe.ellipsoid(join(0.02), pad, vec3::scale([0.027, 0.02, 0.03], size));
        for (x, reach) in [(-0.022, 0.038), (-0.0075, 0.048), (0.0075, 0.048), (0.022, 0.038)] {
            let root = vec3::add(ball, vec3::scale([0.6 * x, 0.0, 0.008], size));
            let tip = vec3::add(ball, vec3::scale([x, -0.015, reach], size));
            self.recipe.spindle(join(0.006), root, tip, Girth(0.011 * size, 0.0105 * size, 0.0015 * size));
        }
    }

    fn features(&mut self) {
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
            let on = |p: Vec3| mirror(p, side);
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
                (Face, mirror(self.skull([0.06, -0.01, 0.05]), side), 0.04, out),
            ]);
        }
        for (kind, center, radius, direction) in places {
            let radius = if kind == Face { radius * HEAD_MAGNIFIED * self.to.head } else { radius };
            self.recipe.feature(kind, center, radius, direction);
        }
    }
}
