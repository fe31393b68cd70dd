//! Losses that need no ground truth: bijectivity and orthogonality (Roufosse, Sharma and Ovsjanikov 2019), and the
//! coupling of functional and point map (Cao, Roetzer and Bernard 2023).

use candle_core::{D, Result, Tensor};
use fmnet::Matrix;

/// `|A - I|^2`.
fn distance_to_identity(square: &Tensor) -> Result<Tensor> {
    let identity = Tensor::eye(square.dims2()?.0, square.dtype(), square.device())?;
    (square - identity)?.sqr()?.sum_all()
}

/// `|C12 C21 - I|^2 + |C21 C12 - I|^2`.
pub(crate) fn bijectivity(forth: &Tensor, back: &Tensor) -> Result<Tensor> {
    distance_to_identity(&forth.matmul(back)?)? + distance_to_identity(&back.matmul(forth)?)?
}

/// `|C^T C - I|^2`.
pub(crate) fn orthogonality(map: &Tensor) -> Result<Tensor> {
    distance_to_identity(&map.t()?.matmul(map)?)
}

/// Points of both shapes between which a soft assignment is made.
pub(crate) struct SoftAssignment {
    /// Rows of the target's descriptors, `[m]`.
    pub(crate) rows_target: Tensor,
    /// Rows of the source's descriptors, `[m']`.
    pub(crate) rows_source: Tensor,
    /// The pseudo-inverse of the target's eigenfunctions on its points, `[k_target, m]`.
    pub(crate) inverse_target: Matrix<f32>,
    /// The source's eigenfunctions on its points, `[m', k_source]`.
    pub(crate) basis_source: Matrix<f32>,
}

/// `|C - Psi^+ P Phi|^2`, where row `y` of `P` is the softmax over the source's points of the cosines of their
/// descriptors with that of `y`, over the temperature.
pub(crate) fn coupling(
    map: &Tensor,
    source: &Tensor,
    target: &Tensor,
    points: &SoftAssignment,
    temperature: f64,
) -> Result<Tensor> {
    let source = unit_rows(&source.index_select(&points.rows_source, 0)?)?;
    let target = unit_rows(&target.index_select(&points.rows_target, 0)?)?;
    // Cosines are at most 1: no further shift is needed.
    let weights = ((target.matmul(&source.t()?)? - 1.0)? / temperature)?.exp()?;
    let assignment = weights.broadcast_div(&weights.sum_keepdim(D::Minus1)?)?;
    let constant = |matrix: &Matrix<f32>| {
        Tensor::from_slice(matrix.data(), (matrix.rows(), matrix.cols()), map.device())?.to_dtype(map.dtype())
    };
    let transferred = assignment.matmul(&constant(&points.basis_source)?)?;
    (map - constant(&points.inverse_target)?.matmul(&transferred)?)?.sqr()?.sum_all()
}

/// Each row divided by its length.
pub(crate) fn unit_rows(x: &Tensor) -> Result<Tensor> {
    /// Keeps the square root differentiable at zero.
    const TINY: f64 = 1e-12;
    x.broadcast_div(&(x.sqr()?.sum_keepdim(D::Minus1)? + TINY)?.sqrt()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check_gradient, random};
    use candle_core::Device;

    #[test]
    fn orthogonal_maps_that_undo_each_other_cost_nothing() {
        let (sin, cos) = 0.3f64.sin_cos();
        let turn = Tensor::new(&[[cos, -sin], [sin, cos]], &Device::Cpu).unwrap();
        let value = |loss: Result<Tensor>| loss.unwrap().to_scalar::<f64>().unwrap();
        assert!(value(bijectivity(&turn, &turn.t().unwrap())) < 1e-15);
        assert!(value(orthogonality(&turn)) < 1e-15);
        let double = (&turn * 2.0).unwrap();
        // |4 I - I|^2 = 2 * 9
        assert!((value(orthogonality(&double)) - 18.0).abs() < 1e-12);
        let x = Tensor::from_slice(&random(5, 6), (2, 3), &Device::Cpu).unwrap();
        check_gradient(&x, orthogonality, 1e-7);
        let back = Tensor::from_slice(&random(6, 6), (3, 2), &Device::Cpu).unwrap();
        check_gradient(&x, |x| bijectivity(x, &back), 1e-7);
    }

    #[test]
    fn the_coupling_vanishes_for_descriptors_that_tell_the_points_apart_and_has_the_right_gradient() {
        let (m, k) = (5, 2);
        let rows = Tensor::arange(0u32, m as u32, &Device::Cpu).unwrap();
        let basis = Matrix::from_fn(m, k, |i, j| if j == 0 { 1.0 } else { i as f32 - 2.0 });
        // The columns are orthogonal, of squared norms 5 and 10.
        let inverse = Matrix::from_fn(k, m, |j, i| basis[(i, j)] / if j == 0 { 5.0 } else { 10.0 });
        let points = SoftAssignment {
            rows_source: rows.clone(),
            rows_target: rows,
            inverse_target: inverse,
            basis_source: basis,
        };
        let identity = Tensor::eye(k, candle_core::DType::F64, &Device::Cpu).unwrap();
        let apart = Tensor::eye(m, candle_core::DType::F64, &Device::Cpu).unwrap();
        let value = coupling(&identity, &apart, &apart, &points, 0.01).unwrap().to_scalar::<f64>().unwrap();
        assert!(value < 1e-12, "{value}");
        let target = Tensor::from_slice(&random(3, m * 4), (m, 4), &Device::Cpu).unwrap();
        let x = Tensor::from_slice(&random(2, m * 4), (m, 4), &Device::Cpu).unwrap();
        check_gradient(&x, |x| coupling(&identity, x, &target, &points, 0.5), 1e-6);
        check_gradient(&x, |x| coupling(&identity, &target, x, &points, 0.5), 1e-6);
    }
}
