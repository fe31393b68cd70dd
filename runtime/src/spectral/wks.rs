//! The wave kernel signature.

use super::Eigenbasis;
use crate::Matrix;
use crate::numeric::{MatrixView, par_matmul};
use serde::{Deserialize, Serialize};

/// Eigenvalues at unit area up to this are zeros, of further components; they carry no energy.
pub const WKS_ZERO: f64 = 1e-6;
/// Keeps the highest energy a little below the last eigenvalue.
pub const WKS_HEADROOM: f64 = 1.02;
/// Width of an energy in steps of an even division of the range.
pub const WKS_WIDTH: f64 = 7.0;

/// Options of [`wks`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[non_exhaustive]
pub struct WksOptions {
    /// Energies, the width `q` of the signature. Range 1 and up, default 128.
    pub energies: usize,
    /// Eigenpairs that it is computed from. Range 2 and up, default 200.
    pub k: usize,
}

impl Default for WksOptions {
    fn default() -> Self {
        Self { energies: 128, k: 200 }
    }
}

/// The weight of each eigenpair in each energy, `[q, k]`, each row of sum 1; eigenvalues are at unit area.
///
/// With `l` the logarithms of the eigenvalues above zero, energies `e` lie evenly between `l_min + 2 s` and
/// `l_max / 1.02 - 2 s`, `s = 7 (l_max / 1.02 - l_min) / q`; the weights are `exp(-(e - l)^2 / (2 s^2))`. The first
/// eigenpair and those of eigenvalue zero have none.
pub fn wks_weights(eigenvalues: &[f64], energies: usize) -> Matrix {
    let logarithm = |i: usize| (i > 0 && eigenvalues[i] > WKS_ZERO).then(|| eigenvalues[i].ln());
    let logarithms: Vec<Option<f64>> = (0..eigenvalues.len()).map(logarithm).collect();
    let known = || logarithms.iter().flatten().copied();
    let (low, high) =
        (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max) / WKS_HEADROOM);
    let width = WKS_WIDTH * (high - low) / energies as f64;
    let (first, last) = (low + 2.0 * width, high - 2.0 * width);
    let step = if energies > 1 { (last - first) / (energies - 1) as f64 } else { 0.0 };
    let mut weights = Matrix::zeros(energies, eigenvalues.len());
    for e in 0..energies {
        let energy = first + step * e as f64;
        let row = weights.row_mut(e);
        for (weight, logarithm) in row.iter_mut().zip(&logarithms) {
            *weight = logarithm.map_or(0.0, |l| (-(energy - l).powi(2) / (2.0 * width * width)).exp());
        }
        let sum: f64 = row.iter().sum();
        if sum > 0.0 {
            row.iter_mut().for_each(|weight| *weight /= sum);
        }
    }
    weights
}

/// The wave kernel signature of every vertex, `[n, energies]` (Aubry, Schlickewei and Cremers 2011):
/// `sum_i w_ei phi_i^2` with the weights of [`wks_weights`] of energy `e`.
///
/// `basis` is at unit area ([`Eigenbasis::at_unit_area`]); all its eigenpairs are used. The signature does not change
/// with pose, position or scale, and is the same on both sides of a symmetric body.
pub fn wks(basis: &Eigenbasis, energies: usize) -> Matrix<f32> {
    wks_of(&basis.eigenvalues, &basis.eigenvectors.map(|phi| phi as f32), energies)
}

/// [`wks`] of eigenvalues `[k]` and eigenvectors `[n, k]` at unit area.
///
/// # Panics
/// If there are not as many eigenvalues as eigenvectors.
pub fn wks_of(eigenvalues: &[f64], eigenvectors: &Matrix<f32>, energies: usize) -> Matrix<f32> {
    let (n, k) = (eigenvectors.rows(), eigenvectors.cols());
    let weights = wks_weights(eigenvalues, energies).map(|w| w as f32);
    let squares = eigenvectors.map(|phi| phi * phi);
    let mut signature = Matrix::zeros(n, energies);
    if n > 0 && energies > 0 {
        let weights = MatrixView::new(weights.data(), energies, k);
        par_matmul(signature.data_mut(), MatrixView::new(squares.data(), n, k), weights.t());
    }
    signature
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::bumpy_sphere;
    use crate::spectral::{EigenOptions, Laplacian, eigenbasis};

    #[test]
    fn weights_of_an_energy_sum_to_one_and_leave_out_zeros() {
        let weights = wks_weights(&[0.0, 0.0, 2.0, 3.0, 10.0, 40.0], 16);
        for e in 0..16 {
            assert!((weights.row(e).iter().sum::<f64>() - 1.0).abs() < 1e-12);
            assert_eq!(&weights.row(e)[..2], &[0.0, 0.0]);
        }
    }

    #[test]
    fn the_mean_over_the_surface_is_the_sum_of_weights() {
        let mesh = bumpy_sphere(3, 1);
        let (basis, _) = eigenbasis(&Laplacian::new(&mesh), 40, &EigenOptions::default()).unwrap();
        let basis = basis.at_unit_area(40);
        let signature = wks(&basis, 10);
        for e in 0..10 {
            let mean: f64 = (0..basis.n()).map(|v| basis.mass[v] * f64::from(signature[(v, e)])).sum();
            // The eigenfunctions have norm 1.
            assert!((mean - 1.0).abs() < 1e-5, "energy {e}: {mean}");
        }
    }
}
