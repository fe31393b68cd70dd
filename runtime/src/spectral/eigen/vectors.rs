//! Eigenvectors on the mesh: null vectors, signs, residuals.

use super::pencil::Pencil;
use crate::Matrix;
use rayon::prelude::*;

const ROWS_PER_TASK: usize = 1024;

/// Relative difference below which two numbers are a tie in the choice of a sign.
const TIE: f64 = 1e-6;

/// Writes the functions that are constant on one component to the first columns of `eigenvectors`, one of
/// unit norm for each of the `count` largest components.
pub(super) fn write_null_vectors(pencil: &Pencil<'_>, count: usize, eigenvectors: &mut Matrix) {
    for (i, &component) in pencil.components.of_vertex.iter().enumerate() {
        let row = eigenvectors.row_mut(i);
        row[..count].fill(0.0);
        if (component as usize) < count {
            row[component as usize] = pencil.components.areas[component as usize].sqrt().recip();
        }
    }
}

/// Sums over the rows of what `add` accumulates for each row, `[q]`, in an order that is the same for any
/// number of threads.
fn sum_rows(n: usize, q: usize, add: impl Fn(usize, &mut [f64]) + Sync) -> Vec<f64> {
    let parts: Vec<Vec<f64>> = (0..n.div_ceil(ROWS_PER_TASK))
        .into_par_iter()
        .map(|task| {
            let mut part = vec![0.0; q];
            let rows = task * ROWS_PER_TASK..((task + 1) * ROWS_PER_TASK).min(n);
            rows.for_each(|i| add(i, &mut part));
            part
        })
        .collect();
    parts.iter().fold(vec![0.0; q], |mut total, part| {
        total.iter_mut().zip(part).for_each(|(t, p)| *t += p);
        total
    })
}

/// Gives every eigenvector the sign that makes `sum_i A_i phi_i^3` positive. Where that sum is nil (a
/// symmetric shape), the entry of largest magnitude is positive, the one of lowest index among equal ones.
pub(super) fn fix_signs(eigenvectors: &mut Matrix, mass: &[f64]) {
    let k = eigenvectors.cols();
    let moments = sum_rows(eigenvectors.rows(), 2 * k, |i, sums| {
        let (signed, unsigned) = sums.split_at_mut(k);
        for (j, &x) in eigenvectors.row(i).iter().enumerate() {
            signed[j] += mass[i] * x.powi(3);
            unsigned[j] += mass[i] * x.abs().powi(3);
        }
    });
    let flips: Vec<f64> = (0..k)
        .map(|j| {
            let tie = moments[j].abs() <= TIE * moments[k + j];
            let sign = if tie { dominant_entry(eigenvectors, j) } else { moments[j] };
            if sign < 0.0 { -1.0 } else { 1.0 }
        })
        .collect();
    eigenvectors.data_mut().par_chunks_exact_mut(k).for_each(|row| {
        row.iter_mut().zip(&flips).for_each(|(x, flip)| *x *= flip);
    });
}

/// The entry of column `j` of largest magnitude, the first among those that tie.
fn dominant_entry(eigenvectors: &Matrix, j: usize) -> f64 {
    let column = || (0..eigenvectors.rows()).map(|i| eigenvectors[(i, j)]);
    let largest = column().fold(0.0_f64, |m, x| m.max(x.abs()));
    column().find(|x| x.abs() >= (1.0 - TIE) * largest).unwrap_or(0.0)
}

/// `|W phi - lambda A phi| / ((lambda + shift) |A phi|)` for every column, in Euclidean norms.
pub(super) fn residuals(
    pencil: &Pencil<'_>,
    eigenvalues: &[f64],
    eigenvectors: &Matrix,
    mass: &[f64],
    shift: f64,
) -> Vec<f64> {
    let k = eigenvalues.len();
    let sums = sum_rows(eigenvectors.rows(), 2 * k, |i, sums| {
        let mut product = vec![0.0; k];
        pencil.stiffness.multiply_row(i, eigenvectors, &mut product);
        let (squares, norms) = sums.split_at_mut(k);
        for (j, &x) in eigenvectors.row(i).iter().enumerate() {
            squares[j] += (product[j] - eigenvalues[j] * mass[i] * x).powi(2);
            norms[j] += (mass[i] * x).powi(2);
        }
    });
    (0..k).map(|j| (sums[j] / sums[k + j]).sqrt() / (eigenvalues[j] + shift)).collect()
}
