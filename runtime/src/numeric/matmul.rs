//! Dense products on slices: a safe face for the `gemm` crate.

use super::{Real, vectorized};
use rayon::prelude::*;

/// Rows of the destination that [`par_matmul`] gives to one task. Fixed, so that the result does not depend on the
/// number of threads.
const ROWS_PER_TASK: usize = 128;

/// A matrix `[rows, cols]` in a slice, row-major or the transpose of that.
#[derive(Clone, Copy)]
pub struct MatrixView<'a, T> {
    data: &'a [T],
    rows: usize,
    cols: usize,
    row_stride: usize,
    col_stride: usize,
}

impl<'a, T> MatrixView<'a, T> {
    /// `data` as the rows of a `[rows, cols]` matrix.
    ///
    /// # Panics
    /// If there are not `rows * cols` elements.
    pub fn new(data: &'a [T], rows: usize, cols: usize) -> Self {
        assert_eq!(data.len(), rows * cols, "matrix data does not fit its shape [{rows}, {cols}]");
        Self { data, rows, cols, row_stride: cols, col_stride: 1 }
    }

    /// Number of rows.
    pub(crate) fn n_rows(&self) -> usize {
        self.rows
    }

    /// The transpose, without a copy.
    #[must_use]
    pub fn t(self) -> Self {
        Self {
            rows: self.cols,
            cols: self.rows,
            row_stride: self.col_stride,
            col_stride: self.row_stride,
            ..self
        }
    }

    /// Rows `start..end`, without a copy.
    ///
    /// # Panics
    /// If there are no such rows.
    #[must_use]
    pub(crate) fn rows(self, start: usize, end: usize) -> Self {
        assert!(start <= end && end <= self.rows, "rows {start}..{end} of {}", self.rows);
        let first = (start * self.row_stride).min(self.data.len());
        Self { data: &self.data[first..], rows: end - start, ..self }
    }

    /// Columns `start..end`, without a copy.
    ///
    /// # Panics
    /// If there are no such columns.
    #[must_use]
    pub(crate) fn cols(self, start: usize, end: usize) -> Self {
        self.t().rows(start, end).t()
    }
}

/// `dst = lhs rhs`, or `dst += lhs rhs` with `accumulate`; `dst` is row-major `[lhs.rows, rhs.cols]`. On one thread.
///
/// # Panics
/// If the shapes do not fit.
pub fn matmul<T: Real>(dst: &mut [T], accumulate: bool, lhs: MatrixView<T>, rhs: MatrixView<T>) {
    let (m, n, k) = (lhs.rows, rhs.cols, lhs.cols);
    assert_eq!(k, rhs.rows, "inner dimensions");
    assert_eq!(dst.len(), m * n, "destination [{m}, {n}]");
    // SAFETY: a view's last element lies inside its slice (checked by `MatrixView::new`, kept by `t` and `rows`), and
    // `dst` has m * n elements.
    unsafe {
        gemm::gemm(
            m,
            n,
            k,
            dst.as_mut_ptr(),
            1,
            n as isize,
            accumulate,
            lhs.data.as_ptr(),
            lhs.col_stride as isize,
            lhs.row_stride as isize,
            rhs.data.as_ptr(),
            rhs.col_stride as isize,
            rhs.row_stride as isize,
            T::ONE,
            T::ONE,
            false,
            false,
            false,
            gemm::Parallelism::None,
        );
    }
}

/// `dst = lhs rhs` with the rows of `dst` spread over the threads.
///
/// # Panics
/// If the shapes do not fit.
pub fn par_matmul<T: Real>(dst: &mut [T], lhs: MatrixView<T>, rhs: MatrixView<T>) {
    let cols = rhs.cols;
    dst.par_chunks_mut((ROWS_PER_TASK * cols).max(1)).enumerate().for_each(|(task, dst)| {
        let start = task * ROWS_PER_TASK;
        matmul(dst, false, lhs.rows(start, start + dst.len() / cols), rhs);
    });
}

/// `dst = lhs rhs` for a long inner dimension, which is cut into `pieces` whose products are added in order.
///
/// # Panics
/// If the shapes do not fit, or there are no pieces.
pub fn matmul_split<T: Real>(dst: &mut [T], lhs: MatrixView<T>, rhs: MatrixView<T>, pieces: usize) {
    let inner = lhs.cols;
    let bound = |piece: usize| inner * piece / pieces;
    let mut partial = vec![Vec::new(); pieces - 1];
    let mut targets: Vec<&mut [T]> = vec![&mut *dst];
    for part in &mut partial {
        *part = vec![T::ZERO; targets[0].len()];
        targets.push(part);
    }
    targets.par_iter_mut().enumerate().for_each(|(piece, target)| {
        let (start, end) = (bound(piece), bound(piece + 1));
        matmul(target, false, lhs.cols(start, end), rhs.rows(start, end));
    });
    vectorized(|| {
        for part in &partial {
            for (sum, &value) in dst.iter_mut().zip(part) {
                *sum += value;
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn naive(lhs: MatrixView<f64>, rhs: MatrixView<f64>) -> Vec<f64> {
        let at = |m: &MatrixView<f64>, i: usize, j: usize| m.data[i * m.row_stride + j * m.col_stride];
        let entry = |i, j| (0..lhs.cols).map(|l| at(&lhs, i, l) * at(&rhs, l, j)).sum();
        (0..lhs.rows).flat_map(|i| (0..rhs.cols).map(move |j| entry(i, j))).collect()
    }

    #[test]
    fn products_of_transposed_and_split_operands_equal_the_definition() {
        let (m, n, k) = (150, 7, 31);
        let left: Vec<f64> = (0..m * k).map(|i| (i as f64 * 0.37).sin()).collect();
        let right: Vec<f64> = (0..k * n).map(|i| (i as f64 * 0.73).cos()).collect();
        for lhs in [MatrixView::new(&left, m, k), MatrixView::new(&left, k, m).t()] {
            for rhs in [MatrixView::new(&right, k, n), MatrixView::new(&right, n, k).t()] {
                let expected = naive(lhs, rhs);
                let close = |dst: &[f64]| dst.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-12);
                let mut dst = vec![0.0; m * n];
                par_matmul(&mut dst, lhs, rhs);
                assert!(close(&dst));
                matmul_split(&mut dst, lhs, rhs, 4);
                assert!(close(&dst));
                matmul(&mut dst, true, lhs, rhs);
                assert!(dst.iter().zip(&expected).all(|(a, b)| (a - 2.0 * b).abs() < 1e-12));
            }
        }
    }
}
