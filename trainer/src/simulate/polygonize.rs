//! Level sets of a sampled function as triangles, by marching cubes (Lorensen and Cline 1987). Where a face of a cube
//! is crossed four times its inside corners are taken to be apart, in both cubes that share it, so that the surface
//! is always a closed manifold.

use super::volume::Volume;
use fmnet::Mesh;
use fmnet::mesh::vec3;
use std::collections::HashMap;

/// Corners of the faces of a cube, counter-clockwise from outside; bit `a` of a corner is its step along axis `a`.
const FACES: [[usize; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
/// Vertices keep away from the nodes by this share of an edge, so that no triangle vanishes.
const MARGIN: f32 = 0.05;

/// An edge of a cube by its two corners, the lower one first.
type Edge = [usize; 2];

/// The surface of `value = level`, its faces looking to larger values.
pub(super) fn polygonize(volume: &Volume, level: f32) -> Mesh {
    let mut surface =
        Surface { volume, level, vertices: Vec::new(), of_edge: HashMap::new(), faces: Vec::new() };
    surface.march();
    Mesh::new(surface.vertices, surface.faces).expect("finite values make finite crossings")
}

/// Points of the level set, closer together than the grid.
pub(super) fn crossings(volume: &Volume, level: f32) -> Vec<[f64; 3]> {
    let mesh = polygonize(volume, level);
    let centroid = |f: usize| {
        let [a, b, c] = mesh.corners(f);
        vec3::scale(vec3::add(a, vec3::add(b, c)), 1.0 / 3.0)
    };
    mesh.vertices().iter().copied().chain((0..mesh.n_faces()).map(centroid)).collect()
}

struct Surface<'a> {
    volume: &'a Volume,
    level: f32,
    vertices: Vec<[f64; 3]>,
    /// The vertex on each edge of the grid that crosses the level, by its two nodes, the lower one first.
    of_edge: HashMap<[usize; 2], u32>,
    faces: Vec<[u32; 3]>,
}

impl Surface<'_> {
    fn march(&mut self) {
        let [nx, ny, nz] = self.volume.size;
        let step = |corner: usize| ((corner & 1) * ny + (corner >> 1 & 1)) * nz + (corner >> 2);
        let steps: [usize; 8] = std::array::from_fn(step);
        // Which corners are inside tells the polygons; most of the 256 cases come again and again.
        let mut polygons_of: Vec<Option<Vec<Vec<Edge>>>> = vec![None; 256];
        for i in 0..nx - 1 {
            for j in 0..ny - 1 {
                for k in 0..nz - 1 {
                    let node = (i * ny + j) * nz + k;
                    let inside = steps.map(|s| self.volume.values[node + s] < self.level);
                    let case = (0..8).fold(0, |case, corner| case | usize::from(inside[corner]) << corner);
                    if case == 0 || case == 255 {
                        continue;
                    }
                    for polygon in polygons_of[case].get_or_insert_with(|| polygons(inside)) {
                        self.polygon(polygon, |corner| node + steps[corner]);
                    }
                }
            }
        }
    }

    fn polygon(&mut self, polygon: &[Edge], node: impl Fn(usize) -> usize) {
        let corners: Vec<u32> = polygon.iter().map(|edge| self.vertex(edge.map(&node))).collect();
        let n = corners.len();
        // A diagonal within a face of the cube might be an edge of the neighbouring cube as well.
        let apart = |i: usize, j: usize| !share_face(polygon[i % n], polygon[j % n]);
        match (0..n).find(|&apex| (2..n - 1).all(|j| apart(apex, apex + j))) {
            Some(apex) => self.faces.extend(
                (1..n - 1).map(|j| [corners[apex], corners[(apex + j) % n], corners[(apex + j + 1) % n]]),
            ),
            None => {
                let sum = corners.iter().fold([0.0; 3], |sum, &i| vec3::add(sum, self.vertices[i as usize]));
                let center = self.vertices.len() as u32;
                self.vertices.push(vec3::scale(sum, 1.0 / n as f64));
                self.faces.extend((0..n).map(|j| [center, corners[j], corners[(j + 1) % n]]));
            }
        }
    }

    fn vertex(&mut self, [a, b]: [usize; 2]) -> u32 {
        if let Some(&vertex) = self.of_edge.get(&[a, b]) {
            return vertex;
        }
        let [from, to] = [a, b].map(|node| self.volume.values[node]);
        let t = f64::from(((self.level - from) / (to - from)).clamp(MARGIN, 1.0 - MARGIN));
        let [p, q] = [a, b].map(|node| {
            let [_, ny, nz] = self.volume.size;
            self.volume.position([node / (ny * nz), node / nz % ny, node % nz])
        });
        let vertex = self.vertices.len() as u32;
        self.vertices.push(std::array::from_fn(|axis| p[axis] + t * (q[axis] - p[axis])));
        self.of_edge.insert([a, b], vertex);
        vertex
    }
}

