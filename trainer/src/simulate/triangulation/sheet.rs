//! A triangulation that can be changed edge by edge: split, collapsed, flipped.

use fmnet::Mesh;
use fmnet::mesh::{Topology, vec3};

type Vec3 = [f64; 3];

/// Marks a face, or the ring of a vertex, that is gone.
const GONE: u32 = u32::MAX;

/// A manifold with boundary. Its boundary stays as it is.
pub(super) struct Sheet {
    pub(super) points: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
    /// Faces around each vertex, none for a vertex that is gone.
    rings: Vec<Vec<u32>>,
    /// Vertices on the boundary.
    fixed: Vec<bool>,
}

/// An edge between two faces: its ends `a`, `b`, and the third corners of the face that runs from `a` to `b` and of
/// the other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Diamond {
    pub(super) a: u32,
    pub(super) b: u32,
    pub(super) left: u32,
    pub(super) right: u32,
    left_face: u32,
    right_face: u32,
}

impl Sheet {
    pub(super) fn new(mesh: &Mesh) -> Self {
        let topology = Topology::new(mesh);
        let mut fixed = vec![false; mesh.n_vertices()];
        for edge in topology.boundary_edges() {
            topology.edges()[edge as usize].iter().for_each(|&i| fixed[i as usize] = true);
        }
        let mut rings = vec![Vec::with_capacity(8); mesh.n_vertices()];
        for (f, face) in mesh.faces().iter().enumerate() {
            face.iter().for_each(|&i| rings[i as usize].push(f as u32));
        }
        Self { points: mesh.vertices().to_vec(), faces: mesh.faces().to_vec(), rings, fixed }
    }

    /// The faces that are left, on the vertices they use.
    pub(super) fn into_mesh(self) -> Mesh {
        let mut place = vec![GONE; self.points.len()];
        let kept = (0..self.points.len()).filter(|&i| !self.rings[i].is_empty());
        let mut vertices = Vec::new();
        for i in kept {
            place[i] = vertices.len() as u32;
            vertices.push(self.points[i]);
        }
        let faces = self.faces.iter().filter(|face| face[0] != GONE);
        let faces = faces.map(|face| face.map(|i| place[i as usize])).collect();
        Mesh::new(vertices, faces).expect("points of a valid mesh that moved by finite steps")
    }

    /// Number of vertices that are left.
    pub(super) fn n_vertices(&self) -> usize {
        self.rings.iter().filter(|ring| !ring.is_empty()).count()
    }

    pub(super) fn is_fixed(&self, vertex: u32) -> bool {
        self.fixed[vertex as usize]
    }

    /// The faces around a vertex, each beginning with it.
    pub(super) fn ring(&self, vertex: u32) -> impl Iterator<Item = [u32; 3]> {
        self.rings[vertex as usize].iter().map(move |&f| beginning_with(self.faces[f as usize], vertex))
    }

    /// All edges, each once, in the order of the faces; the first end is the lower one.
    pub(super) fn edges(&self) -> Vec<[u32; 2]> {
        let mut edges = Vec::with_capacity(3 * self.faces.len() / 2);
        for (f, &[a, b, c]) in self.faces.iter().enumerate().filter(|(_, face)| face[0] != GONE) {
            for (i, j) in [(a, b), (b, c), (c, a)] {
                let other = self.face_with(j, i);
                if other.is_none_or(|other| f < other as usize) {
                    edges.push([i.min(j), i.max(j)]);
                }
            }
        }
        edges
    }

    /// Whether there is a face with both vertices.
    fn joined(&self, a: u32, b: u32) -> bool {
        self.rings[a as usize].iter().any(|&f| self.faces[f as usize].contains(&b))
    }

    /// The face that runs from `a` to `b`.
    fn face_with(&self, a: u32, b: u32) -> Option<u32> {
        let runs = |&f: &u32| beginning_with(self.faces[f as usize], a)[1] == b;
        self.rings[a as usize].iter().copied().find(runs)
    }

    /// The two faces at an edge; `None` on the boundary, or where there is no such edge any more.
    pub(super) fn diamond(&self, a: u32, b: u32) -> Option<Diamond> {
        let (left_face, right_face) = (self.face_with(a, b)?, self.face_with(b, a)?);
        let left = beginning_with(self.faces[left_face as usize], a)[2];
        let right = beginning_with(self.faces[right_face as usize], b)[2];
        Some(Diamond { a, b, left, right, left_face, right_face })
    }

    /// Puts a new vertex on an edge, and gives its number.
    pub(super) fn split(&mut self, edge: &Diamond, point: Vec3) -> u32 {
        let middle = self.points.len() as u32;
        self.points.push(point);
        self.fixed.push(false);
        self.rings.push(Vec::with_capacity(8));
        for (f, apex) in [(edge.left_face, edge.left), (edge.right_face, edge.right)] {
            let face = self.faces[f as usize];
            let added = self.faces.len() as u32;
            self.faces.push(face.map(|i| if i == edge.a { middle } else { i }));
            self.faces[f as usize] = face.map(|i| if i == edge.b { middle } else { i });
            self.rings[edge.b as usize].iter_mut().filter(|g| **g == f).for_each(|g| *g = added);
            self.rings[apex as usize].push(added);
            self.rings[middle as usize].extend([f, added]);
        }
        middle
    }

