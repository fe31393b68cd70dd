//! The parameters of a block, as views into the flat vector, and what is derived from them.

use super::{LEAST_EXPONENT, MIN_TIME};
use crate::numeric::{MatrixView, Real, matmul, vectorized};

/// A linear layer `x W + b`.
#[derive(Clone, Copy)]
pub(super) struct Linear<'a, T> {
    pub(super) weight: &'a [T],
    pub(super) bias: &'a [T],
}

impl<'a, T: Real> Linear<'a, T> {
    /// Takes the layer off the front of `parameters`.
    pub(super) fn take(parameters: &mut &'a [T], inputs: usize, outputs: usize) -> Self {
        let (weight, rest) = parameters.split_at(inputs * outputs);
        let (bias, rest) = rest.split_at(outputs);
        *parameters = rest;
        Self { weight, bias }
    }

    fn outputs(&self) -> usize {
        self.bias.len()
    }

    /// `[in, out]`.
    pub(super) fn weight(&self) -> MatrixView<'a, T> {
        MatrixView::new(self.weight, self.weight.len() / self.outputs(), self.outputs())
    }

    /// `out = x W + b` for rows `x`, `[rows, in]`.
    pub(super) fn apply(&self, x: MatrixView<T>, out: &mut [T]) {
        for row in out.chunks_exact_mut(self.outputs()) {
            row.copy_from_slice(self.bias);
        }
        matmul(out, true, x, self.weight());
    }
}

/// The same layer's place in a gradient.
pub(super) struct LinearGradient<'a, T> {
    weight: &'a mut [T],
    bias: &'a mut [T],
}

impl<'a, T: Real> LinearGradient<'a, T> {
    /// Takes the layer off the front of `gradient`.
    pub(super) fn take(gradient: &mut &'a mut [T], inputs: usize, outputs: usize) -> Self {
        let (weight, rest) = std::mem::take(gradient).split_at_mut(inputs * outputs);
        let (bias, rest) = rest.split_at_mut(outputs);
        *gradient = rest;
        Self { weight, bias }
    }

    /// Adds what the rows `x`, `[rows, in]`, and the gradient of their outputs, `[rows, out]`, give.
    pub(super) fn add(&mut self, x: MatrixView<T>, grad_out: &[T]) {
        let outputs = self.bias.len();
        matmul(self.weight, true, x.t(), MatrixView::new(grad_out, grad_out.len() / outputs, outputs));
        vectorized(|| {
            for row in grad_out.chunks_exact(outputs) {
                self.bias.iter_mut().zip(row).for_each(|(sum, &x)| *sum += x);
            }
        });
    }
}

/// Number of parameters of a block.
pub(super) const fn len(width: usize) -> usize {
    width + 2 * width * width + (3 * width + 2 * width) * width + 3 * width
}

/// The parameters of a block.
pub(super) struct Block<'a, T> {
    pub(super) width: usize,
    pub(super) time: &'a [T],
    pub(super) real: &'a [T],
    pub(super) imaginary: &'a [T],
    pub(super) mlp: [Linear<'a, T>; 3],
}

impl<'a, T: Real> Block<'a, T> {
    /// Takes the block off the front of `parameters`.
    pub(super) fn take(parameters: &mut &'a [T], width: usize) -> Self {
        let (time, rest) = parameters.split_at(width);
        let (real, rest) = rest.split_at(width * width);
        let (imaginary, rest) = rest.split_at(width * width);
        *parameters = rest;
        let mut linear = |inputs| Linear::take(parameters, inputs, width);
        Self { width, time, real, imaginary, mlp: [linear(3 * width), linear(width), linear(width)] }
    }

    /// `exp(-lambda t)`, `[k, width]`.
    pub(super) fn decay(&self, eigenvalues: &[T]) -> Vec<T> {
        let times: Vec<f64> = self.time.iter().map(|t| t.to_double().max(MIN_TIME)).collect();
        let row = |lambda: &T| {
            let lambda = lambda.to_double();
            let decay = move |t: &f64| T::from_double((-lambda * t).max(LEAST_EXPONENT).exp());
            times.iter().map(decay).collect::<Vec<T>>()
        };
        eigenvalues.iter().flat_map(row).collect()
    }

    /// `[R | J]` and `[-J | R]`, `[width, 2 width]` each: with them `[u R - v J | v R + u J]` is two products.
    pub(super) fn rotations(&self) -> [Vec<T>; 2] {
        let rows = || self.real.chunks_exact(self.width).zip(self.imaginary.chunks_exact(self.width));
        let of_u = rows().flat_map(|(real, imaginary)| real.iter().chain(imaginary).copied()).collect();
        let of_v =
            rows().flat_map(|(real, imaginary)| imaginary.iter().map(|&x| -x).chain(real.iter().copied()));
        [of_u, of_v.collect()]
    }
}
