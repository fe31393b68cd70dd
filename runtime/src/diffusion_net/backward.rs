//! The backward pass.

use super::block::{Block, Linear, LinearGradient};
use super::forward::{Activations, BlockActivations, ChunkActivations, operator_rows};
use super::{Architecture, MIN_TIME, Operators, check, chunks, pieces, sum_in_order};
use crate::numeric::{MatrixView, Real, matmul, vectorized};
use rayon::prelude::*;
use std::ops::Range;

/// The gradient of the parameters, `[p]`, given that of the descriptors, `[n, outputs]`, and what the forward pass on
/// the same arrays kept.
///
/// A diffusion time at its lower bound gets no gradient that would shorten it. Multi-threaded; the same bytes for any
/// number of threads.
///
/// # Errors
/// If an array has another length than the sizes ask for, or the activations are of another pass.
pub fn backward<T: Real>(
    architecture: &Architecture,
    parameters: &[T],
    input: &[T],
    operators: &Operators<T>,
    activations: &Activations<T>,
    grad_descriptors: &[T],
) -> Result<Vec<T>, String> {
    check(architecture, parameters, input, operators)?;
    let Architecture { inputs, blocks, width, outputs } = *architecture;
    let n = operators.n();
    if grad_descriptors.len() != n * outputs {
        return Err(format!(
            "the gradient has {} entries, expected [{n}, {outputs}]",
            grad_descriptors.len()
        ));
    }
    let rows = chunks(n);
    if activations.blocks.len() != blocks || activations.last.len() != rows.len() {
        return Err("the activations are of another network or shape".into());
    }
    let mut rest = parameters;
    let _ = Linear::take(&mut rest, inputs, width);
    let block_views: Vec<Block<T>> = (0..blocks).map(|_| Block::take(&mut rest, width)).collect();
    let last = Linear::take(&mut rest, width, outputs);

    let mut gradient = vec![T::ZERO; parameters.len()];
    let (head, tail) = gradient.split_at_mut(parameters.len() - (width + 1) * outputs);
    let (input_gradient, mut block_gradients) = head.split_at_mut((inputs + 1) * width);
    let pass = Pass { operators, rows: &rows, width };

    let last_rows = |chunk: usize| MatrixView::new(&activations.last[chunk], rows[chunk].len(), width);
    tail.copy_from_slice(&pass.layer_gradient(grad_descriptors, outputs, width, last_rows));
    let mut grad: Vec<Vec<T>> = rows
        .par_iter()
        .map(|rows| {
            let out = operator_rows(grad_descriptors, outputs, rows);
            let mut grad = vec![T::ZERO; rows.len() * width];
            matmul(&mut grad, false, out, last.weight().t());
            grad
        })
        .collect();
    let block_len = super::block::len(width);
    for (block, kept) in block_views.iter().zip(&activations.blocks).rev() {
        let split = block_gradients.len() - block_len;
        let (before, own) = block_gradients.split_at_mut(split);
        let (own_gradient, grad_x) = pass.block_gradient(block, kept, &grad);
        own.copy_from_slice(&own_gradient);
        grad = grad_x;
        block_gradients = before;
    }
    let grad = grad.concat();
    let input_rows = |chunk: usize| operator_rows(input, inputs, &rows[chunk]);
    input_gradient.copy_from_slice(&pass.layer_gradient(&grad, width, inputs, input_rows));
    Ok(gradient)
}

/// What is constant over the blocks.
struct Pass<'a, T> {
    operators: &'a Operators<T>,
    rows: &'a [Range<usize>],
    width: usize,
}

/// What one piece of a block's rows adds to sums over all rows.
struct BlockSums<T> {
    /// Of the parameters, but for time, real and imaginary part, `[p]`.
    mlp: Vec<T>,
    /// Of `[R | J]` and `[-J | R]`, `[width, 2 width]` each.
    rotations: [Vec<T>; 2],
    /// Of `c`, `[k, width]`.
    coefficients: Vec<T>,
}

impl<'a, T: Real> Pass<'a, T> {
    /// The gradient of a linear layer: weight, then bias.
    fn layer_gradient(
        &self,
        grad_out: &[T],
        outputs: usize,
        inputs: usize,
        x: impl Fn(usize) -> MatrixView<'a, T> + Sync,
    ) -> Vec<T> {
        let parts = pieces(self.rows.len())
            .into_par_iter()
            .map(|piece| {
                let mut sum = vec![T::ZERO; (inputs + 1) * outputs];
                for chunk in piece {
                    let rows = &self.rows[chunk];
                    let grad_out = &grad_out[rows.start * outputs..rows.end * outputs];
                    LinearGradient::take(&mut &mut sum[..], inputs, outputs).add(x(chunk), grad_out);
                }
                sum
            })
            .collect();
        sum_in_order(parts)
    }