    /// Whether contracting an edge keeps the surface a manifold of the same topology: the end that goes is not on the
    /// boundary, no vertex but the two opposite the edge neighbours both of its ends (the link condition of Dey et
    /// al. 1999), and neither of the two is left with two faces.
    pub(super) fn may_collapse(&self, edge: &Diamond) -> bool {
        if self.is_fixed(edge.a) {
            return false;
        }
        let neighbors = self.ring(edge.a).map(|face| face[1]).filter(|&i| i != edge.b);
        neighbors.filter(|&i| self.joined(edge.b, i)).count() == 2
            && [edge.left, edge.right].into_iter().all(|i| self.may_lose_a_face(i))
    }

    /// Whether a vertex keeps three neighbours without one of its faces.
    fn may_lose_a_face(&self, vertex: u32) -> bool {
        self.rings[vertex as usize].len() + usize::from(self.is_fixed(vertex)) > 3
    }

    /// Contracts an edge: `a` goes, `b` moves to `point`.
    pub(super) fn collapse(&mut self, edge: &Diamond, point: Vec3) {
        let ring = std::mem::take(&mut self.rings[edge.a as usize]);
        for &f in &ring {
            if f == edge.left_face || f == edge.right_face {
                for i in self.faces[f as usize].into_iter().filter(|&i| i != edge.a) {
                    self.rings[i as usize].retain(|&g| g != f);
                }
                self.faces[f as usize] = [GONE; 3];
            } else {
                let face = self.faces[f as usize];
                self.faces[f as usize] = face.map(|i| if i == edge.a { edge.b } else { i });
                self.rings[edge.b as usize].push(f);
            }
        }
        self.points[edge.b as usize] = point;
    }

    /// Whether an edge may be replaced by the one between the corners opposite to it.
    pub(super) fn may_flip(&self, edge: &Diamond) -> bool {
        !self.joined(edge.left, edge.right) && [edge.a, edge.b].into_iter().all(|i| self.may_lose_a_face(i))
    }

    /// Replaces the edge `a b` by `left right`.
    pub(super) fn flip(&mut self, edge: &Diamond) {
        let Diamond { a, b, left, right, left_face, right_face } = *edge;
        self.faces[left_face as usize] = [left, a, right];
        self.faces[right_face as usize] = [right, b, left];
        self.rings[a as usize].retain(|&f| f != right_face);
        self.rings[b as usize].retain(|&f| f != left_face);
        self.rings[left as usize].push(right_face);
        self.rings[right as usize].push(left_face);
    }

    /// Normal of a triangle by its vertices, as long as twice its area.
    pub(super) fn normal(&self, [a, b, c]: [u32; 3]) -> Vec3 {
        cross([a, b, c].map(|i| self.points[i as usize]))
    }
}

/// Normal of a triangle, as long as twice its area.
pub(super) fn cross([a, b, c]: [Vec3; 3]) -> Vec3 {
    vec3::cross(vec3::sub(b, a), vec3::sub(c, a))
}

/// The face turned so that it begins with one of its corners.
fn beginning_with([a, b, c]: [u32; 3], vertex: u32) -> [u32; 3] {
    if a == vertex {
        [a, b, c]
    } else if b == vertex {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fmnet::mesh::shapes::{bumpy_sphere, icosphere, open_half_sphere};

    fn check(mesh: &Mesh, euler: i64) {
        let topology = Topology::new(mesh);
        assert!(topology.is_manifold() && topology.inconsistent_edges().is_empty());
        assert_eq!(topology.euler_characteristic(), euler);
    }

    #[test]
    fn every_change_keeps_a_manifold_of_the_same_topology() {
        for (mesh, euler) in [(bumpy_sphere(2, 1), 2), (open_half_sphere(2), 1)] {
            let mut sheet = Sheet::new(&mesh);
            assert_eq!(sheet.edges().len(), Topology::new(&mesh).edges().len());
            let boundary = Topology::new(&mesh).boundary_edges().len();
            for (number, [a, b]) in sheet.edges().into_iter().enumerate() {
                let Some(edge) = sheet.diamond(a, b) else { continue };
                match number % 4 {
                    0 => drop(sheet.split(&edge, sheet.points[a as usize])),
                    1 if sheet.may_flip(&edge) => sheet.flip(&edge),
                    2 | 3 if sheet.may_collapse(&edge) => sheet.collapse(&edge, sheet.points[b as usize]),
                    _ => {}
                }
            }
            let changed = sheet.into_mesh();
            check(&changed, euler);
            assert_eq!(Topology::new(&changed).boundary_edges().len(), boundary);
        }
    }

    #[test]
    fn a_sphere_collapses_to_a_tetrahedron_and_no_further() {
        let mut sheet = Sheet::new(&icosphere(1));
        for _ in 0..50 {
            for [a, b] in sheet.edges() {
                if let Some(edge) = sheet.diamond(a, b).filter(|edge| sheet.may_collapse(edge)) {
                    sheet.collapse(&edge, sheet.points[b as usize]);
                }
            }
        }
        let least = sheet.into_mesh();
        check(&least, 2);
        assert_eq!(least.n_vertices(), 4);
    }
}
