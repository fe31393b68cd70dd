//! Vertex normals as the authors' implementation has them.

use crate::{Mesh, mesh::vec3};

/// A face whose height is below this fraction of its longest edge has no reliable normal.
const DEGENERATE: f64 = 1e-10;

/// A sum of unit normals shorter than this has cancelled.
const CANCELLED: f64 = 1e-6;

/// Unit normals, `[n]`: the normalised sum of the unit normals of the faces around each vertex, not weighted by area.
///
/// `None` for a vertex on no face with an area; zero where opposite faces cancel each other.
pub(super) fn vertex_normals(mesh: &Mesh) -> Vec<Option<[f64; 3]>> {
    let mut normals = vec![None; mesh.n_vertices()];
    for (face, corners) in mesh.faces().iter().enumerate() {
        if let Some(normal) = face_normal(mesh, face) {
            for &i in corners {
                let sum = normals[i as usize].unwrap_or([0.0; 3]);
                normals[i as usize] = Some(vec3::add(sum, normal));
            }
        }
    }
    for normal in normals.iter_mut().flatten() {
        let length = vec3::norm(*normal);
        *normal = if length > CANCELLED { vec3::scale(*normal, 1.0 / length) } else { [0.0; 3] };
    }
    normals
}

fn face_normal(mesh: &Mesh, face: usize) -> Option<[f64; 3]> {
    let [a, b, c] = mesh.corners(face);
    let longest = vec3::distance(a, b).max(vec3::distance(b, c)).max(vec3::distance(c, a));
    // Edges of length 1 at most, so that the product of two of a tiny face does not underflow.
    let unit = 1.0 / longest;
    let cross = vec3::cross(vec3::scale(vec3::sub(b, a), unit), vec3::scale(vec3::sub(c, a), unit));
    let length = vec3::norm(cross);
    (length > DEGENERATE).then(|| vec3::scale(cross, 1.0 / length))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_count_alike_and_degenerate_ones_not_at_all() {
        let vertices = vec![
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 100.0, 0.0],
            [0.0, 0.0, 1.0],
            [2.0, 0.0, 0.0],
            [5.0, 5.0, 5.0],
            [0.0; 3],
        ];
        let faces = vec![[0, 1, 2], [0, 2, 3], [0, 1, 4], [6, 6, 6]];
        let normals = vertex_normals(&Mesh::new(vertices, faces).unwrap());
        let half = 0.5f64.sqrt();
        let expected = [half, 0.0, half];
        assert!(vec3::distance(normals[0].unwrap(), expected) < 1e-15);
        assert_eq!(normals[1], Some([0.0, 0.0, 1.0]));
        assert_eq!(normals[4], None, "on a degenerate face alone");
        assert_eq!(normals[5], None, "on no face");
        assert_eq!(normals[6], None, "on a face that is a point");
    }

    #[test]
    fn opposite_faces_cancel() {
        let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = Mesh::new(vertices, vec![[0, 1, 2], [0, 2, 1]]).unwrap();
        assert_eq!(vertex_normals(&mesh), vec![Some([0.0; 3]); 3]);
    }
}
