//! Functional maps: least squares, the regularised solve, soft correspondence.
//!
//! A functional map `C`, `[k_target, k_source]`, takes the Fourier coefficients of a function on the source
//! to those of the corresponding function on the target. From descriptors with coefficients `F^ = Phi^T A F`,
//! `[k_source, q]`, and `G^`, `[k_target, q]`, it is the solution of `C F^ = G^` in the sense of a
//! [`FmapSolver`].

mod adjoint;
mod both;
mod dense;
mod factor;
mod least_squares;
mod part;
mod points;
mod regularized;
mod soft;
mod solution;

use crate::Matrix;
use crate::point_map::Comparison;
use crate::spectral::Eigenbasis;
use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use adjoint::functional_map_of;
pub use both::{BothMaps, bidirectional, both_maps, functional_maps};
pub(crate) use factor::Factor;
pub use least_squares::{LeastSquaresOptions, least_squares};
pub use part::part;
pub use points::{from_points, pseudo_inverse};
pub use regularized::{regularized, resolvent_mask, scale_free_eigenvalues};
pub use soft::{ColumnNorm, SoftCorrespondence, SoftPeak};
pub use solution::FmapSolution;

pub(crate) use both::mean_with_transpose;
pub(crate) use dense::{multiply, solve_positive_definite, thin_svd};

/// How a functional map is computed from descriptors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum FmapSolver {
    /// The paper's: all coefficients by least squares, [`least_squares`].
    LeastSquares,
    /// With the resolvent mask, which asks the map to commute with the Laplacians, [`regularized`].
    Regularized {
        /// Weight of the mask, relative to the mean diagonal of `F^ F^T`. Range 0 (plain least squares)
        /// upwards, default [`FmapSolver::DEFAULT_MASK_WEIGHT`]. A stronger mask, 1.0, helps across different
        /// connectivities.
        weight: f64,
    },
    /// The mean of the regularised solves of both directions, [`bidirectional`]. Models of earlier versions call it
    /// `two-way`.
    #[serde(alias = "two-way")]
    Bidirectional {
        /// Weight of the mask in each solve. Range 0 upwards, default [`FmapSolver::BIDIRECTIONAL_WEIGHT`].
        weight: f64,
    },
    /// The regularised solves of both directions, both kept, [`functional_maps`]: vertices are compared in the
    /// [`crate::point_map::Embedding`].
    Joint {
        /// Weight of the mask in each solve. Range 0 upwards, default [`FmapSolver::DEFAULT_MASK_WEIGHT`].
        weight: f64,
    },
    /// For a source that is a part of the target, with bases in one unit: the transpose of the regularised solve from
    /// the whole to the part, [`part`].
    Part {
        /// Weight of the mask. Range 0 upwards, default [`FmapSolver::DEFAULT_MASK_WEIGHT`].
        weight: f64,
    },
}

impl FmapSolver {
    /// The weight of the mask that models are trained with.
    pub const DEFAULT_MASK_WEIGHT: f64 = 0.1;
    /// The weight of the mask where the mean of both directions is taken.
    pub const BIDIRECTIONAL_WEIGHT: f64 = 0.03;
    /// The weight of the mask for a part, by models whose maps of wholes are joint: on parts of dogs 1 to 30 are
    /// alike after the wavelet filter, and raw maps are worse at 0.1.
    pub const PART_WEIGHT: f64 = 1.0;

    /// What to match with, given what the network was trained with: both directions where it was the regularised
    /// solve. The paper's least squares stay what they are.
    pub fn for_matching(self) -> Self {
        match self {
            Self::Regularized { .. } => Self::Bidirectional { weight: Self::BIDIRECTIONAL_WEIGHT },
            other => other,
        }
    }
}

impl FmapSolver {
    /// What to match a part with, given what was asked for, if anything, and what suits wholes: of two directions
    /// only one holds there.
    pub fn for_part(chosen: Option<Self>, of_wholes: Self) -> Self {
        match (chosen, of_wholes) {
            (None, Self::Joint { .. }) => Self::Part { weight: Self::PART_WEIGHT },
            (None, _) => Self::Part { weight: Self::DEFAULT_MASK_WEIGHT },
            (Some(Self::Bidirectional { weight } | Self::Joint { weight }), _) => Self::Part { weight },
            (Some(other), _) => other,
        }
    }

    /// The same with so many times the weight of the mask, where it has one.
    pub(crate) fn with_mask(mut self, times: f64) -> Self {
        match &mut self {
            Self::LeastSquares => {}
            Self::Regularized { weight }
            | Self::Bidirectional { weight }
            | Self::Joint { weight }
            | Self::Part { weight } => *weight *= times,
        }
        self
    }

