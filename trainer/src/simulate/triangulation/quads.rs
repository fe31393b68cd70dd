//! Quadrilaterals, each split in two triangles, as most modellers leave them.

use super::surface::{Place, Surface};
use crate::simulate::visibility::unit;
use fmnet::Mesh;
use fmnet::mesh::{Topology, vec3};
use rand::Rng;
use std::collections::BTreeMap;

type Vec3 = [f64; 3];

/// Rounds in which vertices move to the middle of their neighbours.
const ROUNDS: usize = 4;

/// Which diagonals split the quadrilaterals.
#[derive(Clone, Copy, Debug)]
enum Diagonal {
    /// From the corners of the coarse mesh.
    Corner,
    /// Between the middles of its edges.
    Edge,
    Shorter,
    Random,
}

/// About four times as many vertices as `coarse`: its triangles are joined to quadrilaterals where that can be done
/// well, and each polygon is divided into quadrilaterals around its middle (Catmull and Clark 1978, without their
/// smoothing).
pub(super) fn quads(surface: &Surface, coarse: &Mesh, rng: &mut impl Rng) -> Mesh {
    let polygons = polygons(coarse);
    let mut places = surface.places(coarse);
    let mut middles: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    let mut quads: Vec<[u32; 4]> = Vec::new();
    for polygon in &polygons {
        let corners: Vec<Place> = polygon.iter().map(|&i| places[i as usize]).collect();
        let center = add(&mut places, middle(surface, &corners));
        let next = |k: usize| polygon[(k + 1) % polygon.len()];
        let sides: Vec<u32> = (0..polygon.len())
            .map(|k| {
                let (i, j) = (polygon[k], next(k));
                *middles.entry([i.min(j), i.max(j)]).or_insert_with(|| {
                    let ends = [places[i as usize], places[j as usize]];
                    add(&mut places, middle(surface, &ends))
                })
            })
            .collect();
        for k in 0..polygon.len() {
            quads.push([polygon[k], sides[k], center, sides[(k + polygon.len() - 1) % polygon.len()]]);
        }
    }
    relax(surface, &mut places, &quads, &boundary(&quads));
    split(&places, &quads, rng)
}

fn add(places: &mut Vec<Place>, place: Place) -> u32 {
    places.push(place);
    places.len() as u32 - 1
}

fn middle(surface: &Surface, places: &[Place]) -> Place {
    surface.middle(places).unwrap_or(places[0])
}

