//! Samples of the vertices: spread evenly, or drawn by area.

use super::Mesh;
use crate::numeric::vectorized;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Farthest point sampling by Euclidean distance: `start`, then always the vertex farthest from all before it.
///
/// Gives `min(count, n)` different vertices in the order chosen, so that every prefix is a sampling too; the lowest
/// index wins a tie. A `start` that is no vertex, or `count` 0, gives none.
pub fn farthest_point_sampling(mesh: &Mesh, count: usize, start: u32) -> Vec<u32> {
    let vertices = mesh.vertices();
    let along = |axis: usize| vertices.iter().map(|p| p[axis]).collect::<Vec<f64>>();
    let [x, y, z] = [along(0), along(1), along(2)];
    // Squares are in the order of the distances.
    farthest_point_sampling_by(vertices.len(), count, start, |source, squares| {
        let from = vertices[source as usize];
        for (((square, x), y), z) in squares.iter_mut().zip(&x).zip(&y).zip(&z) {
            *square = (x - from[0]).powi(2) + (y - from[1]).powi(2) + (z - from[2]).powi(2);
        }
    })
}

/// As [`farthest_point_sampling`] of `n` points, by any distance: `distances_from(source, distances)` fills the
/// distances from one point to all, `[n]`. Points at infinite distance, as on another component, are taken first; a
/// distance that is NaN counts as infinite.
pub fn farthest_point_sampling_by(
    n: usize,
    count: usize,
    start: u32,
    mut distances_from: impl FnMut(u32, &mut [f64]),
) -> Vec<u32> {
    if count == 0 || start as usize >= n {
        return Vec::new();
    }
    // Distance to the nearest sample, below zero for the samples themselves.
    let mut nearest = vec![f64::INFINITY; n];
    let mut distances = vec![0.0; n];
    let mut samples = vec![start];
    while samples.len() < count.min(n) {
        let last = samples[samples.len() - 1];
        nearest[last as usize] = -1.0;
        let farthest = vectorized(|| {
            distances_from(last, &mut distances);
            nearest.iter_mut().zip(&distances).for_each(|(nearest, &distance)| {
                *nearest = if distance < *nearest { distance } else { *nearest };
            });
            largest(&nearest)
        });
        samples.push(nearest.iter().position(|&distance| distance == farthest).unwrap_or(0) as u32);
    }
    samples
}

/// The largest of numbers from -1 up.
#[inline(always)]
fn largest(numbers: &[f64]) -> f64 {
    let (chunks, rest) = numbers.as_chunks::<16>();
    let mut lanes = [-1.0; 16];
    for chunk in chunks {
        for (lane, &number) in lanes.iter_mut().zip(chunk) {
            *lane = if number > *lane { number } else { *lane };
        }
    }
    lanes.iter().chain(rest).copied().fold(-1.0, f64::max)
}

/// Draws `min(count, n)` different vertices by their `areas`, `[n]` in any unit, each next one with a probability
/// proportional to its area among those left.
///
/// The order is that of the draws. Areas that are not positive count as zero and come last. Deterministic in the seed.
/// Efraimidis and Spirakis, Weighted random sampling with a reservoir (2006): the largest `log(u) / area` win.
pub fn area_weighted_sampling(areas: &[f64], count: usize, seed: u64) -> Vec<u32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut keyed: Vec<(f64, u32)> = areas
        .iter()
        .enumerate()
        .map(|(i, &area)| {
            // 1 - u is in (0, 1]: its logarithm is finite.
            let log_u = (1.0 - rng.random::<f64>()).ln();
            (if area > 0.0 { log_u / area } else { f64::NEG_INFINITY }, i as u32)
        })
        .collect();
    keyed.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    keyed.into_iter().take(count).map(|(_, i)| i).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{shapes, vec3};
    use std::collections::BTreeSet;

    fn all_different(samples: &[u32]) -> bool {
        samples.iter().collect::<BTreeSet<_>>().len() == samples.len()
    }

    #[test]
    fn samples_cover_the_mesh_within_their_own_distance() {
        let mesh = shapes::bumpy_sphere(4, 2);
        let samples = farthest_point_sampling(&mesh, 60, 5);
        assert_eq!((samples.len(), samples[0]), (60, 5));
        let position = |v: u32| mesh.vertices()[v as usize];
        let gap = |v: u32, to: &[u32]| {
            to.iter().map(|&s| vec3::distance(position(s), position(v))).fold(f64::INFINITY, f64::min)
        };
        let separation = gap(samples[59], &samples[..59]);
        for i in 1..60 {
            assert!(gap(samples[i], &samples[..i]) >= separation);
        }
        for v in 0..mesh.n_vertices() as u32 {
            assert!(gap(v, &samples) <= separation);
        }
    }

    #[test]
    fn a_prefix_is_a_sampling() {
        let mesh = shapes::torus(20, 10, 0.3);
        assert_eq!(farthest_point_sampling(&mesh, 30, 0)[..12], farthest_point_sampling(&mesh, 12, 0));
    }

    #[test]
    fn all_vertices_are_sampled_once_even_at_one_position() {
        let soup = shapes::triangle_soup();
        let samples = farthest_point_sampling(&soup, usize::MAX, 0);
        assert_eq!(samples.len(), soup.n_vertices());
        assert!(all_different(&samples));
    }

    #[test]
    fn odd_arguments_give_nothing_or_everything() {
        let mesh = shapes::icosphere(0);
        assert!(farthest_point_sampling(&mesh, 0, 0).is_empty());
        assert!(farthest_point_sampling(&mesh, 3, 12).is_empty());
        assert!(farthest_point_sampling(&Mesh::default(), 3, 0).is_empty());
        let apart = farthest_point_sampling_by(4, 9, 2, |_, d| d.fill(f64::INFINITY));
        assert_eq!(apart, [2, 0, 1, 3]);
        let unknown = farthest_point_sampling_by(3, 9, 0, |_, d| d.fill(f64::NAN));
        assert_eq!(unknown, [0, 1, 2]);
        assert!(area_weighted_sampling(&[], 3, 0).is_empty());
    }

    #[test]
    fn draws_follow_the_areas() {
        let areas = [1.0, 2.0, 3.0, 4.0, 0.0, f64::NAN];
        let mut first = [0usize; 6];
        for seed in 0..20_000 {
            first[area_weighted_sampling(&areas, 1, seed)[0] as usize] += 1;
        }
        for (i, &n) in first.iter().enumerate() {
            let expected = [0.1, 0.2, 0.3, 0.4, 0.0, 0.0][i];
            assert!((n as f64 / 20_000.0 - expected).abs() < 0.012, "{first:?}");
        }
    }

    #[test]
    fn draws_are_without_replacement_and_repeatable() {
        let areas = shapes::bumpy_sphere(3, 1).vertex_areas();
        let draws = area_weighted_sampling(&areas, 200, 4);
        assert_eq!(draws.len(), 200);
        assert!(all_different(&draws));
        assert_eq!(draws, area_weighted_sampling(&areas, 200, 4));
        assert_ne!(draws, area_weighted_sampling(&areas, 200, 5));
        assert_eq!(area_weighted_sampling(&areas, usize::MAX, 4).len(), areas.len());
    }
}
