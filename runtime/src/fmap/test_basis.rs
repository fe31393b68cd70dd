//! Analytic eigenbases for the tests of maps.

use crate::Matrix;
use crate::spectral::Eigenbasis;

/// The first `k` Neumann eigenfunctions of a 1 x 1.37 rectangle, sampled at the centres of `nx` x `ny` cells,
/// where they are exactly orthonormal.
pub(crate) fn rectangle(nx: usize, ny: usize, k: usize) -> Eigenbasis {
    let height = 1.37;
    let wave = |order: usize| std::f64::consts::PI * order as f64;
    let mut modes: Vec<(f64, usize, usize)> = (0..nx * ny)
        .map(|m| (m % nx, m / nx))
        .map(|(a, b)| (wave(a).powi(2) + (wave(b) / height).powi(2), a, b))
        .collect();
    modes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let norm = |order: usize| if order == 0 { 1.0 } else { 2f64.sqrt() };
    let eigenvectors = Matrix::from_fn(nx * ny, k, |vertex, j| {
        let (_, a, b) = modes[j];
        let (u, v) = ((vertex % nx) as f64 + 0.5, (vertex / nx) as f64 + 0.5);
        let value = (wave(a) * u / nx as f64).cos() * (wave(b) * v / ny as f64).cos();
        value * norm(a) * norm(b) / height.sqrt()
    });
    let eigenvalues = modes[..k].iter().map(|mode| mode.0).collect();
    Eigenbasis { eigenvalues, eigenvectors, mass: vec![height / (nx * ny) as f64; nx * ny] }
}

/// The same shape with vertex `order[i]` in place `i`.
pub(crate) fn reordered(basis: &Eigenbasis, order: &[u32]) -> Eigenbasis {
    Eigenbasis {
        eigenvalues: basis.eigenvalues.clone(),
        eigenvectors: basis.eigenvectors.select_rows(order),
        mass: order.iter().map(|&i| basis.mass[i as usize]).collect(),
    }
}

/// The same shape with every third eigenvector negated.
pub(crate) fn flipped(basis: &Eigenbasis) -> Eigenbasis {
    let eigenvectors = Matrix::from_fn(basis.n(), basis.k(), |i, j| sign(j) * basis.eigenvectors[(i, j)]);
    Eigenbasis { eigenvectors, ..basis.clone() }
}

/// The sign that [`flipped`] gives eigenvector `j`.
pub(crate) fn sign(j: usize) -> f64 {
    if j % 3 == 1 { -1.0 } else { 1.0 }
}

/// A permutation of `n` without a simple pattern; `n` must not be a multiple of 389.
pub(crate) fn shuffle(n: usize) -> Vec<u32> {
    (0..n).map(|i| ((i * 389 + 17) % n) as u32).collect()
}

/// The `[k, k]` identity.
pub(crate) fn identity(k: usize) -> Matrix {
    Matrix::from_fn(k, k, |i, j| if i == j { 1.0 } else { 0.0 })
}

/// Fails with the worst entry where two matrices differ by more than `tolerance`.
pub(crate) fn assert_close(found: &Matrix, expected: &Matrix, tolerance: f64) {
    assert_eq!((found.rows(), found.cols()), (expected.rows(), expected.cols()), "shapes differ");
    let difference = |i: usize| (found.data()[i] - expected.data()[i]).abs();
    let worst = (0..found.data().len()).max_by(|&a, &b| difference(a).total_cmp(&difference(b)));
    if let Some(worst) = worst {
        let (row, col) = (worst / found.cols(), worst % found.cols());
        assert!(
            difference(worst) <= tolerance,
            "entry ({row}, {col}) is {}, expected {}",
            found.data()[worst],
            expected.data()[worst]
        );
    }
}
