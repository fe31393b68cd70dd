//! Points on the surface of a mesh, which need not be vertices.

use super::{Mesh, triangle};
use crate::Matrix;
use crate::numeric::Real;

/// A point on a mesh: a triangle and the barycentric weights of its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The triangle, 0-based.
    pub face: u32,
    /// Weights of its corners, in the order of the triangle: none is negative, and they sum to 1.
    pub weights: [f64; 3],
}

impl SurfacePoint {
    /// The corner number `corner`, 0 to 2, of a triangle.
    ///
    /// # Panics
    /// If `corner` is above 2.
    pub fn at_corner(face: u32, corner: usize) -> Self {
        let mut weights = [0.0; 3];
        weights[corner] = 1.0;
        Self { face, weights }
    }

    /// Its position, in the unit of the mesh.
    ///
    /// # Panics
    /// If the mesh has no such triangle.
    pub fn position(&self, mesh: &Mesh) -> [f64; 3] {
        triangle::weighted(mesh.corners(self.face as usize), self.weights)
    }

    /// The corner of largest weight, the first of several.
    ///
    /// # Panics
    /// If the mesh has no such triangle.
    pub fn nearest_vertex(&self, mesh: &Mesh) -> u32 {
        let [u, v, w] = self.weights;
        let corner = if u >= v && u >= w { 0 } else { 1 + usize::from(w > v) };
        mesh.faces()[self.face as usize][corner]
    }

    /// The mean of the rows of the three corners by their weights, `[d]`: the value at this point of `d` functions
    /// that are linear on every triangle. `values` is `[n, d]`, a row for each vertex of the mesh.
    ///
    /// # Panics
    /// If the mesh has no such triangle, or the matrix has no such row.
    pub fn interpolate<T: Real>(&self, mesh: &Mesh, values: &Matrix<T>) -> Vec<T> {
        let [a, b, c] = mesh.faces()[self.face as usize].map(|i| values.row(i as usize));
        let [u, v, w] = self.weights.map(T::from_double);
        a.iter().zip(b).zip(c).map(|((&a, &b), &c)| u * a + v * b + w * c).collect()
    }
}

/// Every vertex as a point on the mesh, `[n]`: a corner of the first triangle that has it; `None` for a vertex of no
/// triangle.
pub fn vertices_on_surface(mesh: &Mesh) -> Vec<Option<SurfacePoint>> {
    let mut points = vec![None; mesh.n_vertices()];
    for (face, corners) in mesh.faces().iter().enumerate() {
        for (corner, &vertex) in corners.iter().enumerate() {
            points[vertex as usize].get_or_insert(SurfacePoint::at_corner(face as u32, corner));
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::{bumpy_sphere, with_unreferenced_vertices};

    #[test]
    fn positions_are_interpolated_like_any_other_function() {
        let mesh = bumpy_sphere(2, 1);
        let positions = Matrix::from_fn(mesh.n_vertices(), 3, |i, j| mesh.vertices()[i][j]);
        for (face, weights) in [(0, [0.2, 0.3, 0.5]), (17, [1.0, 0.0, 0.0]), (99, [0.0, 0.75, 0.25])] {
            let point = SurfacePoint { face, weights };
            let interpolated = point.interpolate(&mesh, &positions);
            assert!(interpolated.iter().zip(point.position(&mesh)).all(|(a, b)| (a - b).abs() < 1e-15));
            let heaviest = (0..3).max_by(|&a, &b| weights[a].total_cmp(&weights[b])).unwrap();
            assert_eq!(point.nearest_vertex(&mesh), mesh.faces()[face as usize][heaviest]);
        }
        let tie = SurfacePoint { face: 3, weights: [0.25, 0.375, 0.375] };
        assert_eq!(tie.nearest_vertex(&mesh), mesh.faces()[3][1]);
    }

    #[test]
    fn vertices_are_points_at_their_own_place() {
        let mesh = with_unreferenced_vertices();
        let points = vertices_on_surface(&mesh);
        for (vertex, point) in points.iter().enumerate() {
            let used = mesh.faces().iter().flatten().any(|&i| i as usize == vertex);
            assert_eq!(point.is_some(), used);
            if let Some(point) = point {
                assert_eq!(point.position(&mesh), mesh.vertices()[vertex]);
                assert_eq!(point.nearest_vertex(&mesh), vertex as u32);
            }
        }
        assert!(points.iter().any(Option::is_none) && points.iter().any(Option::is_some));
    }
}
