//! The local reference frame of a neighbourhood (Tombari et al. 2010, section 3).
//!
//! The axes are eigenvectors of a weighted covariance of the offsets from the vertex: x that of the largest
//! eigenvalue, z that of the smallest, y their cross product. The covariance determines an axis up to its sign; the
//! side with the majority of the neighbours decides that.
//!
//! The authors' implementation departs from the paper, and so does this: the weight of a neighbour is the radius
//! minus its *squared* distance, hence negative beyond the distance 3, and the covariance is divided by the sum of
//! the weights, which is then mostly negative too. In a tie, the authors keep the sign that their eigensolver
//! happened to return, which depends on how the mesh is rotated; [`break_tie`] does not.

use std::array;

use super::{
    IN_PLANE, RADIUS,
    eigen::{Symmetric3, extreme_eigenvectors},
    neighborhood::{Grid, LANES, Neighborhood},
};
use crate::mesh::vec3;

/// A sum of signed terms below this fraction of the sum of their magnitudes has cancelled.
const CANCELLED: f64 = 1e-6;

/// In a tie the neighbours decide whose rank by distance differs at most by this much from the median.
const MEDIAN_RANKS: usize = 2;

/// Relative difference of squared distances that are equal but for rounding.
const SAME_DISTANCE: f64 = 1e-9;

/// What the histogram needs of a frame, besides the offsets in it.
pub(super) struct Frame {
    pub(super) z_axis: [f64; 3],
    /// Whether the vote on the sign of x or of z was tied.
    pub(super) tied: bool,
}

/// The frame of `neighbors`; writes their offsets in that frame to `neighbors.local`.
#[inline(always)]
pub(super) fn local_frame(grid: &Grid, neighbors: &mut Neighborhood) -> Frame {
    let [z, x] = extreme_eigenvectors(covariance(neighbors));
    let axes = [x, vec3::cross(z, x), z];
    let [majority_x, majority_z] = project(neighbors, axes);
    let tied = majority_x == 0 || majority_z == 0;
    let sign_x = match majority_x {
        0 => break_tie(neighbors, 0).unwrap_or(1.0),
        majority => majority.signum() as f64,
    };
    let sign_z = match majority_z {
        0 => break_tie(neighbors, 2).or_else(|| side_of_normals(grid, neighbors, z)).unwrap_or(1.0),
        majority => majority.signum() as f64,
    };
    let signs = [sign_x, sign_z * sign_x, sign_z];
    let len = neighbors.len();
    for (local, sign) in neighbors.local.iter_mut().zip(signs) {
        local[..len].iter_mut().for_each(|p| *p *= sign as f32);
    }
    Frame { z_axis: vec3::scale(z, sign_z), tied }
}

/// The weighted covariance of the offsets, up to a positive factor.
#[inline(always)]
fn covariance(neighbors: &Neighborhood) -> Symmetric3 {
    /// Independent partial sums, which do not wait for each other.
    const SUMS: usize = 4;
    const { assert!(LANES.is_multiple_of(SUMS)) };
    let padded = neighbors.padded_len();
    let [dx, dy, dz] = array::from_fn(|k| neighbors.offsets[k][..padded].as_chunks::<SUMS>().0);
    let distances2 = neighbors.distances2[..padded].as_chunks::<SUMS>().0;

    let mut distance_sums = [0.0; SUMS];
    let mut sums = [[0.0; SUMS]; 6];
    for (((dx, dy), dz), distance2) in dx.iter().zip(dy).zip(dz).zip(distances2) {
        for l in 0..SUMS {
            let (x, y, z) = (dx[l], dy[l], dz[l]);
            let weight = RADIUS - distance2[l];
            let (wx, wy, wz) = (weight * x, weight * y, weight * z);
            distance_sums[l] += distance2[l];
            sums[0][l] += wx * x;
            sums[1][l] += wy * y;
            sums[2][l] += wz * z;
            sums[3][l] += wx * y;
            sums[4][l] += wx * z;
            sums[5][l] += wy * z;
        }
    }
    let weight_sum = RADIUS * neighbors.len() as f64 - distance_sums.iter().sum::<f64>();
    sums.map(|partial| partial.iter().sum::<f64>() * weight_sum.signum())
}

