//! Nearest neighbours between two sets of rows in both directions at once, to single precision.
//!
//! One product of the two sets holds all inner products, and with the norms all distances: its rows have the nearest
//! neighbours of one direction, its columns those of the other. That is faster than two searches where both
//! directions are wanted and the sets are not large; distances that agree to single precision may be taken for one
//! another.

use super::kernels::Kernels;
use super::{SearchError, check_finite};
use crate::Matrix;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;
use std::borrow::Cow;

/// Rows of either set in one product: what fits the cache.
const ROWS: usize = 192;
const COLUMNS: usize = 256;

/// For each row `a_x` of `a`, `[n_a, d]`, the index of the nearest row of `b`, `[n_b, d]`, and the other way round;
/// of equally near ones the lowest. The same for any number of threads.
///
/// # Errors
/// If a set is empty, an entry is not finite, or the widths differ.
pub(crate) fn mutual_nearest([a, b]: [&Rows; 2]) -> Result<[Vec<u32>; 2], SearchError> {
    check_pair([a, b])?;
    let blocks: Vec<Block> =
        (0..a.n().div_ceil(ROWS)).into_par_iter().map(|block| Block::new(a, b, block * ROWS)).collect();
    let forth = blocks.iter().flat_map(|block| block.forth.indices.iter().copied()).collect();
    let mut back = Lowest::none(b.n());
    blocks.iter().for_each(|block| back.improve(&block.back));
    Ok([forth, back.indices])
}

/// Whether two sets can be compared.
pub(super) fn check_pair([a, b]: [&Rows; 2]) -> Result<(), SearchError> {
    if a.entries.cols() != b.entries.cols() {
        return Err(SearchError::WidthMismatch { queries: a.entries.cols(), targets: b.entries.cols() });
    }
    if a.n() == 0 || b.n() == 0 {
        return Err(SearchError::NoTargets);
    }
    check_finite(&a.entries, "queries")?;
    check_finite(&b.entries, "targets")
}

/// The squared norm of each row, `[n]`.
pub(crate) fn squared_norms(rows: &Matrix) -> Vec<f64> {
    (0..rows.rows()).map(|i| rows.row(i).iter().map(|x| x * x).sum()).collect()
}

/// Rows in single precision, `[n, d]`, with half of their squared norms, or of what takes their place: the squared
/// distance of a row `a_x` of one set and `b_y` of another is `2 (s_x + t_y - a_x . b_y)`.
pub(crate) struct Rows<'a> {
    entries: Cow<'a, Matrix<f32>>,
    half_squares: Vec<f32>,
}

impl<'a> Rows<'a> {
    /// Rows `[n, d]` and half of their squared norms, `[n]`.
    pub(crate) fn new(entries: Cow<'a, Matrix<f32>>, half_squares: Vec<f32>) -> Self {
        assert_eq!(entries.rows(), half_squares.len(), "one square for each row");
        Self { entries, half_squares }
    }

    /// Rows rounded, with their squared norms.
    pub(crate) fn rounded(rows: &Matrix, squares: &[f64]) -> Self {
        let half_squares = squares.iter().map(|square| (square / 2.0) as f32).collect();
        Self::new(Cow::Owned(rows.map(|x| x as f32)), half_squares)
    }

    pub(super) fn n(&self) -> usize {
        self.entries.rows()
    }

    /// Some of the rows, in this order.
    pub(super) fn select(&self, rows: &[u32]) -> Rows<'static> {
        let half_squares = rows.iter().map(|&i| self.half_squares[i as usize]).collect();
        Rows::new(Cow::Owned(self.entries.select_rows(rows)), half_squares)
    }

    pub(super) fn row(&self, i: usize) -> &[f32] {
        self.entries.row(i)
    }

    pub(super) fn half_square(&self, i: usize) -> f32 {
        self.half_squares[i]
    }

    fn view(&self, first: usize, count: usize) -> MatRef<'_, f32> {
        self.entries.as_faer().subrows(first, count)
    }
}

/// For each row the lowest value so far of `|y|^2 / 2 - x . y`, which orders the distances to `x`, and whose it is.
struct Lowest {
    values: Vec<f32>,
    indices: Vec<u32>,
}

