//! Wavelet refinement (Hu, Li, Liu et al. 2021, "Efficient deformable shape correspondence via multiscale spectral
//! manifold wavelets preservation").
//!
//! A map that preserves distances takes wavelets to wavelets, at every scale. Each round asks that of a functional
//! map `C`: with the filters `g_s` of all scales, `C~ = sum_s g_s(mu) C g_s(lambda)` entry by entry, see [`bands`].
//! Entries between functions of unlike frequency fade, the more the farther apart they are, and with them what a
//! wrong match brings in.

mod bands;
mod by_samples;
mod part;
mod sampled;

use super::zoomout::least_squares_map;
use super::{RefineError, check_bases};
use crate::Matrix;
use crate::fmap::{BothMaps, functional_map_of, scale_free_eigenvalues};
use crate::mesh::Mesh;
use crate::point_map::search::AlongEdges;
use crate::point_map::{Embedding, PointMap};
use crate::spectral::Eigenbasis;
use bands::filter_mask;

pub use part::wavelet_of_part;

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
    /// One after the other. At least one; default 3 rounds at 60 eigenfunctions, 2 at 128, 3 at 200.
    pub stages: Vec<WaveletStage>,
}

/// What else is known of a pair.
#[derive(Clone, Copy, Debug, Default)]
pub struct WaveletHints<'a> {
    /// Columns beside the embedding's rows, of source and target, `[n, a]` each, which count in every distance:
    /// descriptors, or landmarks.
    pub anchors: Option<&'a [Matrix; 2]>,
    /// The meshes that the bases are of, source and target. With them, if they have many vertices, rounds match
    /// samples only, five for each eigenfunction and 1000 or more, and the last round all vertices, along the edges.
    /// Without them, rounds search through all vertices.
    pub meshes: Option<[&'a Mesh; 2]>,
}

const COARSE_TO_FINE: [WaveletStage; 3] = [
    WaveletStage { k: 60, rounds: 3 },
    WaveletStage { k: 128, rounds: 2 },
    WaveletStage { k: 200, rounds: 3 },
];

impl Default for WaveletOptions {
    fn default() -> Self {
        Self::coarse_to_fine(200, 200)
    }
}

