//! The forward pass.

use super::block::{Block, Linear};
use super::{Architecture, Operators, check, chunks, pieces, sum_in_order};
use crate::numeric::{MatrixView, Real, matmul, vectorized};
use rayon::prelude::*;
use std::ops::Range;

/// What the backward pass needs of the forward pass.
pub struct Activations<T> {
    pub(super) blocks: Vec<BlockActivations<T>>,
    /// The last block's output, a chunk each.
    pub(super) last: Vec<Vec<T>>,
}

pub(super) struct BlockActivations<T> {
    /// `c`, `[k, width]`.
    pub(super) coefficients: Vec<T>,
    pub(super) chunks: Vec<ChunkActivations<T>>,
}

/// One chunk of rows, `[rows, ...]`.
pub(super) struct ChunkActivations<T> {
    /// `[x, d, g]`, `[rows, 3 width]`.
    pub(super) concatenated: Vec<T>,
    /// `u`, `[rows, width]`.
    pub(super) u: Vec<T>,
    /// `v`, `[rows, width]`.
    pub(super) v: Vec<T>,
    /// `[u R - v J | v R + u J]`, `[rows, 2 width]`.
    pub(super) turned: Vec<T>,
    /// After the first and the second layer, `[rows, width]` each.
    pub(super) hidden: [Vec<T>; 2],
}

/// Descriptors `[n, outputs]` of the input functions `[n, inputs]` (both row-major), and what [`super::backward`]
/// needs where `keep` says so.
///
/// Multi-threaded; the same bytes for any number of threads.
///
/// # Errors
/// If an array has another length than the sizes ask for: which, expected and found.
pub fn forward<T: Real>(
    architecture: &Architecture,
    parameters: &[T],
    input: &[T],
    operators: &Operators<T>,
    keep: bool,
) -> Result<(Vec<T>, Option<Activations<T>>), String> {
    check(architecture, parameters, input, operators)?;
    let Architecture { inputs, blocks, width, outputs } = *architecture;
    let rows = chunks(operators.n());
    let mut rest = parameters;
    let first = Linear::take(&mut rest, inputs, width);
    let mut x: Vec<Vec<T>> = rows
        .par_iter()
        .map(|rows| {
            let chunk = &input[rows.start * inputs..rows.end * inputs];
            let mut out = vec![T::ZERO; rows.len() * width];
            first.apply(MatrixView::new(chunk, rows.len(), inputs), &mut out);
            out
        })
        .collect();
    let mut kept = Vec::new();
    for _ in 0..blocks {
        let block = Block::take(&mut rest, width);
        let (out, activations) = run_block(&block, &x, operators, &rows, keep);
        x = out;
        kept.extend(activations);
    }
    let last = Linear::take(&mut rest, width, outputs);
    let mut descriptors = vec![T::ZERO; operators.n() * outputs];
    let targets: Vec<&mut [T]> =
        crate::numeric::split_rows(&mut descriptors, outputs, rows.iter().map(Range::len));
    targets
        .into_par_iter()
        .zip(&x)
        .for_each(|(out, x)| last.apply(MatrixView::new(x, x.len() / width, width), out));
    Ok((descriptors, keep.then_some(Activations { blocks: kept, last: x })))
}

fn run_block<T: Real>(
    block: &Block<T>,
    x: &[Vec<T>],
    operators: &Operators<T>,
    rows: &[Range<usize>],
    keep: bool,
) -> (Vec<Vec<T>>, Option<BlockActivations<T>>) {
    let mut coefficients = project(x, operators, rows, block.width);
    let decay = block.decay(&operators.eigenvalues);
    vectorized(|| coefficients.iter_mut().zip(&decay).for_each(|(c, &decay)| *c *= decay));
    let rotations = block.rotations();
    let done: Vec<(Vec<T>, Option<ChunkActivations<T>>)> = (rows, x)
        .into_par_iter()
        .map(|(rows, x)| {
            let chunk = ChunkActivations::new(block, &rotations, x, &coefficients, operators, rows);
            let mut out = vec![T::ZERO; x.len()];
            block.mlp[2].apply(MatrixView::new(&chunk.hidden[1], rows.len(), block.width), &mut out);
            vectorized(|| out.iter_mut().zip(x).for_each(|(out, &x)| *out += x));
            (out, keep.then_some(chunk))
        })
        .collect();
    let (out, chunks): (Vec<_>, Vec<_>) = done.into_iter().unzip();
    let activations = BlockActivations { coefficients, chunks: chunks.into_iter().flatten().collect() };
    (out, keep.then_some(activations))
}

