//! A shape with its samples, in single precision but for its eigenfunctions at the samples.

use crate::Matrix;
use crate::fmap::Factor;
use crate::numeric::{MatrixView, matmul, par_matmul, vectorized};
use crate::point_map::search::Rows;
use crate::spectral::Eigenbasis;
use rayon::prelude::*;
use std::borrow::Cow;

/// Rows of a product whose norms are taken while they are in the cache.
const ROWS: usize = 64;

/// A shape with its samples, and `k` of its eigenfunctions.
pub(super) struct Sampled<'a> {
    k: usize,
    basis: &'a Eigenbasis,
    samples: &'a [u32],
    /// The eigenfunctions, and the columns beside the embedding, `[n, k + a]`.
    rows: Matrix<f32>,
    /// Half of their squared norms, `[n]`.
    half_squares: Vec<f32>,
    /// Those of the samples, `[m, k + a]`.
    sample_rows: Matrix<f32>,
    /// Takes values at the samples, `[m]`, to the coefficients of the function that fits them best, by the areas,
    /// `[k, m]`.
    projection: Matrix,
}

impl<'a> Sampled<'a> {
    /// Of the first `k` eigenfunctions of a basis, columns beside the embedding, `[n, a]`, and samples with the areas
    /// around them.
    pub(super) fn new(
        basis: &'a Eigenbasis,
        anchors: Option<&Matrix>,
        samples: &'a [u32],
        areas: &[f64],
        k: usize,
    ) -> Self {
        let mut rows = Matrix::zeros(basis.n(), k + anchors.map_or(0, Matrix::cols));
        let mut half_squares = vec![0.0; basis.n()];
        vectorized(|| {
            for (i, half) in half_squares.iter_mut().enumerate() {
                let (left, right) = rows.row_mut(i).split_at_mut(k);
                left.iter_mut().zip(basis.eigenvectors.row(i)).for_each(|(to, &from)| *to = from as f32);
                let columns = anchors.map_or(&[][..], |anchors| anchors.row(i));
                right.iter_mut().zip(columns).for_each(|(to, &from)| *to = from as f32);
                *half = half_square(left) + half_square(right);
            }
        });
        let sample_rows = rows.select_rows(samples);
        let projection = projection(&basis.eigenvectors.select_rows(samples).first_cols(k), areas);
        Self { k, basis, samples, rows, half_squares, sample_rows, projection }
    }

    /// The eigenfunctions, `[n, k]`.
    pub(super) fn eigenfunctions(&self) -> MatrixView<'_, f32> {
        view(&self.rows).cols(0, self.k)
    }

    /// The functional map by which the samples' matches pull functions back from the other shape, `[k, k_other]`.
    pub(super) fn pull_back(&self, images: &[u32], other: &Self) -> Matrix {
        let pulled = other.basis.eigenvectors.select_rows(images);
        let mut c = Matrix::zeros(self.k, other.k);
        par_matmul(c.data_mut(), view(&self.projection), view(&pulled).cols(0, other.k));
        c
    }

    /// `Phi C^T` of the samples with the columns beside, `[m, k_other + a]`.
    pub(super) fn queries(&self, c: &Matrix<f32>) -> Matrix<f32> {
        self.beside_columns(&transported(view(&self.sample_rows).cols(0, self.k), c), &self.sample_rows)
    }

    /// `Phi C^T` of all vertices, `[n, k_other]`.
    pub(super) fn transported(&self, c: &Matrix<f32>) -> Matrix<f32> {
        transported(self.eigenfunctions(), c)
    }

    /// Rows with the columns of some rows of this shape beside them, `[rows, k_other + a]`.
    fn beside_columns(&self, left: &Matrix<f32>, own: &Matrix<f32>) -> Matrix<f32> {
        let width = left.cols() + own.cols() - self.k;
        let mut data = Vec::with_capacity(left.rows() * width);
        for i in 0..left.rows() {
            data.extend_from_slice(left.row(i));
            data.extend_from_slice(&own.row(i)[self.k..]);
        }
        Matrix::from_vec(left.rows(), width, data)
    }

    /// The rows of all vertices in the joint embedding, `[n, k + k_other + a]`: the eigenfunctions and their image,
    /// the target's coefficients first, the source's, the columns.
    pub(super) fn embedded(&self, image: &Matrix<f32>, is_target: bool) -> Matrix<f32> {
        let width = image.cols() + self.rows.cols();
        let mut data = Vec::with_capacity(image.rows() * width);
        for i in 0..image.rows() {
            let (own, columns) = self.rows.row(i).split_at(self.k);
            let coefficients = if is_target { [own, image.row(i)] } else { [image.row(i), own] };
            coefficients.into_iter().chain([columns]).for_each(|part| data.extend_from_slice(part));
        }
        Matrix::from_vec(image.rows(), width, data)
    }

    /// Half of the squared norms of the vertices' rows in an embedding, of which one part is an image, `[n]`.
    pub(super) fn squares_with(&self, image: &Matrix<f32>) -> Vec<f32> {
        vectorized(|| (0..image.rows()).map(|i| self.half_squares[i] + half_square(image.row(i))).collect())
    }

    /// Half of the squared norms of the vertices' rows in an embedding, of which one part is `Phi C^T`, `[n]`.
    pub(super) fn half_squares(&self, c: &Matrix<f32>) -> Vec<f32> {
        let mut half_squares = self.half_squares.clone();
        half_squares.par_chunks_mut(ROWS).enumerate().for_each(|(chunk, sums)| {
            let first = chunk * ROWS;
            let mut product = vec![0.0; sums.len() * c.rows()];
            matmul(&mut product, false, self.eigenfunctions().rows(first, first + sums.len()), view(c).t());
            let rows = product.chunks_exact(c.rows());
            vectorized(|| sums.iter_mut().zip(rows).for_each(|(sum, row)| *sum += half_square(row)));
        });
        half_squares
    }

    /// The samples' rows in the other shape's space, with the squares of those of the vertices.
    pub(super) fn sample_rows(&self, queries: Matrix<f32>, of_vertices: &[f32]) -> Rows<'static> {
        let half_squares = self.samples.iter().map(|&s| of_vertices[s as usize]).collect();
        Rows::new(Cow::Owned(queries), half_squares)
    }

    /// The vertices' rows in their own space.
    pub(super) fn vertex_rows(&self, half_squares: Vec<f32>) -> Rows<'_> {
        Rows::new(Cow::Borrowed(&self.rows), half_squares)
    }

    /// The vertices' rows in the other shape's space, by `C12 + C21^T`; `image` is that by the map forth alone.
    pub(super) fn transported_rows(&self, sum: &Matrix<f32>, image: &Matrix<f32>) -> Rows<'static> {
        let rows = self.beside_columns(&self.transported(sum), &self.rows);
        Rows::new(Cow::Owned(rows), self.squares_with(image))
    }
}

