//! Normalisation and activation, fused into single passes over the rows.
//!
//! The rows `[n, width]` of all shapes lie one below the other. A *group* is the rows that share statistics: one shape,
//! or all shapes together. Groups are cut into chunks that fit a core's cache; whatever is summed over rows is summed
//! within each chunk and then over the chunks in order, so results do not depend on the number of threads.

use super::Activation;
use crate::numeric::{Real, vectorized};

/// Rows of a chunk: at width 352 in single precision, 352 KiB.
const CHUNK_ROWS: usize = 384;

/// How the rows are grouped for statistics and cut for the threads.
#[derive(Clone, Debug)]
pub(super) struct RowPlan {
    /// Rows of each group, in order.
    pub(super) groups: Vec<usize>,
    /// Group and rows of each chunk, in order.
    pub(super) chunks: Vec<(usize, std::ops::Range<usize>)>,
}

impl RowPlan {
    /// Groups of the given numbers of rows.
    pub(super) fn new(groups: Vec<usize>) -> Self {
        let mut chunks = Vec::new();
        let mut start = 0;
        for (group, &rows) in groups.iter().enumerate() {
            let pieces = rows.div_ceil(CHUNK_ROWS).max(1);
            let bound = |piece: usize| start + rows * piece / pieces;
            chunks.extend((0..pieces).map(|piece| (group, bound(piece)..bound(piece + 1))));
            start += rows;
        }
        Self { groups, chunks }
    }

    /// Number of rows in all.
    pub(super) fn rows(&self) -> usize {
        self.groups.iter().sum()
    }

    /// Rows of each chunk, in order.
    pub(super) fn lengths(&self) -> impl Iterator<Item = usize> + '_ {
        self.chunks.iter().map(|(_, rows)| rows.len())
    }
}

/// Mean and variance of each channel over a group (biased, as batch normalisation has it).
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Moments {
    /// Number of rows.
    pub(super) count: f64,
    /// Mean of each channel.
    pub(super) mean: Vec<f64>,
    /// Variance of each channel.
    pub(super) variance: Vec<f64>,
}

impl Moments {
    /// Of the rows of one chunk, by two passes.
    pub(super) fn of_rows<T: Real>(rows: &[T], width: usize) -> Self {
        let count = (rows.len() / width) as f64;
        let mut mean = vec![T::zero(); width];
        let mut variance = vec![T::zero(); width];
        vectorized(|| {
            for row in rows.chunks_exact(width) {
                for (sum, &value) in mean.iter_mut().zip(row) {
                    *sum += value;
                }
            }
            for sum in &mut mean {
                *sum = T::from_f64(sum.to_f64() / count);
            }
            for row in rows.chunks_exact(width) {
                for ((sum, &value), &mean) in variance.iter_mut().zip(row).zip(&mean) {
                    *sum += (value - mean) * (value - mean);
                }
            }
        });
        let mean = mean.iter().map(|mean| mean.to_f64()).collect();
        Self { count, mean, variance: variance.iter().map(|sum| sum.to_f64() / count).collect() }
    }

    /// Of each group, from its chunks (Chan, Golub and LeVeque's update).
    pub(super) fn of_groups(plan: &RowPlan, chunks: &[Moments]) -> Vec<Self> {
        let mut groups = vec![Self::default(); plan.groups.len()];
        for ((group, _), chunk) in plan.chunks.iter().zip(chunks) {
            groups[*group].add(chunk);
        }
        groups
    }

    fn add(&mut self, other: &Self) {
        if self.count == 0.0 {
            *self = other.clone();
            return;
        }
        let count = self.count + other.count;
        let (own, new) = (self.count / count, other.count / count);
        for c in 0..self.mean.len() {
            let delta = other.mean[c] - self.mean[c];
            self.mean[c] += delta * new;
            self.variance[c] = own * self.variance[c] + new * other.variance[c] + own * new * delta * delta;
        }
        self.count = count;
    }

    /// The normalisation `(value - mean) * inv_std` that these moments give.
    pub(super) fn normalizer<T: Real>(&self, epsilon: f64) -> Normalizer<T> {
        Normalizer {
            mean: self.mean.iter().map(|&mean| T::from_f64(mean)).collect(),
            inv_std: self.variance.iter().map(|&v| T::from_f64(1.0 / (v + epsilon).sqrt())).collect(),
        }
    }
}

/// Maps a channel to mean 0 and variance 1.
#[derive(Clone, Debug)]
pub(super) struct Normalizer<T> {
    mean: Vec<T>,
    /// One over the standard deviation.
    pub(super) inv_std: Vec<T>,
}

