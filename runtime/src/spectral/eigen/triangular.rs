//! Triangular solves with a supernodal Cholesky factor for several right-hand sides at once.
//!
//! The right-hand sides are interleaved by rows, so that one entry of the factor meets all of them in one
//! vector register. Each right-hand side sees the same operations in the same order whatever the number `W`
//! beside it.

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

/// A factor `L` with the reciprocals of its diagonal in the diagonal's place.
#[derive(Clone, Copy)]
pub(super) struct LowerFactor<'a> {
    pub(super) symbolic: &'a SymbolicSupernodalCholesky<u32>,
    pub(super) values: &'a [f64],
}

/// Consecutive columns with the same rows below them, stored as one dense column-major block.
struct Supernode<'a> {
    start: usize,
    columns: usize,
    /// Rows below the diagonal block.
    pattern: &'a [u32],
    /// `[columns + pattern.len(), columns]`.
    values: &'a [f64],
}

impl<'a> LowerFactor<'a> {
    #[inline(always)]
    fn supernode(self, s: usize) -> Supernode<'a> {
        let node = self.symbolic.supernode(s);
        let value_offsets = self.symbolic.col_ptr_for_val();
        Supernode {
            start: node.start(),
            columns: self.symbolic.supernode_end()[s] as usize - node.start(),
            pattern: node.pattern(),
            values: &self.values[value_offsets[s] as usize..value_offsets[s + 1] as usize],
        }
    }

    /// Solves `L L^T X = B` in place.
    pub(super) fn solve<const W: usize>(self, x: &mut [[f64; W]]) {
        assert_eq!(x.len(), self.symbolic.nrows(), "factor and right-hand sides differ in size");
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") {
                // SAFETY: the processor has the instructions that the function is compiled for.
                return unsafe { self.solve_avx512(x) };
            }
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                // SAFETY: as above.
                return unsafe { self.solve_avx2(x) };
            }
        }
        self.solve_with::<W, { cfg!(target_arch = "aarch64") }>(x);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    fn solve_avx512<const W: usize>(self, x: &mut [[f64; W]]) {
        self.solve_with::<W, true>(x);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn solve_avx2<const W: usize>(self, x: &mut [[f64; W]]) {
        self.solve_with::<W, true>(x);
    }

    #[inline(always)]
    fn solve_with<const W: usize, const FMA: bool>(self, x: &mut [[f64; W]]) {
        let n_supernodes = self.symbolic.n_supernodes();
        for s in 0..n_supernodes {
            self.supernode(s).forward::<W, FMA>(x);
        }
        for s in (0..n_supernodes).rev() {
            self.supernode(s).backward::<W, FMA>(x);
        }
    }
}

impl Supernode<'_> {
    /// Column `j` of the block.
    #[inline(always)]
    fn column(&self, j: usize) -> &[f64] {
        let rows = self.columns + self.pattern.len();
        &self.values[j * rows..(j + 1) * rows]
    }

    /// Solves for the supernode's own unknowns and subtracts their part from the rows below.
    #[inline(always)]
    fn forward<const W: usize, const FMA: bool>(&self, x: &mut [[f64; W]]) {
        let (above, below) = x.split_at_mut(self.start + self.columns);
        let own = &mut above[self.start..];
        for j in 0..self.columns {
            let column = self.column(j);
            let (done, rest) = own.split_at_mut(j + 1);
            scale(&mut done[j], column[j]);
            for (xi, &l) in rest.iter_mut().zip(&column[j + 1..]) {
                axpy::<W, FMA>(xi, -l, &done[j]);
            }
        }
        let mut i = 0;
        while i + 8 <= self.pattern.len() {
            self.scatter::<W, 8, FMA>(i, own, below);
            i += 8;
        }
        while i + 2 <= self.pattern.len() {
            self.scatter::<W, 2, FMA>(i, own, below);
            i += 2;
        }
        if i < self.pattern.len() {
            self.scatter::<W, 1, FMA>(i, own, below);
        }
    }

    /// Subtracts the part of `own` from `T` rows of the pattern.
    #[inline(always)]
    fn scatter<const W: usize, const T: usize, const FMA: bool>(
        &self,
        first: usize,
        own: &[[f64; W]],
        below: &mut [[f64; W]],
    ) {
        let mut sums = [[0.0; W]; T];
        for (j, xj) in own.iter().enumerate() {
            let l = &self.column(j)[self.columns + first..][..T];
            for t in 0..T {
                axpy::<W, FMA>(&mut sums[t], l[t], xj);
            }
        }
        let base = self.start + self.columns;
        for (&row, sum) in self.pattern[first..first + T].iter().zip(&sums) {
            let target = &mut below[row as usize - base];
            for w in 0..W {
                target[w] -= sum[w];
            }
        }
    }

    /// Subtracts the part of the rows below and solves for the supernode's own unknowns.
    #[inline(always)]
    fn backward<const W: usize, const FMA: bool>(&self, x: &mut [[f64; W]]) {
        let (above, below) = x.split_at_mut(self.start + self.columns);
        let own = &mut above[self.start..];
        let mut j = 0;
        while j + 4 <= self.columns {
            self.gather::<W, 4, FMA>(j, own, below);
            j += 4;
        }
        while j < self.columns {
            self.gather::<W, 1, FMA>(j, own, below);
            j += 1;
        }
        for j in (0..self.columns).rev() {
            let column = self.column(j);
            let (head, rest) = own.split_at_mut(j + 1);
            for (xi, &l) in rest.iter().zip(&column[j + 1..]) {
                axpy::<W, FMA>(&mut head[j], -l, xi);
            }
            scale(&mut head[j], column[j]);
        }
    }

    /// Subtracts from `T` of the own unknowns the part of the rows below. Even and odd rows are summed apart,
    /// so that the sums do not wait for each other.
    #[inline(always)]
    fn gather<const W: usize, const T: usize, const FMA: bool>(
        &self,
        first: usize,
        own: &mut [[f64; W]],
        below: &[[f64; W]],
    ) {
        let base = self.start + self.columns;
        let columns: [&[f64]; T] = std::array::from_fn(|t| &self.column(first + t)[self.columns..]);
        let mut sums = [[[0.0; W]; T]; 2];
        let pairs = self.pattern.chunks_exact(2);
        let odd_one = pairs.remainder();
        for (p, rows) in pairs.enumerate() {
            for half in 0..2 {
                let xi = &below[rows[half] as usize - base];
                for t in 0..T {
                    axpy::<W, FMA>(&mut sums[half][t], columns[t][2 * p + half], xi);
                }
            }
        }
        if let Some(&row) = odd_one.first() {
            for t in 0..T {
                axpy::<W, FMA>(
                    &mut sums[0][t],
                    columns[t][self.pattern.len() - 1],
                    &below[row as usize - base],
                );
            }
        }
        for t in 0..T {
            for w in 0..W {
                own[first + t][w] -= sums[0][t][w] + sums[1][t][w];
            }
        }
    }
}

/// `y += a x`
#[inline(always)]
fn axpy<const W: usize, const FMA: bool>(y: &mut [f64; W], a: f64, x: &[f64; W]) {
    for w in 0..W {
        y[w] = if FMA { a.mul_add(x[w], y[w]) } else { y[w] + a * x[w] };
    }
}

/// `y *= a`
#[inline(always)]
fn scale<const W: usize>(y: &mut [f64; W], a: f64) {
    y.iter_mut().for_each(|y| *y *= a);
}
