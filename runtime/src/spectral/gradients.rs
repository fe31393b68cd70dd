//! Gradients of eigenfunctions at the vertices.

use super::Eigenbasis;
use crate::Matrix;
use crate::mesh::{Mesh, vec3};
use crate::numeric::vectorized;
use rayon::prelude::*;

/// The gradients of the eigenfunctions of a shape at its vertices, in a tangent frame at each vertex.
#[derive(Clone, Debug, PartialEq)]
pub struct EigenGradients {
    /// Component along the first axis of the frame, `[n, k]`.
    pub x: Matrix,
    /// Component along the second axis, `[n, k]`.
    pub y: Matrix,
}

/// The gradients of the columns of `basis`, `[n, k]` twice, in 1 / unit of the mesh times the unit of the eigenvectors.
///
/// A function that is linear on each triangle has a constant gradient there; at a vertex it is the mean over the
/// triangles around it, weighted by area. It is given in an orthonormal frame of the plane across the vertex normal
/// (the sum of the area-weighted face normals), right-handed with the normal as third axis. Which frame is arbitrary,
/// and nothing should depend on it: `x + i y` is determined up to a rotation at each vertex, and mirroring the mesh
/// conjugates it. Where a vertex has no normal or no triangle, the gradient is 0.
///
/// # Panics
/// If the basis is not of the mesh's vertices.
pub fn eigen_gradients(mesh: &Mesh, basis: &Eigenbasis) -> EigenGradients {
    assert_eq!(mesh.n_vertices(), basis.n(), "mesh and basis are of different shapes");
    let (n, k) = (basis.n(), basis.k());
    let stencils = Stencils::new(mesh);
    let (mut x, mut y) = (Matrix::zeros(n, k), Matrix::zeros(n, k));
    if k > 0 {
        let rows = x.data_mut().par_chunks_mut(k).zip(y.data_mut().par_chunks_mut(k));
        rows.enumerate().for_each(|(vertex, (x, y))| {
            vectorized(|| {
                for &(neighbor, [along_x, along_y]) in stencils.of(vertex) {
                    let values = basis.eigenvectors.row(neighbor as usize);
                    for ((x, y), value) in x.iter_mut().zip(y.iter_mut()).zip(values) {
                        *x += along_x * value;
                        *y += along_y * value;
                    }
                }
            });
        });
    }
    EigenGradients { x, y }
}

/// For each vertex, the vertices of the triangles around it and what they weigh in the two components.
struct Stencils {
    first: Vec<usize>,
    entries: Vec<(u32, [f64; 2])>,
}

impl Stencils {
    fn new(mesh: &Mesh) -> Self {
        let n = mesh.n_vertices();
        let (mut normals, mut areas) = (vec![[0.0; 3]; n], vec![0.0; n]);
        let mut around: Vec<Vec<u32>> = vec![Vec::new(); n];
        for (face, corners) in mesh.faces().iter().enumerate() {
            let cross = mesh.face_cross(face);
            let area = 0.5 * vec3::norm(cross);
            if !(area > 0.0 && area.is_finite()) {
                continue;
            }
            for &corner in corners {
                normals[corner as usize] = vec3::add(normals[corner as usize], cross);
                areas[corner as usize] += area;
                around[corner as usize].push(face as u32);
            }
        }
        let mut stencils = Self { first: vec![0], entries: Vec::new() };
        for vertex in 0..n {
            if let Some(frame) = tangent_frame(normals[vertex]) {
                for &face in &around[vertex] {
                    stencils.add_face(mesh, face as usize, frame, areas[vertex]);
                }
                stencils.merge_last();
            }
            stencils.first.push(stencils.entries.len());
        }
        stencils
    }

    /// The gradient of the hat function at a corner is `normal x opposite edge / (2 area)`; its share of the mean is
    /// the face's area over `around`, that of all faces around the vertex.
    fn add_face(&mut self, mesh: &Mesh, face: usize, frame: [[f64; 3]; 2], around: f64) {
        let corners = mesh.corners(face);
        let cross = mesh.face_cross(face);
        let normal = vec3::scale(cross, 1.0 / vec3::norm(cross));
        for i in 0..3 {
            let opposite = vec3::sub(corners[(i + 2) % 3], corners[(i + 1) % 3]);
            let share = vec3::scale(vec3::cross(normal, opposite), 0.5 / around);
            self.entries.push((mesh.faces()[face][i], frame.map(|axis| vec3::dot(axis, share))));
        }
    }

