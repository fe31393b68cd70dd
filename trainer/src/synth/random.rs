//! Seeded random numbers and the distributions that bodies and poses are drawn from.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::math::{Vec3, unit};

/// What a generator is used for: different purposes get independent streams of the same seed, so that asking for
/// more holes does not change the pose.
#[derive(Clone, Copy)]
pub(super) enum Purpose {
    Shape = 1,
    Pose = 2,
    Remesh = 3,
    Damage = 4,
    Landmarks = 5,
    Heading = 6,
    Breed = 7,
    Stance = 8,
}

/// The generator of one purpose, species and seed.
pub(super) fn generator(species: usize, seed: u64, purpose: Purpose) -> ChaCha8Rng {
    generator_of_trial(species, seed, purpose, 0)
}

/// [`generator`], another one for every trial.
pub(super) fn generator_of_trial(species: usize, seed: u64, purpose: Purpose, trial: u8) -> ChaCha8Rng {
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    [bytes[8], bytes[11], ..] = species.to_le_bytes();
    bytes[9] = purpose as u8;
    bytes[10] = trial;
    ChaCha8Rng::from_seed(bytes)
}

/// Uniform in `[low, high)`.
pub(super) fn uniform(rng: &mut impl Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.random::<f64>()
}

/// Normal with the given mean and deviation, cut at 2.5 deviations (Box and Muller 1958).
pub(super) fn normal(rng: &mut impl Rng, mean: f64, deviation: f64) -> f64 {
    let (u, v): (f64, f64) = (1.0 - rng.random::<f64>(), rng.random());
    let z = (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos();
    mean + deviation * z.clamp(-2.5, 2.5)
}

/// True with the given probability.
pub(super) fn chance(rng: &mut impl Rng, probability: f64) -> bool {
    rng.random::<f64>() < probability
}

/// A direction near `mean`: each coordinate off by a normal `spread`, then made unit.
pub(super) fn direction(rng: &mut impl Rng, mean: Vec3, spread: f64) -> Vec3 {
    let mean = unit(mean);
    unit(std::array::from_fn(|i| normal(rng, mean[i], spread)))
}

/// A random order of `0..n` (Fisher and Yates).
pub(super) fn permutation(rng: &mut impl Rng, n: usize) -> Vec<u32> {
    let mut order: Vec<u32> = (0..n as u32).collect();
    for i in (1..n).rev() {
        order.swap(i, rng.random_range(0..=i));
    }
    order
}
