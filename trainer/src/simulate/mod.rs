//! Stand-ins for data that is not at hand, made from registered shapes whose correspondence is known.
//!
//! - [`simulate_scan`] makes of a closed registration what a 3D scanner would have seen of it; [`write_scans`] a
//!   folder in the layout of the FAUST scans.
//! - [`cut_part`] cuts a part out of a shape; [`write_parts`] a folder in the layout of the SHREC'16 partial
//!   correspondence benchmark (Cosmo et al. 2016), or one with a manifest where shapes do not share a triangulation.
//! - [`triangulated`] gives a shape another triangulation, with correspondences that are points on its surface;
//!   [`write_triangulations`] a folder with a manifest.
//!
//! All folders are read by [`Dataset::open`](crate::dataset::Dataset::open) like the real ones. The same options and
//! seed give the same files. An interrupted run goes on where it was: files are there in full or not at all, and
//! those that are there are left alone.

mod carve;
mod folder;
mod part;
mod part_files;
mod polygonize;
mod random;
mod scan;
mod scan_files;
mod smooth;
mod surface_part_files;
#[cfg(test)]
mod tests;
mod triangulation;
mod triangulation_files;
mod visibility;
mod volume;

use crate::dataset::DatasetError;
use fmnet::io::IoError;
use fmnet::mesh::{DecimateError, RepairError};
use std::path::PathBuf;
use thiserror::Error;

pub use part::{Part, PartKind, PartOptions, cut_part};
pub use part_files::write_parts;
pub use scan::{Axis, ScanOptions, simulate_scan};
pub use scan_files::write_scans;
pub use triangulation::{Manner, Plan, Triangulated, TriangulationOptions, triangulated};
pub use triangulation_files::write_triangulations;

/// Told after each shape how many of how many are there, and the name of its file.
pub type SimulateProgress<'a> = &'a (dyn Fn(usize, usize, &str) + Sync);

/// Why shapes could not be simulated.
#[derive(Debug, Error)]
pub enum SimulateError {
    /// An option is out of its range.
    #[error("option {option} is {value}, but must be {range}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// What it is.
        value: String,
        /// What it may be.
        range: &'static str,
    },
    /// A scan needs an inside and an outside.
    #[error(
        "edge {edge:?} (0-based vertices) has {faces} faces; scans are simulated of closed surfaces only"
    )]
    NotClosed {
        /// The edge.
        edge: [u32; 2],
        /// How many faces it has.
        faces: usize,
    },
    /// Nothing is left of the shape.
    #[error("no surface is left; the shape may have no volume, or its faces look inwards")]
    Empty,
    /// No part of the wanted size was found.
    #[error(
        "no connected part of {low:.0} to {high:.0} % of the area in {tries} tries; allow a wider range of areas",
        low = 100.0 * share[0],
        high = 100.0 * share[1]
    )]
    NoPart {
        /// Least and largest share of the area.
        share: [f64; 2],
        /// Cuts tried.
        tries: usize,
    },
    /// The dataset does not fit what is to be made of it.
    #[error("{folder}: {reason}")]
    Unfit {
        /// The dataset's folder.
        folder: PathBuf,
        /// What does not fit, and the remedy.
        reason: String,
    },
    /// The output folder holds something else.
    #[error("{path} tells of another simulation; choose another folder, or remove it to start anew")]
    OtherSimulation {
        /// The file that tells what was simulated.
        path: PathBuf,
    },
    /// One shape failed.
    #[error("{name}: {source}")]
    InShape {
        /// Its name.
        name: String,
        /// Why.
        source: Box<SimulateError>,
    },
    /// The dataset's files are wrong.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The shape cannot be made a manifold.
    #[error(transparent)]
    Repair(#[from] RepairError),
    /// The dense surface could not be reduced.
    #[error(transparent)]
    Decimate(#[from] DecimateError),
    /// A file could not be written.
    #[error(transparent)]
    Io(#[from] IoError),
}

impl SimulateError {
    fn in_shape(self, name: &str) -> Self {
        Self::InShape { name: name.into(), source: Box::new(self) }
    }
}

/// An option's value, if it is in its range.
fn check(
    option: &'static str,
    ok: bool,
    value: impl std::fmt::Debug,
    range: &'static str,
) -> Result<(), SimulateError> {
    match ok {
        true => Ok(()),
        false => Err(SimulateError::Option { option, value: format!("{value:?}"), range }),
    }
}
