//! Learned dense correspondence between deformable 3D shapes: two mesh files in, a dense map out.

pub mod descriptor;
pub mod eval;
pub mod fmap;
pub mod geodesic;
pub mod io;
mod matrix;
pub mod mesh;
pub mod network;
pub mod point_map;
pub mod refine;
pub mod render;
pub mod spectral;
pub mod synth;
pub mod upscale;

pub use matrix::Matrix;
pub use mesh::Mesh;
