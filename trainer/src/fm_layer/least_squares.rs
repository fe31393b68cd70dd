//! `C = G F^T (F F^T + ridge)^-1` and its adjoint.

use super::FmLayerError;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::{Mat, MatMut, MatRef, Par, Side};

/// A symmetric positive (semi-)definite `[k, k]` system, ready to be solved.
pub(super) enum Factor {
    /// The lower Cholesky factor.
    Cholesky(Mat<f64>),
    /// The truncated pseudo-inverse.
    PseudoInverse(Mat<f64>),
}

impl Factor {
    /// Factors `system` by Cholesky's method, or says that it is not positive definite.
    pub(super) fn cholesky(mut system: Mat<f64>) -> Option<Self> {
        let scratch =
            llt::factor::cholesky_in_place_scratch::<f64>(system.nrows(), Par::Seq, Default::default());
        let mut memory = MemBuffer::new(scratch);
        let stack = MemStack::new(&mut memory);
        llt::factor::cholesky_in_place(
            system.as_mut(),
            Default::default(),
            Par::Seq,
            stack,
            Default::default(),
        )
        .ok()?;
        Some(Self::Cholesky(system))
    }

    /// The pseudo-inverse of `system` without the eigenvalues below the largest over `max_condition`.
    pub(super) fn pseudo_inverse(system: MatRef<'_, f64>, max_condition: f64) -> Option<Self> {
        let eigen = system.self_adjoint_eigen(Side::Lower).ok()?;
        let (values, vectors) = (eigen.S().column_vector(), eigen.U());
        let k = system.nrows();
        let threshold = values[k - 1] / max_condition;
        let scaled =
            Mat::from_fn(k, k, |i, j| if values[j] > threshold { vectors[(i, j)] / values[j] } else { 0.0 });
        let mut inverse = Mat::zeros(k, k);
        multiply(inverse.as_mut(), scaled.as_ref(), vectors.transpose());
        Some(Self::PseudoInverse(inverse))
    }

    /// A lower bound of the condition number, from the pivots; 1 for a pseudo-inverse.
    pub(super) fn condition(&self) -> f64 {
        let Self::Cholesky(factor) = self else { return 1.0 };
        let pivots = || (0..factor.nrows()).map(|i| factor[(i, i)]);
        (pivots().fold(0.0, f64::max) / pivots().fold(f64::INFINITY, f64::min)).powi(2)
    }

    /// Replaces every column of `rhs` `[k, m]` by its solution.
    pub(super) fn solve(&self, mut rhs: MatMut<'_, f64>) {
        match self {
            Self::Cholesky(factor) => {
                let mut memory = MemBuffer::new(llt::solve::solve_in_place_scratch::<f64>(
                    factor.nrows(),
                    rhs.ncols(),
                    Par::Seq,
                ));
                llt::solve::solve_in_place(factor.as_ref(), rhs, Par::Seq, MemStack::new(&mut memory));
            }
            Self::PseudoInverse(inverse) => {
                let copy = rhs.to_owned();
                multiply(rhs.as_mut(), inverse.as_ref(), copy.as_ref());
            }
        }
    }
}

/// `dst = lhs rhs` on one thread.
pub(super) fn multiply(dst: MatMut<'_, f64>, lhs: MatRef<'_, f64>, rhs: MatRef<'_, f64>) {
    faer::linalg::matmul::matmul(dst, faer::Accum::Replace, lhs, rhs, 1.0, Par::Seq);
}

/// Factors `system = F F^T` with the guard against bad conditioning.
pub(super) fn factor_guarded(
    mut system: Mat<f64>,
    ridge: f64,
    max_condition: f64,
    condition: f64,
) -> Result<Factor, FmLayerError> {
    let k = system.nrows();
    let shift = ridge * (0..k).map(|i| system[(i, i)]).sum::<f64>() / k as f64;
    for i in 0..k {
        system[(i, i)] += shift;
    }
    // The ridge bounds the condition number by about k / ridge.
    let well_conditioned = condition <= max_condition || ridge * max_condition > k as f64;
    if well_conditioned && let Some(factor) = Factor::cholesky(system.clone()) {
        return Ok(factor);
    }
    Factor::pseudo_inverse(system.as_ref(), max_condition).ok_or(FmLayerError::NotFinite)
}
