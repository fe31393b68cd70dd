//! The functional map with the resolvent mask.

use super::dense::ThinSvd;
use super::{FmapError, FmapInfo, check_length, check_system, dense, relative_residual};
use crate::Matrix;
use crate::spectral::Eigenbasis;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::{factor, solve};
use faer::{Mat, Par};
use rayon::prelude::*;

/// Exponent of the normalised eigenvalues in the resolvent.
const RESOLVENT_EXPONENT: f64 = 0.5;
/// Singular values of a row's system below this share of the largest count as zero where its Cholesky factor
/// fails.
const SINGULAR: f64 = 1e-12;

/// Eigenvalues times the area of the shape, `[k]`: pure numbers, the same for a shape at any scale.
pub fn scale_free_eigenvalues(basis: &Eigenbasis) -> Vec<f64> {
    let area: f64 = basis.mass.iter().sum();
    basis.eigenvalues.iter().map(|eigenvalue| eigenvalue * area).collect()
}

/// The resolvent mask `D`, `[k_target, k_source]` (Ren et al. 2019, "Structured regularization of functional
/// map computations").
///
/// Entry `(i, j)` tells how far apart the resolvents of the two Laplacians are at target eigenvalue `i` and
/// source eigenvalue `j`, and so how little a map that commutes with the Laplacians would use it: with `g =
/// (lambda / s)^0.5`, `s` the largest of all eigenvalues, `D = (re_i - re_j)^2 + (im_i - im_j)^2`, where `re
/// = g / (g^2 + 1)`, `im = 1 / (g^2 + 1)`. Entries lie between 0 and 1/2.
///
/// The eigenvalues are `[k_source]` and `[k_target]`. The mask does not change when both shapes are scaled together. To let
/// shapes of different size match, pass eigenvalues times area, as [`scale_free_eigenvalues`] gives them. Eigenvalues below
/// zero, which are rounded zeros, count as zero.
pub fn resolvent_mask(eigenvalues_source: &[f64], eigenvalues_target: &[f64]) -> Matrix {
    let largest = eigenvalues_source.iter().chain(eigenvalues_target).copied().fold(0.0, f64::max);
    let scale = if largest > 0.0 { largest } else { 1.0 };
    let resolvent = |eigenvalue: &f64| {
        let g = (eigenvalue.max(0.0) / scale).powf(RESOLVENT_EXPONENT);
        let denominator = g * g + 1.0;
        (g / denominator, 1.0 / denominator)
    };
    let source: Vec<(f64, f64)> = eigenvalues_source.iter().map(resolvent).collect();
    let target: Vec<(f64, f64)> = eigenvalues_target.iter().map(resolvent).collect();
    Matrix::from_fn(target.len(), source.len(), |i, j| {
        let (re, im) = (target[i].0 - source[j].0, target[i].1 - source[j].1);
        re * re + im * im
    })
}

/// The map `C`, `[k_target, k_source]`, that minimises `||C F^ - G^||_F^2 + weight d sum_ij D_ij C_ij^2`,
/// with the [`resolvent_mask`] `D`, `d` the mean diagonal of `F^ F^T` and `weight` 0 or more.
///
/// `f_hat` is `[k_source, q]`, `g_hat` `[k_target, q]`; the eigenvalues, `[k_source]` and `[k_target]`,
/// should be [`scale_free_eigenvalues`]. The rows of `C` are independent: row `i` solves `(F^ F^T + weight d
/// diag(D_i)) c_i = F^ g_i` by a Cholesky factorisation of its own. A row whose system is singular gets the
/// solution of least norm, and [`FmapInfo::rank`] tells.
///
/// # Errors
/// If the matrices are empty, not finite or of different width, a list of eigenvalues has another length, or the weight is
/// negative or not finite.
pub fn regularized(
    f_hat: &Matrix,
    g_hat: &Matrix,
    eigenvalues_source: &[f64],
    eigenvalues_target: &[f64],
    weight: f64,
) -> Result<(Matrix, FmapInfo), FmapError> {
    check_system(f_hat, g_hat)?;
    check_length("the source's list of eigenvalues", eigenvalues_source.len(), f_hat.rows())?;
    check_length("the target's list of eigenvalues", eigenvalues_target.len(), g_hat.rows())?;
    if !(weight.is_finite() && weight >= 0.0) {
        return Err(FmapError::BadWeight { weight });
    }
    let k_source = f_hat.rows();
    let gram = dense::multiply(f_hat.as_faer(), f_hat.as_faer().transpose()); // [k_source, k_source]
    let mean_diagonal = (0..k_source).map(|i| gram[(i, i)]).sum::<f64>() / k_source as f64;
    let mask = resolvent_mask(eigenvalues_source, eigenvalues_target);
    let mut c = dense::multiply(g_hat.as_faer(), f_hat.as_faer().transpose()); // right-hand sides, then rows of C

    let rows: Vec<RowInfo> = c
        .data_mut()
        .par_chunks_mut(k_source)
        .enumerate()
        .map_init(
            || RowSolver::new(k_source),
            |solver, (i, row)| solver.solve(&gram, mask.row(i), weight * mean_diagonal, row),
        )
        .collect::<Result<_, _>>()?;
    let rank = rows.iter().map(|row| row.rank).min().unwrap_or(0);
    let condition = rows.iter().map(|row| row.condition).fold(1.0, f64::max);
    let relative_residual = relative_residual(&c, f_hat, g_hat);
    Ok((c, FmapInfo { rank, condition, relative_residual }))
}

