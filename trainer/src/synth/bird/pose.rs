//! Poses of birds: standing, walking, pecking, spreading the wings, flying; within the limits of the joints.

use rand::Rng;

use super::super::math::{Quat, unit};
use super::super::random::{chance, normal, uniform};
use super::super::skeleton::Skeleton;
use super::bone::{self, limb};
use fmnet::mesh::vec3;

/// A wing, seen from the lying trunk; angles in degrees.
#[derive(Clone, Copy, Debug, Default)]
struct Wing {
    /// How far it is folded along the flank: 0 stretched out, 1 folded.
    fold: f64,
    /// How far it is raised, and swept back.
    lift: f64,
    sweep: f64,
    /// Turn about itself, and bend of its outer half upwards.
    twist: f64,
    bend: f64,
}

/// A leg: swing forwards, and how far knee and ankle close, in degrees.
#[derive(Clone, Copy, Debug, Default)]
struct Leg {
    swing: f64,
    knee: f64,
    ankle: f64,
    out: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Posture {
    /// How far the trunk points upwards.
    rise: f64,
    /// Bends of the neck: upwards at its base, upwards towards the head, to the left.
    neck: [f64; 3],
    /// Bends of the head: upwards, to the left, rolled.
    head: [f64; 3],
    /// Bends of the tail: upwards, to the left.
    tail: [f64; 2],
    wings: [Wing; 2],
    legs: [Leg; 2],
}

const FOLDED: Wing = Wing { fold: 1.0, lift: 0.0, sweep: 0.0, twist: 0.0, bend: 0.0 };

/// Local rotation of every bone of a bird in a random posture.
pub(super) fn random(skeleton: &Skeleton, rng: &mut impl Rng) -> Vec<Quat> {
    let mut posture = match rng.random_range(0..8) {
        0 => Posture { wings: [FOLDED; 2], ..Posture::default() },
        1 => walking(rng),
        2 => pecking(rng),
        3 | 4 => flying(rng),
        5 => spreading(rng),
        6 => looking_back(rng),
        _ => free(rng),
    };
    posture.vary(rng);
    posture.rotations(skeleton)
}

/// Local rotation of every bone of a bird that stands still, the same on both sides, its wings folded or stretched out.
pub(super) fn resting(skeleton: &Skeleton, rng: &mut impl Rng) -> Vec<Quat> {
    let wing = if chance(rng, 0.6) {
        Wing { fold: uniform(rng, 0.9, 1.0), ..Wing::default() }
    } else {
        Wing { lift: uniform(rng, -8.0, 12.0), sweep: uniform(rng, -5.0, 12.0), ..Wing::default() }
    };
    let neck = [normal(rng, 0.0, 8.0), normal(rng, -8.0, 8.0), 0.0];
    let head = [normal(rng, 0.0, 6.0), 0.0, 0.0];
    let posture = Posture { wings: [wing; 2], neck, head, ..Posture::default() };
    posture.rotations(skeleton)
}

fn walking(rng: &mut impl Rng) -> Posture {
    let mut posture = Posture { wings: [FOLDED; 2], ..Posture::default() };
    let reach = uniform(rng, 8.0, 32.0);
    posture.legs[0] = Leg { swing: reach, knee: uniform(rng, 0.0, 30.0), ankle: 10.0, out: 0.0 };
    posture.legs[1] = Leg { swing: -reach, knee: -5.0, ankle: uniform(rng, -10.0, 25.0), out: 0.0 };
    if chance(rng, 0.3) {
        // On one leg.
        posture.legs =
            [Leg { swing: 25.0, knee: 75.0, ankle: uniform(rng, 40.0, 90.0), out: 0.0 }, Leg::default()];
    }
    if chance(rng, 0.5) {
        posture.legs.swap(0, 1);
    }
    posture
}

fn pecking(rng: &mut impl Rng) -> Posture {
    let mut posture = walking(rng);
    posture.rise = uniform(rng, -35.0, -10.0);
    posture.neck = [uniform(rng, -70.0, -25.0), uniform(rng, -45.0, 10.0), 0.0];
    posture
}

fn flying(rng: &mut impl Rng) -> Posture {
    let lift = uniform(rng, -45.0, 60.0);
    let fold = uniform(rng, 0.0, 0.25);
    let bend = uniform(rng, -0.5, 0.5) * lift;
    let wing = Wing { fold, lift, sweep: uniform(rng, -12.0, 15.0), twist: normal(rng, 0.0, 8.0), bend };
    let trailing = chance(rng, 0.5);
    let leg = if trailing {
        Leg { swing: -40.0, knee: -10.0, ankle: -35.0, out: 0.0 }
    } else {
        Leg { swing: 25.0, knee: 70.0, ankle: 80.0, out: 0.0 }
    };
    Posture { wings: [wing; 2], legs: [leg; 2], rise: normal(rng, -10.0, 10.0), ..Posture::default() }
}

/// Standing with the wings half open or raised.
fn spreading(rng: &mut impl Rng) -> Posture {
    let wing = Wing {
        fold: uniform(rng, 0.0, 0.6),
        lift: uniform(rng, -30.0, 50.0),
        sweep: uniform(rng, -15.0, 25.0),
        twist: uniform(rng, -10.0, 30.0),
        bend: uniform(rng, -30.0, 20.0),
    };
    Posture { wings: [wing; 2], rise: uniform(rng, -5.0, 20.0), ..Posture::default() }
}

fn looking_back(rng: &mut impl Rng) -> Posture {
    let side = if chance(rng, 0.5) { 1.0 } else { -1.0 };
    let mut posture = walking(rng);
    posture.neck = [uniform(rng, -10.0, 15.0), uniform(rng, -30.0, 10.0), side * uniform(rng, 30.0, 100.0)];
    posture.head[1] = side * uniform(rng, 0.0, 35.0);
    posture
}

fn free(rng: &mut impl Rng) -> Posture {
    let mut posture = walking(rng);
    for wing in &mut posture.wings {
        *wing = Wing {
            fold: if chance(rng, 0.4) { 1.0 } else { uniform(rng, 0.0, 0.5) },
            lift: uniform(rng, -35.0, 55.0),
            sweep: uniform(rng, -20.0, 25.0),
            twist: uniform(rng, -20.0, 25.0),
            bend: uniform(rng, -35.0, 30.0),
        };
    }
    posture.neck = [uniform(rng, -60.0, 25.0), uniform(rng, -50.0, 40.0), uniform(rng, -60.0, 60.0)];
    posture
}

impl Posture {
    fn vary(&mut self, rng: &mut impl Rng) {
        let values = self.neck.iter_mut().zip([7.0, 12.0, 9.0]);
        let values = values.chain(self.head.iter_mut().zip([9.0, 9.0, 6.0]));
        for (value, deviation) in values.chain(self.tail.iter_mut().zip([14.0, 9.0])) {
            *value = normal(rng, *value, deviation);
        }
        for wing in &mut self.wings {
            // Folded wings lie where they do.
            let loose = 1.0 - 0.8 * wing.fold;
            wing.fold = normal(rng, wing.fold, 0.03);
            let values = [(&mut wing.lift, 5.0), (&mut wing.sweep, 4.0), (&mut wing.twist, 5.0)];
            for (value, deviation) in values.into_iter().chain([(&mut wing.bend, 6.0)]) {
                *value = normal(rng, *value, loose * deviation);
            }
        }
        for leg in &mut self.legs {
            for (value, deviation) in
                [(&mut leg.swing, 4.0), (&mut leg.knee, 5.0), (&mut leg.ankle, 6.0), (&mut leg.out, 4.0)]
            {
                *value = normal(rng, *value, deviation);
            }
        }
    }

