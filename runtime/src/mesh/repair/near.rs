//! Vertices that are one but for rounding: of triangles that share no vertices, with noise; of seams that two programs wrote.

use super::faces::weld;
use crate::Mesh;
use crate::mesh::{Topology, vec3};
use std::collections::HashMap;

/// Vertices on a boundary that are no further apart than this share of the bounding box's diagonal may be taken as one.
pub(crate) const NEAR: f64 = 1e-5;
/// Nor may they be further apart than this share of the shortest edge at either, so that no face collapses.
const OF_EDGE: f64 = 0.25;

/// For every vertex the first one at its position ([`weld`]) or, where both are on a boundary, near it.
///
/// A mesh without boundary, or whose boundary vertices are all further apart, gets what [`weld`] gives.
pub(crate) fn weld_near(mesh: &Mesh) -> Vec<u32> {
    let mut welded = weld(mesh);
    let within = tolerances(mesh, &welded);
    let mut found = Clusters { mesh, size: NEAR * mesh.diagonal(), of_cell: HashMap::new() };
    let mut nearest: Vec<u32> = (0..mesh.n_vertices() as u32).collect();
    for v in (0..mesh.n_vertices()).filter(|&v| within[v] > 0.0) {
        match found.nearest(v as u32, &within) {
            Some(first) => nearest[v] = first,
            None => found.add(v as u32),
        }
    }
    welded.iter_mut().for_each(|v| *v = nearest[*v as usize]);
    welded
}

/// How near a vertex may be to each boundary vertex to be taken for it; 0 for all other vertices.
fn tolerances(mesh: &Mesh, welded: &[u32]) -> Vec<f64> {
    let faces: Vec<[u32; 3]> = mesh.faces().iter().map(|face| face.map(|v| welded[v as usize])).collect();
    let topology = Topology::of_faces(&faces, mesh.n_vertices());
    let mut on_boundary = vec![false; mesh.n_vertices()];
    let boundary = topology.boundary_edges();
    for &edge in &boundary {
        topology.edges()[edge as usize].iter().for_each(|&v| on_boundary[v as usize] = true);
    }
    if boundary.is_empty() {
        return vec![0.0; mesh.n_vertices()];
    }
    let largest = NEAR * mesh.diagonal();
    let mut within: Vec<f64> = on_boundary.iter().map(|&is| if is { largest } else { 0.0 }).collect();
    for &[a, b] in topology.edges() {
        let [a, b] = [a as usize, b as usize];
        let length = OF_EDGE * vec3::distance(mesh.vertices()[a], mesh.vertices()[b]);
        [a, b].into_iter().for_each(|v| within[v] = within[v].min(length));
    }
    within
}

/// The first vertices of their places, in the cells of a grid.
struct Clusters<'a> {
    mesh: &'a Mesh,
    /// Side of a cell: no vertex is further away from one that it may be taken for.
    size: f64,
    of_cell: HashMap<[i64; 3], Vec<u32>>,
}

impl Clusters<'_> {
    fn cell(&self, vertex: u32) -> [i64; 3] {
        self.mesh.vertices()[vertex as usize].map(|x| (x / self.size).floor() as i64)
    }

    fn add(&mut self, vertex: u32) {
        self.of_cell.entry(self.cell(vertex)).or_default().push(vertex);
    }

    /// The nearest first vertex that is near enough for both, the lowest of equals.
    fn nearest(&self, vertex: u32, within: &[f64]) -> Option<u32> {
        let cell = self.cell(vertex);
        let around = (0..27i64).filter_map(|i| {
            let step = [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1];
            self.of_cell.get(&[0, 1, 2].map(|axis| cell[axis].saturating_add(step[axis])))
        });
        let place = self.mesh.vertices()[vertex as usize];
        let distance = |&other: &u32| vec3::distance(place, self.mesh.vertices()[other as usize]);
        let near = around.flatten().copied().map(|other| (distance(&other), other));
        near.filter(|&(d, other)| d <= within[vertex as usize].min(within[other as usize]))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .map(|(_, other)| other)
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
}
