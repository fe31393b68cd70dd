//! What the gradient tests share.

use candle_core::{Result, Tensor, Var};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// `len` numbers in -1 to 1 from a seed.
pub(crate) fn random(seed: u64, len: usize) -> Vec<f64> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    (0..len).map(|_| generator.random_range(-1.0..1.0)).collect()
}

/// Asserts that the gradient of the scalar `loss` at `x` (f64) equals the central differences, to `tolerance`
/// relative to the largest entry.
pub(crate) fn check_gradient(x: &Tensor, loss: impl Fn(&Tensor) -> Result<Tensor>, tolerance: f64) {
    const STEP: f64 = 1e-5;
    let variable = Var::from_tensor(x).unwrap();
    let gradients = loss(variable.as_tensor()).unwrap().backward().unwrap();
    let gradient: Vec<f64> = gradients.get(&variable).unwrap().flatten_all().unwrap().to_vec1().unwrap();
    let values: Vec<f64> = x.flatten_all().unwrap().to_vec1().unwrap();
    let at = |i: usize, step: f64| -> f64 {
        let mut moved = values.clone();
        moved[i] += step;
        let x = Tensor::from_vec(moved, x.shape(), x.device()).unwrap();
        loss(&x).unwrap().to_scalar().unwrap()
    };
    let numeric: Vec<f64> = (0..values.len()).map(|i| (at(i, STEP) - at(i, -STEP)) / (2.0 * STEP)).collect();
    let largest = numeric.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    assert!(largest > 0.0, "the loss does not depend on the input");
    for (i, (a, b)) in gradient.iter().zip(&numeric).enumerate() {
        assert!(
            (a - b).abs() <= tolerance * largest,
            "entry {i}: {a:e} by the backward pass, {b:e} by differences"
        );
    }
}
