//! Seeded initialisation: the same numbers for the same seed on every machine.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Distribution of the initial weights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum WeightInit {
    /// Uniform in `+- sqrt(6 / (inputs + outputs))` (Glorot and Bengio 2010).
    #[default]
    Xavier,
    /// Uniform in `+- sqrt(6 / inputs)` (He et al. 2015).
    He,
}

/// Flat initial parameters of `blocks` residual blocks of width `width`: weights as `weight` says, shifts 0, scales
/// 1, but `residual_scale` for the second normalisation of each block.
pub(super) fn initialize(
    blocks: usize,
    width: usize,
    weight: WeightInit,
    residual_scale: f64,
    seed: u64,
) -> Vec<f32> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let bound = match weight {
        WeightInit::Xavier => (6.0 / (2 * width) as f64).sqrt(),
        WeightInit::He => (6.0 / width as f64).sqrt(),
    };
    let mut flat = Vec::new();
    for half in 0..2 * blocks {
        flat.extend((0..width * width).map(|_| generator.random_range(-bound..bound) as f32));
        let scale = if half % 2 == 0 { 1.0 } else { residual_scale as f32 };
        flat.extend(std::iter::repeat_n(scale, width));
        flat.extend(std::iter::repeat_n(0.0, width));
    }
    flat
}