/// Pairs of triangles as quadrilaterals, the squarest first, and the triangles that are left.
fn polygons(mesh: &Mesh) -> Vec<Vec<u32>> {
    let topology = Topology::new(mesh);
    let mut pairs: Vec<(f64, usize)> = Vec::new();
    let quad = |e: usize| {
        let &[left, right] = topology.half_edges(e) else { return None };
        let [a, b] = topology.ends(left);
        let apex = |h: u32| mesh.faces()[h as usize / 3][(h as usize + 2) % 3];
        Some(([a, apex(right), b, apex(left)], [left / 3, right / 3]))
    };
    for e in 0..topology.edges().len() {
        if let Some((corners, _)) = quad(e) {
            let skew = skewness(corners.map(|i| mesh.vertices()[i as usize]));
            if skew < 0.75 {
                pairs.push((skew, e));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut taken = vec![false; mesh.n_faces()];
    let mut polygons = Vec::new();
    for (_, e) in pairs {
        let Some((corners, faces)) = quad(e) else { continue };
        if faces.iter().all(|&f| !taken[f as usize]) {
            faces.iter().for_each(|&f| taken[f as usize] = true);
            polygons.push(corners.to_vec());
        }
    }
    let left = mesh.faces().iter().zip(taken).filter(|(_, taken)| !taken);
    polygons.extend(left.map(|(face, _)| face.to_vec()));
    polygons
}

/// The largest absolute cosine of the angles of a quadrilateral.
fn skewness(corners: [Vec3; 4]) -> f64 {
    let cosine = |k: usize| {
        let [to, fro] = [1, 3].map(|d| unit(vec3::sub(corners[(k + d) % 4], corners[k])));
        vec3::dot(to, fro).abs()
    };
    (0..4).map(cosine).fold(0.0, f64::max)
}

/// The vertices on edges of one quadrilateral, ascending.
fn boundary(quads: &[[u32; 4]]) -> Vec<u32> {
    let mut count: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for quad in quads {
        for k in 0..4 {
            let (i, j) = (quad[k], quad[(k + 1) % 4]);
            *count.entry([i.min(j), i.max(j)]).or_default() += 1;
        }
    }
    let mut fixed: Vec<u32> = count.into_iter().filter(|(_, n)| *n == 1).flat_map(|(edge, _)| edge).collect();
    fixed.sort_unstable();
    fixed.dedup();
    fixed
}

fn relax(surface: &Surface, places: &mut [Place], quads: &[[u32; 4]], fixed: &[u32]) {
    for _ in 0..ROUNDS {
        let mut sums = vec![([0.0; 3], 0.0); places.len()];
        for quad in quads {
            for k in 0..4 {
                let (i, j) = (quad[k] as usize, quad[(k + 1) % 4] as usize);
                for (to, from) in [(i, j), (j, i)] {
                    sums[to].0 = vec3::add(sums[to].0, places[from].position);
                    sums[to].1 += 1.0;
                }
            }
        }
        for (i, (sum, count)) in sums.into_iter().enumerate() {
            if count == 0.0 || fixed.binary_search(&(i as u32)).is_ok() {
                continue;
            }
            let Place { position, normal, .. } = places[i];
            let step = vec3::scale(vec3::sub(vec3::scale(sum, 1.0 / count), position), 0.5);
            let along = vec3::sub(step, vec3::scale(normal, vec3::dot(step, normal)));
            if let Some(place) = surface.closest(vec3::add(position, along), normal) {
                places[i] = place;
            }
        }
    }
}

fn split(places: &[Place], quads: &[[u32; 4]], rng: &mut impl Rng) -> Mesh {
    let styles = [Diagonal::Corner, Diagonal::Edge, Diagonal::Shorter, Diagonal::Random];
    let style = styles[rng.random_range(0..styles.len())];
    let position = |i: u32| places[i as usize].position;
    let length = |i: u32, j: u32| vec3::distance(position(i), position(j));
    let mut around = vec![0; places.len()];
    quads.iter().for_each(|quad| around[quad[0] as usize] += 1);
    let mut faces = Vec::with_capacity(2 * quads.len());
    for &[a, b, c, d] in quads {
        let first = match style {
            Diagonal::Corner => true,
            Diagonal::Edge => false,
            Diagonal::Shorter => length(a, c) <= length(b, d),
            Diagonal::Random => rng.random(),
        };
        let halves = |first: bool| if first { [[a, b, c], [a, c, d]] } else { [[b, c, d], [b, d, a]] };
        // A quadrilateral with a dent is split through it.
        let upright = |first: bool| {
            let uprights = halves(first).map(|face| {
                let [p, q, r] = face.map(position);
                let normal = unit(vec3::cross(vec3::sub(q, p), vec3::sub(r, p)));
                vec3::dot(
                    normal,
                    unit(face.iter().fold([0.0; 3], |sum, &i| vec3::add(sum, places[i as usize].normal))),
                )
            });
            uprights[0].min(uprights[1])
        };
        let first = first == (upright(first) > 0.2 || upright(first) >= upright(!first));
        // Two quadrilaterals alone around a corner share both of its edges; the diagonal between these would be the
        // same edge.
        faces.extend(halves(first || around[a as usize] == 2));
    }
    let vertices = places.iter().map(|place| place.position).collect();
    Mesh::new(vertices, faces).expect("places on a valid mesh are finite")
}
