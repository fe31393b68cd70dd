//! The Laplacian of a mesh as a pair of matrices.

use super::{SparseMatrix, cotangent_stiffness, lumped_mass};
use crate::mesh::Mesh;

/// The Laplace-Beltrami operator of a mesh in its weak form: `W phi = lambda A phi`.
///
/// Boundaries are natural (Neumann). The pointwise operator is `A^-1 W`, with non-negative eigenvalues.
#[derive(Clone, Debug, PartialEq)]
pub struct Laplacian {
    /// Cotangent stiffness `W`, `[n, n]`, positive semi-definite, without unit.
    pub stiffness: SparseMatrix,
    /// Lumped mass `A`, the diagonal `[n]`, positive, in squared units of the mesh.
    pub mass: Vec<f64>,
}

impl Laplacian {
    /// The Laplacian of any triangle mesh: open, in several components, non-manifold or with degenerate
    /// faces.
    ///
    /// Vertices that no triangle uses are components of their own, each with an eigenvalue 0; remove them
    /// first where they are not wanted in the eigenbasis.
    pub fn new(mesh: &Mesh) -> Self {
        Self { stiffness: cotangent_stiffness(mesh), mass: lumped_mass(mesh) }
    }

    /// Number of vertices `n`.
    pub fn n(&self) -> usize {
        self.mass.len()
    }
}
