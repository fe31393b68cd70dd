//! Areas, normals and lengths of a mesh.

use super::{Mesh, vec3};

impl Mesh {
    /// Area of every triangle, `[m]`, in squared units of the file.
    pub fn face_areas(&self) -> Vec<f64> {
        (0..self.n_faces()).map(|f| 0.5 * vec3::norm(self.face_cross(f))).collect()
    }

    /// Total area, in squared units of the file.
    pub fn area(&self) -> f64 {
        self.face_areas().iter().sum()
    }

    /// Square root of the total area: the length that every length parameter is relative to.
    pub fn scale(&self) -> f64 {
        self.area().sqrt()
    }

    /// Barycentric vertex areas, `[n]`: a third of the area of the triangles around each vertex. They sum to the area.
    pub fn vertex_areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.n_vertices()];
        for (face, area) in self.faces().iter().zip(self.face_areas()) {
            for &i in face {
                areas[i as usize] += area / 3.0;
            }
        }
        areas
    }

    /// Cross product of two edges of triangle `face`: its normal times twice its area.
    pub fn face_cross(&self, face: usize) -> [f64; 3] {
        let [a, b, c] = self.corners(face);
        vec3::cross(vec3::sub(b, a), vec3::sub(c, a))
    }
}
