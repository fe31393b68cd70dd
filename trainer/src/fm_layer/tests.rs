//! The layer against its defining equations, its gradient against central differences.

use super::*;
use crate::testing::{check_gradient, random};
use candle_core::{DType, Device, Tensor};
use fmnet::Matrix;
use fmnet::fmap::{FmapSolver, LeastSquaresOptions, least_squares, regularized, resolvent_mask};

const K_SOURCE: usize = 5;
const K_TARGET: usize = 4;
const Q: usize = 9;

fn descriptors(seed: u64, k: usize) -> Tensor {
    Tensor::from_vec(random(seed, k * Q), (k, Q), &Device::Cpu).unwrap()
}

/// Of the source and of the target.
fn eigenvalues() -> (Vec<f64>, Vec<f64>) {
    let spectrum = |scale: f64, k: usize| (0..k).map(|i| scale * i as f64).collect();
    (spectrum(12.0, K_SOURCE), spectrum(13.5, K_TARGET))
}

fn mask() -> Matrix {
    let (source, target) = eigenvalues();
    resolvent_mask(&source, &target)
}

const REGULARIZED: FmapSolver = FmapSolver::Regularized { weight: FmapSolver::DEFAULT_MASK_WEIGHT };
const SOLVERS: [FmapSolver; 3] =
    [FmapSolver::LeastSquares, REGULARIZED, FmapSolver::Regularized { weight: 3.0 }];

fn rows(tensor: &Tensor) -> Vec<Vec<f64>> {
    tensor.to_dtype(DType::F64).unwrap().to_vec2().unwrap()
}

#[test]
fn every_row_satisfies_its_normal_equations() {
    let (f, g) = (descriptors(1, K_SOURCE), descriptors(2, K_TARGET));
    let (rows_f, rows_g) = (rows(&f), rows(&g));
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let mean = (0..K_SOURCE).map(|i| dot(&rows_f[i], &rows_f[i])).sum::<f64>() / K_SOURCE as f64;
    for solver in SOLVERS {
        let map = rows(&functional_map(&f, &g, solver, &mask()).unwrap().map);
        for i in 0..K_TARGET {
            for j in 0..K_SOURCE {
                let diagonal = match solver {
                    FmapSolver::Regularized { weight } => weight * mean * mask()[(i, j)],
                    _ => 0.0,
                };
                let system = |l: usize| dot(&rows_f[j], &rows_f[l]);
                let left = (0..K_SOURCE).map(|l| system(l) * map[i][l]).sum::<f64>() + diagonal * map[i][j];
                let right = dot(&rows_f[j], &rows_g[i]);
                assert!((left - right).abs() < 1e-12, "{solver:?} row {i}, column {j}: {left} vs {right}");
            }
        }
    }
}

#[test]
fn maps_equal_those_of_the_runtime() {
    let (f, g) = (descriptors(1, K_SOURCE), descriptors(2, K_TARGET));
    let matrix = |t: &Tensor, k| Matrix::from_vec(k, Q, t.flatten_all().unwrap().to_vec1().unwrap());
    let (f_hat, g_hat) = (matrix(&f, K_SOURCE), matrix(&g, K_TARGET));
    let (source, target) = eigenvalues();
    let plain = least_squares(&f_hat, &g_hat, &LeastSquaresOptions::default()).unwrap().0;
    let masked = regularized(&f_hat, &g_hat, &source, &target, 0.1).unwrap().0;
    for (solver, expected) in [(FmapSolver::LeastSquares, plain), (REGULARIZED, masked)] {
        let map = rows(&functional_map(&f, &g, solver, &mask()).unwrap().map);
        let close = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-11;
        assert!(map.iter().flatten().zip(expected.data()).all(close), "{solver:?}");
    }
}

#[test]
fn gradients_of_both_solvers_equal_central_differences() {
    let weights =
        Tensor::from_vec(random(6, K_TARGET * K_SOURCE), (K_TARGET, K_SOURCE), &Device::Cpu).unwrap();
    let (f, g) = (descriptors(1, K_SOURCE), descriptors(2, K_TARGET));
    for solver in SOLVERS {
        let loss = |f: &Tensor, g: &Tensor| {
            let map = functional_map(f, g, solver, &mask())?.map;
            (map.sqr()? * &weights)?.sum_all()
        };
        check_gradient(&f, |x| loss(x, &g), 1e-7);
        check_gradient(&g, |x| loss(&f, x), 1e-7);
    }
}

