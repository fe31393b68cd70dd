//! Nearest neighbours between two sets of rows in both directions at once, to single precision.
//!
//! One product of the two sets holds all inner products, and with the norms all distances: its rows have the nearest
//! neighbours of one direction, its columns those of the other. That is faster than two searches where both directions are
//! wanted and the sets are not large; distances that agree to single precision may be taken for one another.

use super::{SearchError, check_finite};
use crate::Matrix;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

/// Rows of either set in one product: what fits the cache.
const ROWS: usize = 192;
const COLUMNS: usize = 256;
/// Accumulators along a row of the product, which the compiler keeps in vector registers.
const LANES: usize = 16;

/// For each row `a_x` of `a`, `[n_a, d]`, the index of the nearest row of `b`, `[n_b, d]`, and the other way round; of equally
/// near ones the lowest. The same for any number of threads.
///
/// # Errors
/// If a set is empty, an entry is not finite, or the widths differ.
pub(crate) fn mutual_nearest([a, b]: [&Rows; 2]) -> Result<[Vec<u32>; 2], SearchError> {
    check_pair([a, b])?;
    let blocks: Vec<Block> =
        (0..a.n().div_ceil(ROWS)).into_par_iter().map(|block| Block::new(a, b, block * ROWS)).collect();
    let forth = blocks.iter().flat_map(|block| block.forth.iter().map(|best| best.index)).collect();
    let mut back = vec![Best::NONE; b.n()];
    for block in &blocks {
        back.iter_mut().zip(&block.back).for_each(|(best, found)| best.improve(*found));
    }
    Ok([forth, back.iter().map(|best| best.index).collect()])
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

/// Rows in single precision, `[n, d]`, with half of their squared norms, or of what takes their place: the squared distance of a row
/// `a_x` of one set and `b_y` of another is `2 (s_x + t_y - a_x . b_y)`.
pub(crate) struct Rows {
    entries: Matrix<f32>,
    half_squares: Vec<f32>,
}

impl Rows {
    /// Rows `[n, d]` and half of their squared norms, `[n]`.
    pub(crate) fn new(entries: Matrix<f32>, half_squares: Vec<f32>) -> Self {
        assert_eq!(entries.rows(), half_squares.len(), "one square for each row");
        Self { entries, half_squares }
    }

    /// Rows rounded, with their squared norms.
    pub(crate) fn rounded(rows: &Matrix, squares: &[f64]) -> Self {
        let half_squares = squares.iter().map(|square| (square / 2.0) as f32).collect();
        Self::new(rows.map(|x| x as f32), half_squares)
    }

    pub(super) fn n(&self) -> usize {
        self.entries.rows()
    }

    /// Some of the rows, in this order.
    pub(super) fn select(&self, rows: &[u32]) -> Self {
        let half_squares = rows.iter().map(|&i| self.half_squares[i as usize]).collect();
        Self::new(self.entries.select_rows(rows), half_squares)
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

/// The lowest value so far of `|y|^2 / 2 - x . y`, which orders the distances to `x`.
#[derive(Clone, Copy)]
struct Best {
    value: f32,
    index: u32,
}

impl Best {
    const NONE: Self = Self { value: f32::INFINITY, index: 0 };

    fn improve(&mut self, found: Self) {
        if found.value < self.value {
            *self = found;
        }
    }
}

/// What some rows of `a` find in all of `b`, and all of `b` in them.
struct Block {
    forth: Vec<Best>,
    back: Vec<Best>,
}

impl Block {
    fn new(a: &Rows, b: &Rows, first: usize) -> Self {
        let rows = ROWS.min(a.n() - first);
        let mut block = Self { forth: vec![Best::NONE; rows], back: vec![Best::NONE; b.n()] };
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
            for (i, row) in products.chunks_exact(columns).enumerate() {
                block.forth[i].improve(lowest(row, b_squares, start as u32));
                let (square, index) = (a.half_squares[first + i], (first + i) as u32);
                for (best, product) in block.back[start..start + columns].iter_mut().zip(row) {
                    let value = square - product;
                    let better = value < best.value;
                    best.value = if better { value } else { best.value };
                    best.index = if better { index } else { best.index };
                }
            }
        }
        block
    }
}

/// The lowest `square - product`, and where; indices count from `start`.
fn lowest(products: &[f32], squares: &[f32], start: u32) -> Best {
    let mut values = [f32::INFINITY; LANES];
    let mut chunks = [0u32; LANES];
    let whole = products.chunks_exact(LANES).zip(squares.chunks_exact(LANES));
    for (chunk, (products, squares)) in whole.enumerate() {
        for lane in 0..LANES {
            let value = squares[lane] - products[lane];
            let better = value < values[lane];
            values[lane] = if better { value } else { values[lane] };
            chunks[lane] = if better { chunk as u32 } else { chunks[lane] };
        }
    }
    let mut best = Best::NONE;
    for lane in 0..LANES {
        let found = Best { value: values[lane], index: start + chunks[lane] * LANES as u32 + lane as u32 };
        if (found.value, found.index) < (best.value, best.index) || best.value == f32::INFINITY {
            best = found;
        }
    }
    let tail = products.len() / LANES * LANES;
    for (i, (product, square)) in products.iter().zip(squares).enumerate().skip(tail) {
        best.improve(Best { value: square - product, index: start + i as u32 });
    }
    best
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
