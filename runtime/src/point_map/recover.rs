//! The point map of a functional map.

use super::search::{SearchError, nearest_rows};
use super::{Embedding, PointMap};
use crate::Matrix;
use crate::spectral::Eigenbasis;
use faer::{Accum, Par};
use rayon::prelude::*;
use thiserror::Error;

/// Rows of the transported embedding computed by one product.
const CHUNK: usize = 1024;

/// How a point of the source is compared with one of the target, given a functional map `C`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Comparison {
    /// The distance `|C phi(x) - psi(y)|` on the target (Ovsjanikov et al. 2012), as in the paper.
    #[default]
    Distance,
    /// The distance `|phi(x) - C^T psi(y)|` on the source, by the adjoint functional map, as in ZoomOut. A map that
    /// is blurred shortens what it transports, and a shortened query is drawn to short rows of `psi`; here the rows
    /// themselves are shortened, the query keeps its length. On FAUST pairs the mean error of the raw bidirectional
    /// maps is 1.1 instead of 1.3.
    Adjoint,
    /// The sum of both squares, in the [`super::Embedding`] of the functional maps of both directions; of one map,
    /// with its adjoint as the other.
    Joint,
}

/// Why no point map can be recovered.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum RecoverError {
    /// The functional map is not one between these bases.
    #[error(
        "the functional map is {rows} x {cols}, but the bases ask for {k_target} x {k_source} (target x source); \
         truncate the bases or check the direction of the map"
    )]
    ShapeMismatch {
        /// Rows of the functional map.
        rows: usize,
        /// Columns of the functional map.
        cols: usize,
        /// Eigenfunctions of the target.
        k_target: usize,
        /// Eigenfunctions of the source.
        k_source: usize,
    },
    /// The positions are not those of the source.
    #[error("{found} vertices for a source basis of {expected}; give those of the mesh that the basis is of")]
    VertexCount {
        /// Number of positions.
        found: usize,
        /// Vertices of the source's basis.
        expected: usize,
    },
    /// A match names a vertex that does not exist.
    #[error(
        "match {index} is of source vertex {source_vertex} and target vertex {target_vertex}, but the shapes have {n_source} \
         and {n_target} vertices (0-based); give matches between the vertices that the bases are of"
    )]
    MatchOutOfRange {
        /// The match, 0-based.
        index: usize,
        /// Its source vertex.
        source_vertex: u32,
        /// Its target vertex.
        target_vertex: u32,
        /// Vertices of the source.
        n_source: usize,
        /// Vertices of the target.
        n_target: usize,
    },
    /// The nearest neighbour search failed.
    #[error(transparent)]
    Search(#[from] SearchError),
}

/// For each source vertex `x` the target vertex `y` whose row of `Psi` is nearest to `C phi(x)` (Ovsjanikov
/// et al. 2012): the delta function at `x`, transported by `c`, `[k_target, k_source]`, looks most like the
/// one at `y`. Of equally near ones it is the lowest; every source vertex gets a match.
///
/// The confidence of a match is the cosine of the angle between `C phi(x)` and `psi(y)`, negative ones as 0:
/// it is 1 where the functional map takes the point exactly to its match, and falls where the map blurs or
/// contradicts itself.
///
/// # Errors
/// If `c` is not of that shape, or an entry of it or of a basis is not finite.
pub fn recover(
    c: &Matrix,
    basis_source: &Eigenbasis,
    basis_target: &Eigenbasis,
) -> Result<PointMap, RecoverError> {
    recover_by(Comparison::Distance, c, basis_source, basis_target)
}

/// [`recover`] with a choice of what is compared; the confidence is the cosine of the angle between what is
/// compared.
///
/// # Errors
/// As [`recover`].
pub fn recover_by(
    comparison: Comparison,
    c: &Matrix,
    basis_source: &Eigenbasis,
    basis_target: &Eigenbasis,
) -> Result<PointMap, RecoverError> {
    Embedding::of_one(comparison, c, basis_source, basis_target)?.forth()
}

/// Checks that `c` is `[k_target, k_source]`.
pub(crate) fn check_shape(
    c: &Matrix,
    basis_source: &Eigenbasis,
    basis_target: &Eigenbasis,
) -> Result<(), RecoverError> {
    let (k_target, k_source) = (basis_target.k(), basis_source.k());
    if (c.rows(), c.cols()) == (k_target, k_source) {
        return Ok(());
    }
    Err(RecoverError::ShapeMismatch { rows: c.rows(), cols: c.cols(), k_target, k_source })
}

/// For each row of `transported`, `[n_source, k_target]`, the nearest row of the target's eigenvectors.
pub(crate) fn recover_transported(
    transported: &Matrix,
    basis_target: &Eigenbasis,
) -> Result<PointMap, RecoverError> {
    let (targets, confidence) = nearest_with_cosine(transported, &basis_target.eigenvectors)?;
    Ok(PointMap { confidence: Some(confidence), ..PointMap::new(targets, basis_target.n()) })
}

/// For each query the nearest row, and the cosine of the angle between the two.
fn nearest_with_cosine(queries: &Matrix, rows: &Matrix) -> Result<(Vec<u32>, Vec<f32>), SearchError> {
    let nearest = nearest_rows(queries, rows)?.index;
    let confidence = cosines(queries, rows, &nearest);
    Ok((nearest, confidence))
}

/// The cosine of the angle between each query and its match among the rows, negative ones as 0.
pub(crate) fn cosines(queries: &Matrix, rows: &Matrix, matches: &[u32]) -> Vec<f32> {
    let cosine = |(x, &y): (usize, &u32)| {
        let (query, found) = (queries.row(x), rows.row(y as usize));
        let lengths = (dot(query, query) * dot(found, found)).sqrt();
        if lengths > 0.0 { (dot(query, found) / lengths).clamp(0.0, 1.0) as f32 } else { 0.0 }
    };
    matches.par_iter().enumerate().map(cosine).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// `Phi C^T`, `[n, k_to]`, of the eigenvectors `[n, k_from]` and a map `[k_to, k_from]`: row `x` is the delta
/// function at `x` transported.
pub(crate) fn transport(eigenvectors: &Matrix, c: &Matrix) -> Matrix {
    let mut transported = Matrix::zeros(eigenvectors.rows(), c.rows());
    let width = c.rows().max(1);
    transported.data_mut().par_chunks_mut(CHUNK * width).enumerate().for_each(|(chunk, rows)| {
        let count = rows.len() / width;
        faer::linalg::matmul::matmul(
            faer::MatMut::from_row_major_slice_mut(rows, count, c.rows()),
            Accum::Replace,
            eigenvectors.as_faer().subrows(chunk * CHUNK, count),
            c.as_faer().transpose(),
            1.0,
            Par::Seq,
        );
    });
    transported
}

#[cfg(test)]
mod tests;