/// The polygons in which the surface crosses a cube, each as the edges of the cube that it crosses, counter-clockwise
/// from outside.
fn polygons(inside: [bool; 8]) -> Vec<Vec<Edge>> {
    // Around a face each edge by which one comes in is followed by one by which one leaves again; the inside corners
    // between them are cut off by the line from the one to the other. Every crossed edge is come in by in one of its
    // two faces.
    let mut next: Vec<(Edge, Edge)> = Vec::new();
    for face in FACES {
        let crossed: Vec<(Edge, bool)> = (0..4)
            .map(|k| [face[k], face[(k + 1) % 4]])
            .filter(|&[from, to]| inside[from] != inside[to])
            .map(|[from, to]| ([from.min(to), from.max(to)], inside[to]))
            .collect();
        for (k, (edge, _)) in crossed.iter().enumerate().filter(|(_, (_, enters))| *enters) {
            next.push((*edge, crossed[(k + 1) % crossed.len()].0));
        }
    }
    let mut polygons = Vec::new();
    while let Some((first, mut edge)) = next.pop() {
        let mut polygon = vec![first];
        while edge != first {
            polygon.push(edge);
            let Some(place) = next.iter().position(|(from, _)| *from == edge) else { break };
            edge = next.swap_remove(place).1;
        }
        polygons.push(polygon);
    }
    polygons
}

/// Whether two edges lie in one face of the cube.
fn share_face(a: Edge, b: Edge) -> bool {
    let corners = [a[0], a[1], b[0], b[1]];
    (0..3).any(|axis| corners.iter().all(|c| (c ^ corners[0]) >> axis & 1 == 0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fmnet::mesh::shapes::torus;
    use fmnet::mesh::{Topology, vec3};

    #[test]
    fn every_case_of_a_cube_is_a_surface() {
        for case in 1..255 {
            let inside: [bool; 8] = std::array::from_fn(|corner| case >> corner & 1 == 1);
            let mut crossed: Vec<Edge> = polygons(inside).concat();
            crossed.sort_unstable();
            let mut expected: Vec<Edge> = (0..8)
                .flat_map(|a| [1, 2, 4].map(|step| [a, a | step]))
                .filter(|[a, b]| a != b && inside[*a] != inside[*b])
                .collect();
            expected.sort_unstable();
            assert_eq!(crossed, expected, "case {case}: every crossed edge is in one polygon");
        }
    }

    /// Random values in a box that is outside all around: every case beside every other.
    #[test]
    fn noise_makes_a_closed_manifold() {
        let mut volume = Volume::new(&torus(12, 6, 0.4), 0.15, 0.2);
        let [nx, ny, nz] = volume.size;
        let mut state = 1u32;
        for (at, value) in volume.values.iter_mut().enumerate() {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let [i, j, k] = [at / (ny * nz), at / nz % ny, at % nz];
            let inner = [(i, nx), (j, ny), (k, nz)].iter().all(|&(x, n)| x > 0 && x + 1 < n);
            *value = if inner && state >> 31 == 0 { -1.0 } else { 1.0 };
        }
        let surface = polygonize(&volume, 0.0);
        let topology = Topology::new(&surface);
        assert!(surface.n_faces() > 1000 && topology.is_closed() && topology.is_manifold());
        assert!(topology.inconsistent_edges().is_empty());
    }

    #[test]
    fn level_sets_of_a_torus_are_closed_manifolds_of_its_area() {
        let volume = Volume::new(&torus(120, 60, 0.4), 0.05, 0.2);
        for offset in [0.0, 0.1] {
            let surface = polygonize(&volume, offset);
            let topology = Topology::new(&surface);
            assert!(topology.is_closed() && topology.is_manifold());
            assert!(topology.inconsistent_edges().is_empty());
            assert_eq!(topology.euler_characteristic(), 0);
            let exact = 4.0 * std::f64::consts::PI.powi(2) * (0.4 + f64::from(offset));
            assert!((surface.area() / exact - 1.0).abs() < 0.02, "{} instead of {exact}", surface.area());
            // The volume by the divergence theorem is positive where faces look outwards.
            let volume: f64 = (0..surface.n_faces())
                .map(|f| vec3::dot(surface.face_cross(f), surface.corners(f)[0]) / 6.0)
                .sum();
            assert!(volume > 0.0);
        }
    }
}
