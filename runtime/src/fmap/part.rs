//! The functional map from a part of a shape to the whole.

use super::{FmapError, FmapInfo, regularized};
use crate::Matrix;

/// The functional map `C`, `[k_target, k_source]`, where the source is a part of the target.
///
/// A function on the whole restricts to the part, but a function on the part says nothing of the rest: of the two
/// directions only the one from the target to the source, `C' G^ = F^`, is an equation that holds (Rodola et al.
/// 2017, *Partial functional correspondence*). It is solved with [`regularized`], and its transpose takes the delta
/// function at a point of the part to the one at its match.
///
/// `f_hat` is `[k_source, q]`, `g_hat` `[k_target, q]`. The eigenvalues, `[k_source]` and `[k_target]`, must be in
/// one unit ([`crate::spectral::Eigenbasis::in_unit`]): the mask then is slanted by itself, as a part has fewer
/// eigenvalues below any bound than the whole. The figures of [`FmapInfo`] are those of that solve, its residual
/// `||C' G^ - F^|| / ||F^||`. Errors as in [`regularized`].
pub fn part(
    f_hat: &Matrix,
    g_hat: &Matrix,
    eigenvalues_source: &[f64],
    eigenvalues_target: &[f64],
    weight: f64,
) -> Result<(Matrix, FmapInfo), FmapError> {
    let (back, info) = regularized(g_hat, f_hat, eigenvalues_target, eigenvalues_source, weight)?;
    Ok((back.transposed(), info))
}
