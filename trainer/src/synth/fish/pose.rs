//! Poses of fish: bends of the body, as in swimming and turning, and of the fins.

use rand::Rng;

use super::super::math::Quat;
use super::super::random::{chance, normal, uniform};
use super::bone::{self, limb};

/// Bends in degrees.
#[derive(Clone, Copy, Debug, Default)]
struct Posture {
    /// Of every joint of the spine from the head to the tail, to the left and upwards.
    spine: [[f64; 2]; 6],
    /// Lean of the dorsal and of the anal fin to the left.
    lean: [f64; 2],
    /// Of each side, how far the pectoral fin is raised and laid back, and the pelvic fin is spread.
    fins: [[f64; 3]; 2],
}

/// The bones of the spine from the head to the tail.
const SPINE: [usize; 6] =
    [bone::HEAD, bone::FRONT, bone::REAR, bone::REAR_MIDDLE, bone::REAR_END, bone::TAIL];
/// How much each of them bends.
const SHARES: [f64; 6] = [0.35, 0.6, 0.8, 1.0, 1.1, 0.9];

/// Local rotation of every bone of a fish in a random posture.
pub(super) fn random(rng: &mut impl Rng) -> Vec<Quat> {
    let mut posture = Posture::default();
    let bend = normal(rng, 0.0, 17.0);
    let (phase, waves) = (uniform(rng, 0.0, std::f64::consts::TAU), uniform(rng, 0.3, 1.1));
    // A wave that runs along the body, or a bend to one side; some bend upwards and downwards.
    let turning = chance(rng, 0.35);
    let lift = if chance(rng, 0.35) { normal(rng, 0.0, 14.0) } else { normal(rng, 0.0, 3.0) };
    for (i, (joint, share)) in posture.spine.iter_mut().zip(SHARES).enumerate() {
        let wave = (phase + waves * i as f64).sin();
        let side = if turning { bend } else { 1.25 * bend * wave };
        *joint = [normal(rng, share * side, 3.0), normal(rng, share * lift * wave, 2.0)];
    }
    posture.lean = [normal(rng, 0.0, 10.0), normal(rng, 0.0, 10.0)];
    for fins in &mut posture.fins {
        *fins = [normal(rng, 0.0, 25.0), uniform(rng, -25.0, 40.0), normal(rng, 0.0, 15.0)];
    }
    posture.rotations()
}

/// Local rotation of every bone of a fish that is stretched out, the same on both sides.
pub(super) fn resting(rng: &mut impl Rng) -> Vec<Quat> {
    let fins = [normal(rng, 0.0, 12.0), uniform(rng, -10.0, 20.0), normal(rng, 0.0, 8.0)];
    let lift = normal(rng, 0.0, 2.0);
    Posture { spine: [[0.0, lift]; 6], fins: [fins; 2], ..Posture::default() }.rotations()
}

impl Posture {
    /// Rotations of the bones, every angle first brought within the limits of its joint.
    fn rotations(&self) -> Vec<Quat> {
        let mut rotations = vec![Quat::IDENTITY; bone::COUNT];
        for ([side, lift], bone) in self.spine.into_iter().zip(SPINE) {
            let (side, lift) = (side.clamp(-28.0, 28.0), lift.clamp(-22.0, 22.0));
            // What points forwards turns to the left about +y and rises about -x; what points backwards, the other way.
            let sign = if [bone::HEAD, bone::FRONT].contains(&bone) { 1.0 } else { -1.0 };
            rotations[bone] = Quat::y(sign * side).then_after(Quat::x(-sign * lift));
        }
        let [dorsal, anal] = self.lean.map(|angle| angle.clamp(-20.0, 20.0));
        rotations[bone::DORSAL] = Quat::z(-dorsal);
        rotations[bone::ANAL] = Quat::z(anal);
        for (side, [lift, back, spread]) in self.fins.into_iter().enumerate() {
            let mut set = |name: usize, rotation: Quat| {
                rotations[limb(name, side)] = if side == 0 { rotation } else { rotation.mirrored() };
            };
            let (lift, back) = (lift.clamp(-40.0, 45.0), back.clamp(-35.0, 25.0));
            set(bone::PECTORAL, Quat::z(lift).then_after(Quat::y(back)));
            set(bone::PELVIC, Quat::z(spread.clamp(-10.0, 35.0)));
        }
        rotations
    }
}
