//! One system a row: `(F F^T + weight d diag(D_i)) c_i = F g_i`.

use super::FmLayerError;
use super::least_squares::Factor;
use faer::Mat;
use rayon::prelude::*;

/// Factors the systems of all rows; `mask` is `weight d D` `[k_target, k_source]`, row-major.
pub(super) fn factor_rows(
    system: &Mat<f64>,
    mask: &[f64],
    condition: f64,
) -> Result<Vec<Factor>, FmLayerError> {
    let k = system.nrows();
    mask.par_chunks(k)
        .enumerate()
        .map(|(row, mask)| {
            let mut system = system.clone();
            for (j, &value) in mask.iter().enumerate() {
                system[(j, j)] += value;
            }
            Factor::cholesky(system).ok_or(FmLayerError::NotPositiveDefinite { row, condition })
        })
        .collect()
}
