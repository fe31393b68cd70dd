//! Poses of bipeds: postures with variation, kept within the limits of the joints.

use rand::Rng;

use super::biped::bone::{self, limb};
use super::math::{Quat, Vec3, unit};
use super::postures::archetype;
use super::random::{chance, direction, normal, uniform};
use super::skeleton::Skeleton;
use fmnet::mesh::vec3;

/// One arm, described for the left side; angles in degrees.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arm {
    /// Direction of the upper arm seen from the chest: outwards, upwards, forwards.
    pub(super) aim: Vec3,
    pub(super) twist: f64,
    pub(super) elbow: f64,
    /// Turn of the forearm about itself.
    pub(super) pronation: f64,
    pub(super) wrist: f64,
    pub(super) curl: f64,
}

/// One leg, described for the left side; angles in degrees.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leg {
    /// Direction of the thigh seen from the pelvis: outwards, upwards, forwards.
    pub(super) aim: Vec3,
    pub(super) twist: f64,
    pub(super) knee: f64,
    /// Positive with the toes down.
    pub(super) ankle: f64,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Posture {
    /// Forward tilt of the pelvis.
    pub(super) tilt: f64,
    /// Bend forwards, to the left's opposite, and turn to the left, of the whole spine.
    pub(super) spine: [f64; 3],
    pub(super) head: [f64; 3],
    pub(super) arms: [Arm; 2],
    pub(super) legs: [Leg; 2],
    /// Bends of the tail: upwards, to the left.
    pub(super) tail: [f64; 2],
}

pub(super) const HANGING: Arm =
    Arm { aim: [0.2, -1.0, 0.02], twist: 0.0, elbow: 14.0, pronation: 0.0, wrist: 0.0, curl: 20.0 };
pub(super) const STRAIGHT: Leg = Leg { aim: [0.08, -1.0, 0.02], twist: 8.0, knee: 4.0, ankle: 0.0 };
pub(super) const STANDING: Posture = Posture {
    tilt: 0.0,
    spine: [0.0; 3],
    head: [0.0; 3],
    arms: [HANGING; 2],
    legs: [STRAIGHT; 2],
    tail: [0.0; 2],
};

/// Local rotation of every bone of a biped in a random posture.
pub(super) fn random_biped(skeleton: &Skeleton, rng: &mut impl Rng) -> Vec<Quat> {
    let mut posture = archetype(rng);
    posture.vary(rng);
    if chance(rng, 0.5) {
        posture.mirror();
    }
    posture.rotations(skeleton)
}

/// Local rotation of every bone of a biped at rest, the same on both sides: arms out, lowered or hanging.
pub(super) fn resting_biped(skeleton: &Skeleton, rng: &mut impl Rng) -> Vec<Quat> {
    let mut posture = STANDING;
    let rise: f64 = match rng.random_range(0..3) {
        0 => uniform(rng, -8.0, 8.0),
        1 => uniform(rng, -55.0, -25.0),
        _ => uniform(rng, -84.0, -66.0),
    };
    let (sin, cos) = rise.to_radians().sin_cos();
    let arm = Arm {
        aim: [cos, sin, uniform(rng, -0.08, 0.08)],
        elbow: uniform(rng, 0.0, 12.0),
        pronation: if chance(rng, 0.5) { 0.0 } else { uniform(rng, -60.0, 0.0) },
        curl: uniform(rng, 0.0, 18.0),
        ..HANGING
    };
    let leg = Leg { aim: [uniform(rng, 0.03, 0.3), -1.0, 0.0], knee: uniform(rng, 0.0, 4.0), ..STRAIGHT };
    (posture.arms, posture.legs) = ([arm; 2], [leg; 2]);
    posture.rotations(skeleton)
}

impl Posture {
    fn vary(&mut self, rng: &mut impl Rng) {
        self.tail = [normal(rng, 0.0, 30.0), normal(rng, 0.0, 25.0)];
        for (value, deviation) in self.spine.iter_mut().zip([4.0, 4.0, 7.0]) {
            *value = normal(rng, *value, deviation);
        }
        for (value, deviation) in self.head.iter_mut().zip([7.0, 5.0, 14.0]) {
            *value = normal(rng, *value, deviation);
        }
        for arm in &mut self.arms {
            arm.aim = direction(rng, arm.aim, 0.09);
            for (value, deviation) in [
                (&mut arm.twist, 10.0),
                (&mut arm.elbow, 8.0),
                (&mut arm.pronation, 18.0),
                (&mut arm.wrist, 10.0),
                (&mut arm.curl, 14.0),
            ] {
                *value = normal(rng, *value, deviation);
            }
        }
        for leg in &mut self.legs {
            leg.aim = direction(rng, leg.aim, 0.04);
            for (value, deviation) in [(&mut leg.twist, 6.0), (&mut leg.knee, 4.0), (&mut leg.ankle, 4.0)] {
                *value = normal(rng, *value, deviation);
            }
        }
    }

    fn mirror(&mut self) {
        self.arms.swap(0, 1);
        self.legs.swap(0, 1);
        for pair in [&mut self.spine, &mut self.head] {
            pair[1] = -pair[1];
            pair[2] = -pair[2];
        }
    }