struct RowInfo {
    rank: usize,
    condition: f64,
}

/// The workspace for one row's system.
struct RowSolver {
    system: Mat<f64>,
    buffer: MemBuffer,
}

impl RowSolver {
    fn new(k: usize) -> Self {
        let scratch = factor::cholesky_in_place_scratch::<f64>(k, Par::Seq, Default::default())
            .or(solve::solve_in_place_scratch::<f64>(k, 1, Par::Seq));
        Self { system: Mat::zeros(k, k), buffer: MemBuffer::new(scratch) }
    }

    /// Replaces the right-hand side `row` by the solution of `(gram + weight diag(mask)) x = row`.
    fn solve(
        &mut self,
        gram: &Matrix,
        mask: &[f64],
        weight: f64,
        row: &mut [f64],
    ) -> Result<RowInfo, FmapError> {
        self.assemble(gram, mask, weight);
        let k = row.len();
        let stack = MemStack::new(&mut self.buffer);
        let factored = factor::cholesky_in_place(
            self.system.as_mut(),
            Default::default(),
            Par::Seq,
            stack,
            Default::default(),
        );
        let pivots = || (0..k).map(|i| self.system[(i, i)]);
        let (largest, smallest) = (pivots().fold(0.0, f64::max), pivots().fold(f64::INFINITY, f64::min));
        if factored.is_ok() && smallest > SINGULAR.sqrt() * largest {
            let rhs = faer::MatMut::from_column_major_slice_mut(row, k, 1);
            solve::solve_in_place(self.system.as_ref(), rhs, Par::Seq, stack);
            return Ok(RowInfo { rank: k, condition: (largest / smallest).powi(2) });
        }
        self.assemble(gram, mask, weight);
        self.solve_singular(row)
    }

    fn assemble(&mut self, gram: &Matrix, mask: &[f64], weight: f64) {
        self.system.copy_from(gram.as_faer());
        for (i, &entry) in mask.iter().enumerate() {
            self.system[(i, i)] += weight * entry;
        }
    }

    /// The solution of least norm, by the singular value decomposition.
    fn solve_singular(&self, row: &mut [f64]) -> Result<RowInfo, FmapError> {
        let k = row.len();
        let ThinSvd { u, s, v } = dense::thin_svd(self.system.as_ref())?;
        let rank = s.iter().take_while(|&&x| x > SINGULAR * s[0]).count();
        let right = Matrix::from_vec(k, 1, row.to_vec());
        let mut coefficients = dense::multiply(u.transpose(), right.as_faer());
        for (j, x) in coefficients.data_mut().iter_mut().enumerate() {
            *x = if j < rank { *x / s[j] } else { 0.0 };
        }
        row.copy_from_slice(dense::multiply(v.as_ref(), coefficients.as_faer()).data());
        let condition = if s[k - 1] > 0.0 { s[0] / s[k - 1] } else { f64::INFINITY };
        Ok(RowInfo { rank, condition })
    }
}
