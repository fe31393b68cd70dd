//! Block Lanczos with full orthogonalisation and thick restart (Wu and Simon 2000).

use super::filter::Filter;
use super::orthonormalise::{column_norms, orthonormalise, random_block};
use super::panel::{BLOCK, Panel, Square, TallMatrix};
use super::ritz::RitzPairs;
use faer::{Mat, MatRef};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A Krylov subspace of the filtered operator `F`: `F V = V T + Q B E^T`, with `E` the last `BLOCK` unit
/// vectors.
pub(super) struct Lanczos<'a> {
    filter: &'a Filter<'a>,
    /// Null vectors, then `V`.
    space: TallMatrix,
    /// Number of null vectors.
    null: usize,
    /// Null vectors and columns of `V`.
    len: usize,
    /// First column that `F Q` couples to.
    coupled: usize,
    /// The projected operator `T`.
    projected: Mat<f64>,
    /// The next block `Q`.
    next: Panel,
    /// `B`
    coupling: Square,
    random: ChaCha8Rng,
    /// Blocks that `F` was applied to.
    pub(super) steps: usize,
}

impl<'a> Lanczos<'a> {
    /// Starts from a random block orthogonal to the `null` vectors in the first columns of `space`, which are
    /// kept out of the subspace. `space` has room for `capacity` more columns.
    pub(super) fn new(
        filter: &'a Filter<'a>,
        space: TallMatrix,
        null: usize,
        n: usize,
        capacity: usize,
        seed: u64,
    ) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut next = vec![[0.0; BLOCK]; n];
        random_block(&mut next, &space, null, &mut random);
        Self {
            filter,
            space,
            null,
            len: null,
            coupled: null,
            projected: Mat::zeros(capacity, capacity),
            next,
            coupling: [[0.0; BLOCK]; BLOCK],
            random,
            steps: 0,
        }
    }

    /// Dimension of the subspace, null vectors aside.
    pub(super) fn dimension(&self) -> usize {
        self.len - self.null
    }

    /// Moves the next block into the subspace and makes a new one.
    pub(super) fn expand(&mut self) {
        let (start, end) = (self.len, self.len + BLOCK);
        self.space.set_panel(start, &self.next);
        let mut image = self.filter.apply(&self.next);
        self.steps += 1;
        let norms = column_norms(&image);
        // The few columns that the image has large parts of go first. What rounding leaves of all the columns
        // after that is small, so one pass over them makes the image orthogonal to working precision.
        let mut coefficients = self.space.inner(self.coupled..end, &image);
        self.space.subtract(self.coupled..end, &coefficients, &mut image);
        let rest = self.space.inner(0..end, &image);
        self.space.subtract(0..end, &rest, &mut image);
        for (c, r) in coefficients.iter_mut().zip(&rest[self.coupled..]) {
            c.iter_mut().zip(r).for_each(|(c, r)| *c += r);
        }
        self.record(start, &coefficients);
        self.coupling = orthonormalise(&mut image, &norms, &self.space, end, &mut self.random);
        self.next = image;
        self.coupled = start;
        self.len = end;
    }

    /// Writes the columns of `T` for the block at `start`, and the rows that mirror them.
    fn record(&mut self, start: usize, coefficients: &[[f64; BLOCK]]) {
        let column = start - self.null;
        for (c, values) in coefficients.iter().enumerate() {
            let row = self.coupled + c - self.null;
            for (j, &value) in values.iter().enumerate() {
                if row < column {
                    self.projected[(row, column + j)] = value;
                    self.projected[(column + j, row)] = value;
                } else {
                    let mirrored = coefficients[start + j - self.coupled][row - column];
                    self.projected[(row, column + j)] = 0.5 * (value + mirrored);
                }
            }
        }
    }

    /// The Ritz pairs of the subspace; `None` where the dense eigenproblem fails.
    pub(super) fn ritz_pairs(&self) -> Option<RitzPairs> {
        let m = self.dimension();
        RitzPairs::new(self.projected.as_ref().submatrix(0, 0, m, m), &self.coupling)
    }

    /// Shrinks the subspace to its first `keep` Ritz vectors; the next block stays.
    pub(super) fn restart(&mut self, ritz: &RitzPairs, keep: usize) {
        let rotation = ritz.vectors.as_ref().subcols(0, keep);
        self.space.rotate(self.null..self.len, rotation);
        self.projected.fill(0.0);
        for (i, &value) in ritz.values[..keep].iter().enumerate() {
            self.projected[(i, i)] = value;
        }
        self.len = self.null + keep;
        self.coupled = self.null;
    }

    /// Replaces the next block by a random one, to find eigenvectors that the Krylov subspace has no part of.
    pub(super) fn inject_random_block(&mut self) {
        random_block(&mut self.next, &self.space, self.len, &mut self.random);
        self.coupling = [[0.0; BLOCK]; BLOCK];
    }

    /// Calls `write` with rows of the first `count` Ritz vectors, chunk by chunk, and the first row of each
    /// chunk.
    ///
    /// Each vector is `F v / value` for the Ritz vector `v`, which needs no product with `F` but the
    /// coupling: it has the part of the next block that `v` lacks, so that noise at high frequency, which `F`
    /// suppresses, is not seen when `W` multiplies it (Nour-Omid, Parlett, Ericsson and Jensen 1987).
    pub(super) fn ritz_vectors(&self, ritz: &RitzPairs, count: usize, write: impl Fn(usize, &[f64]) + Sync) {
        let y = ritz.vectors.as_ref().subcols(0, count);
        let z = Mat::from_fn(BLOCK, count, |i, j| ritz.outside[(i, j)] / ritz.values[j]);
        self.space.combine(self.null..self.len, y, &self.next, MatRef::from(z.as_ref()), write);
    }
}
