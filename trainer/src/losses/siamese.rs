//! The siamese loss of the paper's comparison.

use candle_core::{Result, Tensor};

/// The siamese loss (Hadsell et al. 2006):
/// `gamma mean |f - f+|^2 + (1 - gamma) mean max(0, margin - |f - f-|)^2`.
///
/// `source` and `target` are descriptors `[m, q]` whose rows correspond; `negatives` lists pairs (source row, target
/// row) that do not. The paper sums where we take means, so that the step does not depend on the number of pairs.
pub(crate) fn siamese(
    source: &Tensor,
    target: &Tensor,
    negatives: &[(u32, u32)],
    gamma: f64,
    margin: f64,
) -> Result<Tensor> {
    /// Keeps the square root differentiable where two descriptors agree.
    const TINY: f64 = 1e-12;
    let positive = (source - target)?.sqr()?.sum(1)?.mean_all()?;
    let positive = (positive * gamma)?;
    if negatives.is_empty() {
        return Ok(positive);
    }
    let (rows_source, rows_target): (Vec<u32>, Vec<u32>) = negatives.iter().copied().unzip();
    let rows_source = Tensor::from_vec(rows_source, negatives.len(), source.device())?;
    let rows_target = Tensor::from_vec(rows_target, negatives.len(), target.device())?;
    let apart = (source.index_select(&rows_source, 0)? - target.index_select(&rows_target, 0)?)?;
    let distance = (apart.sqr()?.sum(1)? + TINY)?.sqrt()?;
    let hinge = ((distance * -1.0)? + margin)?.relu()?.sqr()?.mean_all()?;
    positive + (hinge * (1.0 - gamma))?
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check_gradient, random};
    use candle_core::Device;

    #[test]
    fn siamese_loss_equals_its_definition_and_its_gradient_the_central_differences() {
        let (m, q) = (6, 4);
        let values = random(3, 2 * m * q);
        let negatives = [(0, 1), (2, 5), (3, 3), (4, 0), (2, 1)];
        let (gamma, margin) = (0.3, 1.1);
        let split = |x: &Tensor| (x.narrow(0, 0, m), x.narrow(0, m, m));
        let loss = |x: &Tensor| {
            let (source, target) = split(x);
            siamese(&source?, &target?, &negatives, gamma, margin)
        };
        let row = |i: usize| &values[i * q..(i + 1) * q];
        let squared = |i: usize, j: usize| -> f64 {
            row(i).iter().zip(row(m + j)).map(|(a, b)| (a - b) * (a - b)).sum()
        };
        let positive: f64 = (0..m).map(|i| squared(i, i)).sum::<f64>() / m as f64;
        let hinge = |&(i, j): &(u32, u32)| (margin - squared(i as usize, j as usize).sqrt()).max(0.0).powi(2);
        let negative: f64 = negatives.iter().map(hinge).sum::<f64>() / negatives.len() as f64;
        assert!(negative > 0.0, "some pairs lie within the margin");
        let x = Tensor::from_slice(&values, (2 * m, q), &Device::Cpu).unwrap();
        let value = loss(&x).unwrap().to_scalar::<f64>().unwrap();
        assert!((value - gamma * positive - (1.0 - gamma) * negative).abs() < 1e-9);
        check_gradient(&x, loss, 1e-7);
    }
}
