//! Seeded random numbers.

use fmnet::mesh::vec3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The generator of shape number `index` of a seed; each shape's numbers depend on no other shape's.
pub(super) fn generator(seed: u64, index: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(index);
    rng
}

/// Uniform in `[low, high)`.
pub(super) fn uniform(rng: &mut impl Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.random::<f64>()
}

/// Normal of mean 0 and deviation 1 (Box and Muller 1958).
pub(super) fn normal(rng: &mut impl Rng) -> f64 {
    let (u, v): (f64, f64) = (1.0 - rng.random::<f64>(), rng.random());
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// A direction uniform on the sphere.
pub(super) fn direction(rng: &mut impl Rng) -> [f64; 3] {
    let p = [normal(rng), normal(rng), normal(rng)];
    let norm = vec3::norm(p);
    if norm > 0.0 { vec3::scale(p, 1.0 / norm) } else { [1.0, 0.0, 0.0] }
}

/// An index, with a probability proportional to its weight; the weights are not negative, and one is positive.
pub(super) fn weighted(rng: &mut impl Rng, weights: &[f64]) -> u32 {
    let mut left = rng.random::<f64>() * weights.iter().sum::<f64>();
    let mut chosen = 0;
    for (i, &weight) in weights.iter().enumerate().filter(|w| *w.1 > 0.0) {
        chosen = i;
        left -= weight;
        if left < 0.0 {
            break;
        }
    }
    chosen as u32
}
