//! The plain least-squares functional map between matched points, for comparison with the robust one.

use super::l21_admm::{PseudoInverse, UpscaleError};
use crate::Matrix;

/// `C`, `[k_target, k_source]`, that minimises `sum_j || C phi(x_j) - psi(y_j) ||^2` over matches `j`.
///
/// Arguments are the matrices of [`super::delta_coefficients`].
///
/// # Errors
/// As [`super::l21_functional_map`].
pub fn least_squares_functional_map(phi: &Matrix, psi: &Matrix) -> Result<Matrix, UpscaleError> {
    let solver = PseudoInverse::new(phi, psi)?;
    Ok(solver.solve(psi).transposed())
}
