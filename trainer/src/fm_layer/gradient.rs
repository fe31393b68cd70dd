//! The solve and its gradient, for both solvers.
//!
//! Row `i` of `C` solves `S_i c_i = F g_i` with `S_i = F F^T + weight d diag(D_i)` and `d = tr(F F^T) / k`. For a gradient
//! `dC` let `m_i = S_i^-1 dc_i` be the rows of `M`. Then `dG = M F` and
//! `dF = M^T (G - C F) - C^T M F + 2 / k dd F`, where `dd = -weight sum_ij m_ij D_ij c_ij`. The least squares are the case
//! of equal rows: `D = 1` with the ridge as weight. The truncated pseudo-inverse is differentiated with its subspace held
//! fixed.

use super::least_squares::{Factor, factor_guarded, multiply};
use super::{FmLayerError, FmSolver, default_max_condition, regularized};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd;
use faer::{Mat, MatRef, Par};
use rayon::prelude::*;

/// A solved functional map, with what its gradient needs.
pub(super) struct Solution {
    source: Mat<f64>,
    target: Mat<f64>,
    factors: Vec<Factor>,
    /// `weight D` `[k_target, k_source]`, row-major; empty where it is zero.
    mask: Vec<f64>,
    /// `C` `[k_target, k_source]`.
    pub(super) map: Mat<f64>,
    /// Condition number of `F F^T`.
    pub(super) condition: f64,
}

impl Solution {
    /// Solves for the functional map; `source` is `F`, `target` is `G`, `mask` the resolvent mask (regularised only).
    pub(super) fn new(
        source: Mat<f64>,
        target: Mat<f64>,
        solver: &FmSolver,
        mask: &[f64],
    ) -> Result<Self, FmLayerError> {
        let (k_source, k_target) = (source.nrows(), target.nrows());
        let mut system = Mat::zeros(k_source, k_source);
        multiply(system.as_mut(), source.as_ref(), source.transpose());
        let condition = condition_number(&system)?;
        let (factors, mask) = match *solver {
            FmSolver::LeastSquares { ridge, max_condition } => {
                let mask = if ridge > 0.0 { vec![ridge; k_source * k_target] } else { Vec::new() };
                (vec![factor_guarded(system, ridge, max_condition, condition)?], mask)
            }
            FmSolver::Regularized { weight } => {
                let mask: Vec<f64> = mask.iter().map(|value| weight * value).collect();
                let mean = mean_diagonal(&system);
                let scaled: Vec<f64> = mask.iter().map(|value| mean * value).collect();
                (regularized::factor_rows(&system, &scaled, default_max_condition())?, mask)
            }
        };
        let mut rhs = Mat::zeros(k_source, k_target);
        multiply(rhs.as_mut(), source.as_ref(), target.transpose());
        solve_columns(&factors, &mut rhs);
        Ok(Self { map: rhs.transpose().to_owned(), source, target, factors, mask, condition })
    }

    /// The gradients of `F` and `G` for the gradient `grad` of `C`.
    pub(super) fn backward(&self, grad: MatRef<'_, f64>) -> (Mat<f64>, Mat<f64>) {
        let (k, q) = self.source.shape();
        let mut adjoint = grad.transpose().to_owned();
        solve_columns(&self.factors, &mut adjoint);
        let mut grad_target = Mat::zeros(self.target.nrows(), q);
        multiply(grad_target.as_mut(), adjoint.transpose(), self.source.as_ref());

        let mut residual = Mat::zeros(self.target.nrows(), q);
        multiply(residual.as_mut(), self.map.as_ref(), self.source.as_ref());
        residual = &self.target - &residual;
        let mut grad_source = Mat::zeros(k, q);
        multiply(grad_source.as_mut(), adjoint.as_ref(), residual.as_ref());
        let mut second = Mat::zeros(k, q);
        multiply(second.as_mut(), self.map.transpose(), grad_target.as_ref());
        let scale = 2.0 / k as f64 * self.mean_diagonal_gradient(&adjoint);
        for j in 0..q {
            for i in 0..k {
                grad_source[(i, j)] += scale * self.source[(i, j)] - second[(i, j)];
            }
        }
        (grad_source, grad_target)
    }

    /// The gradient of `d`, the mean diagonal of `F F^T`; `adjoint` is `M^T`.
    fn mean_diagonal_gradient(&self, adjoint: &Mat<f64>) -> f64 {
        let k = self.source.nrows();
        let term = |(index, mask): (usize, &f64)| {
            let (i, j) = (index / k, index % k);
            mask * adjoint[(j, i)] * self.map[(i, j)]
        };
        -self.mask.iter().enumerate().map(term).sum::<f64>()
    }
}

fn mean_diagonal(system: &Mat<f64>) -> f64 {
    (0..system.nrows()).map(|i| system[(i, i)]).sum::<f64>() / system.nrows() as f64
}

/// Solves each column with its own factor, or all with the only one.
fn solve_columns(factors: &[Factor], rhs: &mut Mat<f64>) {
    if let [factor] = factors {
        return factor.solve(rhs.as_mut());
    }
    rhs.par_col_chunks_mut(1).zip(factors).for_each(|(column, factor)| factor.solve(column));
}

/// Largest over smallest eigenvalue of a symmetric positive semi-definite matrix; infinite where it is singular.
fn condition_number(system: &Mat<f64>) -> Result<f64, FmLayerError> {
    let k = system.nrows();
    if !(0..k).all(|i| system[(i, i)].is_finite()) {
        return Err(FmLayerError::NotFinite);
    }
    let mut values = faer::Col::zeros(k);
    let scratch =
        evd::self_adjoint_evd_scratch::<f64>(k, evd::ComputeEigenvectors::No, Par::Seq, Default::default());
    let mut memory = MemBuffer::new(scratch);
    evd::self_adjoint_evd(
        system.as_ref(),
        values.as_diagonal_mut(),
        None,
        Par::Seq,
        MemStack::new(&mut memory),
        Default::default(),
    )
    .map_err(|_| FmLayerError::NotFinite)?;
    let largest = values[k - 1];
    if largest <= 0.0 {
        return Err(FmLayerError::Zero);
    }
    Ok(if values[0] > 0.0 { largest / values[0] } else { f64::INFINITY })
}
