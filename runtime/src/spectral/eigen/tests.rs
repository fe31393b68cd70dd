//! Spectra that are known, and what holds for every mesh.

use super::*;
use crate::Mesh;
use crate::mesh::shapes::joined;
use crate::spectral::test_shapes::{bumpy, grid, scaled, sphere, zoo};
use std::f64::consts::PI;

fn solve(mesh: &Mesh, k: usize) -> (Eigenbasis, EigenInfo) {
    eigenbasis(&Laplacian::new(mesh), k, &EigenOptions::default()).unwrap()
}

/// Largest entry of `|Phi^T A Phi - I|`.
fn orthonormality_error(basis: &Eigenbasis) -> f64 {
    let weighted = Matrix::from_fn(basis.n(), basis.k(), |i, j| basis.mass[i] * basis.eigenvectors[(i, j)]);
    let product = basis.eigenvectors.as_faer().transpose() * weighted.as_faer();
    let error = |i: usize, j: usize| (product[(i, j)] - f64::from(u8::from(i == j))).abs();
    (0..basis.k())
        .flat_map(|i| (0..basis.k()).map(move |j| (i, j)))
        .map(|(i, j)| error(i, j))
        .fold(0.0, f64::max)
}

/// Linear elements of area `h^2` have a relative error of about `lambda h^2 / 12` in a smooth eigenvalue
/// `lambda`.
fn discretisation_error(mesh: &Mesh, eigenvalue: f64) -> f64 {
    1e-9 + 0.15 * eigenvalue.powi(2) * mesh.area() / mesh.n_vertices() as f64
}

fn in_pool<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

#[test]
fn sphere_has_eigenvalues_l_times_l_plus_one_with_their_multiplicities() {
    let mesh = sphere(30);
    let (basis, info) = solve(&mesh, 100);
    assert_eq!(info.complete, Some(true));
    for l in 0..10_usize {
        for (i, value) in basis.eigenvalues.iter().enumerate().skip(l * l).take(2 * l + 1) {
            let expected = (l * (l + 1)) as f64;
            let tolerance = discretisation_error(&mesh, expected);
            assert!((value - expected).abs() <= tolerance, "eigenvalue {i}: {value}, expected {expected}");
        }
    }
    assert!(orthonormality_error(&basis) < 1e-10);
}

#[test]
fn rectangle_has_the_neumann_spectrum() {
    let (width, height, k) = (3.0, 2.0, 40);
    let mesh = grid(90, 60, width, height);
    let (basis, _) = solve(&mesh, k);
    let mode = |i: usize, j: usize| (PI * i as f64 / width).powi(2) + (PI * j as f64 / height).powi(2);
    let mut expected: Vec<f64> = (0..30).flat_map(|i| (0..30).map(move |j| mode(i, j))).collect();
    expected.sort_by(f64::total_cmp);
    for (value, expected) in basis.eigenvalues.iter().zip(&expected) {
        let tolerance = discretisation_error(&mesh, *expected);
        assert!((value - expected).abs() <= tolerance, "{value}, expected {expected}");
    }
}

#[test]
fn every_mesh_of_the_zoo_has_an_orthonormal_basis() {
    for (name, mesh) in zoo() {
        // Rounding of an eigenvector is multiplied by the largest entries of W, which belong to degenerate
        // faces.
        let largest = Laplacian::new(&mesh).stiffness.diagonal().into_iter().fold(0.0, f64::max);
        let bound = 1e-9 + 1e-10 * largest;
        for k in [1, 7, 60, 200, mesh.n_vertices()].into_iter().filter(|&k| k <= mesh.n_vertices().min(700)) {
            let (basis, info) = solve(&mesh, k);
            assert!(orthonormality_error(&basis) < 1e-10, "{name}, k {k}: {}", orthonormality_error(&basis));
            assert!(basis.eigenvalues.is_sorted(), "{name}, k {k}");
            let zeros = basis.eigenvalues.iter().filter(|&&x| x == 0.0).count();
            assert_eq!(zeros, info.components.min(k), "{name}, k {k}");
            assert_ne!(info.complete, Some(false), "{name}, k {k}");
            let low_end = 3 * k <= mesh.n_vertices();
            assert!(!low_end || info.max_residual < bound, "{name}, k {k}: residual {}", info.max_residual);
        }
    }
}

