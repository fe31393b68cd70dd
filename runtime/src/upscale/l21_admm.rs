//! `min_C || C F^ - G^ ||_{2,1}` (the paper's equation "upscale") by ADMM.
//!
//! With the matches as rows, `x_j = phi(x_j)` and `y_j = psi(y_j)`, and `M = C^T`, the problem is
//! `min_M sum_j || x_j M - y_j ||_2`. Splitting `z_j = x_j M - y_j` gives, with scaled multipliers `u_j` (Boyd et al.
//! 2011, section 3.1.1):
//!
//! - `M <- X^+ (Y + Z - U)`,
//! - `z_j <- shrink(x_j M - y_j + u_j, 1 / rho)`, the proximal map of the l2 norm,
//! - `u_j <- u_j + x_j M - y_j - z_j`,
//!
//! until both residuals are below the tolerance (section 3.3.1), with `rho` balanced between them (section 3.4.1).

use crate::Matrix;
use faer::linalg::solvers::{DenseSolveCore, Llt, Solve};
use faer::{Accum, Mat, Par, Side};
use rayon::prelude::*;
use thiserror::Error;

/// Settings of [`l21_functional_map`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct AdmmOptions {
    /// At most so many iterations. Range 0 (least squares) and up, default 200.
    pub max_iterations: usize,
    /// Both residuals must fall below this, relative to the norms of what they compare. Above 0, default 1e-4.
    pub tolerance: f64,
}

impl Default for AdmmOptions {
    fn default() -> Self {
        Self { max_iterations: 200, tolerance: 1e-4 }
    }
}

/// How a run of [`l21_functional_map`] went.
#[derive(Clone, Debug, PartialEq)]
pub struct AdmmInfo {
    /// Iterations done.
    pub iterations: usize,
    /// Whether both residuals fell below the tolerance, or least squares fit already. If not, the map is the last
    /// iterate.
    pub converged: bool,
    /// The objective, `|| C F^ - G^ ||_{2,1}`, at the end.
    pub objective: f64,
    /// The objective of the least-squares solution that the iteration started from.
    pub initial_objective: f64,
    /// `|| X M - Y - Z ||_F` relative to the largest norm of its three terms.
    pub primal_residual: f64,
    /// `|| Z - Z_before ||_F` relative to the norm of the scaled multipliers `U`: the bound of the dual residual,
    /// without the factor `X^T`.
    pub dual_residual: f64,
}

/// Why a functional map could not be upscaled.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum UpscaleError {
    /// The two sides do not have one row for each match.
    #[error("{source_rows} source rows and {target_rows} target rows: each match needs one of both")]
    RowCount {
        /// Rows of the source side.
        source_rows: usize,
        /// Rows of the target side.
        target_rows: usize,
    },
    /// A side has no basis functions.
    #[error(
        "the {side} has no basis functions; a map needs an eigenbasis of at least one eigenfunction of either shape"
    )]
    NoFunctions {
        /// `source` or `target`.
        side: &'static str,
    },
    /// Too few matches to determine the map.
    #[error(
        "{matches} matches do not determine a map of k = {k} source functions; use a smaller k or more matches"
    )]
    TooFewMatches {
        /// Number of matches.
        matches: usize,
        /// Size of the source basis.
        k: usize,
    },
    /// The matched source vertices leave some basis function undetermined.
    #[error(
        "the matched source vertices do not tell {k} basis functions apart; use a smaller k or spread the matches"
    )]
    Singular {
        /// Size of the source basis.
        k: usize,
    },
}

/// The functional map `C`, `[k_target, k_source]`, that minimises the l2,1 norm over the matches.
///
/// `phi` is `[m, k_source]` and `psi` `[m, k_target]`, as [`super::delta_coefficients`] gives them. The result does
/// not depend on the number of threads.
///
/// # Errors
/// If the numbers of rows differ or are fewer than `k_source`, `k_source` or `k_target` is 0, or the rows of `phi` do
/// not determine the map.
pub fn l21_functional_map(
    phi: &Matrix,
    psi: &Matrix,
    options: &AdmmOptions,
) -> Result<(Matrix, AdmmInfo), UpscaleError> {
    let solver = PseudoInverse::new(phi, psi)?;
    let mut map = solver.solve(psi);
    let mut fitted = product(phi, &map);
    let initial_objective = l21_distance(&fitted, psi);
    let (m, k_target) = (psi.rows(), psi.cols());
    let mut rho = m as f64 / initial_objective.max(f64::MIN_POSITIVE);
    let mut split = difference(&fitted, psi);
    let mut multipliers: Matrix = Matrix::zeros(m, k_target);
    let mut info = AdmmInfo {
        iterations: 0,
        converged: initial_objective <= f64::EPSILON * frobenius(psi.data()) * m as f64,
        objective: initial_objective,
        initial_objective,
        primal_residual: 0.0,
        dual_residual: 0.0,
    };
    while !info.converged && info.iterations < options.max_iterations {
        info.iterations += 1;
        map = solver.solve(&combine(psi, &split, &multipliers));
        fitted = product(phi, &map);
        let step = update_split(&fitted, psi, rho, &mut split, &mut multipliers);
        let scale = frobenius(fitted.data()).max(frobenius(split.data())).max(frobenius(psi.data()));
        info.primal_residual = step.primal / scale;
        info.dual_residual = step.dual / frobenius(multipliers.data()).max(f64::MIN_POSITIVE);
        info.converged = info.primal_residual.max(info.dual_residual) < options.tolerance;
        balance(&mut rho, &info, &mut multipliers);
    }
    info.objective = l21_distance(&fitted, psi);
    Ok((map.transposed(), info))
}