/// `Phi C^T`, `[rows, k_other]`.
fn transported(phi: MatrixView<f32>, c: &Matrix<f32>) -> Matrix<f32> {
    let mut transported = Matrix::zeros(phi.n_rows(), c.rows());
    par_matmul(transported.data_mut(), phi, view(c).t());
    transported
}

/// `(Phi^T A Phi)^-1 Phi^T A`, `[k, m]`, of rows `[m, k]` and areas `[m]`.
fn projection(phi: &Matrix, areas: &[f64]) -> Matrix {
    let k = phi.cols();
    let mut weighted = Matrix::from_fn(k, phi.rows(), |j, i| areas[i] * phi[(i, j)]);
    let mut gram = Matrix::zeros(k, k);
    matmul(gram.data_mut(), false, view(&weighted), view(phi));
    // Where the decomposition fails, which it does for numbers that are not finite, the search says so.
    if let Ok(factor) = Factor::new(gram.as_faer().to_owned()) {
        factor.solve(weighted.as_faer_mut());
    }
    weighted
}

fn view<T: Copy>(matrix: &Matrix<T>) -> MatrixView<'_, T> {
    MatrixView::new(matrix.data(), matrix.rows(), matrix.cols())
}

#[inline(always)]
fn half_square(row: &[f32]) -> f32 {
    let (chunks, rest) = row.as_chunks::<16>();
    let mut sums = [0.0; 16];
    chunks.iter().for_each(|chunk| (0..16).for_each(|lane| sums[lane] += chunk[lane] * chunk[lane]));
    (sums.iter().sum::<f32>() + rest.iter().map(|x| x * x).sum::<f32>()) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_projection_gives_back_the_coefficients_of_a_function() {
        let phi = Matrix::from_fn(40, 5, |i, j| (0.3 * (i * (j + 1)) as f64).cos());
        let areas: Vec<f64> = (0..40).map(|i| 1.0 + 0.5 * f64::from(i).sin()).collect();
        let projection = projection(&phi, &areas);
        let coefficients = [1.0, -2.0, 0.5, 3.0, -0.25];
        let value = |i: usize| (0..5).map(|j| coefficients[j] * phi[(i, j)]).sum::<f64>();
        for (j, expected) in coefficients.into_iter().enumerate() {
            let found: f64 = (0..40).map(|i| projection[(j, i)] * value(i)).sum();
            assert!((found - expected).abs() < 1e-12);
        }
    }
}