    /// Adds up what each vertex weighs in the stencil that was begun last.
    fn merge_last(&mut self) {
        let start = self.first[self.first.len() - 1];
        let mut merged: Vec<(u32, [f64; 2])> = Vec::with_capacity(8);
        for &(vertex, [x, y]) in &self.entries[start..] {
            match merged.iter_mut().find(|(known, _)| *known == vertex) {
                Some((_, sum)) => *sum = [sum[0] + x, sum[1] + y],
                None => merged.push((vertex, [x, y])),
            }
        }
        self.entries.truncate(start);
        self.entries.extend(merged);
    }

    fn of(&self, vertex: usize) -> &[(u32, [f64; 2])] {
        &self.entries[self.first[vertex]..self.first[vertex + 1]]
    }
}

/// Two orthonormal axes that with the direction of `normal` make a right-handed frame; `None` where it has no
/// direction.
fn tangent_frame(normal: [f64; 3]) -> Option<[[f64; 3]; 2]> {
    let length = vec3::norm(normal);
    if !(length > 0.0 && length.is_finite()) {
        return None;
    }
    let normal = vec3::scale(normal, 1.0 / length);
    // The coordinate axis that is farthest from the normal.
    let least = (0..3).min_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs())).unwrap_or(0);
    let mut axis = [0.0; 3];
    axis[least] = 1.0;
    let first = vec3::cross(normal, axis);
    let first = vec3::scale(first, 1.0 / vec3::norm(first));
    Some([first, vec3::cross(normal, first)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::icosphere;

    fn basis_of(mesh: &Mesh, functions: &[&dyn Fn([f64; 3]) -> f64]) -> Eigenbasis {
        let entry = |v: usize, j: usize| functions[j](mesh.vertices()[v]);
        Eigenbasis {
            eigenvalues: vec![0.0; functions.len()],
            eigenvectors: Matrix::from_fn(mesh.n_vertices(), functions.len(), entry),
            mass: mesh.vertex_areas(),
        }
    }

    #[test]
    fn on_the_sphere_coordinates_have_the_gradients_of_calculus() {
        let mesh = icosphere(4);
        let basis = basis_of(&mesh, &[&|_| 1.0, &|p| p[0], &|p| p[1], &|p| p[2]]);
        let gradients = eigen_gradients(&mesh, &basis);
        for v in 0..mesh.n_vertices() {
            let p = mesh.vertices()[v];
            let at = |j: usize| [gradients.x[(v, j)], gradients.y[(v, j)]];
            assert!(at(0).iter().all(|x| x.abs() < 1e-12), "a constant has no gradient");
            for (axis, along) in p.into_iter().enumerate() {
                let [x, y] = at(axis + 1);
                // The gradient of a coordinate is its axis projected on the tangent plane.
                assert!((x * x + y * y - (1.0 - along * along)).abs() < 0.02, "vertex {v}, axis {axis}");
            }
            // The gradients of x and y turn counter-clockwise, seen from outside, by the sign of z.
            let ([ax, ay], [bx, by]) = (at(1), at(2));
            assert!((ax * by - ay * bx - p[2]).abs() < 0.02, "vertex {v} of {p:?}");
        }
    }

    #[test]
    fn vertices_without_faces_have_no_gradient() {
        let corners = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [5.0, 5.0, 5.0]];
        let mesh = Mesh::new(corners, vec![[0, 1, 2], [1, 1, 2]]).unwrap();
        let gradients = eigen_gradients(&mesh, &basis_of(&mesh, &[&|p| 3.0 * p[0] - p[1]]));
        let squared = |v: usize| gradients.x[(v, 0)].powi(2) + gradients.y[(v, 0)].powi(2);
        assert_eq!(squared(3), 0.0);
        assert!((0..3).all(|v| (squared(v) - 10.0).abs() < 1e-12));
    }
}
