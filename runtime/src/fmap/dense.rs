//! Single-threaded dense products and decompositions, so that results do not depend on the number of threads.

use super::FmapError;
use crate::Matrix;
use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::{factor, solve};
use faer::linalg::evd;
use faer::linalg::svd::{ComputeSvdVectors, svd, svd_scratch};
use faer::{Accum, Mat, MatRef, Par};

/// The product of two matrices.
pub(crate) fn multiply(left: MatRef<'_, f64>, right: MatRef<'_, f64>) -> Matrix {
    let mut product = Matrix::zeros(left.nrows(), right.ncols());
    faer::linalg::matmul::matmul(product.as_faer_mut(), Accum::Replace, left, right, 1.0, Par::Seq);
    product
}

/// The thin singular value decomposition `A = U diag(s) V^T` of an `[m, n]` matrix, `r = min(m, n)`.
#[derive(Clone, Debug)]
pub(crate) struct ThinSvd {
    /// `[m, r]`.
    pub(crate) u: Mat<f64>,
    /// Descending, `[r]`.
    pub(crate) s: Vec<f64>,
    /// `[n, r]`.
    pub(crate) v: Mat<f64>,
}

/// The thin singular value decomposition of `matrix`.
pub(crate) fn thin_svd(matrix: MatRef<'_, f64>) -> Result<ThinSvd, FmapError> {
    let (rows, cols) = matrix.shape();
    let size = rows.min(cols);
    let (mut u, mut v) = (Mat::zeros(rows, size), Mat::zeros(cols, size));
    let mut s = Diag::zeros(size);
    let thin = ComputeSvdVectors::Thin;
    let scratch = svd_scratch::<f64>(rows, cols, thin, thin, Par::Seq, Default::default());
    svd(
        matrix,
        s.as_mut(),
        Some(u.as_mut()),
        Some(v.as_mut()),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Default::default(),
    )
    .map_err(|_| FmapError::NoConvergence { rows, cols })?;
    let s = s.column_vector().iter().copied().collect();
    Ok(ThinSvd { u, s, v })
}

/// Largest over smallest eigenvalue of a symmetric positive semi-definite `[k, k]` matrix; infinite where it is
/// singular.
pub(super) fn condition(gram: &Matrix) -> Result<f64, FmapError> {
    let k = gram.rows();
    let mut values = Diag::<f64>::zeros(k);
    let vectors = evd::ComputeEigenvectors::No;
    let scratch = evd::self_adjoint_evd_scratch::<f64>(k, vectors, Par::Seq, Default::default());
    let mut memory = MemBuffer::new(scratch);
    let stack = MemStack::new(&mut memory);
    evd::self_adjoint_evd(gram.as_faer(), values.as_mut(), None, Par::Seq, stack, Default::default())
        .map_err(|_| FmapError::NoConvergence { rows: k, cols: k })?;
    let values = values.column_vector();
    Ok(if values[0] > 0.0 { values[k - 1] / values[0] } else { f64::INFINITY })
}

/// The solution of `gram X = right` for a positive definite `gram`, `[k, k]`; `None` where it is singular to
/// working precision.
pub(crate) fn solve_positive_definite(gram: &Matrix, right: &Matrix) -> Option<Matrix> {
    let k = gram.rows();
    let scratch = factor::cholesky_in_place_scratch::<f64>(k, Par::Seq, Default::default())
        .or(solve::solve_in_place_scratch::<f64>(k, right.cols(), Par::Seq));
    let mut buffer = MemBuffer::new(scratch);
    let stack = MemStack::new(&mut buffer);
    let mut lower = gram.as_faer().to_owned();
    factor::cholesky_in_place(lower.as_mut(), Default::default(), Par::Seq, stack, Default::default())
        .ok()?;
    let pivots = || (0..k).map(|i| lower[(i, i)]);
    if pivots().fold(f64::INFINITY, f64::min) <= 1e-6 * pivots().fold(0.0, f64::max) {
        return None;
    }
    let mut solution = right.as_faer().to_owned();
    solve::solve_in_place(lower.as_ref(), solution.as_mut(), Par::Seq, stack);
    Some(Matrix::from_fn(k, right.cols(), |i, j| solution[(i, j)]))
}
