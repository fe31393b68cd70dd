//! How doubtful a map is at each vertex.

use super::Side;
use super::surface::{TORN, cycle_at, keeps_orientation, stretch};
use crate::point_map::PointMap;
use rayon::prelude::*;

/// Steps of averaging over neighbours: about how many edges a sign of trouble reaches.
const STEPS: usize = 8;
/// A way there and back that misses by so much, relative to sqrt(area), is certainly wrong.
const FAR: f64 = 0.2;

/// The doubt of every vertex of the source, `[n]`, from 0 to 1: from the share of reversed triangles and torn edges
/// around it, and from how far it comes back from itself, averaged over its surroundings. Vertices without a match
/// have doubt 1.
///
/// # Panics
/// If a map is not one of these shapes, which [`Quality::measure`](super::Quality::measure) finds out.
pub fn doubt(map: &PointMap, back: Option<&PointMap>, source: Side, target: Side) -> Vec<f32> {
    let reversed = averaged(&reversed_share(map, source, target), source);
    let torn = averaged(&torn_share(map, source, target), source);
    let lost = averaged(&lost_share(map, back, source), source);
    let combined = |x: usize| match map.get(x) {
        None => 1.0,
        // A few reversed triangles and stretched edges are everywhere: vertices are coarse.
        Some(_) => {
            let reversed = ((reversed[x] - 0.1) / 0.5).clamp(0.0, 1.0);
            let torn = (torn[x] / 0.15).min(1.0);
            let lost = lost[x].min(1.0);
            (1.0 - (1.0 - reversed) * (1.0 - torn) * (1.0 - lost)) as f32
        }
    };
    (0..map.len()).map(combined).collect()
}

/// Of each vertex, the share of the triangles around it that the map reverses.
pub(super) fn reversed_share(map: &PointMap, source: Side, target: Side) -> Vec<f64> {
    let mut sums = vec![[0.0; 2]; map.len()];
    for (face, corners) in source.mesh.faces().iter().enumerate() {
        if let Some(keeps) = keeps_orientation(map, face, source, target) {
            for &v in corners {
                sums[v as usize][0] += if keeps { 0.0 } else { 1.0 };
                sums[v as usize][1] += 1.0;
            }
        }
    }
    ratios(&sums)
}

/// Of each vertex, the share of its edges that tear.
fn torn_share(map: &PointMap, source: Side, target: Side) -> Vec<f64> {
    let mut sums = vec![[0.0; 2]; map.len()];
    for &edge in &source.frame.edges {
        if let Some(stretch) = stretch(map, edge, source, target) {
            for v in edge {
                sums[v as usize][0] += f64::from(u8::from(stretch > TORN));
                sums[v as usize][1] += 1.0;
            }
        }
    }
    ratios(&sums)
}

/// Of each vertex, how far it comes back from itself, from 0 to 1.
fn lost_share(map: &PointMap, back: Option<&PointMap>, source: Side) -> Vec<f64> {
    let Some(back) = back else { return vec![0.0; map.len()] };
    (0..map.len()).map(|x| cycle_at(map, back, x, source).map_or(0.0, |d| (d / FAR).min(1.0))).collect()
}

fn ratios(sums: &[[f64; 2]]) -> Vec<f64> {
    sums.iter().map(|[part, whole]| if *whole > 0.0 { part / whole } else { 0.0 }).collect()
}

/// Averages a function over neighbours, weighted by their areas, [`STEPS`] times.
pub(super) fn averaged(values: &[f64], source: Side) -> Vec<f64> {
    let (stiffness, mass) = (&source.laplacian.stiffness, &source.basis.mass);
    let mut values = values.to_vec();
    for _ in 0..STEPS {
        values = (0..values.len())
            .into_par_iter()
            .map(|i| {
                // The row has the vertex itself too.
                let (sum, weight) = stiffness
                    .row(i)
                    .fold((0.0, 0.0), |(sum, weight), (j, _)| (sum + mass[j] * values[j], weight + mass[j]));
                if weight > 0.0 { sum / weight } else { values[i] }
            })
            .collect();
    }
    values
}
