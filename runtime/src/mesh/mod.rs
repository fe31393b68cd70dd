//! Triangle meshes: the type, what can be wrong with one, its repair, its reduction and its subdivision.

mod closest_point;
mod decimate;
mod geometry;
mod nearest;
mod repair;
mod sampling;
pub mod shapes;
mod subdivide;
mod surface_point;
#[cfg(test)]
mod test_data;
mod topology;
mod triangle;
mod union_find;
mod validate;
pub mod vec3;

pub use closest_point::{ClosestPoint, carried_points, closest_points};
pub use decimate::{DecimateError, DecimateOptions, Decimated, decimate};
pub use nearest::{nearest_k_vertices, nearest_vertices};
pub use repair::{RepairError, RepairOptions, RepairReport, Repaired, repair};
pub(crate) use repair::{repeated_faces, weld_near};
pub use sampling::{area_weighted_sampling, farthest_point_sampling, farthest_point_sampling_by};
pub use subdivide::{Subdivided, subdivide};
pub use surface_point::{SurfacePoint, vertices_on_surface};
pub use topology::{Adjacency, Components, Fans, NONE, Topology};
pub use triangle::closest_weights;
pub(crate) use union_find::UnionFind;
pub use validate::{ComponentSize, Found, MeshReport, inspect};

use thiserror::Error;

/// A triangle mesh: vertex positions in the file's own unit, and triangles of 0-based vertex indices.
///
/// Every index is in range and every coordinate finite; anything else a real mesh may have (holes, several
/// components, non-manifold edges, duplicate or unreferenced vertices, degenerate faces) is allowed here.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Mesh {
    vertices: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
}

/// Why vertices and faces do not make a [`Mesh`].
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum MeshError {
    /// A face names a vertex that does not exist.
    #[error(
        "face {face} refers to vertex {index}, but there are only {n_vertices} vertices (0-based); correct it or remove the face"
    )]
    IndexOutOfRange {
        /// The face, 0-based.
        face: usize,
        /// The vertex it names.
        index: u32,
        /// How many vertices there are.
        n_vertices: usize,
    },
    /// A vertex has a coordinate that is NaN or infinite.
    #[error(
        "vertex {vertex} has a coordinate that is not finite: {position:?}; correct it or remove the vertex"
    )]
    NotFinite {
        /// The vertex, 0-based.
        vertex: usize,
        /// Its position.
        position: [f64; 3],
    },
    /// More vertices than a 32-bit index can name.
    #[error("{n_vertices} vertices are more than the {} supported; decimate or split the mesh", u32::MAX - 1)]
    TooLarge {
        /// How many vertices there are.
        n_vertices: usize,
    },
}

impl Mesh {
    /// Checks that every face index is in range and every coordinate finite.
    ///
    /// # Errors
    /// If an index is out of range, a coordinate is not finite, or there are more vertices than 32-bit indices can
    /// name.
    pub fn new(vertices: Vec<[f64; 3]>, faces: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        let n_vertices = vertices.len();
        if n_vertices >= u32::MAX as usize {
            return Err(MeshError::TooLarge { n_vertices });
        }
        if let Some(vertex) = vertices.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(MeshError::NotFinite { vertex, position: vertices[vertex] });
        }
        for (face, corners) in faces.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&i| i as usize >= n_vertices) {
                return Err(MeshError::IndexOutOfRange { face, index, n_vertices });
            }
        }
        Ok(Self { vertices, faces })
    }

    /// Vertex positions, `[n, 3]`.
    pub fn vertices(&self) -> &[[f64; 3]] {
        &self.vertices
    }

    /// Triangles, `[m, 3]` vertex indices, in an oriented mesh counter-clockwise seen from outside.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// Number of vertices `n`.
    pub fn n_vertices(&self) -> usize {
        self.vertices.len()
    }

    /// Number of triangles `m`.
    pub fn n_faces(&self) -> usize {
        self.faces.len()
    }

    /// The positions of the three corners of triangle `face`, `[3, 3]`.
    ///
    /// # Panics
    /// If there is no such triangle.
    pub fn corners(&self, face: usize) -> [[f64; 3]; 3] {
        self.faces[face].map(|i| self.vertices[i as usize])
    }
}