#[test]
fn single_precision_descriptors_are_solved_in_double_precision() {
    let (f, g) = (descriptors(1, K_SOURCE), descriptors(2, K_TARGET));
    let exact = rows(&functional_map(&f, &g, REGULARIZED, &mask()).unwrap().map);
    let (f, g) = (f.to_dtype(DType::F32).unwrap(), g.to_dtype(DType::F32).unwrap());
    let single = functional_map(&f, &g, REGULARIZED, &mask()).unwrap();
    assert_eq!(single.map.dtype(), DType::F32);
    assert!(single.condition > 1.0 && single.condition < 1e4);
    for (a, b) in exact.iter().flatten().zip(rows(&single.map).iter().flatten()) {
        assert!((a - b).abs() < 1e-5);
    }
}

/// Descriptors of rank 3 < `K_SOURCE`.
fn deficient() -> Tensor {
    let mixing = Tensor::from_vec(random(8, K_SOURCE * 3), (K_SOURCE, 3), &Device::Cpu).unwrap();
    mixing.matmul(&descriptors(9, 3)).unwrap()
}

#[test]
fn singular_systems_give_the_shortest_solution() {
    let (f, g) = (deficient(), descriptors(2, K_TARGET));
    let solved = functional_map(&f, &g, FmapSolver::LeastSquares, &Matrix::default()).unwrap();
    assert!(solved.condition > 1e12);
    let map = solved.map;
    // C = G F^+ has its rows in the range of F, and C F is the projection of G: (C F - G) F^T = 0.
    let residual = (map.matmul(&f).unwrap() - g).unwrap().matmul(&f.t().unwrap()).unwrap();
    assert!(rows(&residual).iter().flatten().all(|value| value.abs() < 1e-9));
    let range = functional_map(&f, &f, FmapSolver::LeastSquares, &Matrix::default()).unwrap().map;
    let projected = (map.matmul(&range).unwrap() - map).unwrap();
    assert!(rows(&projected).iter().flatten().all(|value| value.abs() < 1e-9));
}

#[test]
fn regularised_solve_copes_with_singular_descriptors() {
    let solved = functional_map(&deficient(), &descriptors(2, K_TARGET), REGULARIZED, &mask()).unwrap();
    assert!(rows(&solved.map).iter().flatten().all(|value| value.is_finite()));
}

/// As on scans with stray pieces: a function of eigenvalue 0 that is 0 wherever points were drawn.
#[test]
fn regularised_solve_and_gradient_cope_with_functions_that_no_point_sees() {
    let unseen = rows(&descriptors(1, K_SOURCE)).into_iter().enumerate();
    let f: Vec<f64> = unseen.flat_map(|(i, row)| if i == 1 { vec![0.0; Q] } else { row }).collect();
    let f = Tensor::from_vec(f, (K_SOURCE, Q), &Device::Cpu).unwrap();
    let mask = resolvent_mask(&[0.0, 0.0, 12.0, 24.0, 36.0], &[0.0, 13.0, 27.0, 40.0]);
    let (solver, g) = (REGULARIZED, descriptors(2, K_TARGET));
    let f = candle_core::Var::from_tensor(&f).unwrap();
    let map = functional_map(f.as_tensor(), &g, solver, &mask).unwrap().map;
    assert!(rows(&map).iter().all(|row| row[1].abs() < 1e-12 && row[0].abs() < 10.0));
    // The loss sees the map through the drawn points only, as the soft correspondence does.
    let seen = map.index_select(&Tensor::new(&[0u32, 2, 3, 4], &Device::Cpu).unwrap(), 1).unwrap();
    let loss = seen.sqr().unwrap().sum_all().unwrap();
    let gradient = loss.backward().unwrap().remove(f.as_tensor()).unwrap();
    assert!(rows(&gradient).iter().flatten().all(|value| value.abs() < 1e3));
}

#[test]
fn useless_descriptors_are_an_error_that_says_so() {
    let zeros = descriptors(1, K_SOURCE).zeros_like().unwrap();
    let nan = (descriptors(1, K_SOURCE) * f64::NAN).unwrap();
    let g = descriptors(2, K_TARGET);
    let message = |f: &Tensor| {
        functional_map(f, &g, FmapSolver::LeastSquares, &Matrix::default()).err().unwrap().to_string()
    };
    assert!(message(&zeros).contains("all zero"), "{}", message(&zeros));
    assert!(message(&nan).contains("NaN"), "{}", message(&nan));
    assert!(functional_map(&g, &g, REGULARIZED, &Matrix::default()).is_err());
    let untrainable = functional_map(&g, &g, FmapSolver::Bidirectional { weight: 0.1 }, &Matrix::default());
    assert!(untrainable.err().unwrap().to_string().contains("cannot be trained with"));
}
