//! The functional map layer: from spectral descriptors to the functional map `C`, differentiable.
//!
//! `F` `[k_source, q]` and `G` `[k_target, q]` are the descriptors of source and target in their eigenbases; `C`
//! `[k_target, k_source]` takes functions from the source to the target, `C F = G` (paper, equation "ls"). With
//! `S = F F^T`:
//!
//! - [`FmSolver::LeastSquares`]: `C = G F^T (S + ridge)^-1 = G F^+`, the paper's.
//! - [`FmSolver::Regularized`]: row `i` of `C` solves `(S + weight d diag(D_i)) c_i = F g_i`, where `D` is a mask that
//!   grows with the distance of the eigenvalues ([`fmnet::fmap::resolvent_mask`]) and `d` the mean diagonal of `S`.
//!
//! Everything is solved in double precision, whatever the type of the tensors.

mod gradient;
mod least_squares;
mod op;
mod regularized;

pub use op::{FunctionalMap, functional_map};

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// How the functional map is solved for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "solver", rename_all = "kebab-case", deny_unknown_fields)]
pub enum FmSolver {
    /// The paper's least squares.
    LeastSquares {
        /// Added to the diagonal, relative to its mean; at least 0, 0 in the paper.
        #[serde(default)]
        ridge: f64,
        /// Condition number of `F F^T` above which the truncated pseudo-inverse is used; above 1, default 1e12.
        #[serde(default = "default_max_condition")]
        max_condition: f64,
    },
    /// Rows regularised by the resolvent mask (Ren et al. 2019).
    Regularized {
        /// Weight of the mask relative to the mean diagonal of `F F^T`; 0 or more, default 0.1.
        #[serde(default = "default_mask_weight")]
        weight: f64,
    },
}

fn default_max_condition() -> f64 {
    1e12
}

fn default_mask_weight() -> f64 {
    0.1
}

impl FmSolver {
    /// The paper's least squares with its default guard.
    pub fn least_squares() -> Self {
        Self::LeastSquares { ridge: 0.0, max_condition: default_max_condition() }
    }

    /// The regularised solve with its default weight.
    pub fn regularized() -> Self {
        Self::Regularized { weight: default_mask_weight() }
    }
}

impl Default for FmSolver {
    fn default() -> Self {
        Self::regularized()
    }
}

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
}

#[cfg(test)]
mod tests;
