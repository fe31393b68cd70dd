//! The functional map against that of the ground truth.

use candle_core::{Result, Tensor};
use fmnet::Matrix;

/// `|C - C_gt|^2`, the squared Frobenius norm, of maps `[k_target, k_source]`.
pub(crate) fn spectral(map: &Tensor, ground_truth: &Matrix) -> Result<Tensor> {
    let shape = (ground_truth.rows(), ground_truth.cols());
    let truth = Tensor::from_slice(ground_truth.data(), shape, &candle_core::Device::Cpu)?;
    (map - truth.to_dtype(map.dtype())?.to_device(map.device())?)?.sqr()?.sum_all()
}
