//! Exact nearest neighbours between the rows of two matrices.
//!
//! The rows of a spectral embedding lie on a surface in `R^k`, and the search lives off that. The targets are
//! cut into small leaves by bisection; each leaf stores its centre, its radius, a basis of the few directions
//! in which it extends, and for each point the coordinates in that basis and the norm of what is left over.
//! For a query `q` with coordinates `b` and remainder norm `w` in a leaf, every point `p` of the leaf with
//! coordinates `a` and remainder norm `e` satisfies
//!
//! `|q - p|^2 >= |b - a|^2 + max(0, w - e)^2`,
//!
//! which is tight because surfaces are locally flat (`e` is small), and stays tight for queries far off the
//! surface, where a bound by balls fails: the distance `w` to the surface is common to all candidates and
//! cancels. The bound is taken first for a ball around the leaf, then for the leaf's box, then for each
//! point; what survives is decided by the distance itself. Bounds are computed in `f32` and loosened by more
//! than their rounding error; distances in `f64`, summed in one fixed order. The answer is therefore that of
//! a plain double loop, for any number of threads.

mod along_edges;
mod bisect;
mod kernels;
mod leaves;
mod mutual;
mod query;

use crate::Matrix;
use crate::numeric::{Real, vectorized};
pub(crate) use along_edges::AlongEdges;
use bisect::Partition;
use kernels::Kernels;
use leaves::Leaves;
pub(crate) use mutual::{Rows, mutual_nearest, squared_norms};
use thiserror::Error;

/// For each query, the nearest target.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Nearest {
    /// Row of the nearest target, `[n_queries]`; of several equally near ones the lowest.
    pub index: Vec<u32>,
    /// Squared Euclidean distance to it, `[n_queries]`.
    pub squared_distance: Vec<f64>,
}

/// Why a nearest neighbour search is not possible.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SearchError {
    /// There is no target to be near to.
    #[error("there are no target rows to search among; give a target of at least one vertex")]
    NoTargets,
    /// More targets than a 32-bit index can name.
    #[error("{n_targets} target rows are more than the {} supported; decimate the target", u32::MAX - 1)]
    TooManyTargets {
        /// How many target rows there are.
        n_targets: usize,
    },
    /// Queries and targets are points of different spaces.
    #[error("queries have {queries} columns but targets have {targets}; both need the same embedding")]
    WidthMismatch {
        /// Columns of the queries.
        queries: usize,
        /// Columns of the targets.
        targets: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error(
        "row {row} of the {role} has an entry that is not finite; check the functional map and the eigenbasis"
    )]
    NotFinite {
        /// `queries` or `targets`.
        role: &'static str,
        /// The row, 0-based.
        row: usize,
    },
}

/// Targets prepared for many nearest neighbour queries.
///
/// Keeps about 1.8 times the memory of the targets.
pub struct NearestRows {
    partition: Partition,
    /// The targets in the order of the partition, `[n, d]`.
    points: Matrix,
    /// Factor, a power of two, that brings targets near unit length before they are rounded to `f32`.
    scale: f64,
    leaves: Leaves,
    kernels: Kernels,
}

impl NearestRows {
    /// Prepares `targets`, `[n_targets, d]`.
    ///
    /// # Errors
    /// If there are no targets, more than 32 bits can name, or an entry is not finite.
    pub fn new(targets: &Matrix) -> Result<Self, SearchError> {
        let n_targets = targets.rows();
        if n_targets == 0 {
            return Err(SearchError::NoTargets);
        }
        if n_targets >= u32::MAX as usize {
            return Err(SearchError::TooManyTargets { n_targets });
        }
        check_finite(targets, "targets")?;
        let kernels = Kernels::detect();
        let partition = Partition::new(targets, leaf_size(n_targets), kernels);
        let points = targets.select_rows(&partition.order);
        let scale = unit_scale(&points);
        let leaves = Leaves::new(&points, &partition, scale, kernels);
        Ok(Self { partition, points, scale, leaves, kernels })
    }

    /// Number of columns `d` of targets and queries.
    pub fn width(&self) -> usize {
        self.points.cols()
    }

    /// For every row of `queries`, `[n_queries, d]`, the nearest target by Euclidean distance.
    ///
    /// # Errors
    /// If the width is not that of the targets, or an entry is not finite.
    pub fn nearest(&self, queries: &Matrix) -> Result<Nearest, SearchError> {
        if queries.cols() != self.width() {
            return Err(SearchError::WidthMismatch { queries: queries.cols(), targets: self.width() });
        }
        check_finite(queries, "queries")?;
        Ok(query::nearest(self, queries))
    }
}

/// For every row of `queries`, `[n_queries, d]`, the nearest row of `targets`, `[n_targets, d]`.
///
/// Exact, ties go to the lowest index, the same for any number of threads.
///
/// # Errors
/// As [`NearestRows::new`] and [`NearestRows::nearest`].
pub fn nearest_rows(queries: &Matrix, targets: &Matrix) -> Result<Nearest, SearchError> {
    NearestRows::new(targets)?.nearest(queries)
}

/// The squared Euclidean distance of two vectors of one length.
pub(crate) fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    Kernels::detect().squared_distance(a, b)
}

/// The squared Euclidean distance of two vectors of one length, in single precision.
pub(crate) fn squared_distance_single(a: &[f32], b: &[f32]) -> f32 {
    Kernels::detect().squared_distance_single(a, b)
}

/// The inner product of two vectors of one length, in single precision.
pub(crate) fn inner_product(a: &[f32], b: &[f32]) -> f32 {
    let mut product = [0.0];
    Kernels::detect().inner_products(a, b, &mut product);
    product[0]
}

/// Points in a leaf, at most, and queries in a block: the cost of looking at all leaves falls with it, the
/// cost of looking into those that are not excluded grows.
fn leaf_size(n_targets: usize) -> usize {
    (((n_targets as f64).sqrt() / 3.0) as usize).clamp(24, 160)
}

/// The power of two that brings the longest row near unit length.
fn unit_scale(points: &Matrix) -> f64 {
    let longest =
        (0..points.rows()).map(|i| points.row(i).iter().map(|x| x * x).sum::<f64>()).fold(0.0, f64::max);
    let exponent = longest.sqrt().log2();
    if exponent.is_finite() { (-exponent.ceil().clamp(-1000.0, 1000.0)).exp2() } else { 1.0 }
}

fn check_finite<T: Real>(rows: &Matrix<T>, role: &'static str) -> Result<(), SearchError> {
    if vectorized(|| all_finite(rows.data())) {
        return Ok(());
    }
    match rows.data().iter().position(|&x| !x.to_double().is_finite()) {
        Some(entry) => Err(SearchError::NotFinite { role, row: entry / rows.cols() }),
        None => Ok(()),
    }
}

/// Whether no number is NaN or infinite: zero times such a one is NaN, and stays so in a sum.
#[inline(always)]
fn all_finite<T: Real>(numbers: &[T]) -> bool {
    let (chunks, rest) = numbers.as_chunks::<32>();
    let mut sums = [T::ZERO; 32];
    for chunk in chunks {
        for (sum, &number) in sums.iter_mut().zip(chunk) {
            *sum += number * T::ZERO;
        }
    }
    rest.iter().for_each(|&number| sums[0] += number * T::ZERO);
    sums.iter().all(|&sum| sum == T::ZERO)
}

#[cfg(test)]
mod tests;
