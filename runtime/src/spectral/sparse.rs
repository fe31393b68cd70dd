//! A symmetric sparse matrix in compressed rows.

use crate::Matrix;
use rayon::prelude::*;

/// Rows of a product computed by one task.
const ROWS_PER_TASK: usize = 1024;

/// Symmetric sparse matrix `[n, n]` in compressed rows, both triangles stored.
///
/// Row `i` has the columns `indices()[offsets()[i]..offsets()[i + 1]]`, ascending, and the values at the same
/// places. As the matrix is symmetric, the same arrays read as compressed columns. Every diagonal entry is
/// stored, even where it is zero.
#[derive(Clone, Debug, PartialEq)]
pub struct SparseMatrix {
    offsets: Vec<usize>,
    indices: Vec<u32>,
    values: Vec<f64>,
}

impl SparseMatrix {
    /// The matrix with the given entries off the diagonal, each meant for `(i, j)` and `(j, i)`, and the
    /// diagonal that makes every row sum to zero. Entries at one place are added in the order given.
    pub(crate) fn with_zero_row_sums(n: usize, off_diagonal: &[(u32, u32, f64)]) -> Self {
        let mut starts = vec![0_usize; n + 1];
        for &(i, j, _) in off_diagonal {
            starts[i as usize + 1] += 1;
            starts[j as usize + 1] += 1;
        }
        for i in 0..n {
            starts[i + 1] += starts[i];
        }
        let mut entries = vec![(0_u32, 0.0_f64); starts[n]];
        let mut next = starts.clone();
        for &(i, j, value) in off_diagonal {
            for (row, column) in [(i, j), (j, i)] {
                entries[next[row as usize]] = (column, value);
                next[row as usize] += 1;
            }
        }
        let mut matrix = Self {
            offsets: Vec::with_capacity(n + 1),
            indices: Vec::with_capacity(starts[n] / 2 + n),
            values: Vec::with_capacity(starts[n] / 2 + n),
        };
        matrix.offsets.push(0);
        for i in 0..n {
            matrix.push_row(i as u32, &mut entries[starts[i]..starts[i + 1]]);
        }
        matrix
    }

    /// Appends row `row`: `entries` merged by column, and the diagonal.
    fn push_row(&mut self, row: u32, entries: &mut [(u32, f64)]) {
        // A stable sort adds the contributions to (i, j) and to (j, i) in one order: the matrix is exactly
        // symmetric.
        entries.sort_by_key(|&(column, _)| column);
        let start = self.indices.len();
        let mut diagonal_at = None;
        for &(column, value) in entries.iter() {
            if column > row && diagonal_at.is_none() {
                diagonal_at = Some(self.push(row, 0.0));
            }
            if self.indices.len() > start && self.indices.last() == Some(&column) {
                *self.values.last_mut().expect("an index was pushed with its value") += value;
            } else {
                self.push(column, value);
            }
        }
        let diagonal_at = diagonal_at.unwrap_or_else(|| self.push(row, 0.0));
        let sum: f64 = self.values[start..].iter().sum();
        self.values[diagonal_at] = 0.0 - sum;
        self.offsets.push(self.indices.len());
    }

    /// Appends an entry to the last row and returns its place.
    fn push(&mut self, column: u32, value: f64) -> usize {
        self.indices.push(column);
        self.values.push(value);
        self.indices.len() - 1
    }

    /// Number of rows and columns `n`.
    pub fn n(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Where each row starts in `indices` and `values`, `[n + 1]`.
    pub fn offsets(&self) -> &[usize] {
        &self.offsets
    }

    /// Column of every stored entry, row by row.
    pub fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// Value of every stored entry, row by row.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The stored entries of row `i` as (column, value), columns ascending.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.offsets[i]..self.offsets[i + 1];
        self.indices[range.clone()].iter().zip(&self.values[range]).map(|(&j, &value)| (j as usize, value))
    }

    /// The diagonal, `[n]`.
    pub fn diagonal(&self) -> Vec<f64> {
        (0..self.n()).map(|i| self.row(i).filter(|&(j, _)| j == i).map(|(_, value)| value).sum()).collect()
    }

    /// The product with the columns of `x`, `[n, q]`, as `[n, q]`.
    ///
    /// # Panics
    /// If `x` has not `n` rows, which is a bug of the caller.
    pub fn multiply(&self, x: &Matrix) -> Matrix {
        assert_eq!(x.rows(), self.n(), "matrix and vectors live on different meshes");
        let q = x.cols();
        let mut product = Matrix::zeros(self.n(), q);
        product.data_mut().par_chunks_mut((ROWS_PER_TASK * q).max(1)).enumerate().for_each(|(task, rows)| {
            for (r, row) in rows.chunks_exact_mut(q).enumerate() {
                self.multiply_row(task * ROWS_PER_TASK + r, x, row);
            }
        });
        product
    }

    /// Adds row `i` of the product with `x` to `out`, `[q]`.
    pub(crate) fn multiply_row(&self, i: usize, x: &Matrix, out: &mut [f64]) {
        for (j, value) in self.row(i) {
            for (o, &xj) in out.iter_mut().zip(x.row(j)) {
                *o += value * xj;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_entries_add_up_and_rows_sum_to_zero() {
        let matrix = SparseMatrix::with_zero_row_sums(4, &[(0, 2, -1.0), (2, 0, -0.5), (1, 2, 0.25)]);
        assert_eq!(matrix.offsets(), &[0, 2, 4, 7, 8]);
        assert_eq!(matrix.indices(), &[0, 2, 1, 2, 0, 1, 2, 3]);
        assert_eq!(matrix.values(), &[1.5, -1.5, -0.25, 0.25, -1.5, 0.25, 1.25, 0.0]);
        assert_eq!(matrix.diagonal(), &[1.5, -0.25, 1.25, 0.0]);
        let ones = Matrix::from_vec(4, 1, vec![1.0; 4]);
        assert!(matrix.multiply(&ones).data().iter().all(|&x| x == 0.0));
    }
}