struct SplitStep {
    primal: f64,
    dual: f64,
}

/// Updates `z` and `u` row by row; returns `||r||_F` and `||z - z_before||_F`.
fn update_split(
    fitted: &Matrix,
    psi: &Matrix,
    rho: f64,
    split: &mut Matrix,
    multipliers: &mut Matrix,
) -> SplitStep {
    let k = psi.cols();
    let rows: Vec<(f64, f64)> =
        (split.data_mut().par_chunks_mut(k), multipliers.data_mut().par_chunks_mut(k))
            .into_par_iter()
            .enumerate()
            .map(|(j, (z, u))| {
                let residual = fitted.row(j).iter().zip(psi.row(j)).map(|(f, y)| f - y);
                let wanted: Vec<f64> = residual.zip(u.iter()).map(|(r, u)| r + u).collect();
                let norm = frobenius(&wanted);
                let shrink = if norm * rho > 1.0 { 1.0 - 1.0 / (norm * rho) } else { 0.0 };
                let (mut primal, mut dual) = (0.0, 0.0);
                for i in 0..k {
                    let new = shrink * wanted[i];
                    dual += (new - z[i]).powi(2);
                    let new_multiplier = wanted[i] - new;
                    primal += (new_multiplier - u[i]).powi(2);
                    z[i] = new;
                    u[i] = new_multiplier;
                }
                (primal, dual)
            })
            .collect();
    let (primal, dual) = rows.iter().fold((0.0, 0.0), |(p, d), row| (p + row.0, d + row.1));
    SplitStep { primal: primal.sqrt(), dual: dual.sqrt() }
}

/// Doubles or halves `rho` where one residual is ten times the other.
fn balance(rho: &mut f64, info: &AdmmInfo, multipliers: &mut Matrix) {
    let factor = match info.primal_residual / info.dual_residual.max(f64::MIN_POSITIVE) {
        ratio if ratio > 10.0 => 2.0,
        ratio if ratio < 0.1 => 0.5,
        _ => return,
    };
    *rho *= factor;
    multipliers.data_mut().iter_mut().for_each(|u| *u /= factor);
}

/// `X^+ = (X^T X)^-1 X^T`, factored once.
pub(super) struct PseudoInverse {
    /// `X^+`, `[k_source, m]`.
    inverse: Mat<f64>,
}

impl PseudoInverse {
    pub(super) fn new(phi: &Matrix, psi: &Matrix) -> Result<Self, UpscaleError> {
        let (m, k) = (phi.rows(), phi.cols());
        if psi.rows() != m {
            return Err(UpscaleError::RowCount { source_rows: m, target_rows: psi.rows() });
        }
        for (side, columns) in [("source", k), ("target", psi.cols())] {
            if columns == 0 {
                return Err(UpscaleError::NoFunctions { side });
            }
        }
        if m < k {
            return Err(UpscaleError::TooFewMatches { matches: m, k });
        }
        let x = phi.as_faer();
        let mut gram = Mat::<f64>::zeros(k, k);
        faer::linalg::matmul::matmul(gram.as_mut(), Accum::Replace, x.transpose(), x, 1.0, Par::Seq);
        let factor = Llt::new(gram.as_ref(), Side::Lower).map_err(|_| UpscaleError::Singular { k })?;
        let inverse = factor.inverse();
        let bound = 1.0 / f64::EPSILON;
        if !(inverse.norm_max() * gram.norm_max() < bound) {
            return Err(UpscaleError::Singular { k });
        }
        Ok(Self { inverse: factor.solve(x.transpose()) })
    }

    /// `X^+ B`, `[k_source, k_target]`, split over the columns of `B` so that no sum depends on the threads.
    pub(super) fn solve(&self, right: &Matrix) -> Matrix {
        let columns: Vec<usize> = (0..right.cols()).step_by(16).collect();
        let blocks: Vec<Mat<f64>> = columns
            .par_iter()
            .map(|&from| {
                let width = 16.min(right.cols() - from);
                let mut block = Mat::zeros(self.inverse.nrows(), width);
                let right = right.as_faer().subcols(from, width);
                faer::linalg::matmul::matmul(
                    block.as_mut(),
                    Accum::Replace,
                    self.inverse.as_ref(),
                    right,
                    1.0,
                    Par::Seq,
                );
                block
            })
            .collect();
        Matrix::from_fn(self.inverse.nrows(), right.cols(), |i, j| blocks[j / 16][(i, j % 16)])
    }
}