    /// Rotations of the bones, every angle first brought within the limits of its joint.
    fn rotations(&self, skeleton: &Skeleton) -> Vec<Quat> {
        let mut rotations = vec![Quat::IDENTITY; bone::COUNT];
        // Turning about +x lowers what points forwards.
        let rise = self.rise.clamp(-40.0, 40.0);
        rotations[bone::PELVIS] = Quat::x(-rise);
        let [lift, curve, turn] = self.neck;
        let (lift, curve, turn) =
            (lift.clamp(-80.0, 40.0), curve.clamp(-70.0, 60.0), turn.clamp(-120.0, 120.0));
        for (i, share) in [0.6 * lift, 0.4 * lift + 0.5 * curve, 0.5 * curve].into_iter().enumerate() {
            rotations[bone::NECK + i] = Quat::y(turn / 3.0).then_after(Quat::x(-share));
        }
        let [nod, side, roll] = self.head;
        let nod = nod - 0.7 * (lift + curve) - rise;
        let head = Quat::y(side.clamp(-45.0, 45.0)).then_after(Quat::x(-nod.clamp(-45.0, 60.0)));
        rotations[bone::HEAD] = head.then_after(Quat::z(roll.clamp(-25.0, 25.0)));
        let [lift, side] = self.tail;
        // The tail points backwards, so turning about +x raises it.
        rotations[bone::TAIL] = Quat::y(side.clamp(-25.0, 25.0)).then_after(Quat::x(lift.clamp(-30.0, 40.0)));
        let chest = &skeleton.bones[bone::CHEST];
        let raised = Quat::between([0.0, 0.0, 1.0], unit(vec3::sub(chest.tail, chest.head)));
        for side in 0..2 {
            let mut set = |name: usize, rotation: Quat| {
                rotations[limb(name, side)] = if side == 0 { rotation } else { rotation.mirrored() };
            };
            for (i, turn) in self.wings[side].rotations().into_iter().enumerate() {
                set(bone::WING + i, raised.then_after(turn).then_after(raised.inverse()));
            }
            self.legs[side].rotations(rise, &mut set);
        }
        rotations
    }
}

impl Wing {
    /// Rotations of the three bones of the left wing of a lying trunk.
    fn rotations(&self) -> [Quat; 3] {
        let fold = self.fold.clamp(0.0, 1.0);
        let open = 1.0 - fold;
        let lift = open * self.lift.clamp(-60.0, 70.0);
        let sweep = open * self.sweep.clamp(-25.0, 40.0) + 79.0 * fold;
        let twist = Quat::about([1.0, 0.0, 0.0], (open * self.twist.clamp(-35.0, 35.0)).to_radians());
        // Folded, the blade stands on its front edge along the flank.
        let roll = Quat::z(lift - 66.0 * fold);
        let shoulder = roll.then_after(Quat::y(sweep)).then_after(twist);
        let bend = open * self.bend.clamp(-40.0, 40.0);
        let outer = |turn: f64| Quat::z(0.5 * bend).then_after(Quat::y(turn * fold));
        [shoulder, outer(-14.0), outer(26.0)]
    }
}

impl Leg {
    /// Sets the rotations of the left leg under a trunk that points upwards by `rise`.
    fn rotations(&self, rise: f64, set: &mut impl FnMut(usize, Quat)) {
        let swing = self.swing.clamp(-60.0, 60.0) - rise;
        set(bone::THIGH, Quat::z(self.out.clamp(-8.0, 20.0)).then_after(Quat::x(-swing)));
        let (knee, ankle) = (self.knee.clamp(-25.0, 85.0), self.ankle.clamp(-45.0, 100.0));
        set(bone::SHIN, Quat::x(knee));
        set(bone::FOOT, Quat::x(-ankle));
        set(bone::TOES, Quat::x(0.8 * (swing - knee + ankle).clamp(-60.0, 60.0)));
    }
}
