//! Vertices that are one but for rounding: of triangles that share no vertices, with noise; of seams that two
//! programs wrote.

use super::faces::weld;
use crate::Mesh;
use crate::mesh::{Topology, vec3};
use std::collections::{BTreeMap, HashMap};

/// Vertices on a boundary that are no further apart than this share of the bounding box's diagonal may be taken as one.
pub(crate) const NEAR: f64 = 1e-5;
/// Nor may they be further apart than this share of the shortest edge at either, so that no face collapses.
const OF_EDGE: f64 = 0.25;

/// For every vertex the first one at its position ([`weld`]) or, where both are on a boundary, near it.
///
/// A mesh without boundary, or whose boundary vertices are all further apart, gets what [`weld`] gives. Time is
/// linear in the size.
pub(crate) fn weld_near(mesh: &Mesh) -> Vec<u32> {
    let mut welded = weld(mesh);
    let within = tolerances(mesh, &welded);
    let mut firsts = Firsts { vertices: mesh.vertices(), within: &within, levels: BTreeMap::new() };
    let mut nearest: Vec<u32> = (0..mesh.n_vertices() as u32).collect();
    for v in (0..mesh.n_vertices() as u32).filter(|&v| within[v as usize] > 0.0) {
        match firsts.nearest(v) {
            Some(first) => nearest[v as usize] = first,
            None => firsts.add(v),
        }
    }
    welded.iter_mut().for_each(|v| *v = nearest[*v as usize]);
    welded
}

/// How near a vertex may be to each boundary vertex to be taken for it; 0 for all other vertices.
fn tolerances(mesh: &Mesh, welded: &[u32]) -> Vec<f64> {
    let faces: Vec<[u32; 3]> = mesh.faces().iter().map(|face| face.map(|v| welded[v as usize])).collect();
    let topology = Topology::of_faces(&faces, mesh.n_vertices());
    let mut within = vec![0.0; mesh.n_vertices()];
    let largest = NEAR * mesh.diagonal();
    if !largest.is_finite() {
        return within;
    }
    for edge in topology.boundary_edges() {
        topology.edges()[edge as usize].iter().for_each(|&v| within[v as usize] = largest);
    }
    for &[a, b] in topology.edges() {
        let [a, b] = [a as usize, b as usize];
        let length = OF_EDGE * vec3::distance(mesh.vertices()[a], mesh.vertices()[b]);
        [a, b].into_iter().for_each(|v| within[v] = within[v].min(length));
    }
    within
}

/// The first vertices of their places, in a grid for each power of two of their tolerances. Those of a grid are
/// further apart than half a cell, so that no cell holds more than a few.
struct Firsts<'a> {
    vertices: &'a [[f64; 3]],
    within: &'a [f64],
    levels: BTreeMap<i32, HashMap<[i64; 3], Vec<u32>>>,
}

impl Firsts<'_> {
    fn cell(&self, vertex: u32, level: i32) -> [i64; 3] {
        // No vertex of the level may be taken for one that is further away than a cell's side.
        let side = 2f64.powi(level + 1);
        self.vertices[vertex as usize].map(|x| (x / side).floor() as i64)
    }

    fn add(&mut self, vertex: u32) {
        let level = self.within[vertex as usize].log2().floor() as i32;
        let cell = self.cell(vertex, level);
        self.levels.entry(level).or_default().entry(cell).or_default().push(vertex);
    }

    /// The nearest first vertex that is near enough for both, the lowest of equals.
    fn nearest(&self, vertex: u32) -> Option<u32> {
        let around = self.levels.iter().flat_map(|(&level, cells)| {
            let cell = self.cell(vertex, level);
            (0..27i64).filter_map(move |i| {
                let step = [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1];
                cells.get(&[0, 1, 2].map(|axis| cell[axis].saturating_add(step[axis])))
            })
        });
        let place = self.vertices[vertex as usize];
        let near = |&other: &u32| {
            let distance = vec3::distance(place, self.vertices[other as usize]);
            let within = self.within[vertex as usize].min(self.within[other as usize]);
            (distance <= within).then_some((distance, other))
        };
        let nearest =
            around.flatten().filter_map(near).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        nearest.map(|(_, other)| other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use rand::{Rng, SeedableRng};

    /// The mesh with every vertex moved by up to `noise` of the diagonal along each axis.
    fn noisy(mesh: &Mesh, noise: f64) -> Mesh {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let by = noise * mesh.diagonal();
        let vertices = mesh.vertices().iter().map(|p| p.map(|x| x + by * rng.random_range(-1.0..1.0)));
        Mesh::new(vertices.collect(), mesh.faces().to_vec()).unwrap()
    }

    #[test]
    fn noisy_soup_hangs_together_as_soup_does() {
        let soup = shapes::triangle_soup();
        for noise in [1e-9, 1e-7, 2e-6] {
            assert_eq!(weld_near(&noisy(&soup, noise)), weld(&soup), "{noise}");
        }
    }

    #[test]
    fn what_is_closed_or_wide_apart_stays() {
        for (name, mesh) in shapes::zoo() {
            let mesh = noisy(&mesh, 1e-12);
            let closed = Topology::new(&mesh).is_closed();
            assert!(!closed || weld_near(&mesh) == weld(&mesh), "{name}");
        }
        let soup = noisy(&shapes::triangle_soup(), 1e-3);
        assert_eq!(weld_near(&soup), weld(&soup));
        assert_eq!(weld_near(&Mesh::default()), Vec::<u32>::new());
    }

    #[test]
    fn no_face_collapses_however_small_it_is() {
        // A tiny triangle beside a large one, its edges far below the tolerance.
        let tiny = [[0.0, 0.0, 0.0], [1e-7, 0.0, 0.0], [0.0, 1e-7, 0.0]];
        let large = [[5.0, 0.0, 0.0], [9.0, 0.0, 0.0], [5.0, 9.0, 0.0]];
        let mesh = Mesh::new([tiny, large].concat(), vec![[0, 1, 2], [3, 4, 5]]).unwrap();
        assert_eq!(weld_near(&mesh), [0, 1, 2, 3, 4, 5]);
    }

    /// A sheet that is tiny beside a vertex far away: all of its boundary is within the tolerance, and nothing of it
    /// is welded.
    #[test]
    fn a_vertex_far_away_costs_no_time() {
        let sheet = shapes::grid(300, 300);
        let faces: Vec<[u32; 3]> =
            (0..sheet.n_faces() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        let corners = sheet.faces().iter().flatten().map(|&v| sheet.vertices()[v as usize]);
        let far = [[1e6; 3], [2e6, 1e6, 1e6], [1e6, 2e6, 1e6]];
        let n = 3 * sheet.n_faces() as u32;
        let soup =
            Mesh::new(corners.chain(far).collect(), [faces, vec![[n, n + 1, n + 2]]].concat()).unwrap();
        assert_eq!(weld_near(&soup), weld(&soup));
        let huge = Mesh::new(far.map(|p| p.map(|x| x * 1e300)).to_vec(), vec![[0, 1, 2]]).unwrap();
        assert_eq!(weld_near(&huge), [0, 1, 2]);
    }
}
