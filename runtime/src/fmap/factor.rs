//! Factors of the small symmetric systems that functional maps are solved from.

use super::FmapError;
use super::dense::{ThinSvd, multiply, thin_svd};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::{factor, solve};
use faer::{Mat, MatMut, MatRef, Par};

/// Singular values of a system below this share of the largest count as zero where its Cholesky factor fails.
const SINGULAR: f64 = 1e-12;

/// A symmetric positive semi-definite `[k, k]` system, ready to be solved many times.
#[derive(Clone, Debug)]
pub(crate) enum Factor {
    /// The lower Cholesky factor.
    Cholesky(Mat<f64>),
    /// The singular value decomposition, of which the first so many directions count: solutions of least norm.
    Truncated(ThinSvd, usize),
}

impl Factor {
    /// Factors `system` by Cholesky's method, or truncates it where it is singular to working precision.
    pub(crate) fn new(system: Mat<f64>) -> Result<Self, FmapError> {
        if let Some(factor) = Self::cholesky(system.clone())
            && factor.condition() < 1.0 / SINGULAR
        {
            return Ok(factor);
        }
        let svd = thin_svd(system.as_ref())?;
        let rank = svd.s.iter().take_while(|&&x| x > SINGULAR * svd.s[0]).count();
        Ok(Self::Truncated(svd, rank))
    }

    fn cholesky(mut system: Mat<f64>) -> Option<Self> {
        let scratch = factor::cholesky_in_place_scratch::<f64>(system.nrows(), Par::Seq, Default::default());
        let mut memory = MemBuffer::new(scratch);
        let stack = MemStack::new(&mut memory);
        factor::cholesky_in_place(system.as_mut(), Default::default(), Par::Seq, stack, Default::default())
            .ok()?;
        Some(Self::Cholesky(system))
    }

    /// Number of independent directions.
    pub(super) fn rank(&self) -> usize {
        match self {
            Self::Cholesky(lower) => lower.nrows(),
            Self::Truncated(_, rank) => *rank,
        }
    }

    /// The condition number of the whole system; of a Cholesky factor a lower bound, from the pivots.
    pub(super) fn condition(&self) -> f64 {
        match self {
            Self::Cholesky(lower) => {
                let pivots = || (0..lower.nrows()).map(|i| lower[(i, i)]);
                let (largest, smallest) =
                    (pivots().fold(0.0, f64::max), pivots().fold(f64::INFINITY, f64::min));
                (largest / smallest).powi(2)
            }
            Self::Truncated(svd, _) => {
                let smallest = svd.s.last().copied().unwrap_or(0.0);
                if smallest > 0.0 { svd.s[0] / smallest } else { f64::INFINITY }
            }
        }
    }

    /// Replaces every column of `right`, `[k, m]`, by its solution. The work is done on a copy of its own: what faer
    /// rounds depends on where in memory a column begins, and a [`Mat`] always begins at the same alignment.
    pub(crate) fn solve(&self, mut right: MatMut<'_, f64>) {
        match self {
            Self::Cholesky(lower) => {
                let scratch = solve::solve_in_place_scratch::<f64>(lower.nrows(), right.ncols(), Par::Seq);
                let mut memory = MemBuffer::new(scratch);
                let mut aligned = right.to_owned();
                let stack = MemStack::new(&mut memory);
                solve::solve_in_place(lower.as_ref(), aligned.as_mut(), Par::Seq, stack);
                right.copy_from(aligned);
            }
            Self::Truncated(svd, rank) => right.copy_from(truncated_solution(svd, *rank, right.as_ref())),
        }
    }
}

/// `V S^+ U^T b` of each column `b`, without the singular values after the first `rank`.
fn truncated_solution(svd: &ThinSvd, rank: usize, right: MatRef<'_, f64>) -> Mat<f64> {
    let mut coefficients = multiply(svd.u.transpose(), right);
    for j in 0..coefficients.rows() {
        let scale = |x: &mut f64| *x = if j < rank { *x / svd.s[j] } else { 0.0 };
        coefficients.row_mut(j).iter_mut().for_each(scale);
    }
    multiply(svd.v.as_ref(), coefficients.as_faer()).as_faer().to_owned()
}