    /// How points are compared by the maps that [`functional_maps`] gives for this solver.
    pub fn comparison(self) -> Comparison {
        match self {
            Self::Bidirectional { .. } => Comparison::Adjoint,
            Self::Joint { .. } => Comparison::Joint,
            Self::LeastSquares | Self::Regularized { .. } | Self::Part { .. } => Comparison::Distance,
        }
    }
}

impl Default for FmapSolver {
    /// What networks are trained with: the regularised solve.
    fn default() -> Self {
        Self::new(SolverKind::Regularized, None)
    }
}

/// The kinds of [`FmapSolver`], without their settings, as on command lines and in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum SolverKind {
    /// The paper's: all coefficients by least squares.
    LeastSquares,
    /// With the resolvent mask, from the source to the target.
    Regularized,
    /// With the resolvent mask, the mean of both directions.
    #[serde(alias = "two-way")]
    #[cfg_attr(feature = "cli", value(alias = "two-way"))]
    Bidirectional,
    /// With the resolvent mask, both directions beside each other.
    Joint,
    /// With the resolvent mask, from the target to the source, which is a part of it.
    Part,
}

impl FmapSolver {
    /// The solver of a kind with a weight of the mask, by default that of the kind.
    pub fn new(kind: SolverKind, mask_weight: Option<f64>) -> Self {
        let weight = |default| mask_weight.unwrap_or(default);
        match kind {
            SolverKind::LeastSquares => Self::LeastSquares,
            SolverKind::Regularized => Self::Regularized { weight: weight(Self::DEFAULT_MASK_WEIGHT) },
            SolverKind::Bidirectional => Self::Bidirectional { weight: weight(Self::BIDIRECTIONAL_WEIGHT) },
            SolverKind::Joint => Self::Joint { weight: weight(Self::DEFAULT_MASK_WEIGHT) },
            SolverKind::Part => Self::Part { weight: weight(Self::DEFAULT_MASK_WEIGHT) },
        }
    }

    /// The solver that was asked for, by kind, weight of the mask or both; a weight alone means the bidirectional one.
    pub fn chosen(kind: Option<SolverKind>, mask_weight: Option<f64>) -> Option<Self> {
        let kind = kind.or(mask_weight.map(|_| SolverKind::Bidirectional))?;
        Some(Self::new(kind, mask_weight))
    }
}

/// What a solve found.
#[derive(Clone, Debug, PartialEq)]
pub struct FmapInfo {
    /// Number of independent directions kept in the worst conditioned system, at most the number of eigenfunctions on
    /// the side solved from: `k_source`, for a part `k_target`, for both directions the smaller.
    pub rank: usize,
    /// Condition number of what was inverted: for least squares the ratio of the extreme singular values of
    /// `F^`, infinite where `F^` has linearly dependent rows; for the regularised solve a lower bound, from
    /// the pivots, of that of the worst row's system.
    pub condition: f64,
    /// `||C F^ - G^||_F / ||G^||_F`; 0 where `G^` is zero. For [`FmapSolver::Part`] that of the equation solved,
    /// `||C^T G^ - F^||_F / ||F^||_F`.
    pub relative_residual: f64,
}

/// Why a functional map cannot be computed.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum FmapError {
    /// Source and target have different numbers of descriptors.
    #[error(
        "the source has {source_count} descriptors but the target {target_count}; compute both with the same options"
    )]
    DescriptorCount {
        /// Descriptors of the source.
        source_count: usize,
        /// Descriptors of the target.
        target_count: usize,
    },
    /// An array does not fit the others.
    #[error(
        "{what} has length {found}, expected {expected}; compute all of a shape's arrays from one eigenbasis"
    )]
    SizeMismatch {
        /// The array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length that fits.
        expected: usize,
    },
    /// A basis or the descriptors have no entries.
    #[error("{what} is empty; a functional map needs at least one vertex, eigenfunction and descriptor")]
    Empty {
        /// What is empty.
        what: &'static str,
    },
    /// An entry is NaN or infinite.
    #[error("row {row} of {what} has an entry that is not finite; check the mesh and the descriptors")]
    NotFinite {
        /// The matrix.
        what: &'static str,
        /// The row, 0-based.
        row: usize,
    },
    /// The weight of the mask is negative, infinite or not a number.
    #[error("the weight of the mask is {weight}, but must be a finite number, 0 or more")]
    BadWeight {
        /// The weight.
        weight: f64,
    },
    /// A point map names a vertex that does not exist.
    #[error(
        "source vertex {vertex} is matched to target vertex {target}, but the target has {n_target} vertices (0-based); \
         give a map to the mesh that the basis is of"
    )]
    TargetOutOfRange {
        /// The source vertex.
        vertex: usize,
        /// What it is matched to.
        target: u32,
        /// Number of target vertices.
        n_target: usize,
    },
    /// The dense soft correspondence would not fit the memory allowed.
    #[error(
        "a dense soft correspondence of {n_target} x {n_source} takes {needed} bytes, more than the {allowed} allowed; \
         raise the limit or use the peaks, which need no such matrix"
    )]
    TooLarge {
        /// Number of target vertices.
        n_target: usize,
        /// Number of source vertices.
        n_source: usize,
        /// Bytes it would take.
        needed: usize,
        /// Bytes allowed.
        allowed: usize,
    },
    /// A decomposition did not converge, which finite input does not cause.
    #[error(
        "the singular value decomposition of a {rows} x {cols} matrix did not converge; check the scale of the descriptors"
    )]
    NoConvergence {
        /// Rows of the matrix.
        rows: usize,
        /// Columns of the matrix.
        cols: usize,
    },
}