    /// Rotations of the bones, every angle first brought within the limits of its joint.
    fn rotations(&self, skeleton: &Skeleton) -> Vec<Quat> {
        let mut rotations = vec![Quat::IDENTITY; bone::COUNT];
        rotations[bone::PELVIS] = Quat::x(self.tilt.clamp(-20.0, 60.0));
        let [bend, side, turn] = self.spine;
        let (bend, side, turn) = (bend.clamp(-25.0, 70.0), side.clamp(-28.0, 28.0), turn.clamp(-45.0, 45.0));
        let spine = |share: f64| {
            Quat::y(share * turn).then_after(Quat::z(share * side)).then_after(Quat::x(share * bend))
        };
        rotations[bone::LUMBAR] = spine(0.5);
        rotations[bone::CHEST] = spine(0.5);
        let [nod, lean, turn] = self.head;
        let (nod, lean, turn) = (nod.clamp(-40.0, 40.0), lean.clamp(-25.0, 25.0), turn.clamp(-65.0, 65.0));
        let neck = |share: f64| {
            Quat::y(share * turn).then_after(Quat::z(share * lean)).then_after(Quat::x(share * nod))
        };
        rotations[bone::NECK] = neck(0.5);
        rotations[bone::HEAD] = neck(0.5);
        let [lift, swing] = self.tail.map(|angle| angle.clamp(-60.0, 60.0));
        // The tail points backwards, so turning about +x raises it.
        rotations[bone::TAIL] = Quat::y(swing).then_after(Quat::x(0.5 * lift));
        rotations[bone::TAIL + 1] = rotations[bone::TAIL];
        for side in 0..2 {
            let mut set = |name: usize, rotation: Quat| {
                rotations[limb(name, side)] = if side == 0 { rotation } else { rotation.mirrored() };
            };
            self.arms[side].rotations(skeleton, &mut set);
            self.legs[side].rotations(skeleton, &mut set);
        }
        rotations
    }
}

/// Direction of a bone of the left side at rest.
fn rest_direction(skeleton: &Skeleton, name: usize) -> Vec3 {
    let bone = &skeleton.bones[limb(name, 0)];
    unit(vec3::sub(bone.tail, bone.head))
}

impl Arm {
    fn rotations(&self, skeleton: &Skeleton, set: &mut impl FnMut(usize, Quat)) {
        let along = rest_direction(skeleton, bone::UPPER_ARM);
        // Across the arm, out of the back of the hand: the elbow and the wrist hinge about its opposite.
        let up = unit([-along[1], along[0], 0.0]);
        let hinge = vec3::scale(up, -1.0);
        let [x, y, z] = unit(self.aim);
        let aim = unit([x.max(-0.25), y, z.max(-0.65)]);
        // The shoulder girdle takes part of the rise of the arm, and of its reach forwards.
        let girdle = Quat::z(28.0 * (aim[1] + 0.25).max(0.0)).then_after(Quat::y(-14.0 * aim[2].max(0.0)));
        let whole = Quat::between(along, aim)
            .then_after(Quat::about(along, self.twist.clamp(-60.0, 60.0).to_radians()));
        set(bone::CLAVICLE, girdle);
        set(bone::UPPER_ARM, girdle.inverse().then_after(whole));
        let pronation = Quat::about(along, self.pronation.clamp(-75.0, 75.0).to_radians());
        let elbow = Quat::about(hinge, self.elbow.clamp(0.0, 135.0).to_radians());
        // The forearm turns over its whole length: half of the turn is at the elbow, half at the wrist.
        let half = Quat::about(along, 0.5 * self.pronation.clamp(-75.0, 75.0).to_radians());
        set(bone::FOREARM, elbow.then_after(half));
        let wrist = Quat::about(hinge, self.wrist.clamp(-50.0, 55.0).to_radians());
        set(bone::HAND, half.inverse().then_after(pronation).then_after(wrist));
        let curl = self.curl.clamp(-8.0, 85.0);
        // Fingers close towards the palm, the thumb across it.
        set(bone::FINGERS, Quat::z(-curl));
        set(bone::THUMB, Quat::about(along, (0.35 * curl).to_radians()));
    }
}

impl Leg {
    fn rotations(&self, skeleton: &Skeleton, set: &mut impl FnMut(usize, Quat)) {
        let along = rest_direction(skeleton, bone::THIGH);
        let [x, y, z] = unit(self.aim);
        let aim = unit([x.clamp(-0.1, 0.75), y.min(0.45), z.max(-0.5)]);
        let twist = Quat::about(along, -self.twist.clamp(-25.0, 40.0).to_radians());
        set(bone::THIGH, Quat::between(along, aim).then_after(twist));
        set(bone::SHIN, Quat::x(self.knee.clamp(0.0, 138.0)));
        let ankle = self.ankle.clamp(-28.0, 40.0);
        set(bone::FOOT, Quat::x(ankle));
        set(bone::TOES, Quat::x(if ankle > 10.0 { -0.6 * ankle } else { 0.0 }));
    }
}
