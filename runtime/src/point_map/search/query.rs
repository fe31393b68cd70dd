//! The search itself: blocks of neighbouring queries against all leaves.

use super::bisect::Partition;
use super::kernels::{GROUP, Kernels, LANES, LOCAL};
use super::leaves::LeafShape;
use super::{Nearest, NearestRows};
use crate::Matrix;
use rayon::prelude::*;

/// Keeps the slack of a bound positive where squares underflow.
const TINY: f32 = 1e-30;
/// Loosens an `f32` square root or square enough to cover its rounding.
const ROUND_UP: f32 = 1.0 + 4e-6;

/// For every row of `queries` the nearest target.
pub(super) fn nearest(search: &NearestRows, queries: &Matrix) -> Nearest {
    let partition = Partition::new(queries, super::leaf_size(search.points.rows()), search.kernels);
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
    /// Inner products of the leaf centres with the block's centre, `[n_leaves]`.
    products: Vec<f32>,
    /// Leaves that may hold the nearest point of some query, with a lower bound of their distance from the
    /// block's centre.
    leaves: Vec<(f32, u32)>,
    /// Lower bounds for the points of a leaf, `[stride]`.
    bounds: Vec<f32>,
    /// Queries of the block that may find a nearer point in the current leaf.
    open: Vec<usize>,
    /// Query, position and lower bound of points still to be measured.
    pending: Vec<(u32, u32, f32)>,
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

/// The place of a point, a query or the block's centre, relative to one leaf.
struct Placed {
    /// Coordinates in the leaf's basis, relative to its centre.
    b: [f32; LOCAL],
    /// Distance from the leaf's plane.
    w: f32,
    /// What rounding may have added to a lower bound of a squared distance.
    slack: f32,
}

/// A point that is placed relative to leaves: scaled and rounded, with its norm and its square.
#[derive(Clone, Copy)]
struct Point<'a> {
    entries: &'a [f32],
    norm: f32,
    squared_norm: f32,
}

struct Block<'a> {
    search: &'a NearestRows,
    /// The queries, `[n_queries, d]`, as they are.
    exact: Vec<&'a [f64]>,
    /// The queries scaled and, as last row, their mean.
    scaled: Matrix<f32>,
    squared_norm: Vec<f32>,
    /// Distance of each query from the mean.
    spread: Vec<f32>,
    best: Vec<Best>,
    /// Rounding error of a bound, relative to the square of the lengths that entered it.
    ///
    /// An inner product of `d` terms is off by at most `(d + 3) u` times both lengths, `u = 2^-24`. A bound
    /// takes one such product with the centre and, twice, `sqrt(LOCAL)` of them with the basis: below 13 in
    /// all.
    tolerance: f32,
}

impl<'a> Block<'a> {
    fn new(search: &'a NearestRows, queries: &'a Matrix, rows: &[u32]) -> Self {
        let (d, n, scale, kernels) = (queries.cols(), rows.len(), search.scale, search.kernels);
        let exact: Vec<&[f64]> = rows.iter().map(|&i| queries.row(i as usize)).collect();
        let mut mean = vec![0.0; d];
        exact.iter().for_each(|query| kernels.add_scaled(&mut mean, scale / n as f64, query));
        let mut entries: Vec<f32> = Vec::with_capacity((n + 1) * d);
        exact.iter().for_each(|query| entries.extend(query.iter().map(|x| (x * scale) as f32)));
        entries.extend(mean.iter().map(|&x| x as f32));
        // Back in the queries' scale, which is exact, as the scale is a power of two.
        let mean: Vec<f64> = entries[n * d..].iter().map(|&x| f64::from(x) / scale).collect();
        let squared = |row: &[f64]| (kernels.dot(row, row) * scale * scale) as f32;
        let spread =
            |query: &&[f64]| (kernels.squared_distance(query, &mean).sqrt() * scale) as f32 * ROUND_UP;
        Self {
            search,
            scaled: Matrix::from_vec(n + 1, d, entries),
            squared_norm: exact.iter().copied().chain([&mean[..]]).map(squared).collect(),
            spread: exact.iter().map(spread).collect(),
            best: vec![Best::NONE; n],
            tolerance: 16.0 * (d as f32 + 16.0) * f32::EPSILON / 2.0,
            exact,
        }
    }

