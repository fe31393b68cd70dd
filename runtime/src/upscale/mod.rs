//! From the map of two decimated shapes to the map of the full ones (the paper's section "Upscaling").
//!
//! Every vertex of the decimated source gives a match between two vertices of the full shapes. The functional map of
//! the full shapes that agrees best with these matches, [`l21_functional_map`], is then read off at every vertex by
//! nearest neighbour, [`full_point_map`]. The l2,1 norm lets wrong matches stay wrong instead of bending the map
//! towards them.

mod interpolate;
mod l21_admm;
mod least_squares;

pub use l21_admm::{AdmmInfo, AdmmOptions, UpscaleError, l21_functional_map};
pub use least_squares::least_squares_functional_map;

use crate::Matrix;
use crate::point_map::{PointMap, RecoverError, check_shape, recover_transported, transport};
use crate::spectral::Eigenbasis;

/// The values of the eigenfunctions at the matched vertices, `[m, k_source]` and `[m, k_target]`.
///
/// `matches` are pairs (source vertex, target vertex). Row `j` holds the Fourier coefficients of the delta function at
/// match `j`. A delta is given unit mass, so its coefficients are `phi(x_j)` without the vertex's area: the area of a
/// single vertex is an accident of the tessellation, and every match shall count the same.
///
/// # Panics
/// If a match names a vertex that does not exist.
pub fn delta_coefficients(
    basis_source: &Eigenbasis,
    basis_target: &Eigenbasis,
    matches: &[(u32, u32)],
) -> (Matrix, Matrix) {
    let (sources, targets): (Vec<u32>, Vec<u32>) = matches.iter().copied().unzip();
    (basis_source.eigenvectors.select_rows(&sources), basis_target.eigenvectors.select_rows(&targets))
}

/// The point map of the full shapes, of a functional map `c`, `[k_target, k_source]`, of theirs and the matches that
/// it was found from.
///
/// For each source vertex `x` the target vertex whose row of `psi` is nearest to `C phi(x)` plus what `C` misses at
/// the matches near `x`, as far as these are right. The paper does without the latter; then the map of the full
/// shapes is as smooth as `k` eigenfunctions, and worse than that of the decimated ones. `vertices` are the positions
/// of the source, `[n_source, 3]`; `matches` are pairs (source vertex, target vertex). The confidence is the cosine
/// of the angle between what is compared.
///
/// # Errors
/// If `c` or `vertices` does not fit the bases, a match names a vertex that does not exist, or an entry of `c` or a
/// basis is not finite.
pub fn full_point_map(
    c: &Matrix,
    basis_source: &Eigenbasis,
    basis_target: &Eigenbasis,
    vertices: &[[f64; 3]],
    matches: &[(u32, u32)],
) -> Result<PointMap, RecoverError> {
    check_shape(c, basis_source, basis_target)?;
    let (n_source, n_target) = (basis_source.n(), basis_target.n());
    if vertices.len() != n_source {
        return Err(RecoverError::VertexCount { found: vertices.len(), expected: n_source });
    }
    let outside = |&(s, t): &(u32, u32)| s as usize >= n_source || t as usize >= n_target;
    if let Some(index) = matches.iter().position(outside) {
        let (source_vertex, target_vertex) = matches[index];
        return Err(RecoverError::MatchOutOfRange {
            index,
            source_vertex,
            target_vertex,
            n_source,
            n_target,
        });
    }
    let (phi, psi) = (&basis_source.eigenvectors, &basis_target.eigenvectors);
    let mut transported = transport(phi, c);
    interpolate::add_residuals(&mut transported, phi, psi, vertices, matches);
    recover_transported(&transported, basis_target)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fmap::test_basis::{identity, rectangle};

    #[test]
    fn what_does_not_fit_the_bases_is_an_error() {
        let basis = rectangle(5, 6, 8);
        let vertices: Vec<[f64; 3]> = (0..30).map(|i| [f64::from(i % 5), f64::from(i / 5), 0.0]).collect();
        let map = |c: &Matrix, vertices: &[[f64; 3]], matches: &[(u32, u32)]| {
            full_point_map(c, &basis, &basis, vertices, matches)
        };
        let c = identity(8);
        assert_eq!(map(&c, &vertices, &[(0, 0), (29, 29)]).unwrap().targets, Vec::from_iter(0..30));
        let error = map(&identity(7), &vertices, &[]).unwrap_err();
        assert!(matches!(error, RecoverError::ShapeMismatch { rows: 7, .. }), "{error}");
        let error = map(&c, &vertices[1..], &[]).unwrap_err();
        assert_eq!(error, RecoverError::VertexCount { found: 29, expected: 30 });
        for wrong in [(30, 0), (0, 30)] {
            let error = map(&c, &vertices, &[(0, 0), wrong]).unwrap_err();
            assert!(matches!(error, RecoverError::MatchOutOfRange { index: 1, .. }), "{error}");
        }
    }
}
