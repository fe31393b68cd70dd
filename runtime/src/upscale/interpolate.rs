//! What the functional map of the full shapes misses, taken from the matches nearby.

use crate::Matrix;
use crate::mesh::nearest_k_vertices;
use crate::point_map::search::squared_distance;
use rayon::prelude::*;

/// Matches near a vertex that it looks at.
const NEAR: usize = 12;
/// The kernel is as wide as the distance to the match of this rank, from 0: a few matches share in a residual, so
/// that it does not jump where the decimated target is coarse.
const WIDTH_RANK: usize = 3;
/// A match is taken to be wrong where the functional map misses it by more than this many times what it misses at
/// [`RIGHT`] of the matches.
const OUTLIER: f64 = 5.0;
/// A share of the matches that are right for sure; low, so that wrong ones hardly change what is usual among them.
const RIGHT: f64 = 0.35;

/// `C phi(x)` at every vertex of the source plus the residual `psi(y_j) - C phi(x_j)` of the matches near it,
/// `[n, k_target]`.
///
/// A functional map of `k` eigenfunctions is smooth: it cannot follow a map that varies faster. Its residual at a
/// match is what it misses there, and at a vertex the mean of those nearby by `exp(-d^2 / s^2)`, with `d` the
/// distance of rows of `phi` and `s` that to the fourth nearest match. Matches that the map misses by far are left
/// out, as they are wrong; so are vertices near in space but far on the surface, as their rows of `phi` differ.
///
/// `transported` holds the rows `C phi(x)`, `[n, k_target]`; `phi` is `[n, k_source]`, `psi` `[n_target, k_target]`;
/// `vertices` are the positions of the source, `[n]`, and `matches` pairs of its vertices and the target's.
pub(super) fn add_residuals(
    transported: &mut Matrix,
    phi: &Matrix,
    psi: &Matrix,
    vertices: &[[f64; 3]],
    matches: &[(u32, u32)],
) {
    let missed: Vec<f64> = matches
        .iter()
        .map(|&(x, y)| squared_distance(psi.row(y as usize), transported.row(x as usize)).sqrt())
        .collect();
    let mut sorted = missed.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let usual = sorted.get((RIGHT * sorted.len() as f64) as usize).copied().unwrap_or(0.0);
    let limit = OUTLIER * usual;
    let trusted: Vec<(u32, u32)> =
        matches.iter().zip(&missed).filter(|(_, missed)| **missed <= limit).map(|(pair, _)| *pair).collect();
    if trusted.is_empty() {
        return;
    }
    let residual = |&(x, y): &(u32, u32)| {
        let (found, expected) = (transported.row(x as usize), psi.row(y as usize));
        expected.iter().zip(found).map(|(e, f)| e - f).collect::<Vec<f64>>()
    };
    let residuals: Vec<Vec<f64>> = trusted.par_iter().map(residual).collect();
    let places: Vec<[f64; 3]> = trusted.iter().map(|&(x, _)| vertices[x as usize]).collect();
    let near = nearest_k_vertices(&places, vertices, NEAR);
    let width = transported.cols().max(1);
    transported.data_mut().par_chunks_mut(width).zip(near.par_chunks(NEAR)).enumerate().for_each(
        |(vertex, (row, near))| {
            for (weight, j) in weights(phi, vertex, near, &trusted) {
                row.iter_mut().zip(&residuals[j]).for_each(|(value, residual)| *value += weight * residual);
            }
        },
    );
}

/// The weights of the matches `near` a vertex, which sum to 1.
fn weights(phi: &Matrix, vertex: usize, near: &[u32], matches: &[(u32, u32)]) -> Vec<(f64, usize)> {
    let squared = |&j: &u32| squared_distance(phi.row(vertex), phi.row(matches[j as usize].0 as usize));
    let distances: Vec<f64> = near.iter().map(squared).collect();
    let mut sorted = distances.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let width = sorted[WIDTH_RANK].max(f64::MIN_POSITIVE);
    // Relative to the nearest, so that one of them counts however far it is.
    let kernel: Vec<f64> = distances.iter().map(|d| ((sorted[0] - d) / width).exp()).collect();
    let sum: f64 = kernel.iter().sum();
    near.iter().zip(kernel).map(|(&j, weight)| (weight / sum, j as usize)).collect()
}
