//! Wavelet refinement (Hu, Li, Liu et al. 2021, "Efficient deformable shape correspondence via multiscale spectral manifold
//! wavelets preservation").
//!
//! A map that preserves distances takes wavelets to wavelets, at every scale. Each round asks that of a functional map `C`:
//! with the filters `g_s` of all scales, `C~ = sum_s g_s(mu) C g_s(lambda)` entry by entry, see [`bands`]. Entries between
//! functions of unlike frequency fade, the more the farther apart they are, and with them what a wrong match brings in.

mod bands;

use super::zoomout::least_squares_map;
use super::{RefineError, check_bases};
use crate::Matrix;
use crate::fmap::{BothMaps, functional_map_of, scale_free_eigenvalues};
use crate::point_map::{Comparison, Embedding, PointMap};
use crate::spectral::Eigenbasis;
use bands::filter_mask;

/// Rounds at one number of eigenfunctions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WaveletStage {
    /// Eigenfunctions of each shape, 1 and up; fewer where a basis has fewer.
    pub k: usize,
    /// Rounds, 1 and up.
    pub rounds: usize,
}

/// Options of [`wavelet`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct WaveletOptions {
    /// One after the other. At least one; default 5 rounds at 200 eigenfunctions.
    pub stages: Vec<WaveletStage>,
    /// Columns beside the embedding's rows, of source and target, `[n, a]` each, which count in every distance: what is known
    /// beforehand, such as landmarks. Default none.
    pub anchors: Option<Box<[Matrix; 2]>>,
    /// Whether the source is a part of the target, which is refused: a part has no map back from all of the target. Default
    /// false.
    pub part: bool,
}

const COARSE_TO_FINE: [WaveletStage; 3] = [
    WaveletStage { k: 60, rounds: 5 },
    WaveletStage { k: 128, rounds: 3 },
    WaveletStage { k: 200, rounds: 2 },
];

impl Default for WaveletOptions {
    fn default() -> Self {
        Self::at(200)
    }
}

impl WaveletOptions {
    /// Five rounds at `k` eigenfunctions: for a start that is right up to details.
    pub fn at(k: usize) -> Self {
        Self { stages: vec![WaveletStage { k, rounds: 5 }], anchors: None, part: false }
    }

    /// From 60 eigenfunctions, or `k_start` if that is fewer, up to `k_max`: 5 rounds at 60, 3 at 128, 2 at 200. For a start of
    /// which only the rough is right; what it has of details gets lost.
    pub fn coarse_to_fine(k_start: usize, k_max: usize) -> Self {
        let mut stages: Vec<WaveletStage> =
            COARSE_TO_FINE.into_iter().filter(|stage| stage.k < k_max).collect();
        if k_start < COARSE_TO_FINE[0].k.min(k_max) {
            stages.insert(0, WaveletStage { k: k_start, ..COARSE_TO_FINE[0] });
        }
        let rounds = COARSE_TO_FINE[if stages.is_empty() { 0 } else { COARSE_TO_FINE.len() - 1 }].rounds;
        stages.push(WaveletStage { k: k_max, rounds });
        Self { stages, anchors: None, part: false }
    }
}

/// What [`wavelet`] did.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WaveletInfo {
    /// The number of eigenfunctions in each round.
    pub rounds: Vec<usize>,
}

/// The maps of both directions, refined together.
#[derive(Clone, Debug, PartialEq)]
pub struct RefinedBoth<Info> {
    /// The point map from the source to the target, with confidences.
    pub map: PointMap,
    /// The point map from the target to the source, with confidences.
    pub map_back: PointMap,
    /// The functional maps that they were recovered from.
    pub functional_maps: BothMaps,
    /// The embedding in which the vertices were compared.
    pub embedding: Embedding,
    /// What the refinement did.
    pub info: Info,
}

/// Refines the point maps of both directions, `[source to target, target to source]`, by alternating between them and their
/// filtered functional maps while the number of eigenfunctions grows.
///
/// A round takes the functional maps that the point maps pull functions back by, `C12 = Psi^T A_target Phi[T21]` and
/// `C21 = Phi^T A_source Psi[T12]`, filters both, and matches every vertex anew in their [`crate::point_map::Embedding`]. The bases must be
/// at unit area ([`Eigenbasis::at_unit_area`]). Vertices without a match have one afterwards. The confidence of a match is the
/// cosine of the angle between the two rows of the embedding.
///
/// Distances are compared in single precision where the shapes are small, as [`crate::point_map::Embedding::both`] does.
///
/// # Errors
/// If an option is out of range, the source is a part, a basis has no eigenfunctions, a map or the anchors do not fit the
/// bases, a map matches nothing, or an entry of a basis is not finite.
pub fn wavelet(
    maps: [&PointMap; 2],
    basis_source: &Eigenbasis,
    basis_target: &Eigenbasis,
    options: &WaveletOptions,
) -> Result<RefinedBoth<WaveletInfo>, RefineError> {
    check(options)?;
    check_bases(basis_source, basis_target)?;
    check_anchors(options, basis_source.n(), basis_target.n())?;
    let bases = [basis_source, basis_target];
    for (map, [from, to]) in maps.into_iter().zip([bases, [basis_target, basis_source]]) {
        // Checks the whole point map, whatever the first round will use of it.
        functional_map_of(map, &from.truncated(1), &to.truncated(1))?;
        if map.targets.iter().all(|&target| target == PointMap::UNMATCHED) {
            return Err(RefineError::NothingMatched);
        }
    }
    let rounds = rounds(&options.stages, basis_source.k().min(basis_target.k()));
    let last = rounds.len() - 1;
    let mut images = maps.map(|map| map.targets.clone());
    let mut truncated = bases.map(|basis| basis.truncated(rounds[0]));
    for &k in &rounds[..last] {
        let maps = filtered_maps(&images, &mut truncated, bases, k)?;
        images = embedding(&maps, &truncated, options)?.matches()?;
    }
    let functional_maps = filtered_maps(&images, &mut truncated, bases, rounds[last])?;
    let embedding = embedding(&functional_maps, &truncated, options)?;
    let [map, map_back] = embedding.both()?;
    Ok(RefinedBoth { map, map_back, functional_maps, embedding, info: WaveletInfo { rounds } })
}

