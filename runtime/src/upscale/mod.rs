//! From the map of two decimated shapes to the map of the full ones (the paper's section "Upscaling").
//!
//! Every vertex of the decimated source gives a match between two vertices of the full shapes. The functional map of the
//! full shapes that agrees best with these matches, [`l21_functional_map`], is then read off at every vertex by nearest
//! neighbour, [`full_point_map`]. The l2,1 norm lets wrong matches stay wrong instead of bending the map towards them.

mod interpolate;
mod l21_admm;
mod least_squares;

pub use l21_admm::{AdmmInfo, AdmmOptions, UpscaleError, l21_functional_map};
pub use least_squares::least_squares_functional_map;

use crate::Matrix;
use crate::point_map::{PointMap, RecoverError, recover_transported, transport};
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

/// The point map of the full shapes, of a functional map `c`, `[k_target, k_source]`, of theirs and the matches that it was found from.
///
/// For each source vertex `x` the target vertex whose row of `psi` is nearest to `C phi(x)` plus what `C` misses at the
/// matches near `x`, as far as these are right. The paper does without the latter; then the map of the full shapes is as
/// smooth as `k` eigenfunctions, and worse than that of the decimated ones. `vertices` are the positions of the source,
/// `[n_source, 3]`; `matches` are pairs (source vertex, target vertex). The confidence is the cosine of the angle between
/// what is compared.
///
/// # Errors
/// If an entry of `c` or a basis is not finite.
///
/// # Panics
/// If `c` or `vertices` does not fit the bases, or a match names a vertex that does not exist.
pub fn full_point_map(
    c: &Matrix,
    basis_source: &Eigenbasis,
    basis_target: &Eigenbasis,
    vertices: &[[f64; 3]],
    matches: &[(u32, u32)],
) -> Result<PointMap, RecoverError> {
    let (phi, psi) = (&basis_source.eigenvectors, &basis_target.eigenvectors);
    let mut transported = transport(phi, c);
    interpolate::add_residuals(&mut transported, phi, psi, vertices, matches);
    recover_transported(&transported, basis_target)
}
