//! Learned dense correspondence between deformable 3D shapes: two mesh files in, a dense map out.
//!
//! The method is that of Litany, Remez, Rodolà, Bronstein and Bronstein, *Deep Functional Maps: Structured Prediction
//! for Dense Shape Correspondence* (ICCV 2017): descriptors from a network, a functional map between Laplacian
//! eigenbases from the descriptors, a point map from the functional map. This crate holds everything that is needed
//! to use a trained network; training is `fmnet-trainer`. The equations stand in `docs/algorithms.md` of the
//! repository, the file formats in `docs/formats.md`.
//!
//! # A pair from end to end
//!
//! A shape and a renumbered copy, matched by SHOT descriptors without a network;
//! [`pipeline::MatchOptions::default()`] would use the model that is built in.
//!
//! ```
//! use fmnet::mesh::shapes::{bumpy_sphere, permuted};
//! use fmnet::pipeline::{DescriptorKind, MatchOptions, match_meshes};
//!
//! let source = bumpy_sphere(3, 1);
//! let (target, _) = permuted(&source, 7);
//! let options = MatchOptions::default().descriptor(DescriptorKind::Shot).k(40).shot_radius(0.2);
//! let result = match_meshes(&source, &target, &options)?;
//!
//! assert_eq!(result.map.len(), source.n_vertices());
//! let exact = (0..result.map.len())
//!     .filter(|&v| result.map.get(v).is_some_and(|t| source.vertices()[v] == target.vertices()[t as usize]));
//! assert_eq!(exact.count(), source.n_vertices());
//! # Ok::<(), fmnet::Error>(())
//! ```
//!
//! For files, read the meshes with [`io::read_mesh`] and write the map with [`io::write_point_map`]. For many pairs,
//! make one [`pipeline::Matcher`], which loads the model once, call [`describe`](pipeline::Matcher::describe) once
//! for each shape and [`match_shapes`](pipeline::Matcher::match_shapes) for each pair.
//!
//! # The stages
//!
//! | stage | module | what it gives |
//! |---|---|---|
//! | files | [`io`] | meshes with their attributes, point maps, matrices |
//! | repair, decimation | [`mesh`] | an oriented manifold of bounded size, with the way back to the input's vertices |
//! | eigenbasis | [`spectral`] | the first `k` eigenfunctions of the Laplace-Beltrami operator, `[n, k]` |
//! | SHOT | [`descriptor`] | local shape around each vertex, `[n, 352]` |
//! | network | [`network`], [`diffusion_net`] | learned descriptors, `[n, d]`, by tract or onnxruntime |
//! | functional map | [`fmap`] | the matrix `C`, `[k_target, k_source]` |
//! | point map | [`point_map`] | for each source vertex a target vertex |
//! | refinement | [`refine`] | the wavelet filter, ZoomOut, spectral ICP, the product manifold filter |
//! | upscaling | [`upscale`] | from decimated to full meshes |
//! | evaluation | [`eval`], [`geodesic`] | geodesic errors and curves; exact distances |
//! | use | [`render`] | attribute transfer, coloured pairs, an HTML viewer |
//!
//! [`pipeline`] knows their order, [`batch`] the files of many pairs, [`shape`] what is computed of one shape;
//! [`cache`] keeps it in a folder, [`memory`] refuses what would not fit, [`events`] tell how far it is. Programs
//! that match large meshes may install [`LargePages`].
//!
//! # Conventions
//!
//! - X is the **source**, Y the **target**; a point map gives each source vertex a target vertex, a functional map
//!   takes functions on the source to functions on the target.
//! - Matrices are row-major [`Matrix`]; shapes stand in brackets, `[rows, columns]`. Geometry and linear algebra are
//!   in f64, descriptors in f32. Vertices count from 0.
//! - Lengths in options are relative to sqrt(area): results change neither with the unit nor with the position of a
//!   mesh.
//! - The same input gives the same bytes, whatever the number of threads. Nothing here prints or panics on input;
//!   errors name the element and the remedy. Where an index or a size is the caller's own, as with slices, the page
//!   says under *Panics* what must hold.
//! - Options are public fields on top of `Default`; [`MatchOptions`](pipeline::MatchOptions) has a function for each
//!   besides. New ones may come with any version, and so may variants of choices.
//!
//! # Features
//!
//! `tract` (default) runs networks in pure Rust; `ort` runs them by onnxruntime, whose library is loaded from the
//! path in `ORT_DYLIB_PATH`. Without either, networks of `fmnet-train` run on the library's own kernels
//! ([`network::Backend::Native`]), and SHOT descriptors match. `cli` (default) is for the program `fmnet-infer`:
//! libraries leave it out, with all that it pulls in.
//!
//! The library runs in WebAssembly (`wasm32-unknown-unknown`): from bytes to bytes ([`io::decode_mesh`],
//! [`io::encode_point_map`], [`io::encode_glb`]), on one thread, without a clock and without `.npz`.

pub mod batch;
pub mod cache;
pub mod descriptor;
pub mod diffusion_net;
mod error;
pub mod eval;
pub mod events;
pub mod fmap;
pub mod geodesic;
pub mod io;
mod large_pages;
mod matrix;
pub mod memory;
pub mod mesh;
pub mod network;
pub mod numeric;
pub mod pipeline;
pub mod point_map;
pub mod quality;
pub mod refine;
pub mod render;
pub mod shape;
#[cfg(test)]
#[path = "../tests/support/skipped.rs"]
mod skip;
pub mod spectral;
pub mod upscale;

pub use error::{Error, causes};
pub use large_pages::LargePages;
pub use matrix::Matrix;
pub use mesh::Mesh;