impl<T: Real> Normalizer<T> {
    /// `values` becomes its normalised self, `out` becomes `act(scale * values + shift)`.
    pub(super) fn activate(
        &self,
        affine: Affine<T>,
        activation: Activation,
        values: &mut [T],
        out: &mut [T],
    ) {
        self.apply(affine, activation, values, out, None);
    }

    /// `values` becomes its normalised self, `out` becomes `act(skip + scale * values + shift)`.
    pub(super) fn activate_residual(
        &self,
        affine: Affine<T>,
        activation: Activation,
        values: &mut [T],
        skip: &[T],
        out: &mut [T],
    ) {
        self.apply(affine, activation, values, out, Some(skip));
    }

    #[inline(always)]
    fn apply(&self, affine: Affine<T>, act: Activation, values: &mut [T], out: &mut [T], skip: Option<&[T]>) {
        vectorized(|| match (act, skip) {
            (Activation::Elu, None) => self.rows(affine, values, out, elu),
            (Activation::Relu, None) => self.rows(affine, values, out, relu),
            (Activation::Elu, Some(skip)) => self.residual_rows(affine, values, skip, out, elu),
            (Activation::Relu, Some(skip)) => self.residual_rows(affine, values, skip, out, relu),
        });
    }

    #[inline(always)]
    fn rows(&self, affine: Affine<T>, values: &mut [T], out: &mut [T], activate: impl Fn(T) -> T) {
        let width = self.mean.len();
        let (mean, inv_std) = (&self.mean[..width], &self.inv_std[..width]);
        let (scale, shift) = (&affine.scale[..width], &affine.shift[..width]);
        for (values, out) in values.chunks_exact_mut(width).zip(out.chunks_exact_mut(width)) {
            for c in 0..width {
                values[c] = (values[c] - mean[c]) * inv_std[c];
                out[c] = activate(values[c] * scale[c] + shift[c]);
            }
        }
    }

    #[inline(always)]
    fn residual_rows(
        &self,
        affine: Affine<T>,
        values: &mut [T],
        skip: &[T],
        out: &mut [T],
        activate: impl Fn(T) -> T,
    ) {
        let width = self.mean.len();
        let (mean, inv_std) = (&self.mean[..width], &self.inv_std[..width]);
        let (scale, shift) = (&affine.scale[..width], &affine.shift[..width]);
        let rows =
            values.chunks_exact_mut(width).zip(skip.chunks_exact(width)).zip(out.chunks_exact_mut(width));
        for ((values, skip), out) in rows {
            for c in 0..width {
                values[c] = (values[c] - mean[c]) * inv_std[c];
                out[c] = activate(skip[c] + (values[c] * scale[c] + shift[c]));
            }
        }
    }
}

/// The learnable scale and shift after a normalisation.
#[derive(Clone, Copy)]
pub(super) struct Affine<'a, T> {
    /// One factor a channel.
    pub(super) scale: &'a [T],
    /// One summand a channel.
    pub(super) shift: &'a [T],
}

#[inline(always)]
fn elu<T: Real>(x: T) -> T {
    let negative = if x > T::zero() { T::zero() } else { x };
    let exponential = negative.exp_m1_nonpositive();
    if x > T::zero() { x } else { exponential }
}

#[inline(always)]
fn relu<T: Real>(x: T) -> T {
    if x < T::zero() { T::zero() } else { x }
}

/// Sums over rows that the backward pass of a normalisation needs, per channel: of the gradient, and of the gradient
/// times the normalised value.
#[derive(Clone, Debug)]
pub(super) struct GradientSums {
    /// Sum of the gradient: the gradient of the shift.
    pub(super) shift: Vec<f64>,
    /// Sum of the gradient times the normalised value: the gradient of the scale.
    pub(super) scale: Vec<f64>,
}

impl GradientSums {
    fn zeros(width: usize) -> Self {
        Self { shift: vec![0.0; width], scale: vec![0.0; width] }
    }

    fn add(&mut self, other: &Self) {
        let sums = self.shift.iter_mut().chain(&mut self.scale);
        sums.zip(other.shift.iter().chain(&other.scale)).for_each(|(sum, value)| *sum += value);
    }

    /// Of each group, from its chunks.
    pub(super) fn of_groups(plan: &RowPlan, chunks: &[GradientSums]) -> Vec<Self> {
        let width = chunks.first().map_or(0, |chunk| chunk.shift.len());
        let mut groups = vec![Self::zeros(width); plan.groups.len()];
        for ((group, _), chunk) in plan.chunks.iter().zip(chunks) {
            groups[*group].add(chunk);
        }
        groups
    }

    /// Over all groups: the gradients of shift and scale.
    pub(super) fn total(groups: &[GradientSums]) -> Self {
        let mut total = Self::zeros(groups.first().map_or(0, |group| group.shift.len()));
        groups.iter().for_each(|group| total.add(group));
        total
    }
}

