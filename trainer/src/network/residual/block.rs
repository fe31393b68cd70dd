//! One residual block on the CPU, forward and backward: `y = act(norm1(x W1))`, `out = act(x + norm2(y W2))`.
//!
//! `[n, width]` row-major, weights `[width in, width out]`. Each stage goes over the chunks of a [`RowPlan`] once, so
//! that a chunk's product, sums and elementwise work happen while it is in the cache.

use super::norm::{Affine, GradientSums, Moments, NormBackward, Normalizer, RowPlan, activation_backward};
use super::{Activation, pool::BufferPool};
use crate::numeric::{MatrixView, Real, matmul, matmul_split, split_rows};
use rayon::prelude::*;

/// Pieces of the long product of the weight gradients; fixed, so that results do not depend on the threads.
const GRADIENT_PIECES: usize = 4;

/// Parameters of a block, views into the flat parameter vector in this order.
#[derive(Clone, Copy)]
pub(super) struct BlockParameters<'a, T> {
    weights: [&'a [T]; 2],
    affines: [Affine<'a, T>; 2],
}

impl<'a, T> BlockParameters<'a, T> {
    /// Number of parameters of a block.
    pub(super) const fn len(width: usize) -> usize {
        2 * (width * width + 2 * width)
    }

    /// Splits a block's flat parameters: weight, scale and shift of the first half, then of the second.
    pub(super) fn new(flat: &'a [T], width: usize) -> Self {
        let half = |flat: &'a [T]| {
            let (weight, rest) = flat.split_at(width * width);
            let (scale, shift) = rest.split_at(width);
            (weight, Affine { scale, shift })
        };
        let (first, second) = flat.split_at(flat.len() / 2);
        let ((weight1, affine1), (weight2, affine2)) = (half(first), half(second));
        Self { weights: [weight1, weight2], affines: [affine1, affine2] }
    }

    fn weight(&self, half: usize) -> MatrixView<'a, T> {
        let width = self.affines[0].scale.len();
        MatrixView::new(self.weights[half], width, width)
    }
}

/// What the backward pass needs of the forward pass.
pub(super) struct BlockActivations<T> {
    normalized: [Vec<T>; 2],
    hidden: Vec<T>,
    /// The block's output `[n, width]`.
    pub(super) out: Vec<T>,
    normalizers: [Vec<Normalizer<T>>; 2],
    /// Moments of the groups, for each of the two normalisations.
    pub(super) moments: [Vec<Moments>; 2],
}

impl<T: Real> BlockActivations<T> {
    /// Gives the buffers back.
    pub(super) fn recycle(self, pool: &BufferPool<T>) {
        let [normalized1, normalized2] = self.normalized;
        [normalized1, normalized2, self.hidden, self.out].into_iter().for_each(|buffer| pool.give(buffer));
    }
}

/// What is constant over the blocks of a network.
pub(super) struct BlockContext<'a, T> {
    /// Groups and chunks of the rows.
    pub(super) plan: &'a RowPlan,
    /// Number of channels.
    pub(super) width: usize,
    /// Added to variances.
    pub(super) epsilon: f64,
    /// Between the layers.
    pub(super) activation: Activation,
    /// Where buffers come from.
    pub(super) pool: &'a BufferPool<T>,
}

