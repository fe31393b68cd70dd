//! The functional map layer: from spectral descriptors to the functional map `C`, differentiable.
//!
//! `F` `[k_source, q]` and `G` `[k_target, q]` are the descriptors of source and target in their eigenbases; `C`
//! `[k_target, k_source]` takes functions from the source to the target, `C F = G` (paper, equation "ls"). The solve
//! and its gradient are the runtime's, [`fmnet::fmap::FmapSolution`]; here is the Candle op around them.
//!
//! Everything is solved in double precision, whatever the type of the tensors.

mod op;

pub use op::{FunctionalMap, functional_map};

use fmnet::fmap::FmapError;
use thiserror::Error;

/// Why there is no functional map.
#[derive(Debug, Error)]
pub enum FmLayerError {
    /// The descriptors are not finite.
    #[error(
        "the spectral descriptors hold NaN or infinite values; lower the learning rate or check the inputs"
    )]
    NotFinite,
    /// The descriptors vanish.
    #[error(
        "the spectral descriptors of the source are all zero, so that no functional map can be solved for"
    )]
    Zero,
    /// The solve fails for another reason.
    #[error(transparent)]
    Solve(FmapError),
}

impl From<FmapError> for FmLayerError {
    fn from(error: FmapError) -> Self {
        match error {
            FmapError::NotFinite { .. } => Self::NotFinite,
            other => Self::Solve(other),
        }
    }
}

#[cfg(test)]
mod tests;
