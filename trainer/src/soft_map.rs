//! The soft correspondence and the soft error loss (paper, equations "soft_corr" and "lossf").
//!
//! `P = |Psi C Phi^T A|` `[m_target, m_source]` with normalised columns; each column belongs to a source point. The
//! area weights `A` scale whole columns, which the normalisation undoes, so they do not appear here. With `D` the
//! geodesic distances on the target from each source point's match to the target's points, the loss is that of the
//! authors' code, `sum((P o D)^2) / (2 m_source m_target)`.

use crate::device::contiguous;
use crate::numeric::{MatrixView, Real, matmul, matmul_split, vectorized};
use candle_core::{CpuStorage, CustomOp1, DType, Layout, Result, Shape, Tensor, bail};
use fmnet::fmap::ColumnNorm;
use rayon::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// Source points of a task; fixed, so that results do not depend on the threads.
const ROWS_PER_TASK: usize = 128;
/// Independent partial sums along a row.
const LANES: usize = 16;
/// Pieces of the long product of the gradient.
const PIECES: usize = 4;

/// The constants of the soft error for one direction of a pair.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SoftErrorInput<T> {
    /// `Phi` on the source's points, `[m_source, k_source]` row-major.
    pub(crate) basis_source: Vec<T>,
    /// `Psi` on the target's points, `[m_target, k_target]` row-major.
    pub(crate) basis_target: Vec<T>,
    /// Row `j` holds the distances on the target from the match of source point `j`, `[m_source, m_target]` row-major.
    pub(crate) distances: Vec<T>,
    /// Normalisation of the columns of `P`.
    pub(crate) norm: ColumnNorm,
}

/// The soft error of a functional map.
pub(crate) struct SoftError {
    /// Scalar, differentiable by the functional map.
    pub(crate) loss: Tensor,
    /// Mean distance to the match of the target point with the largest entry of each column.
    pub(crate) hard_error: f64,
}

/// Soft error of the functional map `map` `[k_target, k_source]`.
pub(crate) fn soft_error<T: Real>(map: &Tensor, input: SoftErrorInput<T>) -> Result<SoftError> {
    let (k_target, k_source) = map.dims2()?;
    let (m_source, m_target) = (input.basis_source.len() / k_source, input.basis_target.len() / k_target);
    if input.basis_source.len() != m_source * k_source
        || input.basis_target.len() != m_target * k_target
        || input.distances.len() != m_source * m_target
        || input.distances.is_empty()
    {
        bail!(
            "a functional map [{k_target}, {k_source}] does not fit {m_source} source points, {m_target} target points \
             and {} distances",
            input.distances.len()
        );
    }
    let sizes = Sizes { k_source, k_target, m_source, m_target };
    if !map.device().is_cpu() {
        return composed(map, input, sizes);
    }
    let outcome = Arc::new(Mutex::new(None));
    let loss = map.contiguous()?.apply_op1(SoftErrorOp { input, sizes, outcome: outcome.clone() })?;
    let outcome = outcome.lock().unwrap_or_else(PoisonError::into_inner);
    let hard_error = outcome.as_ref().map_or(f64::NAN, |outcome: &Outcome<T>| outcome.hard_error);
    Ok(SoftError { loss, hard_error })
}

#[derive(Clone, Copy)]
struct Sizes {
    k_source: usize,
    k_target: usize,
    m_source: usize,
    m_target: usize,
}

/// Loss and gradient are found together: a scalar's gradient only waits for a factor.
struct Outcome<T> {
    loss: f64,
    hard_error: f64,
    gradient: Vec<T>,
}

struct SoftErrorOp<T> {
    input: SoftErrorInput<T>,
    sizes: Sizes,
    outcome: Arc<Mutex<Option<Outcome<T>>>>,
}

