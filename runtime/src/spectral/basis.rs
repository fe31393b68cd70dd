//! The truncated Laplacian eigenbasis of a shape.

use crate::Matrix;
use crate::numeric::vectorized;
use faer::linalg::matmul::matmul;
use faer::{Accum, Par};
use rayon::prelude::*;
use std::ops::Range;

/// Rows converted to f64 at a time.
const ROWS_PER_BLOCK: usize = 512;
/// Most partial sums of a projection.
const MAX_TASKS: usize = 16;

/// The first `k` eigenpairs of `W phi = lambda A phi`, with `Phi^T A Phi = I`.
#[derive(Clone, Debug, PartialEq)]
pub struct Eigenbasis {
    /// Eigenvalues, ascending, `[k]`, in 1 / squared unit of the mesh.
    pub eigenvalues: Vec<f64>,
    /// Eigenvectors as columns, `[n, k]`, in 1 / unit of the mesh.
    pub eigenvectors: Matrix,
    /// The lumped mass `A`: area of each vertex, `[n]`, in squared units of the mesh.
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
    ///
    /// # Panics
    /// If there are fewer than `k`.
    pub fn truncated(&self, k: usize) -> Self {
        Self {
            eigenvalues: self.eigenvalues[..k].to_vec(),
            eigenvectors: self.eigenvectors.first_cols(k),
            mass: self.mass.clone(),
        }
    }

    /// The first `k` eigenpairs of the shape scaled to unit area: eigenvalues, eigenvectors and mass without a unit.
    ///
    /// Functional maps are computed between such bases, so that a map does not depend on the size of either shape.
    ///
    /// # Panics
    /// If there are fewer than `k`.
    pub fn at_unit_area(&self, k: usize) -> Self {
        self.in_unit(self.area(), k)
    }

    /// The area of the shape, in squared units of the mesh.
    pub fn area(&self) -> f64 {
        self.mass.iter().sum()
    }

    /// The first `k` eigenpairs where an area of `area` (above 0, in squared units of the mesh) counts as 1. For a
    /// part of a shape it is the area of the whole, so that the eigenvalues of both are in one unit.
    ///
    /// # Panics
    /// If there are fewer than `k`.
    pub fn in_unit(&self, area: f64, k: usize) -> Self {
        Self {
            eigenvalues: self.eigenvalues[..k].iter().map(|lambda| lambda * area).collect(),
            eigenvectors: self.scaled_eigenvectors(k, area.sqrt()),
            mass: self.mass.iter().map(|m| m / area).collect(),
        }
    }

    /// The first `k` eigenvectors times a factor, `[n, k]`.
    fn scaled_eigenvectors(&self, k: usize, factor: f64) -> Matrix {
        let mut scaled = Vec::with_capacity(self.n() * k);
        vectorized(|| {
            for i in 0..self.n() {
                scaled.extend(self.eigenvectors.row(i)[..k].iter().map(|x| x * factor));
            }
        });
        Matrix::from_vec(self.n(), k, scaled)
    }

    /// The basis at some of the vertices, in this order: their values and masses.
    pub(crate) fn at_vertices(&self, vertices: &[u32]) -> Self {
        Self {
            eigenvalues: self.eigenvalues.clone(),
            eigenvectors: self.eigenvectors.select_rows(vertices),
            mass: vertices.iter().map(|&v| self.mass[v as usize]).collect(),
        }
    }

    /// Fourier coefficients `Phi^T A F`, `[k, q]`, of the functions `F`, `[n, q]`.
    ///
    /// Multi-threaded, the same bytes for any number of threads; `F` is converted to f64 block by block.
    ///
    /// # Panics
    /// If `functions` has not `n` rows, which is a bug of the caller.
    pub fn project(&self, functions: &Matrix<f32>) -> Matrix {
        assert_eq!(functions.rows(), self.n(), "functions and basis live on different meshes");
        let blocks = self.n().div_ceil(ROWS_PER_BLOCK);
        let tasks = blocks.clamp(1, MAX_TASKS);
        let parts: Vec<Matrix> = (0..tasks)
            .into_par_iter()
            .map(|task| self.project_blocks(functions, task * blocks / tasks..(task + 1) * blocks / tasks))
            .collect();
        parts.into_iter().reduce(add).expect("there is at least one task")
    }

    /// The part of the projection that comes from the given blocks of rows, `[k, q]`.
    fn project_blocks(&self, functions: &Matrix<f32>, blocks: Range<usize>) -> Matrix {
        let q = functions.cols();
        let mut sum = Matrix::zeros(self.k(), q);
        for block in blocks {
            let first = block * ROWS_PER_BLOCK;
            let rows = ROWS_PER_BLOCK.min(self.n() - first);
            let mut weighted = Matrix::zeros(rows, q);
            for r in 0..rows {
                let area = self.mass[first + r];
                let values = functions.row(first + r);
                weighted.row_mut(r).iter_mut().zip(values).for_each(|(w, &f)| *w = area * f64::from(f));
            }
            let phi = self.eigenvectors.as_faer().subrows(first, rows);
            matmul(sum.as_faer_mut(), Accum::Add, phi.transpose(), weighted.as_faer(), 1.0, Par::Seq);
        }
        sum
    }
}

fn add(mut total: Matrix, part: Matrix) -> Matrix {
    total.data_mut().iter_mut().zip(part.data()).for_each(|(t, p)| *t += p);
    total
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projection_is_the_weighted_inner_product() {
        let n = 3 * ROWS_PER_BLOCK + 17;
        let wave = |i: usize, j: usize| ((i * (j + 3)) as f64 * 0.1).sin();
        let basis = Eigenbasis {
            eigenvalues: vec![0.0; 4],
            eigenvectors: Matrix::from_fn(n, 4, wave),
            mass: (0..n).map(|i| 1.0 + (i % 7) as f64).collect(),
        };
        let functions = Matrix::from_fn(n, 5, |i, j| wave(i, j + 7) as f32);
        let coefficients = basis.project(&functions);
        for a in 0..4 {
            for b in 0..5 {
                let expected: f64 =
                    (0..n).map(|i| basis.mass[i] * wave(i, a) * f64::from(functions[(i, b)])).sum();
                assert!((coefficients[(a, b)] - expected).abs() < 1e-9);
            }
        }
    }
}
