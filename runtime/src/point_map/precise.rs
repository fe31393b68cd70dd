//! Precise maps: points on the target's surface rather than its vertices (Ezuz and Ben-Chen 2017, "Deblurring and
//! denoising of maps between shapes").
//!
//! The target's triangles are triangles in the embedding too. The image of a source point is the point of them that
//! is nearest to its row. It lies on a triangle near the nearest vertex, so that only those are tried.

use super::search::squared_distance_single;
use crate::Matrix;
use crate::mesh::{Mesh, SurfacePoint, closest_weights};
use rayon::prelude::*;

/// The surface of a mesh in an embedding, ready for rows to be projected on it.
#[derive(Debug)]
pub struct EmbeddedSurface<'a> {
    mesh: &'a Mesh,
    rows: &'a Matrix<f32>,
    /// Triangles around each vertex: those of vertex `v` are `around[first[v]..first[v + 1]]`.
    first: Vec<u32>,
    around: Vec<u32>,
    /// Squared lengths in the embedding of the sides opposite the corners of each triangle.
    sides: Vec<[f64; 3]>,
}

/// A point of the embedded surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Where it is on the mesh.
    pub point: SurfacePoint,
    /// Squared distance in the embedding to what was projected.
    pub squared_distance: f64,
}

impl<'a> EmbeddedSurface<'a> {
    /// The surface of `mesh` whose vertices have the rows `rows`, `[n, d]`, in the embedding.
    ///
    /// # Panics
    /// If there is not a row for each vertex.
    pub fn new(mesh: &'a Mesh, rows: &'a Matrix<f32>) -> Self {
        assert_eq!(mesh.n_vertices(), rows.rows(), "one row for each vertex");
        let mut first = vec![0u32; mesh.n_vertices() + 1];
        mesh.faces().iter().flatten().for_each(|&v| first[v as usize + 1] += 1);
        (0..mesh.n_vertices()).for_each(|v| first[v + 1] += first[v]);
        let mut next = first.clone();
        let mut around = vec![0; 3 * mesh.n_faces()];
        for (face, corners) in mesh.faces().iter().enumerate() {
            for &v in corners {
                around[next[v as usize] as usize] = face as u32;
                next[v as usize] += 1;
            }
        }
        let side =
            |a: u32, b: u32| f64::from(squared_distance_single(rows.row(a as usize), rows.row(b as usize)));
        let sides = mesh.faces().par_iter().map(|&[a, b, c]| [side(b, c), side(c, a), side(a, b)]).collect();
        Self { mesh, rows, first, around, sides }
    }

    /// The nearest point to `row`, `[d]`, that can be reached downhill: over vertices from one of `starts`, then over
    /// triangles, of which all around the corners that the nearest point so far is between are tried. None where no
    /// triangle is there.
    ///
    /// # Panics
    /// If there is no such vertex, or the row has not `d` entries.
    pub fn project(&self, row: &[f32], starts: &[u32]) -> Option<Projection> {
        let mut distances = Distances { surface: self, row, known: Vec::with_capacity(40) };
        let better = |a: (f64, u32), b: (f64, u32)| if (b.0, b.1) < (a.0, a.1) { b } else { a };
        let lowest = starts.iter().map(|&start| distances.descend(start)).reduce(better)?.1;
        let mut best: Option<Projection> = None;
        let mut tried: Vec<u32> = Vec::with_capacity(32);
        let mut around = vec![lowest];
        while !around.is_empty() {
            let before = best;
            for face in around.drain(..).flat_map(|vertex| self.faces_around(vertex)) {
                if tried.contains(face) {
                    continue;
                }
                tried.push(*face);
                let found = distances.on_face(*face);
                if best.is_none_or(|best| found.squared_distance < best.squared_distance) {
                    best = Some(found);
                }
            }
            if let Some(found) = best.filter(|_| best != before) {
                let corners = self.mesh.faces()[found.point.face as usize];
                around.extend(
                    corners.iter().zip(found.point.weights).filter(|(_, w)| *w > 0.0).map(|(&v, _)| v),
                );
            }
        }
        best
    }

    /// [`EmbeddedSurface::project`] of many rows, `[q, d]`, each from its own start, `[q]`.
    ///
    /// # Panics
    /// As [`EmbeddedSurface::project`].
    pub fn project_all(&self, rows: &Matrix<f32>, starts: &[u32]) -> Vec<Option<SurfacePoint>> {
        let project = |(i, start): (usize, &u32)| Some(self.project(rows.row(i), &[*start])?.point);
        starts.par_iter().enumerate().map(project).collect()
    }

    fn faces_around(&self, vertex: u32) -> &[u32] {
        &self.around[self.first[vertex as usize] as usize..self.first[vertex as usize + 1] as usize]
    }
}

/// The distances from one row to vertices of the surface, each computed once.
struct Distances<'a> {
    surface: &'a EmbeddedSurface<'a>,
    row: &'a [f32],
    known: Vec<(u32, f64)>,
}

