//! The iteration: expands the subspace until the wanted pairs converge, and checks that none is missing.

use super::factor::{Analysis, Cholesky};
use super::filter::Filter;
use super::lanczos::Lanczos;
use super::panel::{BLOCK, TallMatrix};
use super::pencil::Pencil;
use super::ritz::RitzPairs;
use super::{EigenError, EigenOptions};
use crate::Matrix;
use std::cmp::Ordering;

/// The shift is this share of Weyl's estimate of the last eigenvalue: enough to make the factor well
/// conditioned, too little to bring the wanted eigenvalues together.
const RELATIVE_SHIFT: f64 = 0.1;
/// Eigenvalues up to this multiple of Weyl's estimate are amplified.
const RELATIVE_CUT: f64 = 1.6;
/// Least filtered value of a wanted pair: at 1 the damped ones begin.
const LEAST_AMPLIFICATION: f64 = 1.05;
/// How often the cut is doubled, a shift refused by the factorisation enlarged, a missing eigenvector sought.
const MAX_ATTEMPTS: usize = 12;

/// Relative gap between eigenvalues that no rounding closes.
const CLEAR_GAP: f64 = 1e-6;
/// Relative residual that makes the pair after the last wanted one known well enough for the gap before it.
const LEAST_ACCURACY_BEYOND: f64 = 1e-4;

/// What the iteration found.
pub(super) struct Found {
    /// Eigenvalues but the null ones, for area 1, ascending.
    pub(super) eigenvalues: Vec<f64>,
    /// `[n, k]`; the first columns are left for the null vectors.
    pub(super) eigenvectors: Matrix,
    pub(super) stats: Stats,
}

/// Figures for [`EigenInfo`](super::EigenInfo).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stats {
    pub(super) steps: usize,
    pub(super) restarts: usize,
    pub(super) subspace: usize,
    pub(super) factor_entries: usize,
    pub(super) complete: Option<bool>,
}

/// The shift, for area 1, that a solve for `k` pairs starts from.
pub(super) fn shift(k: usize) -> f64 {
    RELATIVE_SHIFT * Pencil::weyl_estimate(k + BLOCK)
}

/// The `k` smallest pairs, of which the null vectors of the pencil's components are known.
pub(super) fn iterate(pencil: &Pencil<'_>, k: usize, options: &EigenOptions) -> Result<Found, EigenError> {
    let analysis = Analysis::new(pencil)?;
    let (sigma, factor) = positive_definite_factor(pencil, &analysis, k)?;
    let mut search =
        Search { pencil, analysis: &analysis, factor: &factor, sigma, k, options, stats: Stats::default() };
    search.stats.factor_entries = analysis.factor_entries();
    let mut cut = RELATIVE_CUT * Pencil::weyl_estimate(k + BLOCK);
    for _ in 0..MAX_ATTEMPTS {
        if let Some(found) = search.run(cut)? {
            return Ok(found);
        }
        cut *= 2.0;
    }
    Err(EigenError::Factorization { reason: "the eigenvalues are far above those of a surface".into() })
}

/// The shift `sigma < 0` and the factor of `D W D - sigma`. Where rounding makes that indefinite, a larger
/// shift is taken.
pub(super) fn positive_definite_factor<'a>(
    pencil: &Pencil<'_>,
    analysis: &'a Analysis,
    k: usize,
) -> Result<(f64, Cholesky<'a>), EigenError> {
    let mut sigma = -shift(k);
    for _ in 0..MAX_ATTEMPTS {
        if let Some(factor) = analysis.cholesky(&pencil.shifted(sigma)) {
            return Ok((sigma, factor));
        }
        sigma *= 10.0;
    }
    Err(EigenError::Factorization { reason: "the matrix is not positive definite".into() })
}

struct Search<'a> {
    pencil: &'a Pencil<'a>,
    analysis: &'a Analysis,
    factor: &'a Cholesky<'a>,
    sigma: f64,
    k: usize,
    options: &'a EigenOptions,
    stats: Stats,
}

