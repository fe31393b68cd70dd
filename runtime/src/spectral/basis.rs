//! The truncated Laplacian eigenbasis of a shape.

use crate::Matrix;
use faer::{Accum, Par};

/// The first `k` eigenpairs of `W phi = lambda A phi`, with `Phi^T A Phi = I`.
#[derive(Clone, Debug, PartialEq)]
pub struct Eigenbasis {
    /// Eigenvalues, ascending, `[k]`, in 1 / squared unit of the mesh.
    pub eigenvalues: Vec<f64>,
    /// Eigenvectors as columns, `[n, k]`.
    pub eigenvectors: Matrix,
    /// The lumped mass `A`: area of each vertex, `[n]`.
    pub mass: Vec<f64>,
}

impl Eigenbasis {
    /// Number of vertices `n`.
    pub fn n(&self) -> usize {
        self.eigenvectors.rows()
    }

    /// Number of eigenpairs `k`.
    pub fn k(&self) -> usize {
        self.eigenvalues.len()
    }

    /// The first `k` eigenpairs only.
    pub fn truncated(&self, k: usize) -> Self {
        Self {
            eigenvalues: self.eigenvalues[..k].to_vec(),
            eigenvectors: self.eigenvectors.first_cols(k),
            mass: self.mass.clone(),
        }
    }

    /// Fourier coefficients `Phi^T A F`, `[k, q]`, of the functions `F`, `[n, q]`.
    pub fn project(&self, functions: &Matrix<f32>) -> Matrix {
        assert_eq!(functions.rows(), self.n(), "functions and basis live on different meshes");
        let mut weighted = functions.map(f64::from);
        for (i, &area) in self.mass.iter().enumerate() {
            weighted.row_mut(i).iter_mut().for_each(|x| *x *= area);
        }
        let mut coefficients = Matrix::zeros(self.k(), functions.cols());
        faer::linalg::matmul::matmul(
            coefficients.as_faer_mut(),
            Accum::Replace,
            self.eigenvectors.as_faer().transpose(),
            weighted.as_faer(),
            1.0,
            Par::Seq,
        );
        coefficients
    }
}
