//! Level sets of a sampled function as triangles, by marching tetrahedra (Doi and Koide 1991): each cube of the grid in six
//! tetrahedra around its diagonal, which fit together across cubes, so that the surface is always a closed manifold.

use super::volume::Volume;
use fmnet::Mesh;
use std::collections::HashMap;

/// Corners of the tetrahedra of a cube, positively oriented; bit `a` of a corner is its step along axis `a`.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 3, 2, 7], [0, 6, 4, 7], [0, 5, 1, 7]];
/// The even orders of four corners that bring each of them to the front.
const FRONT: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]];
/// The even orders of four corners by the two in front.
const PAIRS: [[usize; 4]; 6] =
    [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]];
/// Vertices keep away from the nodes by this share of an edge, so that no triangle vanishes.
const MARGIN: f32 = 0.05;

/// The surface of `value = level`, its faces looking to larger values.
pub(super) fn polygonize(volume: &Volume, level: f32) -> Mesh {
    let mut surface =
        Surface { volume, level, vertices: Vec::new(), of_edge: HashMap::new(), faces: Vec::new() };
    surface.march();
    Mesh::new(surface.vertices, surface.faces).expect("finite values make finite crossings")
}

/// Points of the level set, closer together than the grid.
pub(super) fn crossings(volume: &Volume, level: f32) -> Vec<[f64; 3]> {
    polygonize(volume, level).vertices().to_vec()
}

struct Surface<'a> {
    volume: &'a Volume,
    level: f32,
    vertices: Vec<[f64; 3]>,
    /// The vertex on each edge of the tetrahedra that crosses the level, by its two nodes, the lower one first.
    of_edge: HashMap<(usize, usize), u32>,
    faces: Vec<[u32; 3]>,
}

impl Surface<'_> {
    fn march(&mut self) {
        let [nx, ny, nz] = self.volume.size;
        let step = |corner: usize| ((corner & 1) * ny + (corner >> 1 & 1)) * nz + (corner >> 2);
        let steps: [usize; 8] = std::array::from_fn(step);
        for i in 0..nx - 1 {
            for j in 0..ny - 1 {
                for k in 0..nz - 1 {
                    let node = (i * ny + j) * nz + k;
                    let inside = steps.map(|s| self.volume.values[node + s] < self.level);
                    if inside.iter().any(|&x| x != inside[0]) {
                        for corners in TETRAHEDRA {
                            self.tetrahedron(corners.map(|c| node + steps[c]), corners.map(|c| inside[c]));
                        }
                    }
                }
            }
        }
    }

    fn tetrahedron(&mut self, nodes: [usize; 4], inside: [bool; 4]) {
        match inside.iter().filter(|&&x| x).count() {
            count @ (1 | 3) => {
                let single = (0..4).find(|&i| inside[i] == (count == 1)).expect("one differs");
                let [a, b, c, d] = FRONT[single].map(|i| nodes[i]);
                let face = [self.vertex(a, b), self.vertex(a, c), self.vertex(a, d)];
                self.faces.push(if count == 1 { face } else { [face[0], face[2], face[1]] });
            }
            2 => {
                let order = PAIRS.into_iter().find(|o| inside[o[0]] && inside[o[1]]).expect("two are inside");
                let [a, b, c, d] = order.map(|i| nodes[i]);
                let quad = [self.vertex(a, c), self.vertex(a, d), self.vertex(b, d), self.vertex(b, c)];
                self.faces.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
            }
            _ => {}
        }
    }

    fn vertex(&mut self, a: usize, b: usize) -> u32 {
        let (a, b) = (a.min(b), a.max(b));
        if let Some(&vertex) = self.of_edge.get(&(a, b)) {
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
        self.of_edge.insert((a, b), vertex);
        vertex
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fmnet::mesh::shapes::torus;
    use fmnet::mesh::{Topology, vec3};

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