impl Distances<'_> {
    fn to(&mut self, vertex: u32) -> f64 {
        if let Some(&(_, distance)) = self.known.iter().find(|(v, _)| *v == vertex) {
            return distance;
        }
        let row = self.surface.rows.row(vertex as usize);
        let distance = f64::from(squared_distance_single(self.row, row));
        self.known.push((vertex, distance));
        distance
    }

    /// The vertex that no neighbour of is nearer to the row, downhill from `start`, and its distance.
    fn descend(&mut self, start: u32) -> (f64, u32) {
        let surface = self.surface;
        let mut best = (self.to(start), start);
        loop {
            let mut next = best;
            for &face in surface.faces_around(best.1) {
                for &vertex in &surface.mesh.faces()[face as usize] {
                    let distance = self.to(vertex);
                    if (distance, vertex) < next {
                        next = (distance, vertex);
                    }
                }
            }
            if next == best {
                return best;
            }
            best = next;
        }
    }

    /// The nearest point of a triangle.
    fn on_face(&mut self, face: u32) -> Projection {
        let to_corners = self.surface.mesh.faces()[face as usize].map(|v| self.to(v));
        let sides = self.surface.sides[face as usize];
        let weights = weights_of_nearest(to_corners, sides);
        let [u, v, w] = weights;
        let to_mean = u * to_corners[0] + v * to_corners[1] + w * to_corners[2];
        let spread = v * w * sides[0] + w * u * sides[1] + u * v * sides[2];
        Projection { point: SurfacePoint { face, weights }, squared_distance: (to_mean - spread).max(0.0) }
    }
}

/// The weights of the point of a triangle that is nearest to a point, in a space of any dimension: from the squared
/// distances to the corners and the squared lengths of the sides opposite them.
///
/// The triangle is laid into the plane with its first corner at the origin and its second on an axis.
fn weights_of_nearest([da, db, dc]: [f64; 3], [bc, ca, ab]: [f64; 3]) -> [f64; 3] {
    let length = ab.sqrt();
    if !(length > 0.0) {
        // Two corners coincide: as good as the segment from the first to the third.
        let t = if ca > 0.0 { ((da - dc + ca) / (2.0 * ca)).clamp(0.0, 1.0) } else { 0.0 };
        return [1.0 - t, 0.0, t];
    }
    let x = (ab + ca - bc) / (2.0 * length);
    let y = (ca - x * x).max(0.0).sqrt();
    let along = (da - db + ab) / (2.0 * length);
    let across = if y > 1e-9 * length { (da - dc + ca - 2.0 * along * x) / (2.0 * y) } else { 0.0 };
    closest_weights([along, across, 0.0], [[0.0; 3], [length, 0.0, 0.0], [x, y, 0.0]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::bumpy_sphere;
    use crate::mesh::{closest_points, vec3};

    fn positions(mesh: &Mesh) -> Matrix<f32> {
        Matrix::from_fn(mesh.n_vertices(), 3, |i, j| mesh.vertices()[i][j] as f32)
    }

    /// In space itself the nearest point is the closest point of the mesh.
    #[test]
    fn in_space_it_is_the_closest_point() {
        let mesh = bumpy_sphere(3, 1);
        let rows = positions(&mesh);
        let surface = EmbeddedSurface::new(&mesh, &rows);
        let queries: Vec<[f64; 3]> = mesh
            .faces()
            .iter()
            .enumerate()
            .map(|(face, _)| {
                let weights = [0.2, 0.3 + 0.1 * (face % 3) as f64, 0.5 - 0.1 * (face % 3) as f64];
                vec3::scale(SurfacePoint { face: face as u32, weights }.position(&mesh), 1.01)
            })
            .collect();
        for (query, closest) in queries.iter().zip(closest_points(&mesh, &queries)) {
            let start = closest.unwrap().nearest_vertex(&mesh);
            let found = surface.project(&query.map(|x| x as f32), &[start]).unwrap();
            let expected = vec3::distance(*query, closest.unwrap().position(&mesh));
            assert!((found.squared_distance.sqrt() - expected).abs() < 1e-5);
            assert!(vec3::distance(found.point.position(&mesh), closest.unwrap().position(&mesh)) < 1e-4);
        }
    }

    #[test]
    fn points_of_the_embedded_surface_are_found_from_afar() {
        let mesh = bumpy_sphere(3, 2);
        // A map into more dimensions, in which the surface stays smooth.
        let lift = |p: [f64; 3]| [p[0], p[1], p[2], 0.3 * p[0] * p[1], (0.5 * p[2]).sin()];
        let rows = Matrix::from_fn(mesh.n_vertices(), 5, |i, j| lift(mesh.vertices()[i])[j] as f32);
        let surface = EmbeddedSurface::new(&mesh, &rows);
        for face in (0..mesh.n_faces() as u32).step_by(7) {
            let point = SurfacePoint { face, weights: [0.25, 0.6, 0.15] };
            let row = point.interpolate(&mesh, &rows);
            let start = mesh.faces()[(face as usize * 31 + 5) % mesh.n_faces()][0];
            let found = surface.project(&row, &[start, mesh.faces()[face as usize][2]]).unwrap();
            assert!(found.squared_distance < 1e-8);
            assert!(vec3::distance(found.point.position(&mesh), point.position(&mesh)) < 1e-3);
        }
        let all = surface.project_all(&rows, &(0..mesh.n_vertices() as u32).collect::<Vec<_>>());
        assert!(all.iter().enumerate().all(|(v, p)| p.unwrap().nearest_vertex(&mesh) == v as u32));
    }

    #[test]
    fn flat_triangles_have_a_nearest_point_too() {
        assert_eq!(weights_of_nearest([1.0, 1.0, 0.0], [1.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
        assert_eq!(weights_of_nearest([0.0; 3], [0.0; 3]), [1.0, 0.0, 0.0]);
        // Three corners on a line, 0, 2 and 1; the point is at 0.5.
        let [u, v, w] = weights_of_nearest([0.25, 2.25, 0.25], [1.0, 1.0, 4.0]);
        assert!((2.0 * v + w - 0.5).abs() < 1e-12 && (u + v + w - 1.0).abs() < 1e-12);
    }
}
