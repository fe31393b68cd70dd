//! Synthetic bodies: articulated bipeds and quadrupeds of several species, in random shapes and poses, with exact
//! correspondences. They train the model that needs no licensed data, and they are the shapes of the demo.
//!
//! A species is modelled at rest as an implicit surface ([`Species`]), polygonised once ([`Template`]) and deformed
//! into individuals ([`Template::body`]): bones are lengthened and thickened, flesh is added, and dual quaternion
//! skinning (Kavan et al. 2008) puts the body into a pose. Each individual is triangulated anew, so that neither the
//! order of vertices nor the connectivity tells which points correspond; every vertex still knows its place on the
//! template.

mod adjacency;
mod biped;
mod body;
mod collision;
mod damage;
mod dataset;
mod demo;
mod flip;
mod gait;
mod implicit;
mod loft;
mod math;
mod options;
mod polygonize;
mod pose;
mod quadruped;
mod random;
mod recipe;
mod remesh;
mod shape;
mod skeleton;
mod skinning;
mod species;
mod template;
#[cfg(test)]
mod tests;

use thiserror::Error;

pub use body::Body;
pub use dataset::{DatasetOptions, Split, split_of, write_dataset};
pub use demo::{DemoPair, demo_pair};
pub use options::SynthOptions;
pub use species::Species;
pub use template::Template;

/// Stands in a correspondence for a point that is not there.
pub const UNMATCHED: u32 = u32::MAX;

/// Why bodies could not be made or written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SynthError {
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
    /// A file or folder could not be written.
    #[error(transparent)]
    Write(#[from] crate::io::IoError),
}

/// The individual of `species` with the given seed; to make many of one species, build its [`Template`] once.
///
/// # Errors
/// If an option is out of range.
pub fn generate(species: Species, seed: u64, options: &SynthOptions) -> Result<Body, SynthError> {
    options.check()?;
    Template::new(species).body(seed, options)
}
