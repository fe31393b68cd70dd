//! Random poses of quadrupeds: standing, gaits, sitting, lying, playing, grazing, rearing; within the joints' limits.

use rand::Rng;

use super::math::Quat;
use super::quadruped::bone::{self, limb};
use super::random::{chance, normal, uniform};

/// Bends of one leg from its root to its toes, in degrees, and how far it stands out to the side. Forward swings of
/// the root are positive; the other angles are positive where the joint closes.
#[derive(Clone, Copy, Debug, Default)]
struct Leg {
    swing: f64,
    second: f64,
    third: f64,
    toes: f64,
    out: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Posture {
    /// How far the trunk points upwards.
    rise: f64,
    /// Bends of the back: arched upwards, to the left, twisted.
    back: [f64; 3],
    /// Bends of the neck: upwards, to the left, and of the head: upwards, to the left, rolled.
    neck: [f64; 2],
    head: [f64; 3],
    /// Bends of the tail: upwards, to the left.
    tail: [f64; 2],
    fore: [Leg; 2],
    hind: [Leg; 2],
    /// Bends of the proboscis: forwards, to the left.
    proboscis: [f64; 2],
}

/// Local rotation of every bone of a quadruped in a random posture.
pub(super) fn random_quadruped(rng: &mut impl Rng) -> Vec<Quat> {
    let mut posture = archetype(rng);
    posture.vary(rng);
    posture.rotations()
}

/// Local rotation of every bone of a quadruped that stands still, the same on both sides.
pub(super) fn resting_quadruped(rng: &mut impl Rng) -> Vec<Quat> {
    let mut posture = Posture {
        neck: [normal(rng, 0.0, 10.0), 0.0],
        head: [normal(rng, 0.0, 8.0), 0.0, 0.0],
        tail: [normal(rng, 0.0, 25.0), 0.0],
        ..Posture::default()
    };
    let (fore, hind, out) = (normal(rng, 0.0, 5.0), normal(rng, 0.0, 5.0), uniform(rng, 0.0, 6.0));
    posture.fore = [Leg { swing: fore, out, ..Leg::default() }; 2];
    posture.hind = [Leg { swing: hind, out, ..Leg::default() }; 2];
    posture.rotations()
}

fn archetype(rng: &mut impl Rng) -> Posture {
    match rng.random_range(0..11) {
        0 => Posture::default(),
        1 | 2 => walking(rng),
        3 => galloping(rng),
        4 => sitting(rng),
        5 => lying(rng),
        6 => bowing(rng),
        7 => grazing(rng),
        8 => rearing(rng),
        9 => resting_side(rng),
        _ => looking_back(rng),
    }
}

fn walking(rng: &mut impl Rng) -> Posture {
    let mut posture = Posture::default();
    let reach = uniform(rng, 12.0, 32.0);
    for side in 0..2 {
        let sign = if side == 0 { 1.0 } else { -1.0 };
        let (fore, hind) = (sign * reach, -sign * reach);
        let lifted = uniform(rng, 10.0, 55.0);
        posture.fore[side] =
            Leg { swing: fore, second: if fore > 0.0 { lifted } else { 0.0 }, ..Leg::default() };
        posture.fore[side].third = if fore > 0.0 { lifted } else { -8.0 };
        posture.hind[side] =
            Leg { swing: hind, second: if hind > 0.0 { 0.6 * lifted } else { -8.0 }, ..Leg::default() };
        posture.hind[side].third = posture.hind[side].second;
    }
    posture
}

fn galloping(rng: &mut impl Rng) -> Posture {
    let mut posture = Posture::default();
    let gathered = chance(rng, 0.5);
    let (fore, hind) = if gathered { (-35.0, 40.0) } else { (48.0, -38.0) };
    posture.back[0] = if gathered { 22.0 } else { -12.0 };
    for side in 0..2 {
        let closed = uniform(rng, 0.0, 40.0);
        let [swing_fore, swing_hind] = [normal(rng, fore, 8.0), normal(rng, hind, 8.0)];
        posture.fore[side] = Leg { swing: swing_fore, second: closed, third: closed, ..Leg::default() };
        let knee = if gathered { uniform(rng, 5.0, 35.0) } else { -12.0 };
        posture.hind[side] = Leg { swing: swing_hind, second: knee, third: knee, toes: 20.0, out: 0.0 };
    }
    posture.neck[0] = if gathered { 5.0 } else { -15.0 };
    posture
}

fn sitting(rng: &mut impl Rng) -> Posture {
    let rise = uniform(rng, 25.0, 48.0);
    let mut posture = Posture { rise, ..Posture::default() };
    for side in 0..2 {
        posture.fore[side] = Leg { swing: -0.85 * rise, second: 0.0, ..Leg::default() };
        posture.hind[side] = folded(rng, rise);
    }
    posture.neck[0] = -0.3 * rise;
    posture.head[0] = -0.4 * rise;
    posture
}

/// A hind leg folded on the ground under a trunk that points upwards by `rise`.
fn folded(rng: &mut impl Rng, rise: f64) -> Leg {
    let swing = normal(rng, 50.0, 5.0) - rise;
    Leg {
        swing,
        second: normal(rng, 78.0, 5.0),
        third: normal(rng, 96.0, 5.0),
        toes: 65.0,
        out: uniform(rng, 4.0, 16.0),
    }
}

fn lying(rng: &mut impl Rng) -> Posture {
    let mut posture = Posture::default();
    for side in 0..2 {
        let swing = normal(rng, -22.0, 5.0);
        posture.fore[side] = Leg { swing, second: normal(rng, 68.0, 6.0), third: -5.0, toes: 0.0, out: 5.0 };
        posture.hind[side] = folded(rng, 0.0);
    }
    posture
}

fn bowing(rng: &mut impl Rng) -> Posture {
    let depth = uniform(rng, 15.0, 35.0);
    let mut posture = Posture { rise: -depth, ..Posture::default() };
    for side in 0..2 {
        posture.fore[side] = Leg { swing: 15.0 + depth, second: 0.9 * depth, ..Leg::default() };
        posture.hind[side] = Leg { swing: -depth, ..Leg::default() };
    }
    posture.neck[0] = depth;
    posture.tail[0] = 20.0;
    posture
}

fn grazing(rng: &mut impl Rng) -> Posture {
    let mut posture = walking(rng);
    posture.neck[0] = uniform(rng, -75.0, -30.0);
    posture.head[0] = uniform(rng, -20.0, 15.0);
    posture
}

fn rearing(rng: &mut impl Rng) -> Posture {
    let rise = uniform(rng, 40.0, 70.0);
    let mut posture = Posture { rise, ..Posture::default() };
    for side in 0..2 {
        let closed = uniform(rng, 15.0, 75.0);
        posture.fore[side] =
            Leg { swing: uniform(rng, -20.0, 25.0), second: closed, third: closed, ..Leg::default() };
        posture.hind[side] = Leg { swing: -0.75 * rise, second: 10.0, third: 25.0, ..Leg::default() };
    }
    posture.neck[0] = -0.3 * rise;
    posture
}

/// Stretched out with the legs to the sides.
fn resting_side(rng: &mut impl Rng) -> Posture {
    let mut posture = lying(rng);
    posture.back = [uniform(rng, -5.0, 25.0), uniform(rng, -35.0, 35.0), uniform(rng, -15.0, 15.0)];
    for side in 0..2 {
        posture.fore[side] =
            Leg { swing: uniform(rng, 20.0, 65.0), second: uniform(rng, 0.0, 60.0), ..Leg::default() };
        posture.hind[side] =
            Leg { swing: uniform(rng, -40.0, 50.0), out: uniform(rng, 0.0, 25.0), ..posture.hind[side] };
    }
    posture.neck[0] = uniform(rng, -40.0, 10.0);
    posture
}

fn looking_back(rng: &mut impl Rng) -> Posture {
    let mut posture = walking(rng);
    let side = if chance(rng, 0.5) { 1.0 } else { -1.0 };
    posture.back[1] = side * uniform(rng, 15.0, 40.0);
    posture.neck[1] = side * uniform(rng, 30.0, 70.0);
    posture.head[1] = side * uniform(rng, 5.0, 30.0);
    posture.tail[1] = -side * uniform(rng, 0.0, 40.0);
    posture
}

impl Posture {
    fn vary(&mut self, rng: &mut impl Rng) {
        self.proboscis = [uniform(rng, -50.0, 90.0), normal(rng, 0.0, 25.0)];
        let [back, neck] = [[6.0, 7.0, 4.0], [12.0, 14.0, 0.0]];
        let [head, tail] = [[10.0, 10.0, 6.0], [32.0, 32.0, 0.0]];
        let values = self.back.iter_mut().zip(back).chain(self.neck.iter_mut().zip(neck));
        let values = values.chain(self.head.iter_mut().zip(head)).chain(self.tail.iter_mut().zip(tail));
        for (value, deviation) in values {
            *value = normal(rng, *value, deviation);
        }
        for leg in self.fore.iter_mut().chain(&mut self.hind) {
            for (value, deviation) in [
                (&mut leg.swing, 6.0),
                (&mut leg.second, 6.0),
                (&mut leg.third, 6.0),
                (&mut leg.toes, 6.0),
                (&mut leg.out, 4.0),
            ] {
                *value = normal(rng, *value, deviation);
            }
        }
    }

