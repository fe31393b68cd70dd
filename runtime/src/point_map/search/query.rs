//! The search itself: blocks of neighbouring queries against all leaves.

use super::bisect::Partition;
use super::kernels::{GROUP, LOCAL};
use super::leaves::LeafShape;
use super::{Nearest, NearestRows};
use crate::Matrix;
use faer::{Accum, Par};
use rayon::prelude::*;

/// Queries handled together: their products with the leaf centres are one matrix product.
const BLOCK: usize = 64;
/// Keeps the slack of a bound positive where squares underflow.
const TINY: f32 = 1e-30;
/// Loosens an `f32` square root or square enough to cover its rounding.
const ROUND_UP: f32 = 1.0 + 4e-6;

/// For every row of `queries` the nearest target.
pub(super) fn nearest(search: &NearestRows, queries: &Matrix) -> Nearest {
    let partition = Partition::new(queries, BLOCK, search.kernels);
    let blocks: Vec<Vec<Best>> = partition
        .ranges
        .par_iter()
        .map_init(Scratch::default, |scratch, range| {
            let mut block = Block::new(search, queries, &partition.order[range.clone()]);
            block.run(scratch);
            block.best
        })
        .collect();
    let mut index = vec![0; queries.rows()];
    let mut squared_distance = vec![0.0; queries.rows()];
    for (&query, best) in partition.order.iter().zip(blocks.iter().flatten()) {
        index[query as usize] = best.index;
        squared_distance[query as usize] = best.squared_distance;
    }
    Nearest { index, squared_distance }
}

/// Buffers that outlive a block.
#[derive(Default)]
struct Scratch {
    /// Inner products of leaf centres and queries, `[n_leaves, n_queries]`.
    products: Vec<f32>,
    /// Lower bounds for the points of a leaf, `[stride]`.
    bounds: Vec<f32>,
    /// Queries of the block that may find a nearer point in the current leaf.
    open: Vec<usize>,
}

/// The nearest target found so far.
#[derive(Clone, Copy)]
struct Best {
    squared_distance: f64,
    index: u32,
    /// Its position in the order of the partition.
    position: usize,
    /// Upper bounds of the scaled distance and its square.
    reach: f32,
    squared_reach: f32,
}

impl Best {
    const NONE: Self = Self {
        squared_distance: f64::INFINITY,
        index: u32::MAX,
        position: 0,
        reach: f32::INFINITY,
        squared_reach: f32::INFINITY,
    };
}

/// A query's place relative to one leaf.
struct Placed {
    /// Coordinates in the leaf's basis, relative to its centre.
    b: [f32; LOCAL],
    /// Distance from the leaf's plane.
    w: f32,
    /// What rounding may have added to a lower bound.
    slack: f32,
}

struct Block<'a> {
    search: &'a NearestRows,
    /// The queries, `[n_queries, d]`, as they are and scaled.
    exact: Vec<&'a [f64]>,
    scaled: Matrix<f32>,
    norm: Vec<f32>,
    squared_norm: Vec<f32>,
    best: Vec<Best>,
    /// Rounding error of a bound, relative to the square of the lengths that entered it.
    ///
    /// An inner product of `d` terms is off by at most `(d + 3) u` times both lengths, `u = 2^-24`. A bound takes one such
    /// product with the centre and, twice, `sqrt(LOCAL)` of them with the basis: below 13 in all.
    tolerance: f32,
}

impl<'a> Block<'a> {
    fn new(search: &'a NearestRows, queries: &'a Matrix, rows: &[u32]) -> Self {
        let d = queries.cols();
        let exact: Vec<&[f64]> = rows.iter().map(|&i| queries.row(i as usize)).collect();
        let scaled = Matrix::from_fn(rows.len(), d, |q, t| (exact[q][t] * search.scale) as f32);
        let squares = exact.iter().map(|q| search.kernels.dot(q, q) * search.scale * search.scale);
        let squared_norm: Vec<f32> = squares.map(|square| square as f32).collect();
        let norm = squared_norm.iter().map(|square| square.sqrt()).collect();
        let tolerance = 16.0 * (d as f32 + 16.0) * f32::EPSILON / 2.0;
        Self { search, scaled, norm, squared_norm, best: vec![Best::NONE; rows.len()], tolerance, exact }
    }

    fn run(&mut self, scratch: &mut Scratch) {
        let Scratch { products, bounds, open } = scratch;
        self.multiply_centers(products);
        bounds.resize(self.search.leaves.stride, 0.0);
        self.seed(products, bounds);
        for leaf in 0..self.search.leaves.shapes.len() {
            self.visit(leaf, &products[leaf * self.exact.len()..], bounds, open);
        }
    }

    fn multiply_centers(&self, products: &mut Vec<f32>) {
        let (n_leaves, n_queries) = (self.search.leaves.centers.rows(), self.exact.len());
        products.resize(n_leaves * n_queries, 0.0);
        faer::linalg::matmul::matmul(
            faer::MatMut::from_row_major_slice_mut(products, n_leaves, n_queries),
            Accum::Replace,
            self.search.leaves.centers.as_faer(),
            self.scaled.as_faer().transpose(),
            1.0,
            Par::Seq,
        );
    }