impl Search<'_> {
    /// Pairs wanted besides the null ones.
    fn wanted(&self) -> usize {
        self.k - self.pencil.components.len()
    }

    /// Largest dimension of the subspace.
    fn capacity(&self) -> usize {
        let wanted = self.wanted();
        let dimension = self.options.subspace.unwrap_or(wanted * 23 / 10 + 16 * BLOCK);
        let room = self.pencil.n() - self.pencil.components.len() - BLOCK;
        dimension.max(wanted + 4 * BLOCK).min(room) / BLOCK * BLOCK
    }

    /// Runs with the filter for `cut`; `None` if the cut is below the last wanted eigenvalue.
    fn run(&mut self, cut: f64) -> Result<Option<Found>, EigenError> {
        let (wanted, capacity) = (self.wanted(), self.capacity());
        let filter = Filter::new(self.factor, self.sigma, cut);
        let mut lanczos = self.start(&filter, capacity);
        let mut check_at = (wanted * 17 / 10 + 5 * BLOCK).min(capacity);
        let mut injections = 0;
        loop {
            while lanczos.dimension() < check_at && lanczos.dimension() + BLOCK <= capacity {
                lanczos.expand();
                self.stats.steps += 1;
            }
            self.stats.subspace = self.stats.subspace.max(lanczos.dimension());
            let ritz = lanczos.ritz_pairs().ok_or(EigenError::DenseSolver)?;
            let worst = (0..wanted).map(|j| ritz.residual(j)).fold(0.0, f64::max);
            let amplified = ritz.values[wanted - 1] > LEAST_AMPLIFICATION;
            if worst <= self.options.tolerance && amplified {
                self.stats.complete = self.check_complete(&filter, &ritz);
                if self.stats.complete != Some(false) || injections == MAX_ATTEMPTS {
                    return Ok(Some(self.found(&filter, &lanczos, &ritz)));
                }
                injections += 1;
                lanczos.restart(&ritz, wanted);
                lanczos.inject_random_block();
                check_at = (lanczos.dimension() + 4 * BLOCK).min(capacity);
            } else if lanczos.dimension() + BLOCK <= capacity {
                check_at = lanczos.dimension() + BLOCK * blocks_to_go(worst / self.options.tolerance);
            } else if !amplified {
                return Ok(None);
            } else if self.stats.restarts == self.options.max_restarts {
                let residuals: Vec<f64> = (0..wanted).map(|j| ritz.residual(j)).collect();
                return Err(self.not_converged(worst, residuals));
            } else {
                self.stats.restarts += 1;
                let keep = wanted + (capacity - wanted) / 3;
                lanczos.restart(&ritz, keep);
                check_at = keep + BLOCK * blocks_to_go(worst / self.options.tolerance).max(4);
            }
        }
    }

    /// The first block, orthogonal to the null vectors.
    fn start<'f>(&self, filter: &'f Filter<'f>, capacity: usize) -> Lanczos<'f> {
        let components = &self.pencil.components;
        let mut space = TallMatrix::zeros(self.pencil.n(), components.len() + capacity);
        for (row, &vertex) in self.analysis.order().iter().enumerate() {
            let component = components.of_vertex[vertex as usize] as usize;
            let share = (self.pencil.area / components.areas[component]).sqrt();
            space.set_entry(row, component, share / self.pencil.scale[vertex as usize]);
        }
        Lanczos::new(filter, space, components.len(), self.pencil.n(), capacity, self.options.seed)
    }

    /// Whether as many eigenvalues as were found lie below a number in the last gap between them; `None`
    /// where that is not asked for or cannot be decided.
    fn check_complete(&self, filter: &Filter<'_>, ritz: &RitzPairs) -> Option<bool> {
        if !self.options.verify {
            return None;
        }
        let (found, bound) = last_gap(filter, ritz, self.wanted())?;
        let found = found + self.pencil.components.len();
        match self.analysis.negative_eigenvalues(&self.pencil.shifted(bound))?.cmp(&found) {
            Ordering::Less => None,
            Ordering::Equal => Some(true),
            Ordering::Greater => Some(false),
        }
    }

    fn not_converged(&self, worst: f64, residuals: Vec<f64>) -> EigenError {
        EigenError::NotConverged {
            k: self.k,
            converged: residuals.iter().take_while(|&&r| r <= self.options.tolerance).count(),
            restarts: self.stats.restarts,
            subspace: self.stats.subspace,
            worst,
            residuals,
        }
    }

    fn found(&self, filter: &Filter<'_>, lanczos: &Lanczos<'_>, ritz: &RitzPairs) -> Found {
        let (wanted, null) = (self.wanted(), self.pencil.components.len());
        let mut eigenvectors = Matrix::zeros(self.pencil.n(), self.k);
        let rows = ScatteredRows::new(&mut eigenvectors);
        let order = self.analysis.order();
        let to_mesh = self.pencil.area.sqrt().recip();
        lanczos.ritz_vectors(ritz, wanted, |first, values| {
            for (values, &vertex) in values.chunks_exact(wanted).zip(&order[first..]) {
                let scale = self.pencil.scale[vertex as usize] * to_mesh;
                // SAFETY: `order` is a permutation, so no other call writes this vertex.
                let row = unsafe { rows.row(vertex as usize) };
                row[null..].iter_mut().zip(values).for_each(|(x, v)| *x = v * scale);
            }
        });
        let eigenvalues = ritz.values[..wanted].iter().map(|&v| filter.eigenvalue(v)).collect();
        Found { eigenvalues, eigenvectors, stats: self.stats }
    }
}

