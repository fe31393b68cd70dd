//! The soft error against its definition, its gradient against central differences.

use super::*;
use crate::testing::{check_gradient, random};
use candle_core::Device;

fn input(norm: ColumnNorm) -> SoftErrorInput<f64> {
    // 19 target points: one full set of lanes and a rest.
    let (k_source, k_target, m_source, m_target) = (4, 3, 11, 19);
    SoftErrorInput {
        basis_source: random(1, m_source * k_source),
        basis_target: random(2, m_target * k_target),
        distances: random(3, m_source * m_target).iter().map(|value| value.abs()).collect(),
        norm,
    }
}

fn map() -> Tensor {
    Tensor::from_vec(random(4, 12), (3, 4), &Device::Cpu).unwrap()
}

/// `sum((P o D)^2) / (2 m_s m_t)` and the mean distance at the largest entries, entry by entry.
fn naive(map: &[f64], input: &SoftErrorInput<f64>) -> (f64, f64) {
    let (k_source, k_target, m_source, m_target) = (4, 3, 11, 19);
    let (mut loss, mut hard) = (0.0, 0.0);
    for j in 0..m_source {
        let entry = |i: usize| -> f64 {
            let term = |t: usize, s: usize| {
                input.basis_target[i * k_target + t]
                    * map[t * k_source + s]
                    * input.basis_source[j * k_source + s]
            };
            (0..k_target).map(|t| (0..k_source).map(|s| term(t, s)).sum::<f64>()).sum::<f64>().abs()
        };
        let column: Vec<f64> = (0..m_target).map(entry).collect();
        let norm = match input.norm {
            ColumnNorm::L2 => column.iter().map(|q| q * q).sum::<f64>().sqrt(),
            ColumnNorm::L1 => column.iter().sum(),
        };
        let distance = |i: usize| input.distances[j * m_target + i];
        loss += (0..m_target).map(|i| (column[i] / norm * distance(i)).powi(2)).sum::<f64>();
        let best = (0..m_target).max_by(|&a, &b| column[a].total_cmp(&column[b])).unwrap();
        hard += distance(best);
    }
    (loss / (2 * m_source * m_target) as f64, hard / m_source as f64)
}

#[test]
fn soft_error_equals_its_definition_and_its_gradient_the_central_differences() {
    for norm in [ColumnNorm::L2, ColumnNorm::L1] {
        let values: Vec<f64> = map().flatten_all().unwrap().to_vec1().unwrap();
        let (loss, hard) = naive(&values, &input(norm));
        let sizes = Sizes { k_source: 4, k_target: 3, m_source: 11, m_target: 19 };
        for error in [soft_error(&map(), input(norm)), composed(&map(), input(norm), sizes)] {
            let error = error.unwrap();
            assert!((error.loss.to_scalar::<f64>().unwrap() - loss).abs() < 1e-14);
            assert!((error.hard_error - hard).abs() < 1e-14);
        }
        check_gradient(&map(), |x| soft_error(x, input(norm))?.loss * 3.0, 1e-8);
        check_gradient(&map(), |x| composed(x, input(norm), sizes)?.loss * 3.0, 1e-8);
    }
}

#[test]
fn identity_has_no_error() {
    let n = 17usize;
    let identity: Vec<f64> = (0..n * n).map(|at| if at / n == at % n { 1.0 } else { 0.0 }).collect();
    let distances = (0..n * n).map(|at| (at / n).abs_diff(at % n) as f64).collect();
    let map = Tensor::from_slice(&identity, (n, n), &Device::Cpu).unwrap();
    for norm in [ColumnNorm::L2, ColumnNorm::L1] {
        let (basis_source, basis_target) = (identity.clone(), identity.clone());
        let distances: Vec<f64> = Vec::clone(&distances);
        let error = soft_error(&map, SoftErrorInput { basis_source, basis_target, distances, norm }).unwrap();
        assert_eq!(error.loss.to_scalar::<f64>().unwrap(), 0.0);
        assert_eq!(error.hard_error, 0.0);
    }
}

#[test]
fn sizes_that_do_not_fit_are_an_error() {
    let wrong = Tensor::zeros((3, 5), DType::F64, &Device::Cpu).unwrap();
    assert!(soft_error(&wrong, input(ColumnNorm::L2)).is_err());
}