#[test]
fn iteration_and_dense_solver_agree() {
    let mesh = bumpy(13);
    let laplacian = Laplacian::new(&mesh);
    let pencil = Pencil::new(&laplacian).unwrap();
    let (dense, _) = dense::dense_eigenpairs(&pencil, 60).unwrap();
    let found = iterate(&pencil, 60, &EigenOptions::default()).unwrap();
    for (a, b) in dense[1..].iter().zip(&found.eigenvalues) {
        assert!((a - b).abs() < 1e-11 * a, "{a} and {b}");
    }
}

#[test]
fn two_components_have_two_zeros_and_constant_null_vectors() {
    let (small, large) = (sphere(10), sphere(14));
    let (basis, info) = solve(&joined(&[&small, &scaled(&large, 2.0)]), 30);
    assert_eq!(info.components, 2);
    assert_eq!(basis.eigenvalues[..2], [0.0, 0.0]);
    let n = small.n_vertices();
    assert!((0..basis.n()).all(|i| (basis.eigenvectors[(i, 0)] > 0.0) == (i >= n)));
    assert!((0..basis.n()).all(|i| (basis.eigenvectors[(i, 1)] > 0.0) == (i < n)));
}

#[test]
fn equal_components_beyond_the_block_size_keep_their_multiplicity() {
    let one = bumpy(9);
    let (single, _) = solve(&one, 6);
    let twelve = joined(&[&one; 12]);
    let (basis, info) = solve(&twelve, 72);
    assert_eq!(info.complete, Some(true));
    for (i, value) in basis.eigenvalues.iter().enumerate() {
        let expected = single.eigenvalues[i / 12];
        assert!((value - expected).abs() <= 1e-9 * expected, "eigenvalue {i}: {value}, expected {expected}");
    }
}

#[test]
fn restarts_come_to_the_same_pairs() {
    let laplacian = Laplacian::new(&bumpy(20));
    let (once, _) = eigenbasis(&laplacian, 40, &EigenOptions::default()).unwrap();
    let options = EigenOptions { subspace: Some(72), ..EigenOptions::default() };
    let (often, info) = eigenbasis(&laplacian, 40, &options).unwrap();
    assert!(info.restarts > 0 && info.subspace <= 72);
    for j in 0..40 {
        let (a, b) = (once.eigenvalues[j], often.eigenvalues[j]);
        assert!((a - b).abs() <= 1e-10 * a, "eigenvalue {j}: {a} and {b}");
        let difference =
            (0..once.n()).map(|i| (once.eigenvectors[(i, j)] - often.eigenvectors[(i, j)]).abs());
        assert!(difference.fold(0.0, f64::max) < 1e-6, "eigenvector {j}");
    }
}

