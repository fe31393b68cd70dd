//! A solved functional map that knows its gradient.
//!
//! Row `i` of `C` solves `S_i c_i = F^ g_i` with `S_i = F^ F^T + w d diag(D_i)`, `d = tr(F^ F^T) / k`. For a gradient
//! `dC` let `m_i = S_i^-1 dc_i` be the rows of `M`. Then `dG^ = M F^` and
//! `dF^ = M^T (G^ - C F^) - C^T M F^ + (2 / k) e F^`, where `e = -w sum_ij m_ij D_ij c_ij`. Least squares are the
//! case `w = 0`. Where a system is truncated, its subspace is held fixed.

use super::dense::multiply;
use super::factor::Factor;
use super::least_squares::solve_least_squares;
use super::regularized::{check_mask, solve_rows};
use super::{FmapError, FmapInfo, LeastSquaresOptions, check_system, dense};
use crate::Matrix;
use faer::MatMut;
use rayon::prelude::*;

/// A functional map `C`, `[k_target, k_source]`, with the factors that it was solved by.
#[derive(Clone, Debug)]
pub struct FmapSolution {
    f_hat: Matrix,
    g_hat: Matrix,
    /// One for all rows of `C`, or one for each.
    factors: Vec<Factor>,
    /// `w D`, `[k_target, k_source]`; `None` where the system does not depend on it.
    mask: Option<Matrix>,
    map: Matrix,
    info: FmapInfo,
}

impl FmapSolution {
    /// The solution of [`super::least_squares`].
    ///
    /// # Errors
    /// As [`super::least_squares`].
    pub fn least_squares(
        f_hat: Matrix,
        g_hat: Matrix,
        options: &LeastSquaresOptions,
    ) -> Result<Self, FmapError> {
        check_system(&f_hat, &g_hat)?;
        let (map, info, factor) = solve_least_squares(&f_hat, &g_hat, options)?;
        Ok(Self { f_hat, g_hat, factors: vec![factor], mask: None, map, info })
    }

    /// The solution of [`super::regularized`], given the [`super::resolvent_mask`], `[k_target, k_source]`.
    ///
    /// # Errors
    /// As [`super::regularized`], and if the mask is not of that shape.
    pub fn regularized(f_hat: Matrix, g_hat: Matrix, mask: &Matrix, weight: f64) -> Result<Self, FmapError> {
        check_system(&f_hat, &g_hat)?;
        check_mask(&f_hat, &g_hat, mask, weight)?;
        let (map, info, factors) = solve_rows(&f_hat, &g_hat, mask, weight, |factor| factor)?;
        Ok(Self { f_hat, g_hat, factors, mask: Some(mask.map(|entry| weight * entry)), map, info })
    }

    /// `C`, `[k_target, k_source]`.
    pub fn map(&self) -> &Matrix {
        &self.map
    }

    /// How the solve went.
    pub fn info(&self) -> &FmapInfo {
        &self.info
    }

    /// Condition number of `F^ F^T`, the square of that of `F^`, without the mask; infinite where it is singular.
    ///
    /// # Errors
    /// If the decomposition does not converge, which finite input does not cause.
    pub fn gram_condition(&self) -> Result<f64, FmapError> {
        match self.mask {
            None => Ok(self.info.condition.powi(2)),
            Some(_) => dense::condition(&multiply(self.f_hat.as_faer(), self.f_hat.as_faer().transpose())),
        }
    }

    /// The gradients of `F^`, `[k_source, q]`, and of `G^`, `[k_target, q]`, for the gradient `grad` of `C`,
    /// `[k_target, k_source]`.
    ///
    /// # Panics
    /// If `grad` is not of that shape, which is a bug of the caller.
    pub fn backward(&self, grad: &Matrix) -> (Matrix, Matrix) {
        let shape = (self.map.rows(), self.map.cols());
        assert_eq!((grad.rows(), grad.cols()), shape, "the gradient is not that of the functional map");
        let mut m = grad.clone();
        self.solve_rows(&mut m);
        let grad_target = multiply(m.as_faer(), self.f_hat.as_faer());
        let mut residual = multiply(self.map.as_faer(), self.f_hat.as_faer());
        residual.data_mut().iter_mut().zip(self.g_hat.data()).for_each(|(r, g)| *r = g - *r);
        let mut grad_source = multiply(m.as_faer().transpose(), residual.as_faer());
        let through_map = multiply(self.map.as_faer().transpose(), grad_target.as_faer());
        let scale = 2.0 / self.f_hat.rows() as f64 * self.mean_diagonal_gradient(&m);
        let terms = self.f_hat.data().iter().zip(through_map.data());
        grad_source.data_mut().iter_mut().zip(terms).for_each(|(x, (f, second))| *x += scale * f - second);
        (grad_source, grad_target)
    }

    /// Replaces row `i` of `rows`, `[k_target, k_source]`, by `S_i^-1` times it.
    fn solve_rows(&self, rows: &mut Matrix) {
        let k = rows.cols();
        if let [factor] = &self.factors[..] {
            let count = rows.rows();
            return factor.solve(MatMut::from_column_major_slice_mut(rows.data_mut(), k, count));
        }
        let systems = rows.data_mut().par_chunks_mut(k).zip(&self.factors);
        systems.for_each(|(row, factor)| factor.solve(MatMut::from_column_major_slice_mut(row, k, 1)));
    }

    /// The gradient of `d`, the mean diagonal of `F^ F^T`.
    fn mean_diagonal_gradient(&self, m: &Matrix) -> f64 {
        let Some(mask) = &self.mask else { return 0.0 };
        let terms = mask.data().iter().zip(m.data()).zip(self.map.data());
        -terms.map(|((mask, m), c)| mask * m * c).sum::<f64>()
    }
}