    /// Rotations of the bones, every angle first brought within the limits of its joint.
    fn rotations(&self) -> Vec<Quat> {
        let mut rotations = vec![Quat::IDENTITY; bone::COUNT];
        // Turning about +x lowers what points forwards.
        rotations[bone::PELVIS] = Quat::x(-self.rise.clamp(-40.0, 80.0));
        let [arch, side, twist] = self.back;
        let (arch, side, twist) =
            (arch.clamp(-25.0, 35.0), side.clamp(-45.0, 45.0), twist.clamp(-15.0, 15.0));
        let spine = || Quat::y(0.5 * side).then_after(Quat::x(0.5 * arch)).then_after(Quat::z(0.5 * twist));
        rotations[bone::LUMBAR] = spine();
        rotations[bone::CHEST] = spine();
        let [lift, side] = self.neck;
        let (lift, side) = (lift.clamp(-80.0, 35.0), side.clamp(-80.0, 80.0));
        rotations[bone::LOW_NECK] = Quat::y(0.5 * side).then_after(Quat::x(-0.5 * lift));
        rotations[bone::NECK] = rotations[bone::LOW_NECK];
        let [lift, side, roll] = self.head;
        let head = Quat::y(side.clamp(-40.0, 40.0)).then_after(Quat::x(-lift.clamp(-35.0, 35.0)));
        rotations[bone::HEAD] = head.then_after(Quat::z(roll.clamp(-20.0, 20.0)));
        let [lift, side] = self.tail.map(|angle| angle.clamp(-75.0, 75.0) / 3.0);
        for i in 0..3 {
            // The tail points backwards, so turning about +x raises it.
            rotations[bone::TAIL + i] = Quat::y(-side).then_after(Quat::x(lift));
        }
        let [lift, swing] = self.proboscis.map(|angle| 0.5 * angle.clamp(-70.0, 100.0));
        for i in 0..2 {
            rotations[bone::PROBOSCIS + i] = Quat::z(swing).then_after(Quat::x(-lift));
        }
        for i in 0..2 {
            let mut set = |name: usize, rotation: Quat| {
                rotations[limb(name, i)] = if i == 0 { rotation } else { rotation.mirrored() };
            };
            self.fore[i].fore_rotations(&mut set);
            self.hind[i].hind_rotations(&mut set);
        }
        rotations
    }
}

impl Leg {
    fn fore_rotations(&self, set: &mut impl FnMut(usize, Quat)) {
        let swing = self.swing.clamp(-50.0, 70.0);
        // The shoulder blade slides along the ribs and takes a share of the swing.
        set(bone::BLADE, Quat::x(-0.3 * swing));
        set(bone::UPPER_ARM, Quat::z(self.out.clamp(-6.0, 25.0)).then_after(Quat::x(-0.7 * swing)));
        set(bone::FOREARM, Quat::x(-self.second.clamp(-12.0, 105.0)));
        set(bone::HAND, Quat::x(self.third.clamp(-12.0, 95.0)));
        set(bone::FORE_TOES, Quat::x(self.toes.clamp(-25.0, 40.0)));
    }

    fn hind_rotations(&self, set: &mut impl FnMut(usize, Quat)) {
        let swing = self.swing.clamp(-58.0, 75.0);
        set(bone::THIGH, Quat::z(self.out.clamp(-6.0, 25.0)).then_after(Quat::x(-swing)));
        set(bone::SHIN, Quat::x(self.second.clamp(-18.0, 95.0)));
        set(bone::FOOT, Quat::x(-self.third.clamp(-20.0, 115.0)));
        set(bone::HIND_TOES, Quat::x(self.toes.clamp(-25.0, 70.0)));
    }
}