    /// The gradient of a block's parameters, and of its input, a chunk each, given that of its output.
    fn block_gradient(
        &self,
        block: &Block<T>,
        kept: &BlockActivations<T>,
        grad: &[Vec<T>],
    ) -> (Vec<T>, Vec<Vec<T>>) {
        let rotations = block.rotations();
        let done: Vec<(BlockSums<T>, Vec<Vec<T>>)> = pieces(self.rows.len())
            .into_par_iter()
            .map(|piece| {
                let mut sums = BlockSums::new(self.operators.k(), self.width);
                let grad_x = piece.map(|chunk| {
                    let rows = &self.rows[chunk];
                    sums.add_chunk(block, &rotations, &kept.chunks[chunk], &grad[chunk], self.operators, rows)
                });
                let grad_x = grad_x.collect();
                (sums, grad_x)
            })
            .collect();
        let (sums, grad_x): (Vec<_>, Vec<_>) = done.into_iter().unzip();
        let mut grad_x = grad_x.concat();
        let BlockSums { mlp, rotations: [of_u, of_v], mut coefficients } = BlockSums::total(sums);
        let time = self.time_gradient(block, &coefficients, &kept.coefficients);
        let decay = block.decay(&self.operators.eigenvalues);
        vectorized(|| coefficients.iter_mut().zip(&decay).for_each(|(g, &decay)| *g *= decay));
        self.add_unprojected(&coefficients, &mut grad_x);
        let (real, imaginary) = unturned(&of_u, &of_v, self.width);
        ([time, real, imaginary, mlp].concat(), grad_x)
    }

    /// Adds `A E grad` to the rows, the adjoint of `E^T A x`; `grad` is `[k, width]`.
    fn add_unprojected(&self, grad: &[T], grad_x: &mut [Vec<T>]) {
        let grad = MatrixView::new(grad, self.operators.k(), self.width);
        (self.rows, grad_x).into_par_iter().for_each(|(rows, grad_x)| {
            let mut out = vec![T::ZERO; grad_x.len()];
            let eigenvectors = operator_rows(&self.operators.eigenvectors, self.operators.k(), rows);
            matmul(&mut out, false, eigenvectors, grad);
            let out = out.chunks_exact(self.width).zip(&self.operators.mass[rows.clone()]);
            vectorized(|| {
                for (row, (out, &mass)) in grad_x.chunks_exact_mut(self.width).zip(out) {
                    row.iter_mut().zip(out).for_each(|(grad, &x)| *grad += mass * x);
                }
            });
        });
    }

    /// `sum_i -lambda_i c_i grad_i` of each channel.
    fn time_gradient(&self, block: &Block<T>, grad: &[T], coefficients: &[T]) -> Vec<T> {
        let mut sums = vec![0.0; self.width];
        let rows = grad.chunks_exact(self.width).zip(coefficients.chunks_exact(self.width));
        for (&lambda, (grad, c)) in self.operators.eigenvalues.iter().zip(rows) {
            for (sum, (&grad, &c)) in sums.iter_mut().zip(grad.iter().zip(c)) {
                *sum -= lambda.to_double() * grad.to_double() * c.to_double();
            }
        }
        let kept = |(sum, time): (f64, &T)| {
            let at_bound = time.to_double() <= MIN_TIME;
            T::from_double(if at_bound { sum.min(0.0) } else { sum })
        };
        sums.into_iter().zip(block.time).map(kept).collect()
    }
}

/// The gradients of `R` and `J` from those of `[R | J]` and `[-J | R]`.
fn unturned<T: Real>(of_u: &[T], of_v: &[T], width: usize) -> (Vec<T>, Vec<T>) {
    let rows = || of_u.chunks_exact(2 * width).zip(of_v.chunks_exact(2 * width));
    let real = rows().flat_map(|(u, v)| u[..width].iter().zip(&v[width..]).map(|(&u, &v)| u + v));
    let imaginary = rows().flat_map(|(u, v)| u[width..].iter().zip(&v[..width]).map(|(&u, &v)| u - v));
    (real.collect(), imaginary.collect())
}

impl<T: Real> BlockSums<T> {
    fn new(k: usize, width: usize) -> Self {
        let rotation = vec![T::ZERO; 2 * width * width];
        Self {
            mlp: vec![T::ZERO; 5 * width * width + 3 * width],
            rotations: [rotation.clone(), rotation],
            coefficients: vec![T::ZERO; k * width],
        }
    }

