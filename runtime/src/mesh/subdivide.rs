//! Subdivision of sparse meshes: more vertices on the same surface.

use super::{Mesh, vec3};
use std::cmp::{Ordering, Reverse};
use std::collections::{BinaryHeap, HashMap};

/// A mesh of more vertices on the same surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Subdivided {
    /// The mesh; its first vertices are those of the sparse mesh.
    pub mesh: Mesh,
    /// The sparse mesh's vertex that is nearest to each vertex, of those of the faces that it lies on, `[n]`.
    pub nearest: Vec<u32>,
}

/// Cuts the longest edge in half, again and again, until there are `target` vertices.
///
/// The surface stays what it is, to rounding, with its boundary and its topology; triangles become evenly large and
/// no thinner than half as thin as they were (bisection of longest edges, Rivara 1984). A mesh of `target` vertices
/// or more comes back as it is. Time is `O(n log n)`, the result the same on every machine.
pub fn subdivide(mesh: &Mesh, target: usize) -> Subdivided {
    let mut cuts = Cuts::new(mesh);
    while cuts.vertices.len() < target {
        match cuts.queue.pop() {
            Some(longest) if longest.length > 0.0 => cuts.halve(longest.ends),
            _ => break,
        }
    }
    let mesh = Mesh::new(cuts.vertices, cuts.faces).expect("halves of a valid mesh's faces are valid");
    Subdivided { mesh, nearest: cuts.nearest }
}

struct Cuts<'a> {
    sparse: &'a Mesh,
    vertices: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
    /// The sparse mesh's face that each face is a piece of.
    origin: Vec<u32>,
    nearest: Vec<u32>,
    faces_of: HashMap<[u32; 2], Vec<u32>>,
    queue: BinaryHeap<Edge>,
}

struct Edge {
    length: f64,
    ends: [u32; 2],
}

impl Ord for Edge {
    fn cmp(&self, other: &Self) -> Ordering {
        self.length.total_cmp(&other.length).then(Reverse(self.ends).cmp(&Reverse(other.ends)))
    }
}