/// How many of the wanted eigenvalues come before the last clear gap in the spectrum, and a number in that
/// gap.
///
/// The gap after the last wanted one counts if the pair beyond it is known well enough. Where a multiple
/// eigenvalue is cut off there, the gap is the one before it.
fn last_gap(filter: &Filter<'_>, ritz: &RitzPairs, wanted: usize) -> Option<(usize, f64)> {
    let beyond_known = wanted < ritz.values.len() && ritz.residual(wanted) < LEAST_ACCURACY_BEYOND;
    let last = if beyond_known { wanted } else { wanted - 1 };
    (1..=last).rev().find_map(|count| {
        let below = filter.eigenvalue(ritz.values[count - 1]);
        let gap = filter.eigenvalue(ritz.values[count]) - below;
        (gap > CLEAR_GAP * below).then_some((count, below + 0.5 * gap))
    })
}

/// Blocks until the residual has come down by `ratio`: about one for each digit.
fn blocks_to_go(ratio: f64) -> usize {
    if ratio.is_finite() { (0.9 * ratio.max(1.0).log10()).ceil().clamp(1.0, 8.0) as usize } else { 8 }
}

/// Rows of a matrix that tasks write in any order, each row by one task.
struct ScatteredRows<'a> {
    start: *mut f64,
    rows: usize,
    columns: usize,
    matrix: std::marker::PhantomData<&'a mut Matrix>,
}

// SAFETY: rows are handed out by `row`, whose contract excludes two references to one row.
unsafe impl Sync for ScatteredRows<'_> {}

impl<'a> ScatteredRows<'a> {
    fn new(matrix: &'a mut Matrix) -> Self {
        let (rows, columns) = (matrix.rows(), matrix.cols());
        Self { start: matrix.data_mut().as_mut_ptr(), rows, columns, matrix: std::marker::PhantomData }
    }

    /// Row `i`.
    ///
    /// # Safety
    /// No other reference to this row may exist while the returned one lives.
    #[allow(clippy::mut_from_ref)]
    unsafe fn row(&self, i: usize) -> &mut [f64] {
        assert!(i < self.rows);
        // SAFETY: the row lies within the matrix, which is borrowed for as long as `self` lives.
        unsafe { std::slice::from_raw_parts_mut(self.start.add(i * self.columns), self.columns) }
    }
}
