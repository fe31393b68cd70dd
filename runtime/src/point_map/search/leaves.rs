//! Leaves of the search: groups of targets with a centre, a local basis, and each point's place in it.

use super::bisect::Partition;
use super::kernels::LOCAL;
use crate::Matrix;
use rayon::prelude::*;

/// Makes an `f32` upper bound of what was computed and rounded in `f64`.
const ROUND_UP: f64 = 1.0 + 1e-6;
/// A direction shorter than this share of the leaf's radius is rounding noise.
const NEGLIGIBLE: f64 = 1e-7;

/// All leaves, field by field; coordinates are those of the targets times the common scale.
pub(super) struct Leaves {
    /// Slots per leaf: the largest number of points, rounded up to a multiple of 8.
    pub(super) stride: usize,
    /// `[n_leaves, d]`.
    pub(super) centers: Matrix<f32>,
    /// The rest, one entry per leaf.
    pub(super) shapes: Vec<LeafShape>,
}

/// How the points of one leaf lie around its centre.
pub(super) struct LeafShape {
    /// Norm of the centre and its square.
    pub(super) center_norm: f32,
    pub(super) center_squared: f32,
    /// No point is farther from the centre.
    pub(super) radius: f32,
    /// No point is farther from the plane through the centre along the basis.
    pub(super) remainder: f32,
    /// The orthonormal basis, `[d, LOCAL]`; zero columns where the leaf has fewer directions.
    pub(super) basis: Vec<f32>,
    /// The centre in the basis.
    pub(super) offset: [f32; LOCAL],
    /// The box around the points' coordinates.
    pub(super) low: [f32; LOCAL],
    pub(super) high: [f32; LOCAL],
    /// Coordinates in the basis, relative to the centre, `[LOCAL, stride]`.
    pub(super) coordinates: Vec<f32>,
    /// Distance from the plane, `[stride]`.
    pub(super) remainders: Vec<f32>,
}

impl Leaves {
    /// Describes each group of `partition`; `points` are in the partition's order.
    pub(super) fn new(points: &Matrix, partition: &Partition, scale: f64) -> Self {
        let largest = partition.ranges.iter().map(|range| range.len()).max().unwrap_or(0);
        let stride = largest.next_multiple_of(8);
        let (centers, shapes): (Vec<Vec<f32>>, Vec<LeafShape>) = partition
            .ranges
            .par_iter()
            .map(|range| {
                let rows: Vec<&[f64]> = range.clone().map(|i| points.row(i)).collect();
                describe(&rows, scale, stride)
            })
            .unzip();
        let centers = Matrix::from_vec(shapes.len(), points.cols(), centers.concat());
        Self { stride, centers, shapes }
    }
}

fn describe(rows: &[&[f64]], scale: f64, stride: usize) -> (Vec<f32>, LeafShape) {
    let d = rows[0].len();
    let mut mean = vec![0.0; d];
    for row in rows {
        mean.iter_mut().zip(*row).for_each(|(m, x)| *m += x);
    }
    let center: Vec<f32> = mean.iter().map(|m| (m * (scale / rows.len() as f64)) as f32).collect();
    let mut relative = Matrix::from_fn(rows.len(), d, |i, t| rows[i][t] * scale - f64::from(center[t]));
    let radius = (0..rows.len()).map(|i| norm(relative.row(i))).fold(0.0, f64::max);
    let directions = local_directions(&relative, radius * NEGLIGIBLE);

    let mut basis = vec![0.0; d * LOCAL];
    let mut offset = [0.0; LOCAL];
    let mut coordinates = vec![0.0; LOCAL * stride];
    let (mut low, mut high) = ([0.0; LOCAL], [0.0; LOCAL]);
    for (j, direction) in directions.iter().enumerate() {
        let rounded: Vec<f32> = direction.iter().map(|&x| x as f32).collect();
        let exact: Vec<f64> = rounded.iter().map(|&x| f64::from(x)).collect();
        rounded.iter().enumerate().for_each(|(t, &x)| basis[t * LOCAL + j] = x);
        offset[j] = center.iter().zip(&exact).map(|(&c, x)| f64::from(c) * x).sum::<f64>() as f32;
        (low[j], high[j]) = (f32::MAX, f32::MIN);
        for i in 0..rows.len() {
            let coordinate = dot(relative.row(i), &exact);
            relative.row_mut(i).iter_mut().zip(&exact).for_each(|(r, x)| *r -= coordinate * x);
            let coordinate = coordinate as f32;
            coordinates[j * stride + i] = coordinate;
            low[j] = low[j].min(coordinate);
            high[j] = high[j].max(coordinate);
        }
    }
    let mut remainders = vec![0.0; stride];
    for (i, remainder) in remainders.iter_mut().enumerate().take(rows.len()) {
        *remainder = (norm(relative.row(i)) * ROUND_UP) as f32;
    }
    let center_squared = center.iter().map(|&c| f64::from(c) * f64::from(c)).sum::<f64>();
    let shape = LeafShape {
        center_norm: center_squared.sqrt() as f32,
        center_squared: center_squared as f32,
        radius: (radius * ROUND_UP) as f32,
        remainder: remainders.iter().copied().fold(0.0, f32::max),
        basis,
        offset,
        low,
        high,
        coordinates,
        remainders,
    };
    (center, shape)
}

/// Up to `LOCAL` orthonormal directions that capture most of `relative`, `[m, d]`.
///
/// Greedy: the farthest remaining point gives the next direction (pivoted Gram-Schmidt, which controls the largest
/// remainder, the quantity the bounds depend on), and one pass of subspace iteration evens them out.
fn local_directions(relative: &Matrix, negligible: f64) -> Vec<Vec<f64>> {
    let mut rest = relative.clone();
    let mut greedy: Vec<Vec<f64>> = Vec::new();
    while greedy.len() < LOCAL.min(relative.cols()) {
        let norms: Vec<f64> = (0..rest.rows()).map(|i| norm(rest.row(i))).collect();
        let farthest = (0..norms.len()).fold(0, |best, i| if norms[i] > norms[best] { i } else { best });
        if norms[farthest] <= negligible {
            break;
        }
        let direction: Vec<f64> = rest.row(farthest).iter().map(|x| x / norms[farthest]).collect();
        for i in 0..rest.rows() {
            let along = dot(rest.row(i), &direction);
            rest.row_mut(i).iter_mut().zip(&direction).for_each(|(r, x)| *r -= along * x);
        }
        greedy.push(direction);
    }
    let iterated = greedy.iter().map(|direction| apply_covariance(relative, direction)).collect();
    orthonormalized(iterated, negligible)
}

/// `X^T X v` for the rows `X`.
fn apply_covariance(rows: &Matrix, vector: &[f64]) -> Vec<f64> {
    let mut image = vec![0.0; vector.len()];
    for i in 0..rows.rows() {
        let along = dot(rows.row(i), vector);
        image.iter_mut().zip(rows.row(i)).for_each(|(y, x)| *y += along * x);
    }
    image
}

/// Modified Gram-Schmidt, twice over; vectors that vanish are dropped.
fn orthonormalized(vectors: Vec<Vec<f64>>, negligible: f64) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for mut vector in vectors {
        let original = norm(&vector);
        if original <= negligible * negligible {
            continue;
        }
        for _ in 0..2 {
            for direction in &basis {
                let along = dot(&vector, direction);
                vector.iter_mut().zip(direction).for_each(|(v, x)| *v -= along * x);
            }
        }
        let length = norm(&vector);
        if length > NEGLIGIBLE * original {
            basis.push(vector.iter().map(|v| v / length).collect());
        }
    }
    basis
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}