impl PartialOrd for Edge {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Edge {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Edge {}

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl<'a> Cuts<'a> {
    fn new(sparse: &'a Mesh) -> Self {
        let mut cuts = Self {
            sparse,
            vertices: sparse.vertices().to_vec(),
            faces: sparse.faces().to_vec(),
            origin: (0..sparse.n_faces() as u32).collect(),
            nearest: (0..sparse.n_vertices() as u32).collect(),
            faces_of: HashMap::new(),
            queue: BinaryHeap::new(),
        };
        for face in 0..cuts.faces.len() as u32 {
            let [a, b, c] = cuts.faces[face as usize];
            [[a, b], [b, c], [c, a]].into_iter().for_each(|[a, b]| cuts.join(a, b, face));
        }
        cuts
    }

    /// Notes that an edge is one of a face.
    fn join(&mut self, a: u32, b: u32, face: u32) {
        let ends = key(a, b);
        let faces = self.faces_of.entry(ends).or_default();
        if faces.is_empty() {
            let length = vec3::distance(self.vertices[a as usize], self.vertices[b as usize]);
            self.queue.push(Edge { length, ends });
        }
        faces.push(face);
    }

    fn halve(&mut self, [a, b]: [u32; 2]) {
        let middle = self.vertices.len() as u32;
        let (from, to) = (self.vertices[a as usize], self.vertices[b as usize]);
        // Halves first: the sum of large coordinates may be no number.
        let place = [0, 1, 2].map(|axis| 0.5 * from[axis] + 0.5 * to[axis]);
        let faces = self.faces_of.remove(&[a, b]).unwrap_or_default();
        self.vertices.push(place);
        self.nearest.push(self.nearest_corner(place, &faces));
        for face in faces {
            self.halve_face(face, [a, b], middle);
        }
    }

    fn halve_face(&mut self, face: u32, ends: [u32; 2], middle: u32) {
        let corners = self.faces[face as usize];
        let second = self.faces.len() as u32;
        let with = |old: u32| corners.map(|v| if v == old { middle } else { v });
        // The first half keeps the first end of the edge, the second the second.
        self.faces[face as usize] = with(ends[1]);
        self.faces.push(with(ends[0]));
        self.origin.push(self.origin[face as usize]);
        let Some(&apex) = corners.iter().find(|v| !ends.contains(v)) else { return };
        if let Some(faces) = self.faces_of.get_mut(&key(ends[1], apex)) {
            faces.iter_mut().filter(|f| **f == face).for_each(|f| *f = second);
        }
        self.join(ends[0], middle, face);
        self.join(middle, apex, face);
        self.join(middle, apex, second);
        self.join(ends[1], middle, second);
    }

    /// The nearest corner of the sparse faces that these are pieces of, the lowest of equals.
    fn nearest_corner(&self, place: [f64; 3], faces: &[u32]) -> u32 {
        let corners = faces.iter().flat_map(|&f| self.sparse.faces()[self.origin[f as usize] as usize]);
        let distance = |v: u32| vec3::distance(place, self.sparse.vertices()[v as usize]);
        let nearest =
            corners.map(|v| (distance(v), v)).min_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        nearest.map_or(0, |(_, v)| v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Topology, closest_points, shapes};

    #[test]
    fn the_surface_stays_what_it_is() {
        for (name, sparse) in shapes::zoo() {
            let sparse = crate::mesh::repair(&sparse, &Default::default()).unwrap().mesh;
            let target = 2 * sparse.n_vertices() + 101;
            let Subdivided { mesh, nearest } = subdivide(&sparse, target);
            assert_eq!((mesh.n_vertices(), nearest.len()), (target, target), "{name}");
            assert!((mesh.area() / sparse.area() - 1.0).abs() < 1e-12, "{name}");
            let (before, after) = (Topology::new(&sparse), Topology::new(&mesh));
            assert!(after.is_manifold(), "{name}");
            assert_eq!(after.euler_characteristic(), before.euler_characteristic(), "{name}");
            assert_eq!(after.components().count, before.components().count, "{name}");
            assert_eq!(after.boundary_loops().len(), before.boundary_loops().len(), "{name}");
            assert_eq!(
                after.inconsistent_edges().is_empty(),
                before.inconsistent_edges().is_empty(),
                "{name}"
            );
            assert_eq!(mesh.vertices()[..sparse.n_vertices()], *sparse.vertices(), "{name}");
            for (point, place) in closest_points(&sparse, mesh.vertices()).iter().zip(mesh.vertices()) {
                let on_surface = point.unwrap().position(&sparse);
                assert!(vec3::distance(on_surface, *place) < 1e-12, "{name}");
            }
        }
    }

    #[test]
    fn triangles_become_evenly_large() {
        // A long box: a few long triangles beside small ones.
        let long =
            shapes::transformed(&shapes::icosphere(1), shapes::rotation([0.0, 0.0, 1.0], 0.0), 1.0, [0.0; 3]);
        let stretched = long.vertices().iter().map(|p| [20.0 * p[0], p[1], p[2]]).collect();
        let sparse = Mesh::new(stretched, long.faces().to_vec()).unwrap();
        let longest = |mesh: &Mesh| {
            let topology = Topology::new(mesh);
            let ends = topology.edges().iter().map(|e| e.map(|v| mesh.vertices()[v as usize]));
            ends.map(|[a, b]| vec3::distance(a, b)).fold(0.0, f64::max)
        };
        let mesh = subdivide(&sparse, 2000).mesh;
        assert!(longest(&mesh) < 0.08 * longest(&sparse), "{} of {}", longest(&mesh), longest(&sparse));
    }

    #[test]
    fn each_vertex_knows_the_nearest_of_its_faces() {
        let sparse = shapes::icosphere(1);
        let Subdivided { mesh, nearest } = subdivide(&sparse, 1000);
        let all = crate::mesh::nearest_vertices(sparse.vertices(), mesh.vertices());
        for (v, place) in mesh.vertices().iter().enumerate() {
            let distance = |corner: u32| vec3::distance(*place, sparse.vertices()[corner as usize]);
            assert!(distance(nearest[v]) < distance(all[v]) + 1e-12, "vertex {v}");
        }
    }

    #[test]
    fn what_is_fine_enough_or_has_no_edges_comes_back() {
        let mesh = shapes::icosphere(1);
        assert_eq!(subdivide(&mesh, 42).mesh, mesh);
        assert_eq!(subdivide(&Mesh::default(), 42).mesh, Mesh::default());
        let point = Mesh::new(vec![[1.0; 3]; 3], vec![[0, 1, 2]]).unwrap();
        assert_eq!(subdivide(&point, 42).mesh, point);
    }
}
