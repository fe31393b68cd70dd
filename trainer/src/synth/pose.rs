//! Random poses of bipeds: everyday postures with variation, kept within the limits of the joints.

use rand::Rng;

use super::biped::bone::{self, limb};
use super::math::{Quat, Vec3, unit};
use super::random::{chance, direction, normal, uniform};
use super::skeleton::Skeleton;
use fmnet::mesh::vec3;

/// One arm, described for the left side; angles in degrees.
#[derive(Clone, Copy, Debug)]
struct Arm {
    /// Direction of the upper arm seen from the chest: outwards, upwards, forwards.
    aim: Vec3,
    twist: f64,
    elbow: f64,
    /// Turn of the forearm about itself.
    pronation: f64,
    wrist: f64,
    curl: f64,
}

/// One leg, described for the left side; angles in degrees.
#[derive(Clone, Copy, Debug)]
struct Leg {
    /// Direction of the thigh seen from the pelvis: outwards, upwards, forwards.
    aim: Vec3,
    twist: f64,
    knee: f64,
    /// Positive with the toes down.
    ankle: f64,
}

#[derive(Clone, Copy, Debug)]
struct Posture {
    /// Forward tilt of the pelvis.
    tilt: f64,
    /// Bend forwards, to the left's opposite, and turn to the left, of the whole spine.
    spine: [f64; 3],
    head: [f64; 3],
    arms: [Arm; 2],
    legs: [Leg; 2],
    /// Bends of the tail: upwards, to the left.
    tail: [f64; 2],
}

const HANGING: Arm =
    Arm { aim: [0.2, -1.0, 0.02], twist: 0.0, elbow: 14.0, pronation: 0.0, wrist: 0.0, curl: 20.0 };