/// Writes the coordinates of the offsets along `axes` to `neighbors.local`; returns for x and z by how many
/// more neighbours are on the positive side than on the negative; those in the plane between abstain.
#[inline(always)]
fn project(neighbors: &mut Neighborhood, axes: [[f64; 3]; 3]) -> [i64; 2] {
    let padded = neighbors.padded_len();
    let [dx, dy, dz] = array::from_fn(|k| neighbors.offsets[k][..padded].as_chunks::<LANES>().0);
    let [x, y, z] = &mut neighbors.local;
    let locals = x
        .as_chunks_mut::<LANES>()
        .0
        .iter_mut()
        .zip(y.as_chunks_mut::<LANES>().0)
        .zip(z.as_chunks_mut::<LANES>().0);
    let mut majority = [[0i64; LANES]; 2];
    for (((dx, dy), dz), ((x, y), z)) in dx.iter().zip(dy).zip(dz).zip(locals) {
        let along = |axis: [f64; 3]| -> [f64; LANES] {
            array::from_fn(|l| axis[0] * dx[l] + axis[1] * dy[l] + axis[2] * dz[l])
        };
        let [px, py, pz] = [along(axes[0]), along(axes[1]), along(axes[2])];
        count_sides(&px, &mut majority[0]);
        count_sides(&pz, &mut majority[1]);
        *x = px.map(|p| p as f32);
        *y = py.map(|p| p as f32);
        *z = pz.map(|p| p as f32);
    }
    majority.map(|lanes| lanes.iter().sum())
}

#[inline(always)]
fn count_sides(along: &[f64; LANES], majority: &mut [i64; LANES]) {
    for l in 0..LANES {
        majority[l] += i64::from(along[l] > IN_PLANE) - i64::from(along[l] < -IN_PLANE);
    }
}

/// The sign of an axis whose vote is tied, from `neighbors.local[axis]`: the majority of the five neighbours in the
/// middle of the order by distance (and of those as far as the first or last of them), else the sign of
/// the third moment. `None` if the neighbourhood is symmetric as far as these can tell.
#[cold]
fn break_tie(neighbors: &Neighborhood, axis: usize) -> Option<f64> {
    let len = neighbors.len();
    let along = neighbors.local[axis][..len].iter().map(|&p| f64::from(p));
    let voters = along.zip(&neighbors.distances2[..len]).filter(|(p, _)| p.abs() > IN_PLANE);

    let mut ranked = neighbors.distances2[..len].to_vec();
    ranked.sort_unstable_by(f64::total_cmp);
    let first = ranked[(len / 2).saturating_sub(MEDIAN_RANKS)] * (1.0 - SAME_DISTANCE);
    let last = ranked[(len / 2 + MEDIAN_RANKS).min(len - 1)] * (1.0 + SAME_DISTANCE);
    let middle = voters.clone().filter(|&(_, &distance2)| first <= distance2 && distance2 <= last);
    sign_of_sum(middle.map(|(p, _)| p.signum())).or_else(|| sign_of_sum(voters.map(|(p, _)| p.powi(3))))
}

/// The sign that turns `axis` to the side that the normals of the neighbours point to.
#[cold]
fn side_of_normals(grid: &Grid, neighbors: &Neighborhood, axis: [f64; 3]) -> Option<f64> {
    let points = &neighbors.points[..neighbors.len()];
    sign_of_sum(points.iter().map(|&point| vec3::dot(grid.normal(point).map(f64::from), axis)))
}

/// The sign of the sum, `None` if it is zero but for rounding.
fn sign_of_sum(terms: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, magnitude) = terms.fold((0.0, 0.0), |(sum, magnitude), t| (sum + t, magnitude + t.abs()));
    (sum.abs() > CANCELLED * magnitude).then(|| sum.signum())
}
