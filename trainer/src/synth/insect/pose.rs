//! Poses of insects: standing, walking, rearing, curled; within the limits of the joints.

use rand::Rng;

use super::super::math::Quat;
use super::super::random::{chance, normal, uniform};
use super::bone::{self, limb};

/// Angles of a leg in degrees: forwards, upwards, and how far knee and ankle close.
#[derive(Clone, Copy, Debug, Default)]
struct Leg {
    swing: f64,
    lift: f64,
    knee: f64,
    ankle: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Posture {
    /// Bends of the head: upwards, to the left, rolled.
    head: [f64; 3],
    /// Bends of the abdomen: upwards, to the left.
    abdomen: [f64; 2],
    /// Of each side: the feeler forwards and upwards, and the bend of its elbow; then how far the jaw opens.
    feelers: [[f64; 4]; 2],
    legs: [[Leg; 3]; 2],
}

/// Local rotation of every bone of an insect in a random posture.
pub(super) fn random(rng: &mut impl Rng) -> Vec<Quat> {
    let mut posture = match rng.random_range(0..6) {
        0 => Posture::default(),
        1 | 2 => walking(rng),
        3 => rearing(rng),
        4 => drawn_in(rng),
        _ => free(rng),
    };
    posture.vary(rng);
    posture.rotations()
}

/// Local rotation of every bone of an insect that stands still, the same on both sides.
pub(super) fn resting(rng: &mut impl Rng) -> Vec<Quat> {
    let mut leg = || Leg {
        swing: normal(rng, 0.0, 5.0),
        lift: normal(rng, 0.0, 5.0),
        knee: normal(rng, 0.0, 6.0),
        ankle: 0.0,
    };
    let legs = [leg(), leg(), leg()];
    let feeler =
        [normal(rng, 0.0, 10.0), normal(rng, 0.0, 10.0), normal(rng, 0.0, 10.0), uniform(rng, 0.0, 8.0)];
    let head = [normal(rng, 0.0, 8.0), 0.0, 0.0];
    let abdomen = [normal(rng, 0.0, 6.0), 0.0];
    Posture { head, abdomen, feelers: [feeler; 2], legs: [legs; 2] }.rotations()
}

/// Three legs forwards and up, three backwards, in turn.
fn walking(rng: &mut impl Rng) -> Posture {
    let mut posture = Posture::default();
    let (reach, lift) = (uniform(rng, 8.0, 28.0), uniform(rng, 5.0, 28.0));
    let first = usize::from(chance(rng, 0.5));
    for (side, legs) in posture.legs.iter_mut().enumerate() {
        for (pair, leg) in legs.iter_mut().enumerate() {
            let forwards = (side + pair + first) % 2 == 0;
            *leg = if forwards {
                Leg { swing: reach, lift, knee: 0.5 * lift, ankle: 0.0 }
            } else {
                Leg { swing: -reach, lift: -4.0, knee: 0.0, ankle: 0.0 }
            };
        }
    }
    posture
}

/// The front legs lifted.
fn rearing(rng: &mut impl Rng) -> Posture {
    let mut posture = Posture::default();
    for legs in &mut posture.legs {
        legs[0] = Leg {
            swing: uniform(rng, 5.0, 40.0),
            lift: uniform(rng, 5.0, 40.0),
            knee: uniform(rng, -60.0, 40.0),
            ankle: uniform(rng, -30.0, 30.0),
        };
        legs[2].swing = uniform(rng, -15.0, 10.0);
    }
    posture.head[0] = uniform(rng, 0.0, 25.0);
    posture.abdomen[0] = uniform(rng, -45.0, 20.0);
    posture
}

fn drawn_in(rng: &mut impl Rng) -> Posture {
    let mut posture = Posture::default();
    let close = uniform(rng, 15.0, 45.0);
    for leg in posture.legs.iter_mut().flatten() {
        *leg = Leg { swing: 0.0, lift: uniform(rng, -10.0, 25.0), knee: close, ankle: 0.5 * close };
    }
    posture.abdomen[0] = uniform(rng, -50.0, 0.0);
    posture
}

fn free(rng: &mut impl Rng) -> Posture {
    let mut posture = Posture::default();
    for leg in posture.legs.iter_mut().flatten() {
        *leg = Leg {
            swing: uniform(rng, -28.0, 28.0),
            lift: uniform(rng, -25.0, 35.0),
            knee: uniform(rng, -55.0, 40.0),
            ankle: uniform(rng, -30.0, 40.0),
        };
    }
    posture.abdomen = [uniform(rng, -45.0, 30.0), uniform(rng, -30.0, 30.0)];
    posture.head = [uniform(rng, -20.0, 20.0), uniform(rng, -30.0, 30.0), uniform(rng, -15.0, 15.0)];
    posture
}

impl Posture {
    fn vary(&mut self, rng: &mut impl Rng) {
        let values = self.head.iter_mut().zip([8.0, 8.0, 5.0]);
        for (value, deviation) in values.chain(self.abdomen.iter_mut().zip([9.0, 8.0])) {
            *value = normal(rng, *value, deviation);
        }
        for feeler in &mut self.feelers {
            *feeler = [
                normal(rng, 0.0, 22.0),
                normal(rng, 0.0, 20.0),
                normal(rng, 0.0, 22.0),
                uniform(rng, -4.0, 22.0),
            ];
        }
        for leg in self.legs.iter_mut().flatten() {
            for (value, deviation) in
                [(&mut leg.swing, 5.0), (&mut leg.lift, 5.0), (&mut leg.knee, 7.0), (&mut leg.ankle, 9.0)]
            {
                *value = normal(rng, *value, deviation);
            }
        }
    }