const STRAIGHT: Leg = Leg { aim: [0.08, -1.0, 0.02], twist: 8.0, knee: 4.0, ankle: 0.0 };
const STANDING: Posture = Posture {
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

fn archetype(rng: &mut impl Rng) -> Posture {
    match rng.random_range(0..17) {
        0 => STANDING,
        1 => stride(rng, 22.0, 30.0),
        2 => stride(rng, 45.0, 85.0),
        3 => reaching_up(rng),
        4 => reaching_forward(rng),
        5 => sitting(rng),
        6 => crouching(rng),
        7 => bowing(rng),
        8 => arms_out(rng),
        9 => lunging(rng),
        10 => one_leg(rng),
        11 => guarding(rng),
        12 => hands_on_hips(rng),
        13 => kicking(rng),
        14 => leaning(rng),
        15 => kneeling(rng),
        _ => free(rng),
    }
}

/// A step of walking or running: `swing` of the legs, `elbow` bend.
fn stride(rng: &mut impl Rng, swing: f64, elbow: f64) -> Posture {
    let mut posture = STANDING;
    let (swing, phase) = (normal(rng, swing, 0.2 * swing).to_radians(), uniform(rng, 0.3, 1.0));
    for (side, sign) in [(0, 1.0), (1, -1.0)] {
        let angle: f64 = sign * phase * swing;
        let (leg, arm) = (&mut posture.legs[side], &mut posture.arms[side]);
        leg.aim = [0.06, -angle.cos(), angle.sin()];
        leg.knee =
            if sign > 0.0 { 0.7 * angle.to_degrees() } else { uniform(rng, 10.0, 30.0 + 60.0 * swing) };
        leg.ankle = if sign > 0.0 { -5.0 } else { 15.0 };
        arm.aim = [0.22, -angle.cos(), -0.9 * angle.sin()];
        arm.elbow = normal(rng, elbow, 12.0);
    }
    posture.spine = [6.0 + 8.0 * swing, 0.0, 8.0 * phase];
    posture
}

fn reaching_up(rng: &mut impl Rng) -> Posture {
    let mut posture = STANDING;
    let both = chance(rng, 0.6);
    for side in 0..if both { 2 } else { 1 } {
        posture.arms[side] = Arm {
            aim: direction(rng, [0.45, 1.0, 0.25], 0.2),
            elbow: uniform(rng, 2.0, 50.0),
            curl: uniform(rng, 0.0, 30.0),
            ..HANGING
        };
    }
    posture.head[0] = normal(rng, -12.0, 8.0);
    posture
}

fn reaching_forward(rng: &mut impl Rng) -> Posture {
    let mut posture = STANDING;
    for arm in &mut posture.arms {
        *arm =
            Arm { aim: direction(rng, [0.25, -0.1, 1.0], 0.22), elbow: uniform(rng, 2.0, 60.0), ..HANGING };
    }
    posture.tilt = uniform(rng, 0.0, 12.0);
    posture.spine[0] = uniform(rng, 0.0, 25.0);
    posture
}

fn sitting(rng: &mut impl Rng) -> Posture {
    let mut posture = STANDING;
    for side in 0..2 {
        let rise = uniform(rng, -0.35, 0.1);
        let knee = uniform(rng, 60.0, 100.0);
        posture.legs[side] = Leg { aim: [uniform(rng, 0.1, 0.35), rise, 1.0], twist: 0.0, knee, ankle: 0.0 };
        posture.arms[side] = Arm { aim: [0.25, -1.0, 0.35], elbow: uniform(rng, 30.0, 80.0), ..HANGING };
    }
    posture.spine[0] = uniform(rng, -5.0, 20.0);
    posture
}

fn crouching(rng: &mut impl Rng) -> Posture {
    let mut posture = STANDING;
    let depth = uniform(rng, 0.4, 1.0);
    for side in 0..2 {
        let flex = (112.0 * depth + normal(rng, 0.0, 6.0)).to_radians();
        let (knee, ankle) = (125.0 * depth + normal(rng, 0.0, 6.0), -24.0 * depth);
        posture.legs[side] = Leg { aim: [0.3, -flex.cos(), flex.sin()], twist: 12.0, knee, ankle };
        let aim = direction(rng, [0.3, -0.6, 0.8], 0.25);
        posture.arms[side] = Arm { aim, elbow: uniform(rng, 10.0, 80.0), ..HANGING };
    }
    posture.tilt = 35.0 * depth;
    posture.spine[0] = uniform(rng, 5.0, 35.0);
    posture.head[0] = -15.0 * depth;
    posture
}

fn bowing(rng: &mut impl Rng) -> Posture {
    let mut posture = STANDING;
    posture.tilt = uniform(rng, 20.0, 50.0);
    posture.spine[0] = uniform(rng, 20.0, 50.0);
    let tilt = posture.tilt.to_radians();
    for side in 0..2 {
        posture.legs[side].aim = [0.12, -tilt.cos(), tilt.sin()];
        posture.legs[side].knee = uniform(rng, 2.0, 25.0);
        posture.arms[side].aim = direction(rng, [0.2, -0.6, 1.0], 0.25);
        posture.arms[side].elbow = uniform(rng, 2.0, 40.0);
    }
    posture
}

fn arms_out(rng: &mut impl Rng) -> Posture {
    let mut posture = STANDING;
    for arm in &mut posture.arms {
        let aim = [1.0, uniform(rng, -0.6, 0.5), uniform(rng, -0.3, 0.4)];
        *arm =
            Arm { aim, twist: normal(rng, 0.0, 25.0), elbow: uniform(rng, 0.0, 90.0), curl: 8.0, ..HANGING };
    }
    for leg in &mut posture.legs {
        leg.aim[0] = uniform(rng, 0.05, 0.4);
    }
    posture
}

fn lunging(rng: &mut impl Rng) -> Posture {
    let mut posture = arms_out(rng);
    let reach = uniform(rng, 40.0, 80.0);
    let (front, rear) = (reach.to_radians(), uniform(rng, 15.0, 30.0).to_radians());
    posture.legs[0] =
        Leg { aim: [0.15, -front.cos(), front.sin()], twist: 5.0, knee: reach + 5.0, ankle: -3.0 };
    let knee = uniform(rng, 5.0, 50.0);
    posture.legs[1] = Leg { aim: [0.15, -rear.cos(), -rear.sin()], twist: 10.0, knee, ankle: -10.0 };
    posture.spine[0] = uniform(rng, 0.0, 20.0);
    posture
}

fn one_leg(rng: &mut impl Rng) -> Posture {
    let mut posture = if chance(rng, 0.5) { arms_out(rng) } else { STANDING };
    let aim = direction(rng, [0.3, -0.3, 1.0], 0.25);
    posture.legs[0] =
        Leg { aim, twist: 10.0, knee: uniform(rng, 5.0, 100.0), ankle: uniform(rng, -10.0, 25.0) };
    posture.spine[0] = uniform(rng, -5.0, 20.0);
    posture
}

fn guarding(rng: &mut impl Rng) -> Posture {
    let mut posture = stride(rng, 14.0, 90.0);
    for arm in &mut posture.arms {
        let aim = direction(rng, [0.35, -0.55, 0.8], 0.15);
        *arm = Arm { aim, elbow: uniform(rng, 70.0, 125.0), curl: uniform(rng, 40.0, 85.0), ..HANGING };
    }
    posture
}

fn hands_on_hips(rng: &mut impl Rng) -> Posture {
    let mut posture = STANDING;
    for arm in &mut posture.arms {
        let aim = direction(rng, [0.75, -0.8, -0.25], 0.06);
        *arm = Arm { aim, twist: -45.0, elbow: normal(rng, 82.0, 6.0), ..HANGING };
    }
    posture
}

fn kicking(rng: &mut impl Rng) -> Posture {
    let mut posture = if chance(rng, 0.5) { guarding(rng) } else { arms_out(rng) };
    let aim = direction(rng, [0.3, 0.1, 1.0], 0.3);
    posture.legs[0] =
        Leg { aim, twist: 0.0, knee: uniform(rng, 0.0, 45.0), ankle: uniform(rng, -10.0, 30.0) };
    posture.legs[1].knee = uniform(rng, 2.0, 25.0);
    posture.tilt = uniform(rng, -20.0, 5.0);
    posture.spine = [uniform(rng, -10.0, 30.0), uniform(rng, -15.0, 15.0), uniform(rng, -25.0, 25.0)];
    posture
}

/// Bent and turned sideways, one arm over the head.
fn leaning(rng: &mut impl Rng) -> Posture {
    let mut posture = arms_out(rng);
    posture.spine = [uniform(rng, -15.0, 30.0), uniform(rng, 12.0, 28.0), uniform(rng, -45.0, 45.0)];
    posture.arms[1].aim = direction(rng, [0.3, 1.0, 0.1], 0.25);
    posture.head = [0.0, uniform(rng, -20.0, 20.0), uniform(rng, -40.0, 40.0)];
    posture
}

fn kneeling(rng: &mut impl Rng) -> Posture {
    let mut posture = if chance(rng, 0.5) { reaching_forward(rng) } else { STANDING };
    let one = chance(rng, 0.5);
    posture.legs[0] =
        Leg { aim: [0.15, -1.0, 0.05], twist: 5.0, knee: uniform(rng, 85.0, 110.0), ankle: 35.0 };
    posture.legs[1] = if one {
        Leg {
            aim: [0.2, uniform(rng, -0.3, 0.1), 1.0],
            twist: 5.0,
            knee: uniform(rng, 80.0, 100.0),
            ankle: 0.0,
        }
    } else {
        posture.legs[0]
    };
    posture
}

fn free(rng: &mut impl Rng) -> Posture {
    let mut posture = STANDING;
    for side in 0..2 {
        let aim = [uniform(rng, 0.15, 1.0), uniform(rng, -1.0, 0.9), uniform(rng, -0.35, 1.0)];
        let (twist, elbow) = (uniform(rng, -40.0, 40.0), uniform(rng, 0.0, 110.0));
        let (pronation, wrist) = (uniform(rng, -50.0, 50.0), uniform(rng, -35.0, 35.0));
        posture.arms[side] = Arm { aim, twist, elbow, pronation, wrist, curl: uniform(rng, 0.0, 75.0) };
        let aim = [uniform(rng, 0.05, 0.5), -1.0, uniform(rng, -0.4, 0.9)];
        let knee = uniform(rng, 2.0, 70.0);
        posture.legs[side] =
            Leg { aim, twist: uniform(rng, -15.0, 25.0), knee, ankle: uniform(rng, -15.0, 25.0) };
    }
    posture.spine = [uniform(rng, -15.0, 40.0), uniform(rng, -20.0, 20.0), uniform(rng, -35.0, 35.0)];
    posture.head = [uniform(rng, -25.0, 25.0), uniform(rng, -15.0, 15.0), uniform(rng, -50.0, 50.0)];
    posture
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