    fn total(parts: Vec<Self>) -> Self {
        let mut lists: [Vec<Vec<T>>; 4] = Default::default();
        for Self { mlp, rotations: [of_u, of_v], coefficients } in parts {
            lists.iter_mut().zip([mlp, of_u, of_v, coefficients]).for_each(|(list, part)| list.push(part));
        }
        let [mlp, of_u, of_v, coefficients] = lists.map(sum_in_order);
        Self { mlp, rotations: [of_u, of_v], coefficients }
    }

    /// Adds what a chunk gives, given the gradient of its output, `[rows, width]`; returns that of its input but for
    /// the part through the coefficients.
    fn add_chunk(
        &mut self,
        block: &Block<T>,
        rotations: &[Vec<T>; 2],
        kept: &ChunkActivations<T>,
        grad: &[T],
        operators: &Operators<T>,
        rows: &Range<usize>,
    ) -> Vec<T> {
        let (n, k, width) = (rows.len(), operators.k(), block.width);
        let grad_concatenated = self.mlp_backward(block, kept, grad, n);
        let mut grad_x = grad.to_vec();
        let mut grad_diffused = vec![T::ZERO; n * width];
        let mut grad_turned = vec![T::ZERO; 2 * n * width];
        let (mut grad_u, mut grad_v) = (vec![T::ZERO; n * width], vec![T::ZERO; n * width]);
        vectorized(|| {
            for (i, row) in grad_concatenated.chunks_exact(3 * width).enumerate() {
                let at = i * width..(i + 1) * width;
                grad_x[at.clone()].iter_mut().zip(row).for_each(|(x, &g)| *x += g);
                grad_diffused[at.clone()].copy_from_slice(&row[width..2 * width]);
                let g = &kept.concatenated[(3 * i + 2) * width..3 * (i + 1) * width];
                let (p, q) = kept.turned[2 * i * width..2 * (i + 1) * width].split_at(width);
                let (grad_p, grad_q) = grad_turned[2 * i * width..2 * (i + 1) * width].split_at_mut(width);
                let (u, v) = (&kept.u[at.clone()], &kept.v[at.clone()]);
                let (grad_u, grad_v) = (&mut grad_u[at.clone()], &mut grad_v[at]);
                for c in 0..width {
                    // Through tanh.
                    let grad = row[2 * width + c] * (T::ONE - g[c] * g[c]);
                    grad_p[c] = grad * u[c];
                    grad_q[c] = grad * v[c];
                    grad_u[c] = grad * p[c];
                    grad_v[c] = grad * q[c];
                }
            }
        });
        let grad_turned = MatrixView::new(&grad_turned, n, 2 * width);
        let functions = [(&kept.u, &mut grad_u), (&kept.v, &mut grad_v)];
        for (((function, grad), rotation), sum) in
            functions.into_iter().zip(rotations).zip(&mut self.rotations)
        {
            matmul(grad, true, grad_turned, MatrixView::new(rotation, width, 2 * width).t());
            matmul(sum, true, MatrixView::new(function, n, width).t(), grad_turned);
        }
        let parts = [
            (&operators.eigenvectors, &grad_diffused),
            (&operators.gradients_x, &grad_u),
            (&operators.gradients_y, &grad_v),
        ];
        for (operator, grad) in parts {
            let operator = operator_rows(operator, k, rows);
            matmul(&mut self.coefficients, true, operator.t(), MatrixView::new(grad, n, width));
        }
        grad_x
    }

    /// Through the three layers: the gradient of `[x, d, g]`, `[rows, 3 width]`.
    fn mlp_backward(&mut self, block: &Block<T>, kept: &ChunkActivations<T>, grad: &[T], n: usize) -> Vec<T> {
        let width = block.width;
        let mut sums = &mut self.mlp[..];
        let mut gradient_of =
            [3 * width, width, width].map(|inputs| LinearGradient::take(&mut sums, inputs, width));
        let mut grad = grad.to_vec();
        for layer in [2, 1] {
            let hidden = &kept.hidden[layer - 1];
            gradient_of[layer].add(MatrixView::new(hidden, n, width), &grad);
            let mut below = vec![T::ZERO; n * width];
            matmul(&mut below, false, MatrixView::new(&grad, n, width), block.mlp[layer].weight().t());
            // Through the rectifier.
            vectorized(|| {
                for (grad, &value) in below.iter_mut().zip(hidden) {
                    *grad = if value > T::ZERO { *grad } else { T::ZERO };
                }
            });
            grad = below;
        }
        gradient_of[0].add(MatrixView::new(&kept.concatenated, n, 3 * width), &grad);
        let mut below = vec![T::ZERO; 3 * n * width];
        matmul(&mut below, false, MatrixView::new(&grad, n, width), block.mlp[0].weight().t());
        below
    }
}
