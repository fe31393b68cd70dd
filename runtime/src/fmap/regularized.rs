//! The functional map with the resolvent mask.

use super::factor::Factor;
use super::{FmapError, FmapInfo, check_length, check_system, dense, relative_residual};
use crate::Matrix;
use crate::spectral::Eigenbasis;
use faer::MatMut;
use rayon::prelude::*;

/// Exponent of the normalised eigenvalues in the resolvent.
const RESOLVENT_EXPONENT: f64 = 0.5;

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
/// The eigenvalues are `[k_source]` and `[k_target]`. The mask does not change when both shapes are scaled together.
/// To let shapes of different size match, pass eigenvalues times area, as [`scale_free_eigenvalues`] gives them.
/// Eigenvalues below zero, which are rounded zeros, count as zero.
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
/// If the matrices are empty, not finite or of different width, a list of eigenvalues has another length, or the
/// weight is negative or not finite.
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
    let mask = resolvent_mask(eigenvalues_source, eigenvalues_target);
    check_mask(f_hat, g_hat, &mask, weight)?;
    let (c, info, _) = solve_rows(f_hat, g_hat, &mask, weight, drop)?;
    Ok((c, info))
}

/// Checks the mask of a system that is checked already.
pub(super) fn check_mask(
    f_hat: &Matrix,
    g_hat: &Matrix,
    mask: &Matrix,
    weight: f64,
) -> Result<(), FmapError> {
    check_length("a row of the mask", mask.cols(), f_hat.rows())?;
    check_length("a column of the mask", mask.rows(), g_hat.rows())?;
    if weight.is_finite() && weight >= 0.0 { Ok(()) } else { Err(FmapError::BadWeight { weight }) }
}

/// Solves the system of each row of `C`, and gives what `keep` makes of its factor.
pub(super) fn solve_rows<T: Send>(
    f_hat: &Matrix,
    g_hat: &Matrix,
    mask: &Matrix,
    weight: f64,
    keep: impl Fn(Factor) -> T + Sync,
) -> Result<(Matrix, FmapInfo, Vec<T>), FmapError> {
    let k_source = f_hat.rows();
    let gram = dense::multiply(f_hat.as_faer(), f_hat.as_faer().transpose()); // [k_source, k_source]
    let mean_diagonal = (0..k_source).map(|i| gram[(i, i)]).sum::<f64>() / k_source as f64;
    let mut c = dense::multiply(g_hat.as_faer(), f_hat.as_faer().transpose()); // right-hand sides, then rows of C
    let solve = |(i, row): (usize, &mut [f64])| {
        let mut system = gram.as_faer().to_owned();
        for (j, &entry) in mask.row(i).iter().enumerate() {
            system[(j, j)] += weight * mean_diagonal * entry;
        }
        let factor = Factor::new(system)?;
        factor.solve(MatMut::from_column_major_slice_mut(row, k_source, 1));
        let (rank, condition) = (factor.rank(), factor.condition());
        Ok((rank, condition, keep(factor)))
    };
    let rows: Vec<(usize, f64, T)> =
        c.data_mut().par_chunks_mut(k_source).enumerate().map(solve).collect::<Result<_, FmapError>>()?;
    let rank = rows.iter().map(|row| row.0).min().unwrap_or(0);
    let condition = rows.iter().map(|row| row.1).fold(1.0, f64::max);
    let info = FmapInfo { rank, condition, relative_residual: relative_residual(&c, f_hat, g_hat) };
    Ok((c, info, rows.into_iter().map(|row| row.2).collect()))
}