/// The functional map `C`, `[k_target, k_source]`, that takes the descriptors' coefficients `f_hat`,
/// `[k_source, q]`, to `g_hat`, `[k_target, q]` (see [`Eigenbasis::project`]).
///
/// The mask takes eigenvalues relative to each shape's own area; for [`FmapSolver::Part`] as they are, in one unit of
/// both. For [`FmapSolver::Joint`] it is the map from the source to the target alone; [`functional_maps`] gives both.
///
/// # Errors
/// If the arrays do not fit together, are empty or not finite, the weight is out of range, or a decomposition fails.
pub fn functional_map(
    basis_source: &Eigenbasis,
    basis_target: &Eigenbasis,
    f_hat: &Matrix,
    g_hat: &Matrix,
    solver: FmapSolver,
) -> Result<(Matrix, FmapInfo), FmapError> {
    check_length("a column of the source's coefficients", f_hat.rows(), basis_source.k())?;
    check_length("a column of the target's coefficients", g_hat.rows(), basis_target.k())?;
    match solver {
        FmapSolver::LeastSquares => least_squares(f_hat, g_hat, &LeastSquaresOptions::default()),
        FmapSolver::Regularized { weight } | FmapSolver::Joint { weight } => {
            let [source, target] = [basis_source, basis_target].map(scale_free_eigenvalues);
            regularized(f_hat, g_hat, &source, &target, weight)
        }
        FmapSolver::Bidirectional { weight } => {
            let [source, target] = [basis_source, basis_target].map(scale_free_eigenvalues);
            bidirectional(f_hat, g_hat, &source, &target, weight)
        }
        FmapSolver::Part { weight } => {
            part(f_hat, g_hat, &basis_source.eigenvalues, &basis_target.eigenvalues, weight)
        }
    }
}

/// Checks that `f_hat`, `[k_source, q]`, and `g_hat`, `[k_target, q]`, make a system.
fn check_system(f_hat: &Matrix, g_hat: &Matrix) -> Result<(), FmapError> {
    if f_hat.cols() != g_hat.cols() {
        return Err(FmapError::DescriptorCount { source_count: f_hat.cols(), target_count: g_hat.cols() });
    }
    for (matrix, what) in
        [(f_hat, "the source's coefficient matrix"), (g_hat, "the target's coefficient matrix")]
    {
        if matrix.data().is_empty() {
            return Err(FmapError::Empty { what });
        }
        if let Some(entry) = matrix.data().iter().position(|x| !x.is_finite()) {
            return Err(FmapError::NotFinite { what, row: entry / matrix.cols() });
        }
    }
    Ok(())
}

fn check_length(what: &'static str, found: usize, expected: usize) -> Result<(), FmapError> {
    if found == expected { Ok(()) } else { Err(FmapError::SizeMismatch { what, found, expected }) }
}

/// `||C F^ - G^||_F / ||G^||_F`.
fn relative_residual(c: &Matrix, f_hat: &Matrix, g_hat: &Matrix) -> f64 {
    let image = multiply(c.as_faer(), f_hat.as_faer());
    let squared = |values: &mut dyn Iterator<Item = f64>| values.map(|x| x * x).sum::<f64>();
    let missed = squared(&mut image.data().iter().zip(g_hat.data()).map(|(a, b)| a - b));
    let whole = squared(&mut g_hat.data().iter().copied());
    if whole == 0.0 { 0.0 } else { (missed / whole).sqrt() }
}

#[cfg(test)]
pub(crate) mod test_basis;
#[cfg(test)]
mod tests;
