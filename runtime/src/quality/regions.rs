//! Regions that a map has sent to the wrong place as a whole, as where limbs are exchanged: what it tears off, and
//! maps that are inside out.

use super::Side;
use super::doubt::{averaged, reversed_share};
use super::surface::{TORN, stretch};
use crate::mesh::{UnionFind, vec3};
use crate::point_map::PointMap;
use std::collections::BTreeMap;

/// Smaller regions, as a share of the area, are noise.
const LEAST: f64 = 0.03;
/// A vertex is turned inside out where so large a share of the triangles around it is reversed.
const REVERSED: f64 = 0.5;
/// A tear is of edges that become so many times longer: where it crosses a limb refinement has smoothed it over a few
/// edges.
const CUT: f64 = 2.5;
/// At a quarter of the edges on the border of a region that is elsewhere the surface tears so far apart, relative to
/// sqrt(area): 0.19 to 0.30 at exchanged limbs, up to 0.11 at regions of good maps, but for a foal's short tail on a
/// lion's long one.
const JUMP: f64 = 0.12;

/// The regions of the source that the map has torn off from the rest and sent elsewhere, the largest first: the
/// vertices of each, ascending. A region is connected, has 3 % of the area or more and the same orientation on the
/// target throughout. The largest one of all counts only if it is turned inside out: the map then is mirrored.
///
/// # Panics
/// If the map is not one of these shapes, which [`Quality::measure`](super::Quality::measure) finds out.
pub fn displaced_regions(map: &PointMap, source: Side, target: Side) -> Vec<Vec<u32>> {
    let reversed = averaged(&reversed_share(map, source, target), source);
    let is_reversed = |v: u32| reversed[v as usize] > REVERSED;
    let mut sets = UnionFind::new(map.len());
    let mut border = Vec::new();
    // Where a limb is reversed its border is an edge or two beside the tear; so a border edge has the longest tear
    // next to it.
    let mut tear = vec![0.0f64; map.len()];
    for &edge in &source.frame.edges {
        let Some(stretch) = stretch(map, edge, source, target) else { continue };
        let [a, b] = edge;
        if stretch < CUT && is_reversed(a) == is_reversed(b) {
            sets.union(a, b);
        } else {
            border.push(edge);
        }
        // What is stretched without a tear may be a short tail on a long one.
        if stretch > TORN {
            let [from, to] = edge.map(|v| source.mesh.vertices()[v as usize]);
            let length = stretch * vec3::distance(from, to) / source.frame.unit;
            edge.iter().for_each(|&v| tear[v as usize] = tear[v as usize].max(length));
        }
    }
    let roots: Vec<u32> = (0..map.len() as u32).map(|v| sets.find(v)).collect();
    let regions = by_area(&roots, source);
    let is_elsewhere = |region: &[u32]| {
        let own = |v: u32| roots[v as usize] == roots[region[0] as usize];
        let at_border = border.iter().filter(|[a, b]| own(*a) != own(*b));
        let mut jumps: Vec<f64> =
            at_border.map(|edge| edge.map(|v| tear[v as usize])).map(|[a, b]| a.max(b)).collect();
        jumps.sort_by(f64::total_cmp);
        jumps.get(jumps.len() * 3 / 4).is_some_and(|&jump| jump > JUMP)
    };
    let displaced = |(i, region): (usize, Vec<u32>)| {
        let is_displaced = if i == 0 { is_reversed(region[0]) } else { is_elsewhere(&region) };
        is_displaced.then_some(region)
    };
    regions.into_iter().enumerate().filter_map(displaced).collect()
}

/// The sets of the vertices of these roots that are large enough, the largest first.
fn by_area(roots: &[u32], source: Side) -> Vec<Vec<u32>> {
    let mut regions: BTreeMap<u32, (f64, Vec<u32>)> = BTreeMap::new();
    for (v, &root) in roots.iter().enumerate() {
        let (area, vertices) = regions.entry(root).or_default();
        *area += source.basis.mass[v];
        vertices.push(v as u32);
    }
    let least = LEAST * source.basis.area();
    let mut regions: Vec<(f64, Vec<u32>)> =
        regions.into_values().filter(|(area, _)| *area >= least).collect();
    regions.sort_by(|a, b| b.0.total_cmp(&a.0));
    regions.into_iter().map(|(_, vertices)| vertices).collect()
}