    /// The search, compiled like the kernels for the instruction sets at hand.
    fn run(&mut self, scratch: &mut Scratch) {
        match self.search.kernels {
            #[cfg(target_arch = "x86_64")]
            Kernels::Avx2 => {
                #[target_feature(enable = "avx2,fma")]
                fn avx2(block: &mut Block, scratch: &mut Scratch) {
                    block.search_all(scratch);
                }
                // SAFETY: the variant exists only where detection found AVX2 and FMA.
                unsafe { avx2(self, scratch) }
            }
            Kernels::Portable => self.search_all(scratch),
        }
    }

    #[inline(always)]
    fn search_all(&mut self, scratch: &mut Scratch) {
        let leaves = &self.search.leaves;
        scratch.products.resize(leaves.shapes.len(), 0.0);
        scratch.bounds.resize(leaves.stride, 0.0);
        let center = self.point(self.exact.len());
        self.search.kernels.inner_products(leaves.centers.data(), center.entries, &mut scratch.products);
        self.seed(scratch);
        self.list_leaves(scratch);
        for next in 0..scratch.leaves.len() {
            let (distance, leaf) = scratch.leaves[next];
            if next % 8 == 0 && excluded(distance, self.farthest_reach()) {
                break;
            }
            self.visit(distance, leaf as usize, scratch);
        }
        for (q, position, bound) in scratch.pending.drain(..) {
            if !excluded(bound, self.best[q as usize].squared_reach) {
                self.try_point(q as usize, position as usize);
            }
        }
    }

