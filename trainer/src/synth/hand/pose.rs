//! Poses of hands: gestures with variation, kept within the limits of the joints.

use rand::Rng;

use super::super::math::{Quat, unit};
use super::super::random::{chance, normal, uniform};
use super::super::skeleton::Skeleton;
use super::bone::{self, of_digit};
use fmnet::mesh::vec3;

/// Angles in degrees.
#[derive(Clone, Copy, Debug, Default)]
struct Gesture {
    /// Bend of the wrist towards the palm, and towards the thumb.
    wrist: [f64; 2],
    /// Bends of the first and of the second joint of the fingers, index finger first.
    fingers: [[f64; 2]; 4],
    /// How far each finger leans towards the thumb.
    lean: [f64; 4],
    /// How far the thumb comes in front of the palm, across it, and bends.
    thumb: [f64; 3],
}

/// Local rotation of every bone in a random gesture.
pub(super) fn random(skeleton: &Skeleton, rng: &mut impl Rng) -> Vec<Quat> {
    let mut gesture = archetype(rng);
    gesture.vary(rng);
    gesture.rotations(skeleton)
}

/// Local rotation of every bone at rest: an open hand.
pub(super) fn resting(skeleton: &Skeleton, rng: &mut impl Rng) -> Vec<Quat> {
    let bend = uniform(rng, -4.0, 14.0);
    let apart = uniform(rng, -2.0, 6.0);
    let gesture = Gesture {
        fingers: [[bend, 1.2 * bend.max(0.0)]; 4],
        lean: [apart, 0.3 * apart, -0.4 * apart, -apart],
        thumb: [uniform(rng, -10.0, 20.0), uniform(rng, -15.0, 10.0), uniform(rng, -5.0, 10.0)],
        ..Gesture::default()
    };
    gesture.rotations(skeleton)
}

const RELAXED: Gesture =
    Gesture { wrist: [0.0; 2], fingers: [[18.0, 24.0]; 4], lean: [0.0; 4], thumb: [20.0, 5.0, 12.0] };
const CLOSED: [f64; 2] = [72.0, 86.0];
const FIST: Gesture = Gesture { fingers: [CLOSED; 4], thumb: [38.0, 28.0, 38.0], ..RELAXED };

fn archetype(rng: &mut impl Rng) -> Gesture {
    const OPEN: [f64; 2] = [2.0, 4.0];
    const AWAY: [f64; 3] = [2.0, -25.0, -8.0];
    let gesture = |fingers: [[f64; 2]; 4], thumb: [f64; 3]| Gesture { fingers, thumb, ..RELAXED };
    match rng.random_range(0..12) {
        0 | 1 => {
            let lean = [9.0, 2.0, -5.0, -10.0];
            Gesture { lean, ..gesture([[-4.0, 0.0]; 4], [-5.0, -18.0, -8.0]) }
        }
        2 => FIST,
        // Pointing.
        3 => gesture([OPEN, CLOSED, CLOSED, CLOSED], if chance(rng, 0.3) { AWAY } else { FIST.thumb }),
        // Two fingers.
        4 => Gesture { fingers: [OPEN, OPEN, CLOSED, CLOSED], lean: [8.0, -6.0, 0.0, 0.0], ..FIST },
        // Thumb up, or thumb and little finger.
        5 if chance(rng, 0.5) => gesture([CLOSED; 4], AWAY),
        5 => gesture([CLOSED, CLOSED, CLOSED, OPEN], AWAY),
        6 => pinching(rng),
        7 => around_a_rod(rng),
        // A flat hand bent at the knuckles, or a claw.
        8 if chance(rng, 0.5) => gesture([[uniform(rng, 30.0, 75.0), 5.0]; 4], [35.0, 5.0, 8.0]),
        8 => gesture([[-5.0, uniform(rng, 50.0, 85.0)]; 4], [10.0, 0.0, 35.0]),
        9 => RELAXED,
        _ => free(rng),
    }
}