/// Backward of the activation: multiplies `grad` by the derivative, known from the activation's output, and sums.
pub(super) fn activation_backward<T: Real>(
    activation: Activation,
    grad: &mut [T],
    output: &[T],
    normalized: &[T],
    width: usize,
) -> GradientSums {
    let mut shift = vec![T::zero(); width];
    let mut scale = vec![T::zero(); width];
    let derivative_elu = |y: T| if y > T::zero() { T::one() } else { y + T::one() };
    let derivative_relu = |y: T| if y > T::zero() { T::one() } else { T::zero() };
    vectorized(|| match activation {
        Activation::Elu => sum_rows(grad, output, normalized, &mut shift, &mut scale, derivative_elu),
        Activation::Relu => sum_rows(grad, output, normalized, &mut shift, &mut scale, derivative_relu),
    });
    let wide = |sums: &[T]| sums.iter().map(|sum| sum.to_f64()).collect();
    GradientSums { shift: wide(&shift), scale: wide(&scale) }
}

#[inline(always)]
fn sum_rows<T: Real>(
    grad: &mut [T],
    output: &[T],
    normalized: &[T],
    shift: &mut [T],
    scale: &mut [T],
    derivative: impl Fn(T) -> T,
) {
    let width = shift.len();
    let scale = &mut scale[..width];
    let rows =
        grad.chunks_exact_mut(width).zip(output.chunks_exact(width)).zip(normalized.chunks_exact(width));
    for ((grad, output), normalized) in rows {
        for c in 0..width {
            grad[c] *= derivative(output[c]);
            shift[c] += grad[c];
            scale[c] += grad[c] * normalized[c];
        }
    }
}

/// Backward of normalisation and scale for one group:
/// `dz = scale * inv_std * (grad - mean(grad) - normalized * mean(grad * normalized))`.
pub(super) struct NormBackward<T> {
    factor: Vec<T>,
    mean: Vec<T>,
    slope: Vec<T>,
}

impl<T: Real> NormBackward<T> {
    /// From the sums over the group's rows.
    pub(super) fn new(sums: &GradientSums, rows: usize, scale: &[T], inv_std: &[T]) -> Self {
        let mean = |sums: &[f64]| sums.iter().map(|sum| T::from_f64(sum / rows as f64)).collect();
        Self {
            factor: scale.iter().zip(inv_std).map(|(&scale, &inv_std)| scale * inv_std).collect(),
            mean: mean(&sums.shift),
            slope: mean(&sums.scale),
        }
    }

    /// `out` becomes the gradient at the normalisation's input.
    pub(super) fn apply(&self, grad: &[T], normalized: &[T], out: &mut [T]) {
        let width = self.mean.len();
        let (factor, mean, slope) = (&self.factor[..width], &self.mean[..width], &self.slope[..width]);
        let rows =
            grad.chunks_exact(width).zip(normalized.chunks_exact(width)).zip(out.chunks_exact_mut(width));
        vectorized(|| {
            for ((grad, normalized), out) in rows {
                for c in 0..width {
                    out[c] = factor[c] * (grad[c] - mean[c] - normalized[c] * slope[c]);
                }
            }
        });
    }

    /// As [`Self::apply`], over `grad` itself.
    pub(super) fn apply_in_place(&self, grad: &mut [T], normalized: &[T]) {
        let width = self.mean.len();
        let (factor, mean, slope) = (&self.factor[..width], &self.mean[..width], &self.slope[..width]);
        let rows = grad.chunks_exact_mut(width).zip(normalized.chunks_exact(width));
        vectorized(|| {
            for (grad, normalized) in rows {
                for c in 0..width {
                    grad[c] = factor[c] * (grad[c] - mean[c] - normalized[c] * slope[c]);
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_chunks_combine_to_those_of_the_group() {
        let (rows, width) = (700, 3);
        let values: Vec<f64> = (0..rows * width).map(|i| 5.0 + (i as f64 * 0.61).sin()).collect();
        let plan = RowPlan::new(vec![rows]);
        assert!(plan.chunks.len() > 1);
        let chunk = |range: &std::ops::Range<usize>| &values[range.start * width..range.end * width];
        let chunks: Vec<_> = plan.chunks.iter().map(|(_, r)| Moments::of_rows(chunk(r), width)).collect();
        let combined = &Moments::of_groups(&plan, &chunks)[0];
        let whole = Moments::of_rows(&values, width);
        for c in 0..width {
            assert!((combined.mean[c] - whole.mean[c]).abs() < 1e-13);
            assert!((combined.variance[c] - whole.variance[c]).abs() < 1e-13);
        }
    }
}
