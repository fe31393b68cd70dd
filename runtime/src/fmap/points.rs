//! The functional map of corresponding points.

use super::dense::ThinSvd;
use super::{FmapError, dense};
use crate::Matrix;

/// Weight of the penalty on the size of `C`, relative to the mean diagonal of the Gram matrix of the source's
/// functions.
const RIDGE: f64 = 3e-3;

/// The `C`, `[k_target, k_source]`, that minimises `sum |C phi - psi|^2 + w |C|^2` over the rows `phi` of `source`,
/// `[m, k_source]`, and `psi` of `target`, `[m, k_target]`: the eigenfunctions at `m` corresponding points. The small
/// `w` keeps functions bounded that live where no point is, such as on stray pieces: they go to zero.
///
/// # Errors
/// If the numbers of points differ, there are none, an entry is not finite, or the functions vanish at all points.
pub fn from_points(source: &Matrix, target: &Matrix) -> Result<Matrix, FmapError> {
    super::check_length("the target's list of points", target.rows(), source.rows())?;
    check_functions(source)?;
    check_functions(target)?;
    let transpose = source.as_faer().transpose();
    let mut gram = dense::multiply(transpose, source.as_faer());
    let right = dense::multiply(transpose, target.as_faer());
    let k = gram.rows();
    let mean_diagonal = (0..k).map(|i| gram[(i, i)]).sum::<f64>() / k as f64;
    (0..k).for_each(|i| gram[(i, i)] += RIDGE * mean_diagonal);
    let solution = dense::solve_positive_definite(&gram, &right).ok_or(FmapError::Empty { what: POINTS })?;
    Ok(Matrix::from_fn(solution.cols(), k, |i, j| solution[(j, i)]))
}

/// The matrix in messages.
const POINTS: &str = "the matrix of eigenfunctions at points";

fn check_functions(matrix: &Matrix) -> Result<(), FmapError> {
    if matrix.data().is_empty() {
        return Err(FmapError::Empty { what: POINTS });
    }
    match matrix.data().iter().position(|x| !x.is_finite()) {
        Some(entry) => Err(FmapError::NotFinite { what: POINTS, row: entry / matrix.cols() }),
        None => Ok(()),
    }
}

/// The pseudo-inverse, `[k, m]`, of an `[m, k]` matrix; singular values below 1e-10 of the largest count as zero.
///
/// # Errors
/// If the matrix has no entries, an entry is not finite, or a decomposition does not converge.
pub fn pseudo_inverse(matrix: &Matrix) -> Result<Matrix, FmapError> {
    const SMALL: f64 = 1e-10;
    check_functions(matrix)?;
    let transpose = matrix.as_faer().transpose();
    let gram = dense::multiply(transpose, matrix.as_faer());
    let right = Matrix::from_fn(matrix.cols(), matrix.rows(), |j, i| matrix[(i, j)]);
    if let Some(inverse) = dense::solve_positive_definite(&gram, &right) {
        return Ok(inverse);
    }
    let ThinSvd { u, s, v } = dense::thin_svd(matrix.as_faer())?;
    let scaled = Matrix::from_fn(v.nrows(), s.len(), |i, j| match s[j] > SMALL * s[0] {
        true => v[(i, j)] / s[j],
        false => 0.0,
    });
    Ok(dense::multiply(scaled.as_faer(), u.transpose()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(i: usize, j: usize) -> f64 {
        ((i * (j + 2)) as f64 * 0.7).sin() + if i.is_multiple_of(j + 2) { 1.0 } else { 0.0 }
    }

    #[test]
    fn the_map_of_points_is_found_again() {
        let truth = Matrix::from_fn(3, 4, |i, j| (i as f64 - j as f64) * 0.5 + 1.0);
        let source = Matrix::from_fn(300, 4, |i, j| {
            (std::f64::consts::PI * j as f64 * (i as f64 + 0.5) / 300.0).cos()
        });
        let target = dense::multiply(source.as_faer(), truth.as_faer().transpose());
        let found = from_points(&source, &target).unwrap();
        assert!(found.data().iter().zip(truth.data()).all(|(a, b)| (a - b).abs() < 0.02), "{found:?}");
    }

    #[test]
    fn functions_that_vanish_at_all_points_go_to_zero() {
        let source = Matrix::from_fn(30, 3, |i, j| if j == 2 { 1e-9 * wave(i, 5) } else { wave(i, j) });
        let found = from_points(&source, &Matrix::from_fn(30, 3, |i, j| wave(i, j + 1))).unwrap();
        assert!((0..3).all(|i| found[(i, 2)].abs() < 1e-6));
        assert!(from_points(&Matrix::zeros(5, 2), &Matrix::zeros(5, 2)).is_err());
    }

    #[test]
    fn the_pseudo_inverse_of_dependent_columns_is_that_of_penrose() {
        let matrix = Matrix::from_fn(12, 3, |i, j| if j == 2 { wave(i, 0) + wave(i, 1) } else { wave(i, j) });
        let inverse = pseudo_inverse(&matrix).unwrap();
        let product = dense::multiply(matrix.as_faer(), inverse.as_faer());
        let again = dense::multiply(product.as_faer(), matrix.as_faer());
        assert!(again.data().iter().zip(matrix.data()).all(|(a, b)| (a - b).abs() < 1e-9));
        assert!(pseudo_inverse(&Matrix::from_fn(1, 1, |_, _| f64::NAN)).is_err());
    }
}
