//! Single-threaded dense products and decompositions, so that results do not depend on the number of threads.

use super::FmapError;
use crate::Matrix;
use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::svd::{ComputeSvdVectors, svd, svd_scratch};
use faer::{Accum, Mat, MatRef, Par};

/// The product of two matrices.
pub(crate) fn multiply(left: MatRef<'_, f64>, right: MatRef<'_, f64>) -> Matrix {
    let mut product = Matrix::zeros(left.nrows(), right.ncols());
    faer::linalg::matmul::matmul(product.as_faer_mut(), Accum::Replace, left, right, 1.0, Par::Seq);
    product
}

/// The thin singular value decomposition `A = U diag(s) V^T`, `[m, r]`, `[r]` descending, `[n, r]`, `r = min(m, n)`.
pub(crate) fn thin_svd(matrix: MatRef<'_, f64>) -> Result<(Mat<f64>, Vec<f64>, Mat<f64>), FmapError> {
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
    Ok((u, s, v))
}
