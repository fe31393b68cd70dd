//! Tall matrices `[n, m]` in row-major storage, and their products with narrow panels.
//!
//! Every product splits the rows in chunks of fixed size; sums over rows add the chunks in order. The result
//! is the same bytes for any number of threads.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;
use std::ops::Range;

/// Number of vectors that Lanczos advances together.
pub(super) const BLOCK: usize = 8;

/// `BLOCK` vectors side by side, `[n, BLOCK]`.
pub(super) type Panel = Vec<[f64; BLOCK]>;

/// A small square matrix of coefficients, row-major.
pub(super) type Square = [[f64; BLOCK]; BLOCK];

const ROWS_PER_TASK: usize = 1024;

/// A row-major matrix whose first columns hold vectors; the columns after them are room for more.
pub(super) struct TallMatrix {
    stride: usize,
    data: Vec<f64>,
}

impl TallMatrix {
    pub(super) fn zeros(rows: usize, columns: usize) -> Self {
        // A stride that is an odd multiple of a cache line spreads a column over all sets of the cache.
        let stride = (columns.div_ceil(8) | 1) * 8;
        Self { stride, data: vec![0.0; rows * stride] }
    }

    pub(super) fn set_entry(&mut self, row: usize, column: usize, value: f64) {
        self.data[row * self.stride + column] = value;
    }

    /// Writes `panel` to the columns from `at`.
    pub(super) fn set_panel(&mut self, at: usize, panel: &Panel) {
        for (row, values) in self.data.chunks_exact_mut(self.stride).zip(panel) {
            row[at..at + BLOCK].copy_from_slice(values);
        }
    }

    /// Row chunks with the first row of each.
    fn chunks(&self) -> impl IndexedParallelIterator<Item = &[f64]> {
        self.data.par_chunks(ROWS_PER_TASK * self.stride)
    }

    /// `V^T U` for the columns `V` in the range, `[columns, BLOCK]`.
    pub(super) fn inner(&self, columns: Range<usize>, panel: &Panel) -> Vec<[f64; BLOCK]> {
        let width = columns.len();
        let parts: Vec<Vec<[f64; BLOCK]>> = self
            .chunks()
            .zip(panel.par_chunks(ROWS_PER_TASK))
            .map(|(rows, u)| {
                let mut part = vec![[0.0; BLOCK]; width];
                let v = view(rows, self.stride, u.len(), &columns);
                let u = MatRef::from_row_major_slice(u.as_flattened(), u.len(), BLOCK);
                let out = MatMut::from_row_major_slice_mut(part.as_flattened_mut(), width, BLOCK);
                matmul(out, Accum::Replace, v.transpose(), u, 1.0, Par::Seq);
                part
            })
            .collect();
        sum(parts, width)
    }

    /// `U -= V C` for the columns `V` in the range and the coefficients `C`, `[columns, BLOCK]`.
    pub(super) fn subtract(&self, columns: Range<usize>, coefficients: &[[f64; BLOCK]], panel: &mut Panel) {
        let c = MatRef::from_row_major_slice(coefficients.as_flattened(), columns.len(), BLOCK);
        self.chunks().zip(panel.par_chunks_mut(ROWS_PER_TASK)).for_each(|(rows, u)| {
            let v = view(rows, self.stride, u.len(), &columns);
            let n_rows = u.len();
            let u = MatMut::from_row_major_slice_mut(u.as_flattened_mut(), n_rows, BLOCK);
            matmul(u, Accum::Add, v, c, -1.0, Par::Seq);
        });
    }

    /// Replaces the columns `V` in the range by `V Y`, written from the start of the range.
    pub(super) fn rotate(&mut self, columns: Range<usize>, y: MatRef<'_, f64>) {
        let stride = self.stride;
        self.data.par_chunks_mut(ROWS_PER_TASK * stride).for_each(|rows| {
            let n_rows = rows.len() / stride;
            let product = multiply(view(rows, stride, n_rows, &columns), y);
            for (row, values) in rows.chunks_exact_mut(stride).zip(product.chunks_exact(y.ncols().max(1))) {
                row[columns.start..columns.start + y.ncols()].copy_from_slice(values);
            }
        });
    }

