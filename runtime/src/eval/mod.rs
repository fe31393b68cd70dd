//! Evaluation of point maps and descriptors against ground truth.
//!
//! - [`GroundTruth`]: which target vertex is right, read from what the datasets offer.
//! - [`geodesic_errors`]: how far each match is from the right one, by the Princeton protocol; [`ErrorSummary`] and
//!   [`ErrorCurve`] say it in a few numbers and in a curve.
//! - [`match_ranks`], [`cmc_curve`], [`correct_match_distances`], [`Histogram`]: how well descriptors tell the right
//!   match from the others.
//! - [`LineChart`], [`curves_csv`], [`HtmlReport`]: the same to look at.

mod chart;
mod cmc;
mod curve;
mod geodesic_error;
mod ground_truth;
mod histogram;
mod report;
mod summary;

pub use chart::{AxisScale, LineChart, Series};
pub use cmc::{cmc_curve, correct_match_distances, match_ranks};
pub use curve::{ErrorCurve, curves_csv, curves_from_csv};
pub use geodesic_error::{SymmetricErrors, geodesic_errors, surface_errors, symmetric_geodesic_errors};
pub use ground_truth::{GroundTruth, GroundTruthSource};
pub use histogram::Histogram;
pub use report::{Block, HtmlReport, Section};
pub use summary::ErrorSummary;

use thiserror::Error;

/// Why a map or descriptors could not be evaluated.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EvalError {
    /// Two things that must describe the same shape have different sizes.
    #[error(
        "{what} has {found} vertices, but {other} has {expected}; check that both are for the same meshes, source first"
    )]
    SizeMismatch {
        /// The one that was looked at.
        what: &'static str,
        /// Its size.
        found: usize,
        /// What it was compared with.
        other: &'static str,
        /// The size that one has.
        expected: usize,
    },
    /// A vertex index is not below the number of vertices.
    #[error(
        "{what} names {side} vertex {index}, but there are only {n_vertices} (0-based); check the direction and the base of the file"
    )]
    IndexOutOfRange {
        /// What names it.
        what: &'static str,
        /// `source` or `target`.
        side: &'static str,
        /// The vertex.
        index: u32,
        /// How many vertices there are.
        n_vertices: usize,
    },
    /// Source and target have descriptors of different width.
    #[error(
        "the source's descriptors have {n_source} entries each and the target's {n_target}; make both with the same options"
    )]
    DescriptorWidth {
        /// Entries of a descriptor of the source.
        n_source: usize,
        /// Entries of a descriptor of the target.
        n_target: usize,
    },
    /// The identity was asked for between meshes of different size.
    #[error(
        "the ground truth `identity` needs meshes of one size, but the source has {n_source} and the target {n_target} vertices; where only the first N correspond, say `identity:N`"
    )]
    NoIdentity {
        /// Vertices of the source.
        n_source: usize,
        /// Vertices of the target.
        n_target: usize,
    },
    /// Two lists of corresponding vertices have different lengths.
    #[error(
        "{source_file} has {n_source} lines and {target_file} has {n_target}; line i of one corresponds with line i of the other"
    )]
    ListMismatch {
        /// The list of source vertices.
        source_file: String,
        /// Its length.
        n_source: usize,
        /// The list of target vertices.
        target_file: String,
        /// Its length.
        n_target: usize,
    },
    /// The text is none of the forms of [`GroundTruthSource`].
    #[error(
        "`{0}` is no ground truth; write `identity`, `identity:N`, a map file, or two .vts files as `A.vts,B.vts`"
    )]
    BadGroundTruth(String),
    /// A file could not be read.
    #[error(transparent)]
    Io(#[from] crate::io::IoError),
}

/// An error unless `found == expected`.
fn check_size(
    what: &'static str,
    found: usize,
    other: &'static str,
    expected: usize,
) -> Result<(), EvalError> {
    if found == expected { Ok(()) } else { Err(EvalError::SizeMismatch { what, found, other, expected }) }
}
