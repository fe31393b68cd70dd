//! Local averages of a map: where the neighbours of a vertex go says where it goes.

use super::neighborhood::Neighborhoods;
use crate::Matrix;
use crate::point_map::search::squared_distance;
use rayon::prelude::*;

/// Rounds of the orthogonal iteration for the local coordinates.
const SUBSPACE_ROUNDS: usize = 6;

/// For each vertex its neighbours with weights and two coordinates in the tangent plane.
pub(super) struct LocalCharts {
    charts: Vec<Chart>,
}

/// The neighbours of one vertex, itself first.
struct Chart {
    vertices: Vec<u32>,
    weights: Vec<f64>,
    coordinates: Vec<[f64; 2]>,
}

impl LocalCharts {
    /// Charts of `size` vertices in `embedding`, `[n, d]`.
    pub(super) fn new(embedding: &Matrix, neighborhoods: &Neighborhoods, size: usize) -> Self {
        let chart = |vertex: u32| {
            let near = neighborhoods.of(vertex);
            Chart::new(embedding, &near[..size.min(near.len())])
        };
        Self { charts: (0..embedding.rows() as u32).into_par_iter().map(chart).collect() }
    }

    /// The average of `values[targets]` around each vertex, `[n, d]`: the value at the vertex of the affine function,
    /// of the two coordinates, that fits those of its matched neighbours best. Zeros where no neighbour is matched.
    pub(super) fn average(&self, values: &Matrix, targets: &[u32], unmatched: u32) -> Matrix {
        let mut averages = Matrix::zeros(self.charts.len(), values.cols());
        let width = values.cols().max(1);
        averages.data_mut().par_chunks_mut(width).zip(&self.charts).for_each(|(average, chart)| {
            for (weight, vertex) in chart.kernel(|vertex| targets[vertex as usize] != unmatched) {
                let value = values.row(targets[vertex as usize] as usize);
                average.iter_mut().zip(value).for_each(|(a, v)| *a += weight * v);
            }
        });
        averages
    }
}

impl Chart {
    fn new(embedding: &Matrix, vertices: &[u32]) -> Self {
        let here = embedding.row(vertices[0] as usize);
        let rows: Vec<Vec<f64>> = vertices
            .iter()
            .map(|&v| embedding.row(v as usize).iter().zip(here).map(|(a, b)| a - b).collect())
            .collect();
        let origin = vec![0.0; here.len()];
        let squared: Vec<f64> = rows.iter().map(|row| squared_distance(row, &origin)).collect();
        let reach = squared.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let weights = squared.iter().map(|d| (-2.0 * d / reach).exp()).collect();
        Self { vertices: vertices.to_vec(), weights, coordinates: principal_coordinates(&rows, reach) }
    }

    /// The weights with which the neighbours that are `usable` enter the affine fit's value at the vertex; they sum
    /// to 1.
    fn kernel(&self, usable: impl Fn(u32) -> bool) -> Vec<(f64, u32)> {
        let entries: Vec<(f64, [f64; 3], u32)> = (0..self.vertices.len())
            .filter(|&i| usable(self.vertices[i]))
            .map(|i| {
                (self.weights[i], [1.0, self.coordinates[i][0], self.coordinates[i][1]], self.vertices[i])
            })
            .collect();
        let mut normal = [[0.0; 3]; 3];
        for (weight, f, _) in &entries {
            for a in 0..3 {
                for b in 0..3 {
                    normal[a][b] += weight * f[a] * f[b];
                }
            }
        }
        // Coordinates are of order one; few or collinear neighbours then leave the slope at zero.
        let ridge = 1e-3 * normal[0][0];
        (normal[1][1], normal[2][2]) = (normal[1][1] + ridge, normal[2][2] + ridge);
        let [a, b, c] = first_row_of_inverse(&normal);
        entries.iter().map(|(weight, f, vertex)| (weight * (a + b * f[1] + c * f[2]), *vertex)).collect()
    }
}

/// The first row of the inverse of a symmetric positive definite matrix; zeros where it is singular.
fn first_row_of_inverse(m: &[[f64; 3]; 3]) -> [f64; 3] {
    let minors = [
        m[1][1] * m[2][2] - m[1][2] * m[1][2],
        m[0][2] * m[1][2] - m[0][1] * m[2][2],
        m[0][1] * m[1][2] - m[0][2] * m[1][1],
    ];
    let determinant = m[0][0] * minors[0] + m[0][1] * minors[1] + m[0][2] * minors[2];
    if determinant > 0.0 { minors.map(|minor| minor / determinant) } else { [0.0; 3] }
}

/// Coordinates of the rows, `[m]`, along the two directions in which they extend most, in units of `sqrt(reach)`.
///
/// By orthogonal iteration on the Gram matrix from its two pivots: the longest row, and the one that is longest
/// without it.
fn principal_coordinates(rows: &[Vec<f64>], reach: f64) -> Vec<[f64; 2]> {
    let m = rows.len();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let gram = Matrix::from_fn(m, m, |i, j| if i <= j { dot(&rows[i], &rows[j]) / reach } else { 0.0 });
    let gram = Matrix::from_fn(m, m, |i, j| gram[(i.min(j), i.max(j))]);
    let longest = |lengths: &[f64]| (0..m).max_by(|&a, &b| lengths[a].total_cmp(&lengths[b])).unwrap_or(0);
    let first = longest(&(0..m).map(|i| gram[(i, i)]).collect::<Vec<_>>());
    let scale = gram[(first, first)].max(f64::MIN_POSITIVE);
    let residual: Vec<f64> = (0..m).map(|i| gram[(i, i)] - gram[(i, first)].powi(2) / scale).collect();
    let second = longest(&residual);
    let mut axes = [gram.row(first).to_vec(), gram.row(second).to_vec()];
    for round in 0..=SUBSPACE_ROUNDS {
        orthonormalise(&mut axes);
        if round < SUBSPACE_ROUNDS {
            axes = axes.map(|axis| (0..m).map(|i| dot(gram.row(i), &axis)).collect());
        }
    }
    // With G = U S U^T the coordinates are U sqrt(S).
    let scaled = axes.map(|axis| {
        let image: Vec<f64> = (0..m).map(|i| dot(gram.row(i), &axis)).collect();
        let value = dot(&image, &axis).max(0.0);
        (0..m).map(|i| if value > 0.0 { image[i] / value.sqrt() } else { 0.0 }).collect::<Vec<f64>>()
    });
    (0..m).map(|i| [scaled[0][i], scaled[1][i]]).collect()
}

fn orthonormalise(axes: &mut [Vec<f64>; 2]) {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let unit = |axis: &mut Vec<f64>| {
        let length = dot(axis, axis).sqrt();
        let factor = if length > 1e-12 { 1.0 / length } else { 0.0 };
        axis.iter_mut().for_each(|x| *x *= factor);
    };
    let [first, second] = axes;
    unit(first);
    let along = dot(first, second);
    second.iter_mut().zip(first.iter()).for_each(|(s, f)| *s -= along * f);
    unit(second);
}
