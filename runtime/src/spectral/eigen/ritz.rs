//! Dense symmetric eigenproblems, and Ritz pairs from them.

use super::panel::{BLOCK, Square};
use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{ComputeEigenvectors, self_adjoint_evd, self_adjoint_evd_scratch};
use faer::{Mat, MatRef, Par};

/// Eigenvalues of a symmetric matrix, ascending, and its eigenvectors as columns; `None` where the iteration
/// fails.
pub(super) fn symmetric_eigen(a: MatRef<'_, f64>) -> Option<(Vec<f64>, Mat<f64>)> {
    let n = a.nrows();
    let mut values = Diag::<f64>::zeros(n);
    let mut vectors = Mat::<f64>::zeros(n, n);
    let scratch = self_adjoint_evd_scratch::<f64>(n, ComputeEigenvectors::Yes, Par::Seq, Default::default());
    let mut memory = MemBuffer::try_new(scratch).ok()?;
    self_adjoint_evd(
        a,
        values.as_mut(),
        Some(vectors.as_mut()),
        Par::Seq,
        MemStack::new(&mut memory),
        Default::default(),
    )
    .ok()?;
    Some((values.column_vector().iter().copied().collect(), vectors))
}

/// Ritz pairs of the filtered operator, largest first.
pub(super) struct RitzPairs {
    pub(super) values: Vec<f64>,
    /// In coordinates of the subspace, one column each.
    pub(super) vectors: Mat<f64>,
    /// What the operator adds outside the subspace: coefficients on the next block, `[BLOCK, pairs]`.
    pub(super) outside: Mat<f64>,
}

impl RitzPairs {
    /// From the projected operator `t` and the coupling of its last block to the next one.
    pub(super) fn new(t: MatRef<'_, f64>, coupling: &Square) -> Option<Self> {
        let m = t.nrows();
        let (ascending, vectors) = symmetric_eigen(t)?;
        let vectors = Mat::from_fn(m, m, |i, j| vectors[(i, m - 1 - j)]);
        let outside = Mat::from_fn(BLOCK, m, |i, j| {
            (0..BLOCK).map(|l| coupling[i][l] * vectors[(m - BLOCK + l, j)]).sum()
        });
        Some(Self { values: ascending.into_iter().rev().collect(), vectors, outside })
    }

    /// Residual of pair `j` relative to its value.
    pub(super) fn residual(&self, j: usize) -> f64 {
        let norm = (0..BLOCK).map(|i| self.outside[(i, j)].powi(2)).sum::<f64>().sqrt();
        norm / self.values[j].abs().max(f64::MIN_POSITIVE)
    }
}
