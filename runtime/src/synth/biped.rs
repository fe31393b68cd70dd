//! The body of a biped at rest: facing +z, its left at +x, arms lowered by 40 degrees, legs slightly apart.
//!
//! Lengths are those of an adult 1.75 tall; a species scales regions of it.

use super::loft::Station;
use super::math::{Vec3, lerp, unit};
use super::recipe::{FeatureKind, Girth, Join, Recipe};
use crate::mesh::vec3;

/// Indices of the bones of a biped. Those of a limb are offsets to be passed to [`limb`].
pub(super) mod bone {
    pub(in super::super) const PELVIS: usize = 0;
    pub(in super::super) const LUMBAR: usize = 1;
    pub(in super::super) const CHEST: usize = 2;
    pub(in super::super) const NECK: usize = 3;
    pub(in super::super) const HEAD: usize = 4;
    pub(in super::super) const CLAVICLE: usize = 5;
    pub(in super::super) const UPPER_ARM: usize = 6;
    pub(in super::super) const FOREARM: usize = 7;
    pub(in super::super) const HAND: usize = 8;
    pub(in super::super) const FINGERS: usize = 9;
    pub(in super::super) const THUMB: usize = 10;
    pub(in super::super) const THIGH: usize = 11;
    pub(in super::super) const SHIN: usize = 12;
    pub(in super::super) const FOOT: usize = 13;
    pub(in super::super) const TOES: usize = 14;
    /// Bones of one side.
    pub(in super::super) const PER_SIDE: usize = 10;
    pub(in super::super) const COUNT: usize = 5 + 2 * PER_SIDE;

    /// Bone `name` of the left (`side` 0) or right (1) limb.
    pub(in super::super) fn limb(name: usize, side: usize) -> usize {
        name + side * PER_SIDE
    }
}

/// Proportions of a species, all relative to an average adult's (1) unless said otherwise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Proportions {
    /// Height, in metres, before the other factors.
    pub(super) height: f64,
    pub(super) head: f64,
    pub(super) neck: f64,
    /// Length of the trunk.
    pub(super) trunk: f64,
    pub(super) shoulders: f64,
    pub(super) chest: f64,
    pub(super) waist: f64,
    pub(super) hips: f64,
    /// Flesh in front of the abdomen, in metres.
    pub(super) belly: f64,
    /// Flesh in front of the chest, in metres.
    pub(super) breast: f64,
    pub(super) buttocks: f64,
    pub(super) arm_length: f64,
    pub(super) arm_girth: f64,
    pub(super) hand: f64,
    pub(super) leg_length: f64,
    pub(super) leg_girth: f64,
    pub(super) foot: f64,
    /// How far the jaws stand out, 0 for humans.
    pub(super) muzzle: f64,
}

impl Default for Proportions {
    fn default() -> Self {
        Self {
            height: 1.75,
            head: 1.0,
            neck: 1.0,
            trunk: 1.0,
            shoulders: 1.0,
            chest: 1.0,
            waist: 1.0,
            hips: 1.0,
            belly: 0.0,
            breast: 0.0,
            buttocks: 1.0,
            arm_length: 1.0,
            arm_girth: 1.0,
            hand: 1.0,
            leg_length: 1.0,
            leg_girth: 1.0,
            foot: 1.0,
            muzzle: 0.0,
        }
    }
}

const HEAD_MAGNIFIED: f64 = 1.3;
const HAND_MAGNIFIED: f64 = 1.65;
const FOOT_MAGNIFIED: f64 = 1.2;
const HIP_HEIGHT: f64 = 0.925;
/// Direction of the arm at rest, and across the palm towards the thumb and out of its back.
const ARM: Vec3 = [0.766, -0.643, 0.0];
const BACK_OF_HAND: Vec3 = [0.643, 0.766, 0.0];

