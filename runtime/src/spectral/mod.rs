//! The Laplace-Beltrami operator and its eigenbasis.
//!
//! [`Laplacian::new`] discretises the operator on a mesh as the pair of a stiffness matrix `W` and a lumped
//! mass `A`; [`eigenbasis`] finds the smallest eigenpairs of `W phi = lambda A phi`.

mod basis;
mod eigen;
mod gradients;
mod laplacian;
mod mass;
mod sparse;
mod stiffness;
#[cfg(test)]
mod test_shapes;
mod wks;

pub use basis::Eigenbasis;
pub use eigen::{EigenError, EigenInfo, EigenOptions, eigenbasis, max_eigenpairs};
pub use gradients::{EigenGradients, eigen_gradients};
pub use laplacian::Laplacian;
pub use mass::lumped_mass;
pub use sparse::SparseMatrix;
pub use stiffness::cotangent_stiffness;
pub use wks::{WKS_HEADROOM, WKS_WIDTH, WKS_ZERO, WksOptions, wks, wks_of, wks_weights};