/// Anchors have a row for each vertex, of one width.
fn check_anchors(options: &WaveletOptions, n_source: usize, n_target: usize) -> Result<(), RefineError> {
    let Some([source, target]) = options.anchors.as_deref() else { return Ok(()) };
    let found = [source.rows(), source.cols(), target.rows(), target.cols()];
    match found == [n_source, target.cols(), n_target, source.cols()] {
        true => Ok(()),
        false => Err(RefineError::Descriptors { found, n_source, n_target }),
    }
}

fn embedding(
    maps: &BothMaps,
    [source, target]: &[Eigenbasis; 2],
    options: &WaveletOptions,
) -> Result<Embedding, RefineError> {
    let embedding = maps.embedding(Comparison::Joint, source, target)?;
    Ok(match options.anchors.as_deref() {
        Some([of_source, of_target]) => embedding.with_columns(of_source, of_target),
        None => embedding,
    })
}

/// The filtered functional maps, `[k, k]`, of a pair of point maps, between bases that are cut to `k` where they are not.
fn filtered_maps(
    [forth, back]: &[Vec<u32>; 2],
    truncated: &mut [Eigenbasis; 2],
    bases: [&Eigenbasis; 2],
    k: usize,
) -> Result<BothMaps, RefineError> {
    if truncated[0].k() != k {
        *truncated = bases.map(|basis| basis.truncated(k));
    }
    let [source, target] = &*truncated;
    let (c12, c21) = rayon::join(|| pull_back(back, target, source), || pull_back(forth, source, target));
    let mask = filter_mask(&scale_free_eigenvalues(source), &scale_free_eigenvalues(target));
    let filtered = |c: &Matrix, weight: &dyn Fn(usize, usize) -> f64| {
        Matrix::from_fn(k, k, |i, j| weight(i, j) * c[(i, j)])
    };
    Ok(BothMaps { forth: filtered(&c12?, &|i, j| mask[(i, j)]), back: filtered(&c21?, &|i, j| mask[(j, i)]) })
}

/// The functional map by which a point map `T` pulls functions back from the other shape, `[k, k_other]`: `Phi^T A Psi[T]`; where
/// vertices have no match, the `C` that minimises `sum_x A_x |C^T phi(x) - psi(T(x))|^2` over those that have one.
fn pull_back(images: &[u32], basis: &Eigenbasis, other: &Eigenbasis) -> Result<Matrix, RefineError> {
    let known = (0..images.len()).filter(|&x| images[x] != PointMap::UNMATCHED);
    let matched: Vec<u32> = known.map(|x| x as u32).collect();
    if matched.len() == images.len() {
        let map = PointMap::new(images.to_vec(), other.n());
        return Ok(functional_map_of(&map, basis, other)?.transposed());
    }
    let weighted = |of: &Eigenbasis, rows: &[u32]| {
        let mut weighted = of.eigenvectors.select_rows(rows);
        for (i, &x) in matched.iter().enumerate() {
            let weight = basis.mass[x as usize].sqrt();
            weighted.row_mut(i).iter_mut().for_each(|value| *value *= weight);
        }
        weighted
    };
    let found: Vec<u32> = matched.iter().map(|&x| images[x as usize]).collect();
    Ok(least_squares_map(&weighted(basis, &matched), &weighted(other, &found))?.transposed())
}

/// The number of eigenfunctions of each round.
fn rounds(stages: &[WaveletStage], k_available: usize) -> Vec<usize> {
    let of_stage = |stage: &WaveletStage| std::iter::repeat_n(stage.k.min(k_available), stage.rounds);
    stages.iter().flat_map(of_stage).collect()
}

fn check(options: &WaveletOptions) -> Result<(), RefineError> {
    if options.part {
        return Err(RefineError::Part { method: "the wavelet filter" });
    }
    let least = |option, value| match value {
        0 => Err(RefineError::Option { option, value, range: "at least 1".to_string() }),
        _ => Ok(()),
    };
    least("the number of stages", options.stages.len())?;
    for stage in &options.stages {
        least("k of a stage", stage.k)?;
        least("rounds of a stage", stage.rounds)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
