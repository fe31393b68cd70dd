//! The functional map of the paper: plain least squares.

use super::dense::ThinSvd;
use super::factor::Factor;
use super::{FmapError, FmapInfo, check_system, dense, relative_residual};
use crate::Matrix;

/// Options of [`least_squares`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LeastSquaresOptions {
    /// Singular values of `F^` below this share of the largest count as zero. Range 0 to 1, default 1e-6:
    /// descriptors are single precision, so what lies near their rounding says nothing about the shape.
    pub relative_threshold: f64,
}

impl Default for LeastSquaresOptions {
    fn default() -> Self {
        Self { relative_threshold: 1e-6 }
    }
}

/// `C = G^ F^+`, `[k_target, k_source]`, which minimises `||C F^ - G^||_F` (Litany et al. 2017, eq. 2).
///
/// `f_hat` is `[k_source, q]`, `g_hat` `[k_target, q]`. The pseudo-inverse is taken through the singular
/// values of `F^`, not through the normal equations, which would square its condition number. Directions
/// below [`LeastSquaresOptions::relative_threshold`] are left out, so that with dependent or too few
/// descriptors (`q < k_source`) the result is the solution of least norm; [`FmapInfo::rank`] tells.
///
/// # Errors
/// If the matrices are empty, not finite or of different width, or the decomposition does not converge.
pub fn least_squares(
    f_hat: &Matrix,
    g_hat: &Matrix,
    options: &LeastSquaresOptions,
) -> Result<(Matrix, FmapInfo), FmapError> {
    check_system(f_hat, g_hat)?;
    let (c, info, _) = solve_least_squares(f_hat, g_hat, options)?;
    Ok((c, info))
}

/// The solve of a system that is checked already, and the factor of `F^ F^T`.
pub(super) fn solve_least_squares(
    f_hat: &Matrix,
    g_hat: &Matrix,
    options: &LeastSquaresOptions,
) -> Result<(Matrix, FmapInfo, Factor), FmapError> {
    let ThinSvd { u, s, v } = dense::thin_svd(f_hat.as_faer())?;
    let rank = s.iter().take_while(|&&x| x > 0.0 && x >= options.relative_threshold * s[0]).count();
    // G^ V S^+ U^T
    let mut projected = dense::multiply(g_hat.as_faer(), v.as_ref());
    for i in 0..projected.rows() {
        for (j, x) in projected.row_mut(i).iter_mut().enumerate() {
            *x = if j < rank { *x / s[j] } else { 0.0 };
        }
    }
    let c = dense::multiply(projected.as_faer(), u.transpose());
    let smallest = if s.len() < f_hat.rows() { 0.0 } else { s[s.len() - 1] };
    let condition = if smallest > 0.0 { s[0] / smallest } else { f64::INFINITY };
    let relative_residual = relative_residual(&c, f_hat, g_hat);
    // F^ F^T = U S^2 U^T
    let gram = ThinSvd { v: u.clone(), s: s.iter().map(|x| x * x).collect(), u };
    Ok((c, FmapInfo { rank, condition, relative_residual }, Factor::Truncated(gram, rank)))
}