    /// Calls `write` with the rows of `V Y + U Z`, `[rows, columns of Y]`, chunk by chunk, and the first row
    /// of each chunk.
    pub(super) fn combine(
        &self,
        columns: Range<usize>,
        y: MatRef<'_, f64>,
        panel: &Panel,
        z: MatRef<'_, f64>,
        write: impl Fn(usize, &[f64]) + Sync,
    ) {
        self.chunks().zip(panel.par_chunks(ROWS_PER_TASK)).enumerate().for_each(|(chunk, (rows, u))| {
            let mut product = multiply(view(rows, self.stride, u.len(), &columns), y);
            let out = MatMut::from_row_major_slice_mut(&mut product, u.len(), y.ncols());
            let u = MatRef::from_row_major_slice(u.as_flattened(), u.len(), BLOCK);
            matmul(out, Accum::Add, u, z, 1.0, Par::Seq);
            write(chunk * ROWS_PER_TASK, &product);
        });
    }
}

/// The columns in the range of row-major `rows`.
fn view<'a>(rows: &'a [f64], stride: usize, n_rows: usize, columns: &Range<usize>) -> MatRef<'a, f64> {
    MatRef::from_row_major_slice_with_stride(rows, n_rows, stride, stride)
        .subcols(columns.start, columns.len())
}

/// `v y`, row-major.
fn multiply(v: MatRef<'_, f64>, y: MatRef<'_, f64>) -> Vec<f64> {
    let mut product = vec![0.0; v.nrows() * y.ncols()];
    let out = MatMut::from_row_major_slice_mut(&mut product, v.nrows(), y.ncols());
    matmul(out, Accum::Replace, v, y, 1.0, Par::Seq);
    product
}

fn sum(parts: Vec<Vec<[f64; BLOCK]>>, width: usize) -> Vec<[f64; BLOCK]> {
    let mut total = vec![[0.0; BLOCK]; width];
    for part in parts {
        for (t, p) in total.as_flattened_mut().iter_mut().zip(part.as_flattened()) {
            *t += p;
        }
    }
    total
}

/// `U^T U`.
pub(super) fn gram(panel: &Panel) -> Square {
    let parts: Vec<Vec<[f64; BLOCK]>> = panel
        .par_chunks(ROWS_PER_TASK)
        .map(|u| {
            let mut part = vec![[0.0; BLOCK]; BLOCK];
            let out = MatMut::from_row_major_slice_mut(part.as_flattened_mut(), BLOCK, BLOCK);
            let u = MatRef::from_row_major_slice(u.as_flattened(), u.len(), BLOCK);
            matmul(out, Accum::Replace, u.transpose(), u, 1.0, Par::Seq);
            part
        })
        .collect();
    sum(parts, BLOCK).try_into().expect("the sum has BLOCK rows")
}

/// `U := U M`.
pub(super) fn multiply_right(panel: &mut Panel, m: &Square) {
    let m = MatRef::from_row_major_slice(m.as_flattened(), BLOCK, BLOCK);
    panel.par_chunks_mut(ROWS_PER_TASK).for_each(|u| {
        let n_rows = u.len();
        let product = multiply(MatRef::from_row_major_slice(u.as_flattened(), n_rows, BLOCK), m);
        u.as_flattened_mut().copy_from_slice(&product);
    });
}

/// Applies `update` to corresponding rows of `target` and `source`.
pub(super) fn zip_rows(
    target: &mut Panel,
    source: &Panel,
    update: impl Fn(&mut [f64; BLOCK], &[f64; BLOCK]) + Sync,
) {
    target.par_chunks_mut(ROWS_PER_TASK).zip(source.par_chunks(ROWS_PER_TASK)).for_each(|(t, s)| {
        t.iter_mut().zip(s).for_each(|(t, s)| update(t, s));
    });
}
