//! What cannot be drawn or carried over.

use crate::Mesh;
use crate::mesh::MeshError;
use crate::point_map::PointMap;
use thiserror::Error;

/// Why a map cannot be drawn or followed.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum RenderError {
    /// The map is not of this source.
    #[error(
        "the map has {found} source vertices, but the source mesh has {n_source}; pass the map of these meshes"
    )]
    Source {
        /// Vertices of the map.
        found: usize,
        /// Vertices of the mesh.
        n_source: usize,
    },
    /// The map is not of this target.
    #[error(
        "source vertex {source_vertex} is matched to vertex {vertex}, but the target mesh has {n_target} (both counted from 0); \
         pass the map of these meshes"
    )]
    Target {
        /// The vertex that is matched.
        source_vertex: usize,
        /// Its match.
        vertex: u32,
        /// Vertices of the mesh.
        n_target: usize,
    },
    /// Donors are not of this receiving mesh.
    #[error("{found} vertices receive, but the receiving mesh has {n_receiver}; pass the meshes of the map")]
    Receiver {
        /// Vertices that receive.
        found: usize,
        /// Vertices of the mesh.
        n_receiver: usize,
    },
    /// Donors are not of this giving mesh, or a landmark is none of its vertices.
    #[error(
        "vertex {vertex} gives, but the giving mesh has {n_giver} (counted from 0), or as many values; pass what belongs to \
         the map"
    )]
    Giver {
        /// The vertex.
        vertex: usize,
        /// Vertices of the mesh, or rows of the values.
        n_giver: usize,
    },
    /// A point of the map is on no triangle of this target.
    #[error(
        "the map names triangle {face}, but the target mesh has {n_faces} (counted from 0); pass the meshes of the map"
    )]
    Face {
        /// The triangle.
        face: u32,
        /// Triangles of the mesh.
        n_faces: usize,
    },
    /// The attributes are not those of the giving mesh.
    #[error("{problem}; {remedy}")]
    Attributes {
        /// What is wrong.
        problem: String,
        /// What to do.
        remedy: &'static str,
    },
    /// Both shapes do not make one mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
}

/// Checks that every match is a vertex of the target.
pub(super) fn check_target(map: &PointMap, target: &Mesh) -> Result<(), RenderError> {
    let n_target = target.n_vertices();
    let outside = |(_, matched): &(usize, Option<u32>)| matched.is_some_and(|v| v as usize >= n_target);
    match map.iter().enumerate().find(outside) {
        Some((source_vertex, Some(vertex))) => Err(RenderError::Target { source_vertex, vertex, n_target }),
        _ => Ok(()),
    }
}

/// Checks that a map is one of these meshes.
pub(super) fn check_map(map: &PointMap, source: &Mesh, target: &Mesh) -> Result<(), RenderError> {
    if map.len() != source.n_vertices() {
        return Err(RenderError::Source { found: map.len(), n_source: source.n_vertices() });
    }
    check_target(map, target)
}

#[cfg(test)]
mod tests {
    use super::super::{Donors, ViewerPair, pair_picture, side_by_side, viewer_html};
    use super::*;
    use crate::mesh::shapes::icosphere;

    #[test]
    fn a_map_of_other_meshes_is_refused_wherever_it_is_followed() {
        let (small, large) = (icosphere(0), icosphere(1));
        let beyond = PointMap::new(vec![41; 12], 42);
        let page = |source, target, map| {
            let pair =
                ViewerPair { title: "", name_source: "", name_target: "", source, target, map, caption: "" };
            viewer_html(&pair).unwrap_err()
        };
        let target = RenderError::Target { source_vertex: 0, vertex: 41, n_target: 12 };
        assert_eq!(side_by_side(&small, &small, &beyond).unwrap_err(), target);
        assert_eq!(pair_picture(&small, &small, &beyond, 40).unwrap_err(), target);
        assert_eq!(page(&small, &small, &beyond), target);
        assert_eq!(Donors::of_target(&beyond, &small).unwrap_err(), target);
        let source = RenderError::Source { found: 12, n_source: 42 };
        assert_eq!(side_by_side(&large, &large, &beyond).unwrap_err(), source);
        assert_eq!(page(&large, &large, &beyond), source);
        assert!(target.to_string().contains("vertex 41, but the target mesh has 12"));
    }
}