/// `A B`, split over the rows of `A`.
fn product(a: &Matrix, b: &Matrix) -> Matrix {
    const ROWS: usize = 512;
    let mut result = Matrix::zeros(a.rows(), b.cols());
    let cols = b.cols();
    result.data_mut().par_chunks_mut(ROWS * cols).enumerate().for_each(|(chunk, out)| {
        let rows = out.len() / cols;
        let out = faer::MatMut::from_row_major_slice_mut(out, rows, cols);
        let left = a.as_faer().subrows(chunk * ROWS, rows);
        faer::linalg::matmul::matmul(out, Accum::Replace, left, b.as_faer(), 1.0, Par::Seq);
    });
    result
}

fn combine(psi: &Matrix, split: &Matrix, multipliers: &Matrix) -> Matrix {
    let terms = psi.data().iter().zip(split.data()).zip(multipliers.data());
    Matrix::from_vec(psi.rows(), psi.cols(), terms.map(|((y, z), u)| y + z - u).collect())
}

fn difference(a: &Matrix, b: &Matrix) -> Matrix {
    Matrix::from_vec(a.rows(), a.cols(), a.data().iter().zip(b.data()).map(|(a, b)| a - b).collect())
}

fn l21_distance(a: &Matrix, b: &Matrix) -> f64 {
    let row = |j: usize| a.row(j).iter().zip(b.row(j)).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    (0..a.rows()).map(row).sum()
}

fn frobenius(values: &[f64]) -> f64 {
    values.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::upscale::least_squares_functional_map;
    use rand::{Rng, SeedableRng};

    fn random(rows: usize, cols: usize, seed: u64) -> Matrix {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        Matrix::from_fn(rows, cols, |_, _| rng.random_range(-1.0..1.0))
    }

    fn worst_difference(a: &Matrix, b: &Matrix) -> f64 {
        a.data().iter().zip(b.data()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    /// Matches of a known map, the first `wrong` of them replaced by random ones.
    fn problem(wrong: usize) -> (Matrix, Matrix, Matrix) {
        let (phi, c) = (random(400, 12, 1), random(10, 12, 2));
        let mut psi = product(&phi, &c.transposed());
        let noise = random(wrong, 10, 3);
        for j in 0..wrong {
            psi.row_mut(j).copy_from_slice(noise.row(j));
        }
        (phi, psi, c)
    }

    #[test]
    fn exact_matches_give_the_exact_map() {
        let (phi, psi, c) = problem(0);
        let (found, info) = l21_functional_map(&phi, &psi, &AdmmOptions::default()).unwrap();
        assert!(worst_difference(&found, &c) < 1e-10, "{info:?}");
        assert!(worst_difference(&least_squares_functional_map(&phi, &psi).unwrap(), &c) < 1e-10);
    }

    #[test]
    fn thirty_percent_wrong_matches_are_rejected() {
        let (phi, psi, c) = problem(120);
        let options = AdmmOptions { max_iterations: 2000, tolerance: 1e-7 };
        let (found, info) = l21_functional_map(&phi, &psi, &options).unwrap();
        let plain = least_squares_functional_map(&phi, &psi).unwrap();
        assert!(info.converged, "{info:?}");
        assert!(worst_difference(&found, &c) < 1e-4, "{}", worst_difference(&found, &c));
        assert!(worst_difference(&plain, &c) > 0.05, "least squares should be bent by the wrong matches");
    }

    /// At the optimum the sum of `x_j^T r_j / |r_j|` vanishes.
    #[test]
    fn the_result_is_stationary() {
        let (phi, psi) = (random(300, 6, 4), random(300, 5, 5));
        let options = AdmmOptions { max_iterations: 5000, tolerance: 1e-9 };
        let (c, info) = l21_functional_map(&phi, &psi, &options).unwrap();
        assert!(info.converged && info.objective <= info.initial_objective, "{info:?}");
        let residual = difference(&product(&phi, &c.transposed()), &psi);
        for i in 0..6 {
            for t in 0..5 {
                let slope: f64 =
                    (0..300).map(|j| phi[(j, i)] * residual[(j, t)] / frobenius(residual.row(j))).sum();
                assert!(slope.abs() < 1e-4, "slope {slope} at ({i}, {t})");
            }
        }
    }

    #[test]
    fn impossible_problems_are_errors() {
        let few = l21_functional_map(&random(5, 6, 1), &random(5, 6, 2), &AdmmOptions::default());
        assert_eq!(few.unwrap_err(), UpscaleError::TooFewMatches { matches: 5, k: 6 });
        for (k_source, k_target, side) in [(4, 0, "target"), (0, 4, "source")] {
            let (phi, psi) = (random(5, k_source, 1), random(5, k_target, 2));
            let none = l21_functional_map(&phi, &psi, &AdmmOptions::default());
            assert_eq!(none.unwrap_err(), UpscaleError::NoFunctions { side });
        }
        let twice = Matrix::from_fn(50, 4, |i, j| ((i * 7 + j / 2) as f64).sin());
        let singular = l21_functional_map(&twice, &random(50, 4, 2), &AdmmOptions::default());
        assert_eq!(singular.unwrap_err(), UpscaleError::Singular { k: 4 });
    }
}
