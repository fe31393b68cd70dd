//! Leaves of the search: groups of targets with a centre, a local basis, and each point's place in it.

use super::bisect::Partition;
use super::kernels::{Kernels, LANES, LOCAL};
use crate::Matrix;
use rayon::prelude::*;

/// Makes an `f32` upper bound of what was computed and rounded in `f64`.
const ROUND_UP: f64 = 1.0 + 1e-6;
/// A direction shorter than this share of the leaf's radius is rounding noise.
const NEGLIGIBLE: f64 = 1e-7;
/// Steps of subspace iteration: the first halves the points left to measure, the second takes off another
/// third.
const SUBSPACE_ITERATIONS: usize = 2;
/// Coordinate of an unused slot, too far away to be near anything.
const NOWHERE: f32 = 1e18;

/// All leaves; coordinates are those of the targets times the common scale.
pub(super) struct Leaves {
    /// Slots per leaf: the largest number of points, rounded up to a multiple of `LANES`.
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
    /// The orthonormal basis and, in the last column, the centre, `[d, LANES]`; zero columns where the leaf
    /// has fewer directions.
    pub(super) frame: Vec<f32>,
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
    pub(super) fn new(points: &Matrix, partition: &Partition, scale: f64, kernels: Kernels) -> Self {
        let largest = partition.ranges.iter().map(|range| range.len()).max().unwrap_or(0);
        let stride = largest.next_multiple_of(LANES);
        let (centers, shapes): (Vec<Vec<f32>>, Vec<LeafShape>) = partition
            .ranges
            .par_iter()
            .map(|range| {
                let rows: Vec<&[f64]> = range.clone().map(|i| points.row(i)).collect();
                describe(&rows, scale, stride, kernels)
            })
            .unzip();
        let centers = Matrix::from_vec(shapes.len(), points.cols(), centers.concat());
        Self { stride, centers, shapes }
    }
}

fn describe(rows: &[&[f64]], scale: f64, stride: usize, kernels: Kernels) -> (Vec<f32>, LeafShape) {
    let d = rows[0].len();
    let mut mean = vec![0.0; d];
    rows.iter().for_each(|row| kernels.add_scaled(&mut mean, scale / rows.len() as f64, row));
    let center: Vec<f32> = mean.iter().map(|&m| m as f32).collect();
    let exact_center: Vec<f64> = center.iter().map(|&c| f64::from(c)).collect();
    let mut relative = Matrix::zeros(rows.len(), d);
    for (i, row) in rows.iter().enumerate() {
        kernels.add_scaled(relative.row_mut(i), scale, row);
        kernels.add_scaled(relative.row_mut(i), -1.0, &exact_center);
    }
    let norm = |row: &[f64]| kernels.dot(row, row).sqrt();
    let radius = (0..rows.len()).map(|i| norm(relative.row(i))).fold(0.0, f64::max);
    let directions = local_directions(&relative, radius * NEGLIGIBLE, kernels);

    let mut frame = vec![0.0; d * LANES];
    let mut offset = [0.0; LOCAL];
    let mut coordinates = vec![0.0; LOCAL * stride];
    coordinates.chunks_exact_mut(stride).for_each(|slots| slots[rows.len()..].fill(NOWHERE));
    let (mut low, mut high) = ([0.0; LOCAL], [0.0; LOCAL]);
    center.iter().enumerate().for_each(|(t, &c)| frame[t * LANES + LOCAL] = c);
    for (j, direction) in directions.iter().enumerate() {
        // The basis is what is left after rounding; coordinates and remainders are exact for that.
        let exact: Vec<f64> = direction.iter().map(|&x| f64::from(x as f32)).collect();
        exact.iter().enumerate().for_each(|(t, &x)| frame[t * LANES + j] = x as f32);
        offset[j] = kernels.dot(&exact_center, &exact) as f32;
        (low[j], high[j]) = (f32::MAX, f32::MIN);
        for i in 0..rows.len() {
            let coordinate = kernels.dot(relative.row(i), &exact);
            kernels.add_scaled(relative.row_mut(i), -coordinate, &exact);
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
    let center_squared = kernels.dot(&exact_center, &exact_center);
    let shape = LeafShape {
        center_norm: center_squared.sqrt() as f32,
        center_squared: center_squared as f32,
        radius: (radius * ROUND_UP) as f32,
        remainder: remainders.iter().copied().fold(0.0, f32::max),
        frame,
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
/// Greedy: the farthest remaining point gives the next direction (pivoted Gram-Schmidt, which controls the
/// largest remainder, the quantity the bounds depend on), and a little subspace iteration turns them to the
/// principal axes.
fn local_directions(relative: &Matrix, negligible: f64, kernels: Kernels) -> Vec<Vec<f64>> {
    let mut rest = relative.clone();
    let mut norms: Vec<f64> =
        (0..rest.rows()).map(|i| kernels.dot(rest.row(i), rest.row(i)).sqrt()).collect();
    let mut greedy: Vec<Vec<f64>> = Vec::new();
    while greedy.len() < LOCAL.min(relative.cols()) {
        let farthest = (0..norms.len()).fold(0, |best, i| if norms[i] > norms[best] { i } else { best });
        if norms[farthest] <= negligible {
            break;
        }
        let direction: Vec<f64> = rest.row(farthest).iter().map(|x| x / norms[farthest]).collect();
        for (i, norm) in norms.iter_mut().enumerate() {
            let along = kernels.dot(rest.row(i), &direction);
            kernels.add_scaled(rest.row_mut(i), -along, &direction);
            *norm = kernels.dot(rest.row(i), rest.row(i)).sqrt();
        }
        greedy.push(direction);
    }
    (0..SUBSPACE_ITERATIONS).fold(greedy, |directions, _| {
        let images =
            directions.iter().map(|direction| apply_covariance(relative, direction, kernels)).collect();
        orthonormalized(images, kernels)
    })
}

/// `X^T X v` for the rows `X`.
fn apply_covariance(rows: &Matrix, vector: &[f64], kernels: Kernels) -> Vec<f64> {
    let mut image = vec![0.0; vector.len()];
    for i in 0..rows.rows() {
        kernels.add_scaled(&mut image, kernels.dot(rows.row(i), vector), rows.row(i));
    }
    image
}

/// Modified Gram-Schmidt, twice over; vectors that vanish are dropped.
fn orthonormalized(vectors: Vec<Vec<f64>>, kernels: Kernels) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for mut vector in vectors {
        let original = kernels.dot(&vector, &vector).sqrt();
        for _ in 0..2 {
            for direction in &basis {
                let along = kernels.dot(&vector, direction);
                kernels.add_scaled(&mut vector, -along, direction);
            }
        }
        let length = kernels.dot(&vector, &vector).sqrt();
        if length > NEGLIGIBLE * original {
            basis.push(vector.iter().map(|v| v / length).collect());
        }
    }
    basis
}
