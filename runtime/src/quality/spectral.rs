//! Measures of the functional map of a point map.

use super::SPECTRAL_K;
use crate::Matrix;
use crate::fmap::{FmapError, functional_map_of, multiply, scale_free_eigenvalues};
use crate::point_map::PointMap;
use crate::spectral::Eigenbasis;

pub(super) struct Spectral {
    pub(super) commutativity: f64,
    pub(super) orthogonality: f64,
}

pub(super) fn measure(
    map: &PointMap,
    source: &Eigenbasis,
    target: &Eigenbasis,
) -> Result<Spectral, FmapError> {
    let k = SPECTRAL_K.min(source.k()).min(target.k());
    let (source, target) = (source.truncated(k), target.truncated(k));
    let c = functional_map_of(map, &source, &target)?;
    let commutativity = commutativity(&c, &scale_free_eigenvalues(&source), &scale_free_eigenvalues(&target));
    Ok(Spectral { commutativity, orthogonality: orthogonality(&c) })
}

/// `sum (mu_i - lambda_j)^2 C_ij^2 / sum (mu_i^2 + lambda_j^2) C_ij^2` of `C`, `[k_target, k_source]`; 1 for a `C`
/// without entries beyond the constants.
fn commutativity(c: &Matrix, lambda: &[f64], mu: &[f64]) -> f64 {
    let (mut apart, mut whole) = (0.0, 0.0);
    for (i, mu) in mu.iter().enumerate() {
        for (lambda, entry) in lambda.iter().zip(c.row(i)) {
            apart += (mu - lambda).powi(2) * entry * entry;
            whole += (mu * mu + lambda * lambda) * entry * entry;
        }
    }
    if whole > 0.0 { apart / whole } else { 1.0 }
}

/// `|C C^T - I|^2 / k`.
fn orthogonality(c: &Matrix) -> f64 {
    let gram = multiply(c.as_faer(), c.as_faer().transpose());
    let k = gram.rows();
    let off = |i: usize, j: usize| (gram[(i, j)] - f64::from(u8::from(i == j))).powi(2);
    (0..k).map(|i| (0..k).map(|j| off(i, j)).sum::<f64>()).sum::<f64>() / k as f64
}