/// Thumb and index finger meet.
fn pinching(rng: &mut impl Rng) -> Gesture {
    let index = [normal(rng, 48.0, 5.0), normal(rng, 46.0, 5.0)];
    let bend = uniform(rng, 5.0, 40.0);
    let others = [1.0, 0.8, 0.6].map(|share| [share * bend, share * bend]);
    let fingers = [index, others[0], others[1], others[2]];
    Gesture { fingers, thumb: [48.0, 18.0, 26.0], ..RELAXED }
}

fn around_a_rod(rng: &mut impl Rng) -> Gesture {
    let bends = [uniform(rng, 25.0, 60.0), uniform(rng, 25.0, 55.0)];
    Gesture { fingers: [bends; 4], thumb: [55.0, 0.0, 20.0], ..RELAXED }
}

fn free(rng: &mut impl Rng) -> Gesture {
    let fingers = std::array::from_fn(|_| [uniform(rng, -10.0, 80.0), uniform(rng, 0.0, 90.0)]);
    let thumb = [uniform(rng, -10.0, 50.0), uniform(rng, -25.0, 25.0), uniform(rng, -5.0, 45.0)];
    Gesture { fingers, thumb, ..RELAXED }
}

impl Gesture {
    fn vary(&mut self, rng: &mut impl Rng) {
        self.wrist = [normal(rng, 0.0, 22.0), normal(rng, 0.0, 9.0)];
        let common = normal(rng, 0.0, 5.0);
        for bend in self.fingers.iter_mut().flatten() {
            *bend = normal(rng, *bend + common, 5.0);
        }
        let values = self.lean.iter_mut().zip([2.5; 4]).chain(self.thumb.iter_mut().zip([7.0; 3]));
        for (value, deviation) in values {
            *value = normal(rng, *value, deviation);
        }
    }

    /// Rotations of the bones, every angle first brought within the limits of its joint.
    fn rotations(&self, skeleton: &Skeleton) -> Vec<Quat> {
        let mut rotations = vec![Quat::IDENTITY; bone::COUNT];
        let [bend, side] = self.wrist;
        // Turning about +x takes what points up towards the palm; turning about +z, towards the thumb.
        rotations[bone::PALM] = Quat::z(side.clamp(-25.0, 20.0)).then_after(Quat::x(bend.clamp(-55.0, 60.0)));
        for (finger, (&[first, second], lean)) in self.fingers.iter().zip(self.lean).enumerate() {
            let (first, second) = (first.clamp(-20.0, 85.0), second.clamp(0.0, 98.0));
            // Bent fingers cannot be spread.
            let lean = lean.clamp(-16.0, 16.0) * (1.0 - first.max(0.0) / 100.0);
            let digit = finger + 1;
            rotations[of_digit(digit, 0)] = Quat::z(lean).then_after(Quat::x(first));
            let along = direction(skeleton, of_digit(digit, 1));
            let hinge = unit([along[1], -along[0], 0.0]);
            rotations[of_digit(digit, 1)] = Quat::about(hinge, second.to_radians());
            rotations[of_digit(digit, 2)] = Quat::about(hinge, (0.65 * second).to_radians());
        }
        let [front, across, bend] = self.thumb;
        let (front, across) = (front.clamp(-15.0, 60.0), across.clamp(-30.0, 30.0));
        rotations[of_digit(0, 0)] = Quat::y(front).then_after(Quat::z(-across));
        let along = direction(skeleton, of_digit(0, 1));
        // The thumb bends half across the palm, half towards it.
        let hinge = unit(vec3::cross(along, unit([0.8, 0.0, 0.6])));
        let bend = bend.clamp(-15.0, 60.0);
        rotations[of_digit(0, 1)] = Quat::about(hinge, (0.7 * bend).to_radians());
        rotations[of_digit(0, 2)] = Quat::about(hinge, bend.to_radians());
        rotations
    }
}

/// Direction of a bone at rest.
fn direction(skeleton: &Skeleton, bone: usize) -> [f64; 3] {
    unit(vec3::sub(skeleton.bones[bone].tail, skeleton.bones[bone].head))
}