impl<T: Real> SoftErrorOp<T> {
    fn evaluate(&self, map: &[T]) -> Outcome<T> {
        let Sizes { k_source, k_target, m_source, m_target } = self.sizes;
        let map = MatrixView::new(map, k_target, k_source);
        let basis_target = MatrixView::new(&self.input.basis_target, m_target, k_target);
        let mut coefficients = vec![T::zero(); m_source * k_target];
        let tasks = coefficients
            .par_chunks_mut(ROWS_PER_TASK * k_target)
            .zip(self.input.basis_source.par_chunks(ROWS_PER_TASK * k_source))
            .zip(self.input.distances.par_chunks(ROWS_PER_TASK * m_target));
        let sums: Vec<(f64, f64)> = tasks
            .map(|((coefficients, basis_source), distances)| {
                let rows = basis_source.len() / k_source;
                matmul(coefficients, false, MatrixView::new(basis_source, rows, k_source), map.t());
                let mut soft = vec![T::zero(); rows * m_target];
                matmul(&mut soft, false, MatrixView::new(coefficients, rows, k_target), basis_target.t());
                let sums = self.columns(&mut soft, distances);
                matmul(coefficients, false, MatrixView::new(&soft, rows, m_target), basis_target);
                sums
            })
            .collect();
        let mut gradient = vec![T::zero(); k_target * k_source];
        let basis_source = MatrixView::new(&self.input.basis_source, m_source, k_source);
        matmul_split(
            &mut gradient,
            MatrixView::new(&coefficients, m_source, k_target).t(),
            basis_source,
            PIECES,
        );
        let (soft, hard) = sums.iter().fold((0.0, 0.0), |total, sum| (total.0 + sum.0, total.1 + sum.1));
        Outcome {
            loss: soft / (2 * m_source * m_target) as f64,
            hard_error: hard / m_source as f64,
            gradient,
        }
    }

    /// Replaces the columns of `Psi C Phi^T` (here rows) by the gradient of the loss; returns the sums over the
    /// columns of the soft and of the hard error.
    fn columns(&self, soft: &mut [T], distances: &[T]) -> (f64, f64) {
        let Sizes { m_source, m_target, .. } = self.sizes;
        let scale = 1.0 / (m_source * m_target) as f64;
        let mut sums = (0.0, 0.0);
        vectorized(|| {
            for (soft, distances) in soft.chunks_exact_mut(m_target).zip(distances.chunks_exact(m_target)) {
                let column = ColumnSums::of(soft, distances);
                let (error, [square, constant, sign]) = column.loss_and_slopes(self.input.norm, scale);
                sums.0 += error;
                sums.1 += position(soft, column.largest).map_or(0.0, |at| distances[at].to_f64());
                let [square, constant, sign] = [square, constant, sign].map(T::from_f64);
                for (value, &distance) in soft.iter_mut().zip(distances) {
                    let side = if *value > T::zero() { sign } else { T::zero() - sign };
                    *value = *value * (square * distance * distance + constant) + side;
                }
            }
        });
        sums
    }
}

/// Sums over a column of `Q = Psi C Phi^T`.
struct ColumnSums<T> {
    absolute: f64,
    squared: f64,
    weighted: f64,
    largest: T,
}

impl<T: Real> ColumnSums<T> {
    #[inline(always)]
    fn of(column: &[T], distances: &[T]) -> Self {
        let mut lanes = [[T::zero(); LANES]; 4];
        let chunks = column.chunks_exact(LANES).zip(distances.chunks_exact(LANES));
        for (values, distances) in chunks {
            for lane in 0..LANES {
                accumulate(&mut lanes, lane, values[lane], distances[lane]);
            }
        }
        let tail = column.len() / LANES * LANES;
        for (lane, (&value, &distance)) in column[tail..].iter().zip(&distances[tail..]).enumerate() {
            accumulate(&mut lanes, lane, value, distance);
        }
        let total = |lanes: &[T; LANES]| lanes.iter().map(|value| value.to_f64()).sum();
        let largest = lanes[3].iter().fold(T::zero(), |a, &b| if b > a { b } else { a });
        Self { absolute: total(&lanes[0]), squared: total(&lanes[1]), weighted: total(&lanes[2]), largest }
    }