/// Rows of a `[n, k]` operator.
pub(super) fn operator_rows<'a, T: Real>(
    operator: &'a [T],
    k: usize,
    rows: &Range<usize>,
) -> MatrixView<'a, T> {
    MatrixView::new(&operator[rows.start * k..rows.end * k], rows.len(), k)
}

/// `E^T A x`, `[k, width]`.
fn project<T: Real>(x: &[Vec<T>], operators: &Operators<T>, rows: &[Range<usize>], width: usize) -> Vec<T> {
    let k = operators.k();
    let parts = pieces(rows.len())
        .into_par_iter()
        .map(|piece| {
            let mut sum = vec![T::ZERO; k * width];
            for chunk in piece {
                let weighted = weighted(&x[chunk], &operators.mass[rows[chunk].clone()], width);
                let eigenvectors = operator_rows(&operators.eigenvectors, k, &rows[chunk]);
                matmul(
                    &mut sum,
                    true,
                    eigenvectors.t(),
                    MatrixView::new(&weighted, rows[chunk].len(), width),
                );
            }
            sum
        })
        .collect();
    sum_in_order(parts)
}

/// Each row of `x`, `[rows, width]`, times the area of its vertex.
fn weighted<T: Real>(x: &[T], mass: &[T], width: usize) -> Vec<T> {
    let mut weighted = x.to_vec();
    vectorized(|| {
        for (row, &mass) in weighted.chunks_exact_mut(width).zip(mass) {
            row.iter_mut().for_each(|x| *x *= mass);
        }
    });
    weighted
}

impl<T: Real> ChunkActivations<T> {
    fn new(
        block: &Block<T>,
        [of_u, of_v]: &[Vec<T>; 2],
        x: &[T],
        coefficients: &[T],
        operators: &Operators<T>,
        rows: &Range<usize>,
    ) -> Self {
        let (n, k, width) = (rows.len(), operators.k(), block.width);
        let coefficients = MatrixView::new(coefficients, k, width);
        let synthesise = |operator: &[T]| {
            let mut out = vec![T::ZERO; n * width];
            matmul(&mut out, false, operator_rows(operator, k, rows), coefficients);
            out
        };
        let diffused = synthesise(&operators.eigenvectors);
        let (u, v) = (synthesise(&operators.gradients_x), synthesise(&operators.gradients_y));
        let mut turned = vec![T::ZERO; n * 2 * width];
        for (part, rotation, accumulate) in [(&u, of_u, false), (&v, of_v, true)] {
            let rotation = MatrixView::new(rotation, width, 2 * width);
            matmul(&mut turned, accumulate, MatrixView::new(part, n, width), rotation);
        }
        let mut concatenated = vec![T::ZERO; n * 3 * width];
        vectorized(|| {
            for (i, row) in concatenated.chunks_exact_mut(3 * width).enumerate() {
                let at = i * width..(i + 1) * width;
                row[..width].copy_from_slice(&x[at.clone()]);
                row[width..2 * width].copy_from_slice(&diffused[at.clone()]);
                let (p, q) = turned[2 * i * width..2 * (i + 1) * width].split_at(width);
                let gradients = u[at.clone()].iter().zip(p).zip(v[at].iter().zip(q));
                for (g, ((&u, &p), (&v, &q))) in row[2 * width..].iter_mut().zip(gradients) {
                    *g = (u * p + v * q).tanh();
                }
            }
        });
        let layer = |layer: usize, x: MatrixView<T>| {
            let mut out = vec![T::ZERO; n * width];
            block.mlp[layer].apply(x, &mut out);
            vectorized(|| out.iter_mut().for_each(|x| *x = if *x > T::ZERO { *x } else { T::ZERO }));
            out
        };
        let first = layer(0, MatrixView::new(&concatenated, n, 3 * width));
        let second = layer(1, MatrixView::new(&first, n, width));
        Self { concatenated, u, v, turned, hidden: [first, second] }
    }
}