impl WaveletOptions {
    /// From 60 eigenfunctions, or `k_start` if that is fewer, up to `k_max`: 3 rounds at 60, 2 at 128, 3 at 200. For
    /// a start of which the rough is right; what it has of details the descriptors beside the embedding keep.
    pub fn coarse_to_fine(k_start: usize, k_max: usize) -> Self {
        let mut stages: Vec<WaveletStage> =
            COARSE_TO_FINE.into_iter().filter(|stage| stage.k < k_max).collect();
        if k_start < COARSE_TO_FINE[0].k.min(k_max) {
            stages.insert(0, WaveletStage { k: k_start, ..COARSE_TO_FINE[0] });
        }
        let rounds = COARSE_TO_FINE[if stages.is_empty() { 0 } else { COARSE_TO_FINE.len() - 1 }].rounds;
        stages.push(WaveletStage { k: k_max, rounds });
        Self { stages }
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
    pub embedding: Embedding<f32>,
    /// What the refinement did.
    pub info: Info,
}

/// Refines the point maps of both directions between whole shapes, `[source to target, target to source]`, by
/// alternating between them and their filtered functional maps while the number of eigenfunctions grows.
///
/// A round takes the functional maps that the point maps pull functions back by, `C12 = Psi^T A_target Phi[T21]` and
/// `C21 = Phi^T A_source Psi[T12]`, filters both, and matches every vertex anew in their
/// [`crate::point_map::Embedding`]. The bases must be at unit area ([`Eigenbasis::at_unit_area`]). Vertices without a
/// match have one afterwards. The confidence of a match is the cosine of the angle between the two rows of the
/// embedding.
///
/// With the meshes, or between small shapes, matches are found in single precision; the functional maps that are
/// returned are in double precision.
///
/// # Errors
/// If an option is out of range, a basis has no eigenfunctions, a map, a mesh or the anchors do not fit the
/// bases, a map matches nothing, or an entry of a basis is not finite.
pub fn wavelet(
    maps: [&PointMap; 2],
    basis_source: &Eigenbasis,
    basis_target: &Eigenbasis,
    hints: WaveletHints,
    options: &WaveletOptions,
) -> Result<RefinedBoth<WaveletInfo>, RefineError> {
    let bases = [basis_source, basis_target];
    let k = options.stages.iter().map(|stage| stage.k).max().unwrap_or(1);
    check_hints(hints, bases)?;
    let edges =
        hints.meshes.map(|meshes| AlongEdges::new(meshes, k.min(basis_source.k()).min(basis_target.k())));
    wavelet_along(maps, bases, hints.anchors, edges.as_ref(), options)
}

/// As [`wavelet()`], where the edges of the meshes are known; of the maps no more is needed than the matches of their
/// samples.
pub(crate) fn wavelet_along(
    maps: [&PointMap; 2],
    bases: [&Eigenbasis; 2],
    anchors: Option<&[Matrix; 2]>,
    edges: Option<&AlongEdges>,
    options: &WaveletOptions,
) -> Result<RefinedBoth<WaveletInfo>, RefineError> {
    check(options)?;
    check_bases(bases[0], bases[1])?;
    check_anchors(anchors, bases)?;
    for (map, [from, to]) in maps.into_iter().zip([bases, [bases[1], bases[0]]]) {
        // Checks the whole point map, whatever the first round will use of it.
        functional_map_of(map, &from.truncated(1), &to.truncated(1))?;
        if map.targets.iter().all(|&target| target == PointMap::UNMATCHED) {
            return Err(RefineError::NothingMatched);
        }
    }
    let ks = rounds(&options.stages, bases[0].k().min(bases[1].k()));
    let of_samples =
        edges.filter(|edges| edges.pays()).and_then(|edges| Some((edges, edges.images_of_samples(maps)?)));
    let (functional_maps, embedding, matches) = match of_samples {
        Some((edges, images)) => by_samples::refine(images, bases, anchors, edges, &ks)?,
        None => refine_everywhere(maps, bases, anchors, &ks)?,
    };
    let [map, map_back] = embedding.point_maps(matches);
    Ok(RefinedBoth { map, map_back, functional_maps, embedding, info: WaveletInfo { rounds: ks } })
}

/// What rounds lead to: the last functional maps, their embedding, and the matches in it.
type Found = (BothMaps, Embedding<f32>, [Vec<u32>; 2]);

/// Rounds in which every vertex is matched anew among all of the other shape.
fn refine_everywhere(
    maps: [&PointMap; 2],
    bases: [&Eigenbasis; 2],
    anchors: Option<&[Matrix; 2]>,
    ks: &[usize],
) -> Result<Found, RefineError> {
    let round = |images: [&[u32]; 2], k: usize| -> Result<Found, RefineError> {
        let bases = bases.map(|basis| basis.truncated(k));
        let functional_maps = filtered_maps(images, &bases)?;
        let (forth, back) = (&functional_maps.forth, &functional_maps.back);
        let embedding = Embedding::joint_beside(forth, back, bases.each_ref(), anchors)?;
        let matches = embedding.matches()?;
        Ok((functional_maps, embedding.single(), matches))
    };
    let mut found = round(maps.map(|map| &map.targets[..]), ks[0])?;
    for &k in &ks[1..] {
        found = round(found.2.each_ref().map(|images| &images[..]), k)?;
    }
    Ok(found)
}

/// The filtered functional maps, `[k, k]`, of a pair of point maps.
fn filtered_maps(
    [forth, back]: [&[u32]; 2],
    [source, target]: &[Eigenbasis; 2],
) -> Result<BothMaps, RefineError> {
    let (c12, c21) = rayon::join(|| pull_back(back, target, source), || pull_back(forth, source, target));
    let mask = filter_mask(&scale_free_eigenvalues(source), &scale_free_eigenvalues(target));
    Ok(filtered(&mask, &c12?, &c21?))
}

/// What the filter leaves of functional maps forth and back; the mask is that of maps forth, `[k_target, k_source]`.
fn filtered(mask: &Matrix, forth: &Matrix, back: &Matrix) -> BothMaps {
    BothMaps {
        forth: Matrix::from_fn(forth.rows(), forth.cols(), |i, j| mask[(i, j)] * forth[(i, j)]),
        back: Matrix::from_fn(back.rows(), back.cols(), |i, j| mask[(j, i)] * back[(i, j)]),
    }
}

/// The functional map by which a point map `T` pulls functions back from the other shape, `[k, k_other]`:
/// `Phi^T A Psi[T]`; where vertices have no match, the `C` that minimises `sum_x A_x |C^T phi(x) - psi(T(x))|^2` over
/// those that have one.
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

fn check_hints(hints: WaveletHints, [source, target]: [&Eigenbasis; 2]) -> Result<(), RefineError> {
    let (n_source, n_target) = (source.n(), target.n());
    match hints.meshes.map(|meshes| meshes.map(|mesh| mesh.n_vertices())) {
        Some(found) if found != [n_source, n_target] => {
            Err(RefineError::Meshes { found, n_source, n_target })
        }
        _ => Ok(()),
    }
}

fn check_anchors(anchors: Option<&[Matrix; 2]>, bases: [&Eigenbasis; 2]) -> Result<(), RefineError> {
    let [n_source, n_target] = bases.map(Eigenbasis::n);
    if let Some([a, b]) = anchors
        && ([a.rows(), b.rows()] != [n_source, n_target] || a.cols() != b.cols())
    {
        let found = [a.rows(), a.cols(), b.rows(), b.cols()];
        return Err(RefineError::Descriptors { found, n_source, n_target });
    }
    Ok(())
}

fn check(options: &WaveletOptions) -> Result<(), RefineError> {
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
