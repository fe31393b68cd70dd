//! Recursive bisection of points into equally large, compact groups.

use super::kernels::Kernels;
use crate::Matrix;
use rayon::prelude::*;
use std::ops::Range;

/// Rows looked at to choose the direction of a cut.
const SAMPLE: usize = 64;
/// Power iterations for that direction; a rough principal axis is enough.
const POWER_ITERATIONS: usize = 3;

/// The rows of a matrix, grouped so that rows of one group are near each other.
pub(super) struct Partition {
    /// The rows, group after group, ascending within a group, `[n]`.
    pub(super) order: Vec<u32>,
    /// Where each group lies in `order`.
    pub(super) ranges: Vec<Range<usize>>,
}

impl Partition {
    /// Halves the rows of `points` along their principal axis until no group has more than `max_size` rows.
    pub(super) fn new(points: &Matrix, max_size: usize, kernels: Kernels) -> Self {
        let n = points.rows();
        let mut order: Vec<u32> = (0..n as u32).collect();
        let mut levels = 0;
        while n.div_ceil(1 << levels) > max_size {
            levels += 1;
        }
        split(points, &mut order, levels, kernels);
        let mut ranges = Vec::with_capacity(1 << levels);
        collect_ranges(0..n, levels, &mut ranges);
        Self { order, ranges }
    }
}

fn collect_ranges(range: Range<usize>, levels: u32, ranges: &mut Vec<Range<usize>>) {
    if levels == 0 {
        ranges.push(range);
    } else {
        let middle = range.start + range.len() / 2;
        collect_ranges(range.start..middle, levels - 1, ranges);
        collect_ranges(middle..range.end, levels - 1, ranges);
    }
}

fn split(points: &Matrix, order: &mut [u32], levels: u32, kernels: Kernels) {
    if levels == 0 {
        order.sort_unstable();
        return;
    }
    let axis = principal_axis(points, order, kernels);
    let mut keys: Vec<(f64, u32)> = order
        .par_iter()
        .with_min_len(2048)
        .map(|&i| (kernels.dot(points.row(i as usize), &axis), i))
        .collect();
    let half = order.len() / 2;
    keys.select_nth_unstable_by(half, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    for (slot, key) in order.iter_mut().zip(&keys) {
        *slot = key.1;
    }
    drop(keys);
    let (low, high) = order.split_at_mut(half);
    rayon::join(|| split(points, low, levels - 1, kernels), || split(points, high, levels - 1, kernels));
}

/// An approximate first principal axis of the listed rows, from a sample of them.
fn principal_axis(points: &Matrix, order: &[u32], kernels: Kernels) -> Vec<f64> {
    let count = order.len().min(SAMPLE);
    let mut sample = Matrix::from_vec(count, points.cols(), {
        let rows = (0..count).map(|s| order[s * order.len() / count] as usize);
        rows.flat_map(|i| points.row(i).iter().copied()).collect()
    });
    let mut mean = vec![0.0; points.cols()];
    for s in 0..count {
        mean.iter_mut().zip(sample.row(s)).for_each(|(m, x)| *m += x / count as f64);
    }
    for s in 0..count {
        sample.row_mut(s).iter_mut().zip(&mean).for_each(|(x, m)| *x -= m);
    }
    let norms: Vec<f64> = (0..count).map(|s| kernels.dot(sample.row(s), sample.row(s))).collect();
    let farthest = (0..count).fold(0, |best, s| if norms[s] > norms[best] { s } else { best });
    let mut axis = sample.row(farthest).to_vec();
    for _ in 0..POWER_ITERATIONS {
        let mut next = vec![0.0; points.cols()];
        for s in 0..count {
            let weight = kernels.dot(sample.row(s), &axis);
            next.iter_mut().zip(sample.row(s)).for_each(|(y, x)| *y += weight * x);
        }
        let length = kernels.dot(&next, &next).sqrt();
        if length == 0.0 || !length.is_finite() {
            break;
        }
        axis = next.iter().map(|y| y / length).collect();
    }
    axis
}