impl Lowest {
    fn none(n: usize) -> Self {
        Self { values: vec![f32::INFINITY; n], indices: vec![0; n] }
    }

    fn improve_at(&mut self, i: usize, value: f32, index: u32) {
        if value < self.values[i] {
            (self.values[i], self.indices[i]) = (value, index);
        }
    }

    fn improve(&mut self, other: &Self) {
        (0..self.values.len()).for_each(|i| self.improve_at(i, other.values[i], other.indices[i]));
    }
}

/// What some rows of `a` find in all of `b`, and all of `b` in them.
struct Block {
    forth: Lowest,
    back: Lowest,
}

impl Block {
    fn new(a: &Rows, b: &Rows, first: usize) -> Self {
        let kernels = Kernels::detect();
        let rows = ROWS.min(a.n() - first);
        let mut block = Self { forth: Lowest::none(rows), back: Lowest::none(b.n()) };
        let mut products = vec![0.0; rows * COLUMNS];
        for start in (0..b.n()).step_by(COLUMNS) {
            let columns = COLUMNS.min(b.n() - start);
            let products = &mut products[..rows * columns];
            faer::linalg::matmul::matmul(
                MatMut::from_row_major_slice_mut(products, rows, columns),
                Accum::Replace,
                a.view(first, rows),
                b.view(start, columns).transpose(),
                1.0,
                Par::Seq,
            );
            let b_squares = &b.half_squares[start..start + columns];
            let (values, indices) = (&mut block.back.values[start..], &mut block.back.indices[start..]);
            for (i, row) in products.chunks_exact(columns).enumerate() {
                let (value, index) = kernels.lowest_difference(b_squares, row);
                block.forth.improve_at(i, value, start as u32 + index);
                let of_a = (a.half_squares[first + i], (first + i) as u32);
                kernels.lower_differences(&mut values[..columns], &mut indices[..columns], of_a, row);
            }
        }
        block
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::point_map::search::nearest_rows;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn mutual_nearest(a: &Matrix, b: &Matrix) -> Result<[Vec<u32>; 2], SearchError> {
        super::mutual_nearest([a, b].map(|rows| Rows::rounded(rows, &squared_norms(rows))).each_ref())
    }

    fn random(rows: usize, cols: usize, seed: u64) -> Matrix {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        Matrix::from_fn(rows, cols, |_, _| rng.random_range(-1.0..1.0))
    }

    #[test]
    fn both_directions_are_those_of_two_searches() {
        for (n_a, n_b) in [(1, 1), (700, 531), (191, 257), (5, 400), (400, 5)] {
            let (a, b) = (random(n_a, 7, 1), random(n_b, 7, 2));
            let [forth, back] = mutual_nearest(&a, &b).unwrap();
            assert_eq!(forth, nearest_rows(&a, &b).unwrap().index);
            assert_eq!(back, nearest_rows(&b, &a).unwrap().index);
        }
    }

    #[test]
    fn of_equally_near_rows_the_lowest_is_taken() {
        let a = Matrix::from_fn(450, 3, |i, _| f64::from(i as u32 / 150));
        let b = Matrix::from_fn(600, 3, |i, _| f64::from(i as u32 / 200));
        let [forth, back] = mutual_nearest(&a, &b).unwrap();
        assert!(forth.iter().enumerate().all(|(i, &j)| j as usize == i / 150 * 200));
        assert!(back.iter().enumerate().all(|(j, &i)| i as usize == j / 200 * 150));
    }

    #[test]
    fn bad_rows_are_errors() {
        let a = random(4, 3, 3);
        assert!(matches!(mutual_nearest(&a, &random(4, 2, 4)), Err(SearchError::WidthMismatch { .. })));
        assert_eq!(mutual_nearest(&a, &Matrix::zeros(0, 3)), Err(SearchError::NoTargets));
        let mut nan = a.clone();
        nan[(2, 1)] = f64::NAN;
        let expected = SearchError::NotFinite { role: "targets", row: 2 };
        assert_eq!(mutual_nearest(&a, &nan), Err(expected));
    }
}
