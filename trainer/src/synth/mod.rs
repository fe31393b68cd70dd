//! Synthetic bodies: articulated bipeds, quadrupeds, hands, birds, fish and insects of several species, in random
//! shapes and poses, with exact correspondences. They train the model that needs no licensed data.
//!
//! A breed of a species is modelled at rest as an implicit surface ([`Species`]), polygonised ([`Template`]) and
//! deformed into individuals ([`Template::body`]): bones are lengthened and thickened, flesh is added, and dual
//! quaternion skinning (Kavan et al. 2008) puts the body into a pose. Each individual is triangulated anew, so that
//! neither the order of vertices nor the connectivity tells which points correspond. The landmarks of a [`Family`]
//! are found on each breed by carrying them with the solids that the surface is made of.

mod adjacency;
mod biped;
mod bird;
mod body;
mod bones;
mod carry;
mod collision;
mod correspond;
mod damage;
mod dataset;
mod demo;
mod fish;
mod flip;
mod gait;
mod hand;
mod implicit;
mod insect;
mod loft;
mod math;
mod mirror;
mod options;
mod polygonize;
mod pose;
mod postures;
mod proportions;
mod quadruped;
mod random;
mod recipe;
mod remesh;
mod shape;
mod skeleton;
mod skinning;
mod species;
mod surface;
mod template;
#[cfg(test)]
mod tests;

use thiserror::Error;

pub use body::Body;
pub use dataset::{DatasetOptions, Split, split_of, write_dataset};
pub use demo::{DEMO_FILES, DEMO_LANDMARKS, write_demo};
pub use options::SynthOptions;
pub use species::{Family, Species};
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
    Write(#[from] fmnet::io::IoError),
}
