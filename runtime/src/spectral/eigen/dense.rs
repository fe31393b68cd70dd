//! All eigenpairs of a small mesh.

use super::EigenError;
use super::factor::Analysis;
use super::iterate::positive_definite_factor;
use super::panel::BLOCK;
use super::pencil::Pencil;
use super::ritz::symmetric_eigen;
use crate::Matrix;
use faer::Mat;

/// The `k` smallest eigenvalues for area 1, ascending, and eigenvectors `[n, k]`; those of the null space
/// come first, as any basis of it.
///
/// The matrix decomposed is the inverse of `D W D - sigma`, whose largest eigenvalues are wanted: `D W D`
/// itself may have entries so large, at a degenerate face, that its smallest eigenvalues drown in their
/// rounding.
pub(super) fn dense_eigenpairs(pencil: &Pencil<'_>, k: usize) -> Result<(Vec<f64>, Matrix), EigenError> {
    let analysis = Analysis::new(pencil)?;
    let (sigma, factor) = positive_definite_factor(pencil, &analysis, k)?;
    let (n, order) = (pencil.n(), analysis.order());
    let mut inverse = Mat::<f64>::zeros(n, n);
    for first in (0..n).step_by(BLOCK) {
        let columns = BLOCK.min(n - first);
        let mut panel = vec![[0.0; BLOCK]; n];
        (0..columns).for_each(|c| panel[first + c][c] = 1.0);
        factor.solve(&mut panel);
        for (i, row) in panel.iter().enumerate() {
            (0..columns).for_each(|c| inverse[(i, first + c)] = row[c]);
        }
    }
    raise_null_space(pencil, order, -sigma.recip(), &mut inverse);
    let (thetas, vectors) = symmetric_eigen(inverse.as_ref()).ok_or(EigenError::DenseSolver)?;
    let eigenvalues = thetas.iter().rev().take(k).map(|theta| theta.recip() + sigma).collect();
    let to_mesh = pencil.area.sqrt().recip();
    let mut eigenvectors = Matrix::zeros(n, k);
    for (row, &vertex) in order.iter().enumerate() {
        let scale = pencil.scale[vertex as usize] * to_mesh;
        let values = eigenvectors.row_mut(vertex as usize).iter_mut().enumerate();
        values.for_each(|(j, x)| *x = vectors[(row, n - 1 - j)] * scale);
    }
    Ok((eigenvalues, eigenvectors))
}

/// Adds `amount` to the eigenvalue of the null vectors, which sets them apart from all others.
fn raise_null_space(pencil: &Pencil<'_>, order: &[u32], amount: f64, inverse: &mut Mat<f64>) {
    let components = &pencil.components;
    for (i, &a) in order.iter().enumerate() {
        let component = components.of_vertex[a as usize];
        let share = amount * pencil.area / components.areas[component as usize] / pencil.scale[a as usize];
        for (j, &b) in order.iter().enumerate() {
            if components.of_vertex[b as usize] == component {
                inverse[(i, j)] += share / pencil.scale[b as usize];
            }
        }
    }
}
