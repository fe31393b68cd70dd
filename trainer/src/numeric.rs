//! The runtime's kernels for the element types of Candle.

pub(crate) use fmnet::numeric::{MatrixView, matmul, matmul_split, par_matmul, split_rows, vectorized};

use candle_core::WithDType;

/// A floating-point type of the fused ops: `f32` to train, `f64` to check gradients.
pub(crate) trait Real: WithDType + fmnet::numeric::Real {}

impl Real for f32 {}
impl Real for f64 {}
