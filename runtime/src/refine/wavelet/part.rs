//! The wavelet filter between a part and its whole.

use super::bands::filter_mask;
use super::{WaveletInfo, WaveletOptions, check, check_anchors, rounds};
use crate::Matrix;
use crate::fmap::functional_map_of;
use crate::point_map::PointMap;
use crate::refine::{RefineError, Refined, adjoint_embedding, check_bases, eigenfunctions_of_part};
use crate::spectral::Eigenbasis;

/// As [`wavelet`](super::wavelet()), of the map of a part of the target: only the direction to the whole, from which
/// alone nothing is missing.
///
/// A round takes the functional map of the point map, `C = Psi[T]^T A Phi`, `[k_target, k_source]`, filters it, and
/// gives each vertex `x` of the part the `y` of the whole for which `C^T psi(y)`, the restriction of its delta
/// function to the part, is nearest to `phi(x)`. The part takes as many fewer eigenfunctions as its area is smaller.
///
/// The bases must be in one unit ([`Eigenbasis::in_unit`]). Then the eigenvalues of both say the same of a wave's
/// length, and the filter keeps the slanted diagonal of a part's functional map (Rodola et al. 2017, *Partial
/// functional correspondence*) by itself. `anchors` are columns beside the rows of source and target, `[n, a]` each,
/// which count in every distance.
///
/// # Errors
/// If an option is out of range, a basis has no eigenfunctions, the map or the anchors do not fit the bases, the map
/// matches nothing, or an entry of a basis is not finite.
pub fn wavelet_of_part(
    map: &PointMap,
    basis_source: &Eigenbasis,
    basis_target: &Eigenbasis,
    anchors: Option<&[Matrix; 2]>,
    options: &WaveletOptions,
) -> Result<Refined<WaveletInfo>, RefineError> {
    check(options)?;
    check_bases(basis_source, basis_target)?;
    check_anchors(anchors, [basis_source, basis_target])?;
    if map.targets.iter().all(|&target| target == PointMap::UNMATCHED) {
        return Err(RefineError::NothingMatched);
    }
    let ks = rounds(&options.stages, basis_source.k().min(basis_target.k()));
    let (mut map, mut functional_map) = (map.clone(), Matrix::default());
    for &k in &ks {
        let source = basis_source.truncated(eigenfunctions_of_part(k, basis_source, basis_target));
        let target = basis_target.truncated(k);
        let mask = filter_mask(&source.eigenvalues, &target.eigenvalues);
        let c = functional_map_of(&map, &source, &target)?;
        functional_map = Matrix::from_fn(c.rows(), c.cols(), |i, j| mask[(i, j)] * c[(i, j)]);
        map = adjoint_embedding(&functional_map, basis_source, basis_target, anchors)?.forth()?;
    }
    Ok(Refined { map, functional_map, info: WaveletInfo { rounds: ks } })
}
