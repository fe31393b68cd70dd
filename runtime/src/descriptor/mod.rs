//! Pointwise descriptors: SHOT-352, the input of the network.
//!
//! ```
//! use fmnet::{Mesh, descriptor::{ShotOptions, shot}};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
//! let mesh = Mesh::new(corners, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])?;
//! let mut options = ShotOptions::default();
//! (options.radius, options.min_neighbors) = (2.0, 3);
//! let (descriptors, info) = shot(&mesh, &options)?;
//! assert_eq!((descriptors.rows(), descriptors.cols()), (4, 352));
//! assert_eq!(info.zero_rows, 0);
//! # Ok(())
//! # }
//! ```

mod shot;

pub use shot::{ShotError, ShotInfo, ShotOptions, shot};