/// The body of a biped with the given proportions.
pub(super) fn recipe(proportions: &Proportions) -> Recipe {
    let mut sculptor = Sculptor { recipe: Recipe { cell: 0.0092, ..Recipe::default() }, to: *proportions };
    sculptor.bones();
    sculptor.trunk();
    sculptor.head();
    for side in 0..2 {
        sculptor.arm(side);
        sculptor.hand(side);
        sculptor.leg(side);
        sculptor.foot(side);
    }
    sculptor.features();
    sculptor.recipe.scaled(proportions.height / 1.75)
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
        let skeleton = [
            ("pelvis", None, self.torso([0.0, 0.96, 0.0]), self.torso([0.0, 1.05, -0.005]), 1.0),
            ("lumbar", Some(PELVIS), self.torso([0.0, 1.05, -0.01]), self.torso([0.0, 1.2, -0.015]), 1.0),
            ("chest", Some(LUMBAR), self.torso([0.0, 1.2, -0.015]), self.torso([0.0, 1.43, -0.03]), 1.0),
            ("neck", Some(CHEST), self.torso([0.0, 1.46, -0.03]), self.skull_base(), 0.4),
            ("head", Some(NECK), self.skull_base(), self.skull([0.0, 0.12, 0.0]), 0.3),
        ];
        let magnified = |name: usize| match name {
            HEAD => HEAD_MAGNIFIED,
            HAND | FINGERS | THUMB => HAND_MAGNIFIED,
            FOOT | TOES => FOOT_MAGNIFIED,
            _ => 1.0,
        };
        for (name, parent, head, tail, softness) in skeleton {
            self.recipe.skeleton.add(name, parent, head, tail, softness);
        }
        for side in 0..2 {
            let (shoulder, elbow, wrist) = (self.shoulder(), self.elbow(), self.wrist());
            let (knee, ankle) = (self.knee(), self.ankle());
            let limbs = [
                ("clavicle", CHEST, self.torso([0.03, 1.43, 0.0]), shoulder, 0.8),
                ("upper_arm", CLAVICLE, shoulder, elbow, 0.55),
                ("forearm", UPPER_ARM, elbow, wrist, 0.22),
                ("hand", FOREARM, wrist, self.palm(0.095, 0.0, 0.0), 0.3),
                ("fingers", HAND, self.palm(0.095, 0.0, 0.0), self.palm(0.18, 0.0, 0.0), 0.06),
                ("thumb", HAND, self.palm(0.03, 0.026, 0.0), self.palm(0.085, 0.07, -0.01), 0.06),
                ("thigh", PELVIS, self.hip(), knee, 0.9),
                ("shin", THIGH, knee, ankle, 0.4),
                ("foot", SHIN, ankle, self.sole([0.0, -0.06, 0.125]), 0.2),
                ("toes", FOOT, self.sole([0.0, -0.06, 0.125]), self.sole([0.0, -0.06, 0.19]), 0.15),
            ];
            for (name, parent, head, tail, softness) in limbs {
                let name = format!("{name}_{}", ["left", "right"][side]);
                let parent = if parent < CLAVICLE { parent } else { limb(parent, side) };
                self.recipe.skeleton.add(
                    &name,
                    Some(parent),
                    mirror(head, side),
                    mirror(tail, side),
                    softness,
                );
            }
        }
        let name_of =
            |index: usize| if index < CLAVICLE { index } else { CLAVICLE + (index - CLAVICLE) % PER_SIDE };
        self.recipe.magnified = (0..COUNT).map(|index| magnified(name_of(index))).collect();
    }

    /// Height of a point of the adult body after the trunk and legs are stretched.
    fn height(&self, y: f64) -> f64 {
        y.min(HIP_HEIGHT) * self.to.leg_length + (y - HIP_HEIGHT).max(0.0) * self.to.trunk
    }

    /// A point of the trunk: widened by the shoulders above, the hips below.
    fn torso(&self, [x, y, z]: Vec3) -> Vec3 {
        let up = ((y - 1.0) / 0.35).clamp(0.0, 1.0);
        let width = self.to.hips + up * (self.to.shoulders - self.to.hips);
        [x * width, self.height(y), z]
    }

    fn skull_base(&self) -> Vec3 {
        vec3::add(self.torso([0.0, 1.46, -0.03]), [0.0, 0.095, 0.03 + 0.05 * self.to.muzzle])
    }

    /// A point of the head, relative to the base of the skull, as modelled (enlarged).
    fn skull(&self, p: Vec3) -> Vec3 {
        vec3::add(self.skull_base(), vec3::scale(p, HEAD_MAGNIFIED * self.to.head))
    }

    fn shoulder(&self) -> Vec3 {
        self.torso([0.172, 1.415, -0.02])
    }

    fn elbow(&self) -> Vec3 {
        vec3::add(self.shoulder(), vec3::scale(ARM, 0.29 * self.to.arm_length))
    }

    fn wrist(&self) -> Vec3 {
        vec3::add(self.shoulder(), vec3::scale(ARM, 0.545 * self.to.arm_length))
    }

    /// A point of the hand, as modelled (enlarged): `along` it from the wrist, `across` towards the thumb, `up` out
    /// of its back.
    fn palm(&self, along: f64, across: f64, up: f64) -> Vec3 {
        let offset: Vec3 =
            std::array::from_fn(|i| along * ARM[i] + up * BACK_OF_HAND[i] + [0.0, 0.0, across][i]);
        vec3::add(self.wrist(), vec3::scale(offset, HAND_MAGNIFIED * self.to.hand))
    }

    fn hip(&self) -> Vec3 {
        self.torso([0.09, HIP_HEIGHT, 0.0])
    }

    fn knee(&self) -> Vec3 {
        vec3::add(self.hip(), [0.04, self.height(0.5) - self.height(HIP_HEIGHT), 0.012])
    }

    fn ankle(&self) -> Vec3 {
        vec3::add(self.hip(), [0.072, self.height(0.085) - self.height(HIP_HEIGHT), -0.022])
    }

    /// A point of the foot, relative to the ankle, as modelled (enlarged).
    fn sole(&self, p: Vec3) -> Vec3 {
        vec3::add(self.ankle(), vec3::scale(p, FOOT_MAGNIFIED * self.to.foot))
    }

    fn trunk(&mut self) {
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

    fn trunk_side(&mut self, side: usize) {
        use bone::*;
        let to = self.to;
        let on = |p: Vec3| mirror(p, side);
        let chest = Join { bones: &[CHEST], blend: 0.04 };
        let pectoral = on(self.torso([0.075, 1.315, 0.062 * to.chest]));
        self.recipe.tilted_ellipsoid(chest, pectoral, [0.08, 0.058, 0.038], on([0.3, 1.0, 0.15]));
        if to.breast > 0.0 {
            let center = on(self.torso([0.078, 1.285, 0.075 * to.chest + 0.35 * to.breast]));
            let radius = 0.052 + 0.45 * to.breast;
            self.recipe.ellipsoid(chest, center, [radius, radius, 0.03 + to.breast]);
        }
        let blade = on(self.torso([0.08, 1.33, -0.082 * to.chest]));
        self.recipe.tilted_ellipsoid(chest, blade, [0.058, 0.085, 0.03], on([-0.2, 1.0, 0.1]));
        let lat = (on(self.torso([0.12, 1.34, -0.035])), on(self.torso([0.095, 1.16, -0.02])));
        self.recipe.spindle(chest, lat.0, lat.1, Girth(0.05 * to.chest, 0.035 * to.chest, 0.0));
        let trapezius = Join { bones: &[CHEST, limb(CLAVICLE, side)], blend: 0.04 };
        let (nape, shoulder) = (on(self.torso([0.025, 1.475, -0.035])), on(self.torso([0.15, 1.43, -0.022])));
        self.recipe.spindle(trapezius, nape, shoulder, Girth(0.042 * to.neck, 0.042 * to.arm_girth, 0.0));
        let pelvis = Join { bones: &[PELVIS], blend: 0.045 };
        let buttock = on(self.torso([0.072, 0.9, -0.06]));
        let size = 0.078 * to.buttocks;
        self.recipe.ellipsoid(pelvis, buttock, [size, 1.12 * size, size]);
        let flank = on(self.torso([0.105, 0.99, -0.005]));
        self.recipe.ellipsoid(pelvis, flank, [0.06 * to.hips, 0.075, 0.07]);
    }

    fn head(&mut self) {
        use bone::*;
        let to = self.to;
        let size = HEAD_MAGNIFIED * to.head;
        let join = |blend: f64| Join { bones: &[HEAD], blend: blend * size };
        let at = |x: f64, y: f64, z: f64| self.skull([x, y, z]);
        let by = |r: Vec3| vec3::scale(r, size);
        let (cranium, face) = (at(0.0, 0.098, 0.004), at(0.0, 0.045, 0.042));
        let jut = 0.06 * to.muzzle;
        let (chin, jaw) =
            (at(0.0, -0.012, 0.074 + 0.5 * jut), [at(0.058, 0.03, 0.012), at(-0.058, 0.03, 0.012)]);
        let brow = [at(-0.038, 0.086, 0.078), at(0.038, 0.086, 0.078)];
        let nose = [at(0.0, 0.078, 0.094), at(0.0, 0.043, 0.112 + 0.4 * jut)];
        let lips = at(0.0, 0.016, 0.09 + jut);
        let eyes = [at(0.032, 0.07, 0.103), at(-0.032, 0.07, 0.103)];
        let cheeks = [at(0.042, 0.045, 0.066), at(-0.042, 0.045, 0.066)];
        let ears = [1.0, -1.0].map(|s| (at(s * 0.078, 0.05, -0.008), at(s * 0.086, 0.09, -0.016)));
        let nostrils = [at(0.013, 0.044, 0.098 + 0.4 * jut), at(-0.013, 0.044, 0.098 + 0.4 * jut)];
        let muzzle = at(0.0, 0.02, 0.06 + 0.7 * jut);
        let recipe = &mut self.recipe;
        recipe.ellipsoid(join(0.0), cranium, by([0.077, 0.088, 0.097]));
        recipe.ellipsoid(join(0.03), face, by([0.06, 0.075, 0.056]));
        for (corner, cheek) in jaw.into_iter().zip(cheeks) {
            recipe.spindle(join(0.025), corner, chin, Girth(0.021 * size, 0.02 * size, 0.0));
            recipe.ellipsoid(join(0.02), cheek, by([0.024, 0.022, 0.02]));
        }
        if to.muzzle > 0.0 {
            recipe.ellipsoid(join(0.03), muzzle, by([0.05, 0.042, 0.035 + jut]));
        }
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
            let girth = Girth(0.012 * size, 0.019 * size, 0.003 * size);
            recipe.flat_spindle(join(0.008), low, high, girth, [1.0, 0.0, 0.3], 0.5);
        }
    }

    fn arm(&mut self, side: usize) {
        use bone::*;
        let girth = self.to.arm_girth;
        let on = |p: Vec3| mirror(p, side);
        let (shoulder, elbow, wrist) = (self.shoulder(), self.elbow(), self.wrist());
        let upper = Join { bones: &[limb(UPPER_ARM, side)], blend: 0.035 };
        let lower = Join { bones: &[limb(FOREARM, side)], blend: 0.03 };
        let along =
            |a: Vec3, b: Vec3, t: f64, out: Vec3| on(vec3::add(lerp(a, b, t), vec3::scale(out, girth)));
        let recipe = &mut self.recipe;
        let deltoid = along(shoulder, elbow, 0.12, [0.008, 0.006, 0.0]);
        recipe.tilted_ellipsoid(upper, deltoid, [0.054 * girth, 0.082, 0.058 * girth], on(ARM));
        let (start, end) = (along(shoulder, elbow, 0.05, [0.0; 3]), on(elbow));
        recipe.spindle(upper, start, end, Girth(0.046 * girth, 0.037 * girth, 0.002));
        let biceps = along(shoulder, elbow, 0.55, [0.0, 0.0, 0.016]);
        recipe.tilted_ellipsoid(upper, biceps, [0.031 * girth, 0.085, 0.032 * girth], on(ARM));
        let triceps = along(shoulder, elbow, 0.48, [0.0, 0.0, -0.017]);
        recipe.tilted_ellipsoid(upper, triceps, [0.032 * girth, 0.095, 0.031 * girth], on(ARM));
        let (near, far) = (along(elbow, wrist, 0.0, [0.0; 3]), along(elbow, wrist, 1.02, [0.0; 3]));
        recipe.flat_spindle(
            lower,
            near,
            far,
            Girth(0.037 * girth, 0.0255 * girth, 0.003),
            on(BACK_OF_HAND),
            0.86,
        );
        let belly = along(elbow, wrist, 0.25, [0.004, 0.004, 0.008]);
        recipe.tilted_ellipsoid(lower, belly, [0.038 * girth, 0.085, 0.04 * girth], on(ARM));
        let point = along(elbow, wrist, -0.02, vec3::scale([0.0, 0.0, -1.0], 0.026));
        recipe.ellipsoid(Join { blend: 0.02, ..upper }, point, [0.016; 3]);
    }

    fn hand(&mut self, side: usize) {
        use bone::*;
        let size = HAND_MAGNIFIED * self.to.hand;
        let on = |p: Vec3| mirror(p, side);
        let at = |along: f64, across: f64, up: f64| on(self.palm(along, across, up));
        let back = on(BACK_OF_HAND);
        let palm_join = Join { bones: &[limb(HAND, side)], blend: 0.016 * size };
        // Along, across and girth of each finger: little finger first, as it lies farthest from the thumb.
        let fingers = [(0.086, -0.034, 0.145, -0.052, 0.0075), (0.094, -0.0125, 0.168, -0.0185, 0.0085)];
        let longer = [(0.097, 0.0105, 0.18, 0.014, 0.009), (0.093, 0.033, 0.168, 0.046, 0.0085)];
        let rays: Vec<_> = fingers
            .into_iter()
            .chain(longer)
            .map(|(near, from, far, to, r)| {
                let (root, knuckle) = (at(0.012, 0.4 * from, 0.0), at(near, from, 0.002));
                let (middle, tip) = (at(0.5 * (near + far), 0.5 * (from + to), 0.001), at(far, to, -0.006));
                (root, knuckle, middle, tip, r)
            })
            .collect();
        let (ball_start, ball_end) = (at(0.016, 0.014, -0.006), at(0.05, 0.036, -0.006));
        let (thumb, bend, nail) = (at(0.034, 0.03, -0.006), at(0.064, 0.06, -0.008), at(0.09, 0.074, -0.01));
        let recipe = &mut self.recipe;
        for &(root, knuckle, ..) in &rays {
            let girth = Girth(0.019 * size, 0.0165 * size, 0.0);
            recipe.flat_spindle(palm_join, root, knuckle, girth, back, 0.72);
        }
        recipe.spindle(palm_join, ball_start, ball_end, Girth(0.015 * size, 0.014 * size, 0.002 * size));
        let finger = Join { bones: &[limb(FINGERS, side)], blend: 0.005 * size };
        for (_, knuckle, middle, tip, r) in rays {
            recipe.spindle(finger, knuckle, middle, Girth(1.05 * r * size, r * size, 0.0));
            recipe.spindle(finger, middle, tip, Girth(r * size, 0.85 * r * size, 0.0));
        }
        let join = Join { bones: &[limb(THUMB, side)], blend: 0.009 * size };
        recipe.spindle(join, thumb, bend, Girth(0.0125 * size, 0.0105 * size, 0.0));
        recipe.spindle(join, bend, nail, Girth(0.0105 * size, 0.009 * size, 0.0));
    }

    fn leg(&mut self, side: usize) {
        use bone::*;
        let girth = self.to.leg_girth;
        let on = |p: Vec3| mirror(p, side);
        let (hip, knee, ankle) = (self.hip(), self.knee(), self.ankle());
        let thigh = Join { bones: &[limb(THIGH, side)], blend: 0.04 };
        let shin = Join { bones: &[limb(SHIN, side)], blend: 0.035 };
        let along =
            |a: Vec3, b: Vec3, t: f64, out: Vec3| on(vec3::add(lerp(a, b, t), vec3::scale(out, girth)));
        let (down, below) = (unit(vec3::sub(knee, hip)), unit(vec3::sub(ankle, knee)));
        let recipe = &mut self.recipe;
        let (start, end) = (along(hip, knee, 0.08, [0.004, 0.0, 0.0]), on(knee));
        recipe.spindle(thigh, start, end, Girth(0.081 * girth, 0.05 * girth, 0.004));
        let front = along(hip, knee, 0.45, [0.008, 0.0, 0.026]);
        recipe.tilted_ellipsoid(thigh, front, [0.058 * girth, 0.17, 0.048 * girth], on(down));
        let behind = along(hip, knee, 0.48, [0.0, 0.0, -0.026]);
        recipe.tilted_ellipsoid(thigh, behind, [0.052 * girth, 0.16, 0.046 * girth], on(down));
        let cap = along(hip, knee, 0.99, [0.0, 0.0, 0.028]);
        recipe.ellipsoid(Join { blend: 0.025, ..thigh }, cap, [0.026 * girth, 0.034, 0.024 * girth]);
        let (near, far) = (along(knee, ankle, 0.0, [0.0; 3]), along(knee, ankle, 1.0, [0.0; 3]));
        recipe.spindle(shin, near, far, Girth(0.047 * girth, 0.03 * girth, 0.0));
        for (x, length) in [(-0.016, 0.1), (0.018, 0.088)] {
            let calf = along(knee, ankle, 0.3, [x, 0.0, -0.024]);
            recipe.tilted_ellipsoid(shin, calf, [0.033 * girth, length, 0.036 * girth], on(below));
        }
        let edge = (along(knee, ankle, 0.05, [0.0, 0.0, 0.02]), along(knee, ankle, 0.8, [0.0, 0.0, 0.008]));
        recipe.spindle(shin, edge.0, edge.1, Girth(0.026 * girth, 0.02 * girth, 0.0));
    }

    fn foot(&mut self, side: usize) {
        use bone::*;
        let size = FOOT_MAGNIFIED * self.to.foot;
        let at = |x: f64, y: f64, z: f64| mirror(self.sole([x, y, z]), side);
        let foot = Join { bones: &[limb(FOOT, side)], blend: 0.022 * size };
        let (ankle, heel) = (at(0.0, 0.0, 0.0), at(0.0, -0.052, -0.042));
        let (instep, ball) = (at(-0.004, -0.03, 0.05), at(-0.002, -0.062, 0.125));
        let malleoli = [at(0.025, 0.002, -0.004), at(-0.025, 0.01, 0.004)];
        let (tendon, sole) = (at(0.0, 0.03, -0.03), at(0.012, -0.063, 0.04));
        // Toes, big toe first: place, reach and girth.
        let toes = [(-0.026, 0.19, 0.0155), (-0.004, 0.189, 0.0115), (0.012, 0.183, 0.011)];
        let small = [(0.026, 0.174, 0.0105), (0.038, 0.161, 0.0105)];
        let toes: Vec<_> = toes
            .into_iter()
            .chain(small)
            .map(|(x, reach, r)| (at(0.85 * x, -0.062, 0.118), at(x, -0.085 + r, reach - r), r))
            .collect();
        let recipe = &mut self.recipe;
        recipe.spindle(foot, ankle, instep, Girth(0.037 * size, 0.034 * size, 0.0));
        recipe.flat_spindle(
            foot,
            instep,
            ball,
            Girth(0.036 * size, 0.042 * size, 0.0),
            [0.0, 1.0, 0.0],
            0.58,
        );
        recipe.flat_spindle(foot, heel, sole, Girth(0.033 * size, 0.03 * size, 0.0), [0.0, 1.0, 0.0], 0.85);
        recipe.spindle(foot, tendon, heel, Girth(0.02 * size, 0.026 * size, 0.0));
        for bump in malleoli {
            recipe.ellipsoid(
                Join { blend: 0.015 * size, ..foot },
                bump,
                vec3::scale([0.012, 0.015, 0.013], size),
            );
        }
        let join = Join { bones: &[limb(TOES, side)], blend: 0.006 * size };
        for (root, tip, r) in toes {
            recipe.spindle(join, root, tip, Girth(1.1 * r * size, r * size, 0.0));
        }
    }

    fn features(&mut self) {
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
            let on = |p: Vec3| mirror(p, side);
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
                (Face, mirror(self.skull([0.05, 0.04, 0.07]), side), 0.035, on([1.0, 0.0, 0.6])),
            ]);
        }
        for (kind, center, radius, direction) in places {
            let radius = if kind == Face { radius * HEAD_MAGNIFIED * self.to.head } else { radius };
            self.recipe.feature(kind, center, radius, direction);
        }
    }
}
