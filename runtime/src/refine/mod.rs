//! Refinement of a map: spectral ICP, ZoomOut, the wavelet filter, the product manifold filter.

mod icp;
mod pmf;
mod sampling;
mod wavelet;
mod zoomout;

use crate::Matrix;
use crate::fmap::FmapError;
use crate::point_map::{Comparison, Embedding, PointMap, RecoverError, search::SearchError};
use crate::spectral::Eigenbasis;
use thiserror::Error;

pub use icp::{IcpInfo, IcpOptions, icp};
pub use pmf::{PmfHints, PmfInfo, PmfOptions, pmf};
pub use wavelet::{
    RefinedBoth, WaveletHints, WaveletInfo, WaveletOptions, WaveletStage, wavelet, wavelet_of_part,
};
pub use zoomout::{ZoomOutInfo, ZoomOutOptions, ZoomOutSamples, zoomout};

pub(crate) use wavelet::wavelet_along;

/// A refined map.
#[derive(Clone, Debug, PartialEq)]
pub struct Refined<Info> {
    /// The point map from the source to the target, with confidences.
    pub map: PointMap,
    /// The functional map it was recovered from, `[k_target, k_source]`.
    pub functional_map: Matrix,
    /// What the refinement did.
    pub info: Info,
}

/// Why a map cannot be refined.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum RefineError {
    /// An option is out of its range.
    #[error("{option} is {value}, but must be {range}")]
    Option {
        /// The option.
        option: &'static str,
        /// Its value.
        value: usize,
        /// The values allowed.
        range: String,
    },
    /// An option that is a real number is out of its range.
    #[error("{option} is {value}, but must be {range}")]
    RealOption {
        /// The option.
        option: &'static str,
        /// Its value.
        value: f64,
        /// The values allowed.
        range: String,
    },
    /// The descriptors are not those of the two shapes, or of different width.
    #[error(
        "descriptors are [{}, {}] and [{}, {}], but the shapes have {n_source} and {n_target} vertices; give those of \
         both shapes, of one width",
        found[0], found[1], found[2], found[3]
    )]
    Descriptors {
        /// Rows and columns of the source's, then of the target's.
        found: [usize; 4],
        /// Vertices of the source.
        n_source: usize,
        /// Vertices of the target.
        n_target: usize,
    },
    /// The meshes are not those of the bases.
    #[error(
        "meshes of {} and {} vertices for bases of {n_source} and {n_target} vertices; give the meshes that the bases are of",
        found[0], found[1]
    )]
    Meshes {
        /// Vertices of the source's mesh and of the target's.
        found: [usize; 2],
        /// Vertices of the source's basis.
        n_source: usize,
        /// Vertices of the target's basis.
        n_target: usize,
    },
    /// A basis has no eigenfunctions.
    #[error("the {side} has no eigenfunctions; compute its eigenbasis with k of at least 1")]
    NoEigenfunctions {
        /// `source` or `target`.
        side: &'static str,
    },
    /// Not one source vertex has a match to start from.
    #[error("no source vertex is matched; refinement improves a map, it cannot start without one")]
    NothingMatched,
    /// The functional map of an intermediate point map cannot be computed.
    #[error(transparent)]
    Fmap(#[from] FmapError),
    /// The point map of an intermediate functional map cannot be recovered.
    #[error(transparent)]
    Recover(#[from] RecoverError),
    /// The nearest neighbour search failed.
    #[error(transparent)]
    Search(#[from] SearchError),
}

/// Checks that both bases have eigenfunctions.
fn check_bases(basis_source: &Eigenbasis, basis_target: &Eigenbasis) -> Result<(), RefineError> {
    match [("source", basis_source), ("target", basis_target)].into_iter().find(|(_, basis)| basis.k() == 0) {
        Some((side, _)) => Err(RefineError::NoEigenfunctions { side }),
        None => Ok(()),
    }
}

/// The embedding of a functional map, `[k_target, k_source]`, and its adjoint, in as many eigenfunctions of each
/// shape, of which a part has fewer; with columns beside the rows, where there are any.
pub(crate) fn adjoint_embedding(
    c: &Matrix,
    basis_source: &Eigenbasis,
    basis_target: &Eigenbasis,
    columns: Option<&[Matrix; 2]>,
) -> Result<Embedding, RecoverError> {
    let (source, target) = (basis_source.truncated(c.cols()), basis_target.truncated(c.rows()));
    let embedding = Embedding::of_one(Comparison::Adjoint, c, &source, &target)?;
    Ok(match columns {
        Some([of_source, of_target]) => embedding.with_columns(of_source, of_target),
        None => embedding,
    })
}

/// How many eigenfunctions of a part belong to `k` of its whole: as many fewer as its area is smaller, as its
/// eigenvalues are spaced the wider. Bases in one unit.
fn eigenfunctions_of_part(k: usize, part: &Eigenbasis, whole: &Eigenbasis) -> usize {
    ((k as f64 * part.area() / whole.area()).round() as usize).clamp(1, k)
}

#[cfg(test)]
mod tests;