    /// Twice the column's loss, and the slopes `(a, b, c)` of its gradient `Q (a D^2 + b) + c sign(Q)`.
    #[inline(always)]
    fn loss_and_slopes(&self, norm: ColumnNorm, scale: f64) -> (f64, [f64; 3]) {
        match norm {
            ColumnNorm::L2 => {
                let squared = self.squared.max(f64::MIN_POSITIVE);
                let error = self.weighted / squared;
                (error, [scale / squared, -scale * error / squared, 0.0])
            }
            ColumnNorm::L1 => {
                let absolute = self.absolute.max(f64::MIN_POSITIVE.sqrt());
                let error = self.weighted / absolute / absolute;
                (error, [scale / absolute / absolute, 0.0, -scale * error / absolute])
            }
        }
    }
}

#[inline(always)]
fn accumulate<T: Real>(lanes: &mut [[T; LANES]; 4], lane: usize, value: T, distance: T) {
    let absolute = value.abs();
    let squared = value * value;
    lanes[0][lane] += absolute;
    lanes[1][lane] += squared;
    lanes[2][lane] += squared * (distance * distance);
    lanes[3][lane] = if absolute > lanes[3][lane] { absolute } else { lanes[3][lane] };
}

/// First index whose absolute value is `largest`.
#[inline(always)]
fn position<T: Real>(column: &[T], largest: T) -> Option<usize> {
    let chunk = column.chunks(LANES).position(|values| values.iter().any(|value| value.abs() == largest))?;
    let start = chunk * LANES;
    column[start..].iter().position(|value| value.abs() == largest).map(|at| start + at)
}

impl<T: Real> CustomOp1 for SoftErrorOp<T> {
    fn name(&self) -> &'static str {
        "soft-error"
    }

    fn cpu_fwd(&self, storage: &CpuStorage, layout: &Layout) -> Result<(CpuStorage, Shape)> {
        let outcome = self.evaluate(contiguous(storage, layout)?);
        let loss = T::to_cpu_storage_owned(vec![T::from_f64(outcome.loss)]);
        *self.outcome.lock().unwrap_or_else(PoisonError::into_inner) = Some(outcome);
        Ok((loss, Shape::from(())))
    }

    fn bwd(&self, map: &Tensor, _loss: &Tensor, grad: &Tensor) -> Result<Option<Tensor>> {
        let factor = grad.to_dtype(DType::F64)?.to_scalar::<f64>()?;
        let outcome = self.outcome.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(outcome) = outcome.as_ref() else {
            bail!("the soft error's backward pass comes after its forward pass");
        };
        let gradient: Vec<T> = outcome.gradient.iter().map(|&value| value * T::from_f64(factor)).collect();
        Ok(Some(Tensor::from_vec(gradient, map.shape(), map.device())?))
    }
}

/// The same from Candle's own ops, for devices other than the CPU.
fn composed<T: Real>(map: &Tensor, input: SoftErrorInput<T>, sizes: Sizes) -> Result<SoftError> {
    let Sizes { k_source, k_target, m_source, m_target } = sizes;
    let device = map.device();
    let basis_source = Tensor::from_vec(input.basis_source, (m_source, k_source), device)?;
    let basis_target = Tensor::from_vec(input.basis_target, (m_target, k_target), device)?;
    let distances = Tensor::from_vec(input.distances, (m_source, m_target), device)?;
    let soft = basis_source.matmul(&map.t()?)?.matmul(&basis_target.t()?)?;
    let weighted = (soft.sqr()? * distances.sqr()?)?.sum(1)?;
    let columns = match input.norm {
        ColumnNorm::L2 => soft.sqr()?.sum(1)?,
        ColumnNorm::L1 => soft.abs()?.sum(1)?.sqr()?,
    };
    let loss = ((weighted / columns)?.sum_all()? / (2 * m_source * m_target) as f64)?;
    let best = soft.detach().abs()?.argmax_keepdim(1)?;
    let hard_error = distances.gather(&best, 1)?.to_dtype(DType::F64)?.mean_all()?.to_scalar()?;
    Ok(SoftError { loss, hard_error })
}

#[cfg(test)]
mod tests;
