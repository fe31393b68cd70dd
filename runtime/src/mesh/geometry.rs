//! Areas, normals and lengths of a mesh.

use super::{Mesh, vec3};

impl Mesh {
    /// Area of every triangle, `[m]`, in squared units of the file.
    pub fn face_areas(&self) -> Vec<f64> {
        (0..self.n_faces()).map(|f| self.face_area(f)).collect()
    }

    /// Area of triangle `face`, in squared units of the file.
    ///
    /// # Panics
    /// If there is no such triangle.
    pub fn face_area(&self, face: usize) -> f64 {
        0.5 * vec3::norm(self.face_cross(face))
    }

    /// Total area, in squared units of the file.
    pub fn area(&self) -> f64 {
        self.face_areas().iter().sum()
    }

    /// Square root of the total area, in the unit of the file: the length that every length parameter is relative to.
    pub fn scale(&self) -> f64 {
        self.area().sqrt()
    }

    /// Barycentric vertex areas, `[n]`, in squared units of the file: a third of the area of the triangles around each
    /// vertex. They sum to the area.
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
    ///
    /// # Panics
    /// If there is no such triangle.
    pub fn face_cross(&self, face: usize) -> [f64; 3] {
        let [a, b, c] = self.corners(face);
        vec3::cross(vec3::sub(b, a), vec3::sub(c, a))
    }

    /// Lowest and highest coordinates of all vertices, `[2, 3]`; `None` for a mesh without vertices.
    pub fn bounding_box(&self) -> Option<[[f64; 3]; 2]> {
        let mut vertices = self.vertices().iter();
        let &first = vertices.next()?;
        Some(vertices.fold([first, first], |[low, high], p| {
            let pick = |f: fn(f64, f64) -> f64, a: [f64; 3]| [0, 1, 2].map(|i| f(a[i], p[i]));
            [pick(f64::min, low), pick(f64::max, high)]
        }))
    }

    /// Length of the bounding box's diagonal, in the unit of the file; 0 for a mesh without vertices.
    pub fn diagonal(&self) -> f64 {
        self.bounding_box().map_or(0.0, |[low, high]| vec3::distance(low, high))
    }
}

/// Whether a triangle has no area to speak of: it is a point (no side is longer than 1e-12 of the mesh's `diagonal`) or
/// a line (its height is below 1e-10 of its longest side), so that its cotangents are rounding errors.
pub(super) fn is_degenerate([a, b, c]: [[f64; 3]; 3], diagonal: f64) -> bool {
    let (ab, ac) = (vec3::sub(b, a), vec3::sub(c, a));
    let longest = vec3::norm(ab).max(vec3::norm(ac)).max(vec3::distance(b, c));
    let twice_area = vec3::norm(vec3::cross(ab, ac));
    longest <= 1e-12 * diagonal || twice_area <= 1e-10 * longest * longest
}