impl<T: Real> BlockContext<'_, T> {
    /// Rows of a chunk of `data`.
    fn chunk<'d>(&self, data: &'d [T], chunk: usize) -> &'d [T] {
        let rows = &self.plan.chunks[chunk].1;
        &data[rows.start * self.width..rows.end * self.width]
    }

    fn view<'d>(&self, data: &'d [T]) -> MatrixView<'d, T> {
        MatrixView::new(data, data.len() / self.width, self.width)
    }

    fn split<'d>(&self, data: &'d mut [T]) -> Vec<&'d mut [T]> {
        split_rows(data, self.width, self.plan.lengths())
    }

    fn buffer(&self) -> Vec<T> {
        self.pool.take(self.plan.rows() * self.width)
    }

    /// Forward pass. With `fixed` moments (of each normalisation) the statistics are not taken from the rows.
    pub(super) fn forward(
        &self,
        parameters: BlockParameters<T>,
        input: &[T],
        fixed: Option<&[Moments; 2]>,
    ) -> BlockActivations<T> {
        let mut normalized = [self.buffer(), self.buffer()];
        let (mut hidden, mut out) = (self.buffer(), self.buffer());
        let [first, second] = &mut normalized;
        let groups = |half: usize, chunks: &[Moments]| match fixed {
            Some(moments) => vec![moments[half].clone(); self.plan.groups.len()],
            None => Moments::of_groups(self.plan, chunks),
        };
        let moments_of = |rows: &[T]| match fixed {
            Some(_) => Moments::default(),
            None => Moments::of_rows(rows, self.width),
        };

        let chunks: Vec<Moments> = (self.split(first).into_par_iter().enumerate())
            .map(|(chunk, product)| {
                matmul(product, false, self.view(self.chunk(input, chunk)), parameters.weight(0));
                moments_of(product)
            })
            .collect();
        let moments1 = groups(0, &chunks);
        let normalizers1 = self.normalizers(&moments1);

        let stage = self.split(first).into_par_iter().zip(self.split(&mut hidden)).zip(self.split(second));
        let chunks: Vec<Moments> = (stage.enumerate())
            .map(|(chunk, ((values, hidden), product))| {
                let normalizer = &normalizers1[self.plan.chunks[chunk].0];
                normalizer.activate(parameters.affines[0], self.activation, values, hidden);
                matmul(product, false, self.view(hidden), parameters.weight(1));
                moments_of(product)
            })
            .collect();
        let moments2 = groups(1, &chunks);
        let normalizers2 = self.normalizers(&moments2);

        let stage = self.split(second).into_par_iter().zip(self.split(&mut out)).enumerate();
        stage.for_each(|(chunk, (values, out))| {
            let normalizer = &normalizers2[self.plan.chunks[chunk].0];
            let skip = self.chunk(input, chunk);
            normalizer.activate_residual(parameters.affines[1], self.activation, values, skip, out);
        });
        BlockActivations {
            normalized,
            hidden,
            out,
            normalizers: [normalizers1, normalizers2],
            moments: [moments1, moments2],
        }
    }

    fn normalizers(&self, moments: &[Moments]) -> Vec<Normalizer<T>> {
        moments.iter().map(|moments| moments.normalizer(self.epsilon)).collect()
    }

    /// Backward pass: `grad` enters as the gradient of the block's output and, with `to_input`, leaves as the
    /// gradient of its input. The parameters' gradients are written to `flat`, ordered as the parameters.
    pub(super) fn backward(
        &self,
        parameters: BlockParameters<T>,
        saved: &BlockActivations<T>,
        input: &[T],
        grad: &mut [T],
        flat: &mut [T],
        to_input: bool,
    ) {
        let [normalized1, normalized2] = &saved.normalized;
        let (mut grad_product, mut grad_hidden) = (self.buffer(), self.buffer());
        let (flat1, flat2) = flat.split_at_mut(BlockParameters::<T>::len(self.width) / 2);

        let chunks: Vec<GradientSums> = (self.split(grad).into_par_iter().enumerate())
            .map(|(chunk, grad)| {
                let (out, normalized) = (self.chunk(&saved.out, chunk), self.chunk(normalized2, chunk));
                activation_backward(self.activation, grad, out, normalized, self.width)
            })
            .collect();
        let norm2 = self.norm_backward(1, parameters, saved, &chunks, flat2);

        let stage = self.split(&mut grad_product).into_par_iter().zip(self.split(&mut grad_hidden));
        let chunks: Vec<GradientSums> = (stage.enumerate())
            .map(|(chunk, (grad_product, grad_hidden))| {
                let norm = &norm2[self.plan.chunks[chunk].0];
                norm.apply(self.chunk(grad, chunk), self.chunk(normalized2, chunk), grad_product);
                matmul(grad_hidden, false, self.view(grad_product), parameters.weight(1).t());
                let (hidden, normalized) = (self.chunk(&saved.hidden, chunk), self.chunk(normalized1, chunk));
                activation_backward(self.activation, grad_hidden, hidden, normalized, self.width)
            })
            .collect();
        self.weight_gradient(&saved.hidden, &grad_product, flat2);
        let norm1 = self.norm_backward(0, parameters, saved, &chunks, flat1);

        let stage = self.split(&mut grad_hidden).into_par_iter().zip(self.split(grad)).enumerate();
        stage.for_each(|(chunk, (grad_hidden, grad))| {
            norm1[self.plan.chunks[chunk].0].apply_in_place(grad_hidden, self.chunk(normalized1, chunk));
            if to_input {
                matmul(grad, true, self.view(grad_hidden), parameters.weight(0).t());
            }
        });
        self.weight_gradient(input, &grad_hidden, flat1);
        self.pool.give(grad_product);
        self.pool.give(grad_hidden);
    }

    /// Writes the gradients of a half's scale and shift; returns the backward normalisation of each group.
    fn norm_backward(
        &self,
        half: usize,
        parameters: BlockParameters<T>,
        saved: &BlockActivations<T>,
        chunks: &[GradientSums],
        flat: &mut [T],
    ) -> Vec<NormBackward<T>> {
        let groups = GradientSums::of_groups(self.plan, chunks);
        let total = GradientSums::total(&groups);
        let affine = &mut flat[self.width * self.width..];
        for (grad, sum) in affine.iter_mut().zip(total.scale.iter().chain(&total.shift)) {
            *grad = T::from_f64(*sum);
        }
        let scale = parameters.affines[half].scale;
        let norm = |group: usize| {
            let normalizer = &saved.normalizers[half][group];
            NormBackward::new(&groups[group], self.plan.groups[group], scale, &normalizer.inv_std)
        };
        (0..groups.len()).map(norm).collect()
    }

    /// `input^T grad`, the gradient of a weight, at the front of `flat`.
    fn weight_gradient(&self, input: &[T], grad: &[T], flat: &mut [T]) {
        let weight = &mut flat[..self.width * self.width];
        matmul_split(weight, self.view(input).t(), self.view(grad), GRADIENT_PIECES);
    }
}