    /// A first guess for every query: the most promising point of the leaf with the nearest centre, or what the query
    /// before it found.
    fn seed(&mut self, products: &[f32], bounds: &mut [f32]) {
        let n_queries = self.exact.len();
        let mut nearest = vec![(f32::INFINITY, 0); n_queries];
        for (leaf, shape) in self.search.leaves.shapes.iter().enumerate() {
            let products = &products[leaf * n_queries..][..n_queries];
            for (slot, product) in nearest.iter_mut().zip(products) {
                let distance = shape.center_squared - 2.0 * product;
                if distance < slot.0 {
                    *slot = (distance, leaf);
                }
            }
        }
        for q in 0..n_queries {
            let leaf = nearest[q].1;
            let shape = &self.search.leaves.shapes[leaf];
            let coordinates = self.search.kernels.project(&shape.basis, [self.scaled.row(q); GROUP]);
            let placed = self.place(q, shape, products[leaf * n_queries + q], coordinates[0]);
            self.search.kernels.point_bounds(
                &shape.coordinates,
                &shape.remainders,
                &placed.b,
                placed.w,
                bounds,
            );
            let range = &self.search.partition.ranges[leaf];
            let lowest = (0..range.len()).fold(0, |low, i| if bounds[i] < bounds[low] { i } else { low });
            self.try_point(q, range.start + lowest);
            if q > 0 {
                self.try_point(q, self.best[q - 1].position);
            }
        }
    }

    /// Lets every query that may gain from `leaf` look at it; `products` are the centre's with the queries.
    fn visit(&mut self, leaf: usize, products: &[f32], bounds: &mut [f32], open: &mut Vec<usize>) {
        let shape = &self.search.leaves.shapes[leaf];
        open.clear();
        open.extend((0..self.exact.len()).filter(|&q| {
            let reach = shape.radius + self.best[q].reach;
            let distance = self.squared_norm[q] + shape.center_squared - 2.0 * products[q];
            // Written so that a NaN from an overflow keeps the leaf.
            !(distance - self.slack(q, shape) > reach * reach)
        }));
        for group in open.chunks(GROUP) {
            let rows = std::array::from_fn(|i| self.scaled.row(group[i.min(group.len() - 1)]));
            let coordinates = self.search.kernels.project(&shape.basis, rows);
            for (&q, coordinates) in group.iter().zip(coordinates) {
                let placed = self.place(q, shape, products[q], coordinates);
                if !(box_bound(shape, &placed) - placed.slack > self.best[q].squared_reach) {
                    self.scan(q, leaf, &placed, bounds);
                }
            }
        }
    }

    fn slack(&self, q: usize, shape: &LeafShape) -> f32 {
        let length = self.norm[q] + shape.center_norm + shape.radius;
        self.tolerance * length * length + TINY
    }

    fn place(&self, q: usize, shape: &LeafShape, product: f32, mut b: [f32; LOCAL]) -> Placed {
        let mut within = 0.0;
        for (b, offset) in b.iter_mut().zip(shape.offset) {
            *b -= offset;
            within += *b * *b;
        }
        let distance = self.squared_norm[q] + shape.center_squared - 2.0 * product;
        Placed { b, w: (distance - within).max(0.0).sqrt(), slack: self.slack(q, shape) }
    }

    /// Measures the points of `leaf` that the bound does not exclude.
    fn scan(&mut self, q: usize, leaf: usize, placed: &Placed, bounds: &mut [f32]) {
        let shape = &self.search.leaves.shapes[leaf];
        self.search.kernels.point_bounds(&shape.coordinates, &shape.remainders, &placed.b, placed.w, bounds);
        let range = &self.search.partition.ranges[leaf];
        for (position, &bound) in range.clone().zip(bounds.iter()) {
            if !(bound - placed.slack > self.best[q].squared_reach) {
                self.try_point(q, position);
            }
        }
    }

    fn try_point(&mut self, q: usize, position: usize) {
        let squared_distance =
            self.search.kernels.squared_distance(self.exact[q], self.search.points.row(position));
        let index = self.search.partition.order[position];
        let best = &mut self.best[q];
        if (squared_distance, index) < (best.squared_distance, best.index) {
            let squared = (squared_distance * self.search.scale * self.search.scale) as f32 * ROUND_UP;
            let reach = squared.sqrt() * ROUND_UP;
            *best = Best { squared_distance, index, position, reach, squared_reach: squared };
        }
    }
}

/// Lower bound of the squared distance to any point of the leaf, by the box of their coordinates.
fn box_bound(shape: &LeafShape, placed: &Placed) -> f32 {
    let off = (placed.w - shape.remainder).max(0.0);
    let mut bound = off * off;
    for j in 0..LOCAL {
        let gap = (shape.low[j] - placed.b[j]).max(placed.b[j] - shape.high[j]).max(0.0);
        bound += gap * gap;
    }
    bound
}