#[test]
fn too_low_a_first_estimate_of_the_spectrum_is_corrected() {
    // No surface has eigenvalues far above Weyl's law; a stiffness too large for the mass has.
    let mesh = bumpy(16);
    let mut laplacian = Laplacian::new(&mesh);
    let (basis, _) = eigenbasis(&laplacian, 30, &EigenOptions::default()).unwrap();
    let heavy: Vec<_> = (0..mesh.n_vertices())
        .flat_map(|i| {
            let row: Vec<_> = laplacian.stiffness.row(i).collect();
            row.into_iter().filter(move |e| e.0 < i).map(move |(j, w)| (i as u32, j as u32, 20.0 * w))
        })
        .collect();
    laplacian.stiffness = crate::spectral::SparseMatrix::with_zero_row_sums(mesh.n_vertices(), &heavy);
    let (stiff, _) = eigenbasis(&laplacian, 30, &EigenOptions::default()).unwrap();
    for (a, b) in basis.eigenvalues.iter().zip(&stiff.eigenvalues) {
        assert!((20.0 * a - b).abs() <= 1e-9 * b, "{a} and {b}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let laplacian = Laplacian::new(&bumpy(24));
    let run = |threads| in_pool(threads, || eigenbasis(&laplacian, 50, &EigenOptions::default()).unwrap());
    assert_eq!(run(1), run(2));
    assert_eq!(run(1), run(3));
}

#[test]
fn scale_of_the_mesh_does_not_matter() {
    let mesh = bumpy(16);
    let (basis, _) = solve(&mesh, 40);
    for factor in [1e-3, 256.0, 1e6] {
        let (other, _) = solve(&scaled(&mesh, factor), 40);
        for j in 0..40 {
            let (a, b) = (basis.eigenvalues[j], other.eigenvalues[j] * factor * factor);
            assert!((a - b).abs() <= 1e-10 * a, "factor {factor}, eigenvalue {j}: {a} and {b}");
            let difference = (0..basis.n())
                .map(|i| (basis.eigenvectors[(i, j)] - factor * other.eigenvectors[(i, j)]).abs());
            assert!(difference.fold(0.0, f64::max) < 1e-7, "factor {factor}, eigenvector {j}");
        }
    }
}

#[test]
fn signs_do_not_depend_on_the_seed() {
    let laplacian = Laplacian::new(&bumpy(16));
    let run = |seed| eigenbasis(&laplacian, 30, &EigenOptions { seed, ..EigenOptions::default() }).unwrap().0;
    let (a, b) = (run(0), run(1));
    for j in 0..30 {
        let product: f64 =
            (0..a.n()).map(|i| a.mass[i] * a.eigenvectors[(i, j)] * b.eigenvectors[(i, j)]).sum();
        assert!((product - 1.0).abs() < 1e-9, "eigenvector {j}: {product}");
    }
}

#[test]
fn unusable_input_is_an_error() {
    let options = EigenOptions::default();
    let laplacian = Laplacian::new(&bumpy(8));
    let n = laplacian.n();
    for k in [0, n + 1] {
        assert_eq!(eigenbasis(&laplacian, k, &options), Err(EigenError::TooManyPairs { k, n, limit: n }));
    }
    assert_eq!(solve(&bumpy(8), n).0.k(), n);
    let strict = EigenOptions { tolerance: 0.0, ..options.clone() };
    assert_eq!(eigenbasis(&laplacian, 3, &strict), Err(EigenError::InvalidTolerance { tolerance: 0.0 }));
    assert_eq!(eigenbasis(&Laplacian::new(&Mesh::default()), 2, &options), Err(EigenError::NoVertices));
    let points = Mesh::new(vec![[0.0; 3]; 5], vec![]).unwrap();
    assert!(matches!(eigenbasis(&Laplacian::new(&points), 2, &options), Err(EigenError::NoArea { .. })));
    let huge = scaled(&bumpy(8), 1e200);
    assert!(matches!(
        eigenbasis(&Laplacian::new(&huge), 2, &options),
        Err(EigenError::InvalidMass { .. } | EigenError::NoArea { .. })
    ));
    let mut broken = laplacian.clone();
    broken.mass.pop();
    assert!(matches!(eigenbasis(&broken, 2, &options), Err(EigenError::SizeMismatch { .. })));
}

#[test]
fn giving_up_tells_the_residuals() {
    let laplacian = Laplacian::new(&bumpy(20));
    let options = EigenOptions { subspace: Some(60), max_restarts: 0, ..EigenOptions::default() };
    match eigenbasis(&laplacian, 50, &options) {
        Err(EigenError::NotConverged { k: 50, converged, residuals, .. }) => {
            assert_eq!(residuals.len(), 49);
            assert!(converged < 49);
        }
        other => panic!("expected no convergence, got {other:?}"),
    }
}
