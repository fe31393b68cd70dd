//! Learned dense correspondence between deformable 3D shapes: two mesh files in, a dense map out.

pub mod cache;
pub mod descriptor;
mod error;
pub mod eval;
pub mod events;
pub mod fmap;
pub mod geodesic;
pub mod io;
mod matrix;
pub mod mesh;
pub mod network;
pub mod pipeline;
pub mod point_map;
pub mod refine;
pub mod render;
pub mod shape;
pub mod spectral;
pub mod synth;
pub mod upscale;

pub use error::Error;
pub use matrix::Matrix;
pub use mesh::Mesh;
