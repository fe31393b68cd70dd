//! The mask that regularises the functional map.

/// The resolvent mask `[k_target, k_source]`, row-major (Ren et al. 2019, "Structured regularization of functional map
/// computations"): with `g = sqrt(eigenvalue / largest)` on both shapes,
/// `re = g_t / (g_t^2 + 1) - g_s / (g_s^2 + 1)`, `im = 1 / (g_t^2 + 1) - 1 / (g_s^2 + 1)`, `D = re^2 + im^2`.
///
/// It does not depend on the scale of the shapes as long as both have the same area.
pub fn resolvent_mask(eigenvalues_source: &[f64], eigenvalues_target: &[f64]) -> Vec<f64> {
    let largest =
        eigenvalues_source.iter().chain(eigenvalues_target).copied().fold(f64::MIN_POSITIVE, f64::max);
    let resolvent = |&value: &f64| {
        let squared = (value / largest).max(0.0);
        (squared.sqrt() / (squared + 1.0), 1.0 / (squared + 1.0))
    };
    let source: Vec<_> = eigenvalues_source.iter().map(resolvent).collect();
    let target: Vec<_> = eigenvalues_target.iter().map(resolvent).collect();
    let entry = |t: &(f64, f64), s: &(f64, f64)| (t.0 - s.0).powi(2) + (t.1 - s.1).powi(2);
    target.iter().flat_map(|t| source.iter().map(move |s| entry(t, s))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_spectra_have_a_zero_diagonal_and_a_symmetric_mask() {
        let eigenvalues: Vec<f64> = (0..6).map(|i| f64::from(i) * 12.6).collect();
        let mask = resolvent_mask(&eigenvalues, &eigenvalues);
        for i in 0..6 {
            assert_eq!(mask[i * 6 + i], 0.0);
            for j in 0..6 {
                assert_eq!(mask[i * 6 + j], mask[j * 6 + i]);
                assert!(i == j || mask[i * 6 + j] > 0.0);
            }
        }
        assert!(mask[1] < mask[2] && mask[2] < mask[5]);
    }
}
