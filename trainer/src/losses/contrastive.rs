//! InfoNCE over corresponding points (van den Oord, Li and Vinyals 2018).

use super::unsupervised::unit_rows;
use crate::device::{contiguous, with_slice};
use crate::numeric::{Real, vectorized};
use candle_core::{CpuStorage, CustomOp1, D, DType, Layout, Result, Shape, Tensor, bail};
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// Rows of a task; fixed, so that results do not depend on the threads.
const ROWS_PER_TASK: usize = 64;

/// The mean over both directions of the cross entropy of telling each point's counterpart among all, by the cosines
/// of their descriptors over `temperature`.
///
/// `source` and `target` are `[m, d]`, whose rows correspond.
pub(crate) fn contrastive(source: &Tensor, target: &Tensor, temperature: f64) -> Result<Tensor> {
    let cosines = unit_rows(source)?.matmul(&unit_rows(target)?.t()?)?;
    if cosines.device().is_cpu() {
        let (cosines, inverse) = (cosines.contiguous()?, 1.0 / temperature);
        return match cosines.dtype() {
            DType::F64 => cosines.apply_op1(InfoNce::<f64> { inverse, saved: Mutex::new(None) }),
            _ => cosines.apply_op1(InfoNce::<f32> { inverse, saved: Mutex::new(None) }),
        };
    }
    composed(&cosines, temperature)
}

/// The same from Candle's own ops.
fn composed(cosines: &Tensor, temperature: f64) -> Result<Tensor> {
    let logits = ((cosines - 1.0)? / temperature)?;
    let weights = logits.exp()?;
    let entropy = |dim: D| weights.sum(dim)?.log()?.mean_all();
    let identity = Tensor::eye(logits.dims2()?.0, logits.dtype(), logits.device())?;
    let right = (identity * &logits)?.sum_all()?;
    let right = (right / logits.dims2()?.0 as f64)?;
    ((entropy(D::Minus1)? + entropy(D::Minus2)?)? * 0.5)? - right
}

/// From the cosines `[m, m]` to the loss.
struct InfoNce<T> {
    inverse: f64,
    saved: Mutex<Option<Saved<T>>>,
}

struct Saved<T> {
    /// `exp((cosine - 1) / temperature)`, `[m, m]`.
    weights: Vec<T>,
    /// Sums of rows and of columns, `[m]`.
    rows: Vec<f64>,
    columns: Vec<f64>,
}

impl<T: Real> InfoNce<T> {
    fn weights(&self, cosines: &[T], m: usize) -> Saved<T> {
        let inverse = T::from_double(self.inverse);
        let mut weights = vec![T::ZERO; m * m];
        let tasks = weights.par_chunks_mut(ROWS_PER_TASK * m).zip(cosines.par_chunks(ROWS_PER_TASK * m));
        let parts: Vec<(Vec<f64>, Vec<f64>)> = tasks
            .map(|(weights, cosines)| {
                vectorized(|| {
                    for (weight, &cosine) in weights.iter_mut().zip(cosines) {
                        // Rounding may lift a cosine above 1.
                        let above = (cosine - T::ONE) * inverse;
                        let above = if above < T::ZERO { above } else { T::ZERO };
                        *weight = above.exp_m1_nonpositive() + T::ONE;
                    }
                });
                let mut columns = vec![0.0; m];
                let row = |row: &[T]| {
                    columns.iter_mut().zip(row).for_each(|(sum, x)| *sum += x.to_double());
                    row.iter().map(|x| x.to_double()).sum::<f64>()
                };
                (weights.chunks_exact(m).map(row).collect(), columns)
            })
            .collect();
        let mut columns = vec![0.0; m];
        parts.iter().for_each(|(_, part)| columns.iter_mut().zip(part).for_each(|(sum, x)| *sum += x));
        Saved { weights, rows: parts.into_iter().flat_map(|(rows, _)| rows).collect(), columns }
    }
}

impl<T: Real> CustomOp1 for InfoNce<T> {
    fn name(&self) -> &'static str {
        "info-nce"
    }

    fn cpu_fwd(&self, storage: &CpuStorage, layout: &Layout) -> Result<(CpuStorage, Shape)> {
        let (m, columns) = layout.shape().dims2()?;
        if m == 0 || m != columns {
            bail!("the contrastive loss takes a square of cosines, not [{m}, {columns}]");
        }
        let cosines: &[T] = contiguous(storage, layout)?;
        let saved = self.weights(cosines, m);
        let entropy = |sums: &[f64]| sums.iter().map(|sum| sum.ln()).sum::<f64>();
        let right: f64 = (0..m).map(|i| (cosines[i * m + i].to_double() - 1.0) * self.inverse).sum();
        let loss = (0.5 * (entropy(&saved.rows) + entropy(&saved.columns)) - right) / m as f64;
        *self.saved.lock().unwrap_or_else(PoisonError::into_inner) = Some(saved);
        Ok((T::to_cpu_storage_owned(vec![T::from_double(loss)]), Shape::from(())))
    }

    fn bwd(&self, cosines: &Tensor, _out: &Tensor, grad: &Tensor) -> Result<Option<Tensor>> {
        let Some(saved) = self.saved.lock().unwrap_or_else(PoisonError::into_inner).take() else {
            bail!("the backward pass runs once");
        };
        let m = saved.rows.len();
        let scale = with_slice(grad, |grad: &[T]| Ok(grad[0].to_double()))? * self.inverse / m as f64;
        let of_columns: Vec<T> = saved.columns.iter().map(|sum| T::from_double(0.5 * scale / sum)).collect();
        let mut out = saved.weights;
        out.par_chunks_mut(m).zip(&saved.rows).enumerate().for_each(|(i, (row, sum))| {
            let of_row = T::from_double(0.5 * scale / sum);
            vectorized(|| {
                row.iter_mut().zip(&of_columns).for_each(|(x, &of_column)| *x *= of_row + of_column);
            });
            row[i] -= T::from_double(scale);
        });
        Ok(Some(Tensor::from_vec(out, cosines.shape(), cosines.device())?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check_gradient, random};
    use candle_core::Device;

    #[test]
    fn the_fused_loss_equals_candles_own_ops_and_its_gradient_the_central_differences() {
        let (m, d) = (70, 3);
        let target = Tensor::from_slice(&random(2, m * d), (m, d), &Device::Cpu).unwrap();
        let source = Tensor::from_slice(&random(1, m * d), (m, d), &Device::Cpu).unwrap();
        let value = |loss: Tensor| loss.to_scalar::<f64>().unwrap();
        let cosines = unit_rows(&source).unwrap().matmul(&unit_rows(&target).unwrap().t().unwrap()).unwrap();
        let (fused, own) = (contrastive(&source, &target, 0.07).unwrap(), composed(&cosines, 0.07).unwrap());
        assert!((value(fused) - value(own)).abs() < 1e-10);
        check_gradient(&source, |x| contrastive(x, &target, 0.2), 1e-6);
        check_gradient(&source, |x| contrastive(&target, x, 0.2), 1e-6);
    }

    #[test]
    fn descriptors_that_tell_all_points_apart_cost_nothing() {
        let apart = Tensor::eye(8, candle_core::DType::F32, &Device::Cpu).unwrap();
        assert!(contrastive(&apart, &apart, 0.05).unwrap().to_scalar::<f32>().unwrap() < 1e-6);
    }
}