    /// Rotations of the bones, every angle first brought within the limits of its joint.
    fn rotations(&self) -> Vec<Quat> {
        let mut rotations = vec![Quat::IDENTITY; bone::COUNT];
        let [lift, side, roll] = self.head;
        // Turning about +x lowers what points forwards and raises what points backwards.
        let head = Quat::y(side.clamp(-45.0, 45.0)).then_after(Quat::x(-lift.clamp(-35.0, 35.0)));
        rotations[bone::HEAD] = head.then_after(Quat::z(roll.clamp(-25.0, 25.0)));
        let [lift, side] = self.abdomen;
        let bend = Quat::y(-0.5 * side.clamp(-40.0, 40.0)).then_after(Quat::x(0.5 * lift.clamp(-60.0, 40.0)));
        (rotations[bone::WAIST], rotations[bone::ABDOMEN]) = (bend, bend);
        for side in 0..2 {
            let mut set = |name: usize, rotation: Quat| {
                rotations[limb(name, side)] = if side == 0 { rotation } else { rotation.mirrored() };
            };
            let [swing, lift, elbow, jaw] = self.feelers[side];
            let (swing, lift, elbow) =
                (swing.clamp(-30.0, 40.0), lift.clamp(-35.0, 40.0), elbow.clamp(-45.0, 45.0));
            set(bone::FEELER, Quat::y(swing).then_after(Quat::x(-lift)));
            set(bone::FEELER + 1, Quat::y(0.6 * elbow).then_after(Quat::x(elbow)));
            set(bone::JAW, Quat::y(jaw.clamp(-4.0, 30.0)));
            for (pair, leg) in self.legs[side].iter().enumerate() {
                for (i, rotation) in leg.rotations(pair).into_iter().enumerate() {
                    set(bone::LEG + 3 * pair + i, rotation);
                }
            }
        }
        rotations
    }
}

impl Leg {
    /// Rotations of the three bones of a left leg.
    fn rotations(&self, pair: usize) -> [Quat; 3] {
        // Turns about the horizontal axis across the leg raise it; it points forwards in front, backwards behind.
        let turn = [42.0_f64, -4.0, -48.0][pair].to_radians();
        let across = [-turn.sin(), 0.0, turn.cos()];
        let about = |degrees: f64| Quat::about(across, degrees.to_radians());
        let lift = about(self.lift.clamp(-35.0, 45.0));
        let swing = Quat::y(-self.swing.clamp(-35.0, 40.0));
        [swing.then_after(lift), about(-self.knee.clamp(-70.0, 50.0)), about(-self.ankle.clamp(-45.0, 60.0))]
    }
}