    #[inline(always)]
    fn point(&self, row: usize) -> Point<'_> {
        let squared_norm = self.squared_norm[row];
        Point { entries: self.scaled.row(row), norm: squared_norm.sqrt(), squared_norm }
    }

    /// A first guess for every query: the most promising point of the leaf nearest to the block, or what the
    /// query before it found.
    fn seed(&mut self, scratch: &mut Scratch) {
        let shapes = &self.search.leaves.shapes;
        let distance = |leaf: usize| shapes[leaf].center_squared - 2.0 * scratch.products[leaf];
        let leaf =
            (0..shapes.len()).fold(0, |low, leaf| if distance(leaf) < distance(low) { leaf } else { low });
        let range = &self.search.partition.ranges[leaf];
        for q in 0..self.exact.len() {
            let frame = self.search.kernels.project_one(&shapes[leaf].frame, self.scaled.row(q));
            let placed = self.place(self.point(q), &shapes[leaf], frame);
            self.bound_points(&shapes[leaf], &placed, &mut scratch.bounds);
            let bounds = &scratch.bounds;
            let lowest = (0..range.len()).fold(0, |low, i| if bounds[i] < bounds[low] { i } else { low });
            self.try_point(q, range.start + lowest);
            if q > 0 {
                self.try_point(q, self.best[q - 1].position);
            }
        }
    }

    /// Lists the leaves near enough to the block's centre for some query, the nearest first.
    #[inline(always)]
    fn list_leaves(&self, scratch: &mut Scratch) {
        let farthest = self.farthest_reach();
        let center = self.point(self.exact.len());
        scratch.leaves.clear();
        for (leaf, (shape, product)) in self.search.leaves.shapes.iter().zip(&scratch.products).enumerate() {
            let distance = center.squared_norm + shape.center_squared - 2.0 * product;
            let reach = (shape.radius + farthest) * ROUND_UP;
            if excluded(distance - self.slack(center, shape), reach * reach) {
                continue;
            }
            let placed =
                self.place(center, shape, self.search.kernels.project_one(&shape.frame, center.entries));
            let bound = (box_bound(shape, &placed) - placed.slack).max(0.0).sqrt() / ROUND_UP;
            if !excluded(bound, farthest) {
                scratch.leaves.push((bound, leaf as u32));
            }
        }
        scratch.leaves.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }

    /// How far from the block's centre a point can be that is the nearest of some query.
    #[inline(always)]
    fn farthest_reach(&self) -> f32 {
        self.best
            .iter()
            .zip(&self.spread)
            .map(|(best, spread)| (best.reach + spread) * ROUND_UP)
            .fold(0.0, f32::max)
    }

    /// Lets every query that may gain from `leaf` look at it; no point of the leaf is nearer to the block's
    /// centre than `distance`.
    #[inline(always)]
    fn visit(&mut self, distance: f32, leaf: usize, scratch: &mut Scratch) {
        let shape = &self.search.leaves.shapes[leaf];
        let open = &mut scratch.open;
        open.clear();
        open.extend(
            (0..self.exact.len())
                .filter(|&q| !excluded(distance, (self.best[q].reach + self.spread[q]) * ROUND_UP)),
        );
        for group in open.chunks(GROUP) {
            let rows = std::array::from_fn(|i| self.scaled.row(group[i.min(group.len() - 1)]));
            let frames = self.search.kernels.project(&shape.frame, rows);
            for (&q, frame) in group.iter().zip(frames) {
                let placed = self.place(self.point(q), shape, frame);
                if !excluded(box_bound(shape, &placed) - placed.slack, self.best[q].squared_reach) {
                    self.scan(q, leaf, &placed, &mut scratch.bounds, &mut scratch.pending);
                }
            }
        }
    }

    #[inline(always)]
    fn slack(&self, point: Point, shape: &LeafShape) -> f32 {
        let length = point.norm + shape.center_norm + shape.radius;
        self.tolerance * length * length + TINY
    }

    /// Places a point by its inner products with the columns of the leaf's frame.
    #[inline(always)]
    fn place(&self, point: Point, shape: &LeafShape, frame: [f32; LANES]) -> Placed {
        let b: [f32; LOCAL] = std::array::from_fn(|j| frame[j] - shape.offset[j]);
        let within: f32 = b.iter().map(|b| b * b).sum();
        let distance = point.squared_norm + shape.center_squared - 2.0 * frame[LOCAL];
        Placed { b, w: (distance - within).max(0.0).sqrt(), slack: self.slack(point, shape) }
    }

    #[inline(always)]
    fn bound_points(&self, shape: &LeafShape, placed: &Placed, bounds: &mut [f32]) -> f32 {
        self.search.kernels.point_bounds(&shape.coordinates, &shape.remainders, &placed.b, placed.w, bounds)
    }

    /// Measures the most promising point of `leaf` and notes the others that the bound does not exclude.
    fn scan(
        &mut self,
        q: usize,
        leaf: usize,
        placed: &Placed,
        bounds: &mut [f32],
        pending: &mut Vec<(u32, u32, f32)>,
    ) {
        let lowest = self.bound_points(&self.search.leaves.shapes[leaf], placed, bounds);
        if excluded(lowest - placed.slack, self.best[q].squared_reach) {
            return;
        }
        let range = self.search.partition.ranges[leaf].clone();
        if let Some(first) = bounds[..range.len()].iter().position(|&bound| bound == lowest) {
            self.try_point(q, range.start + first);
        }
        let limit = self.best[q].squared_reach;
        for (position, &bound) in range.zip(bounds.iter()) {
            let bound = bound - placed.slack;
            if !excluded(bound, limit) {
                pending.push((q as u32, position as u32, bound));
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

/// Whether what is at least `bound` away lies beyond `limit`; never where an overflow has made either NaN.
#[inline(always)]
fn excluded(bound: f32, limit: f32) -> bool {
    bound > limit
}

/// Lower bound of the squared distance to any point of the leaf, by the box of their coordinates.
#[inline(always)]
fn box_bound(shape: &LeafShape, placed: &Placed) -> f32 {
    let off = (placed.w - shape.remainder).max(0.0);
    let mut bound = off * off;
    for j in 0..LOCAL {
        let gap = (shape.low[j] - placed.b[j]).max(placed.b[j] - shape.high[j]).max(0.0);
        bound += gap * gap;
    }
    bound
}
