//! One system a row: `(F F^T + weight d diag(D_i)) c_i = F g_i`.

use super::FmLayerError;
use super::least_squares::Factor;
use faer::Mat;
use rayon::prelude::*;

/// Factors the systems of all rows; `mask` is `weight d D` `[k_target, k_source]`, row-major.
///
/// The mask leaves entries free whose eigenvalues are equal. Where the descriptors say nothing of them either, as of functions on
/// stray pieces of a scan that no point was drawn from, the system is singular and its pseudo-inverse is taken.
pub(super) fn factor_rows(
    system: &Mat<f64>,
    mask: &[f64],
    max_condition: f64,
) -> Result<Vec<Factor>, FmLayerError> {
    let k = system.nrows();
    mask.par_chunks(k)
        .map(|mask| {
            let assemble = || {
                let mut system = system.clone();
                for (j, &value) in mask.iter().enumerate() {
                    system[(j, j)] += value;
                }
                system
            };
            let factor = Factor::cholesky(assemble()).filter(|f| f.condition() <= max_condition);
            factor
                .or_else(|| Factor::pseudo_inverse(assemble().as_ref(), max_condition))
                .ok_or(FmLayerError::NotFinite)
        })
        .collect()
}
