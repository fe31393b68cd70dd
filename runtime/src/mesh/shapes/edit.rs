//! New meshes from old: subdivided, moved, renumbered, put side by side.

use super::build;
use crate::Mesh;
use crate::mesh::vec3;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::HashMap;

/// Every triangle split in four at the midpoints of its edges; the surface stays the same. The old vertices come first.
pub fn subdivide(mesh: &Mesh) -> Mesh {
    let mut vertices = mesh.vertices().to_vec();
    let mut midpoints: HashMap<(u32, u32), u32> = HashMap::with_capacity(3 * mesh.n_faces() / 2);
    let mut faces = Vec::with_capacity(4 * mesh.n_faces());
    for &[a, b, c] in mesh.faces() {
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(i, j)| {
            *midpoints.entry((i.min(j), i.max(j))).or_insert_with(|| {
                let sum = vec3::add(mesh.vertices()[i as usize], mesh.vertices()[j as usize]);
                vertices.push(vec3::scale(sum, 0.5));
                vertices.len() as u32 - 1
            })
        });
        faces.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    build(vertices, faces)
}

/// The mesh under `p -> scale * rotation p + translation`; `rotation` by rows.
pub fn transformed(mesh: &Mesh, rotation: [[f64; 3]; 3], scale: f64, translation: [f64; 3]) -> Mesh {
    super::map_vertices(mesh, |p| {
        vec3::add(vec3::scale(rotation.map(|row| vec3::dot(row, p)), scale), translation)
    })
}

/// Rotation matrix, by rows, of `angle` radians about `axis` (of any length but zero).
pub fn rotation(axis: [f64; 3], angle: f64) -> [[f64; 3]; 3] {
    let [x, y, z] = vec3::scale(axis, 1.0 / vec3::norm(axis));
    let (s, c) = angle.sin_cos();
    let t = 1.0 - c;
    [
        [c + t * x * x, t * x * y - s * z, t * x * z + s * y],
        [t * x * y + s * z, c + t * y * y, t * y * z - s * x],
        [t * x * z - s * y, t * y * z + s * x, c + t * z * z],
    ]
}

/// The same surface with vertices, faces and the first corner of each face in random order, and the new index of every
/// old vertex, `[n]`: as a point map from `mesh` to the result, the ground truth.
pub fn permuted(mesh: &Mesh, seed: u64) -> (Mesh, Vec<u32>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut permutation: Vec<u32> = (0..mesh.n_vertices() as u32).collect();
    permutation.shuffle(&mut rng);
    let mut vertices = vec![[0.0; 3]; mesh.n_vertices()];
    for (&position, &new) in mesh.vertices().iter().zip(&permutation) {
        vertices[new as usize] = position;
    }
    let mut faces: Vec<[u32; 3]> =
        mesh.faces().iter().map(|face| face.map(|i| permutation[i as usize])).collect();
    faces.shuffle(&mut rng);
    for face in &mut faces {
        face.rotate_left(rng.random_range(0..3));
    }
    (build(vertices, faces), permutation)
}

/// All meshes as one, in order, nothing welded.
pub fn joined(meshes: &[&Mesh]) -> Mesh {
    let mut vertices = Vec::new();
    let mut faces = Vec::new();
    for mesh in meshes {
        let offset = vertices.len() as u32;
        vertices.extend_from_slice(mesh.vertices());
        faces.extend(mesh.faces().iter().map(|face| face.map(|i| i + offset)));
    }
    build(vertices, faces)
}

#[cfg(test)]
mod tests {
    use super::super::{bumpy_sphere, icosphere};
    use super::*;

    #[test]
    fn subdivision_keeps_the_surface() {
        let mesh = bumpy_sphere(2, 1);
        let fine = subdivide(&mesh);
        assert_eq!(fine.n_faces(), 4 * mesh.n_faces());
        assert!((fine.area() / mesh.area() - 1.0).abs() < 1e-13);
        assert_eq!(&fine.vertices()[..mesh.n_vertices()], mesh.vertices());
    }

    #[test]
    fn permutation_leads_to_the_same_positions() {
        let mesh = bumpy_sphere(2, 1);
        let (shuffled, permutation) = permuted(&mesh, 5);
        for (i, &j) in permutation.iter().enumerate() {
            assert_eq!(mesh.vertices()[i], shuffled.vertices()[j as usize]);
        }
        assert!((shuffled.area() / mesh.area() - 1.0).abs() < 1e-13);
        assert_ne!(mesh, shuffled);
    }

    #[test]
    fn transformation_scales_the_area_and_keeps_the_orientation() {
        let mesh = icosphere(1);
        let moved = transformed(&mesh, rotation([1.0, 2.0, -1.0], 0.7), 3.0, [5.0, 0.0, 1.0]);
        assert!((moved.area() / mesh.area() - 9.0).abs() < 1e-12);
        let outward = vec3::sub(moved.corners(0)[0], [5.0, 0.0, 1.0]);
        assert!(vec3::dot(moved.face_cross(0), outward) > 0.0);
    }
}
