//! Decimation by quadric error edge contraction.

mod contraction;
mod quadric;

use super::{Mesh, Topology, topology::NONE};
use contraction::{Contraction, Limits};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// How [`decimate`](decimate()) chooses its contractions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct DecimateOptions {
    /// Keep every boundary vertex. Default false: boundary vertices are contracted too, along the boundary only and by
    /// the error that this makes in its curve, so that a finely scanned rim gets no more than its share of vertices.
    pub lock_boundary: bool,
    /// Weight of the distance a vertex moves, against its distance to the planes of the surface. From 0 (fewest
    /// vertices where the surface is flat, in long triangles) to 1 (evenly spread), default 0.001: even enough for a
    /// good Laplacian.
    pub evenness: f64,
}

impl Default for DecimateOptions {
    fn default() -> Self {
        Self { lock_boundary: false, evenness: 1e-3 }
    }
}

/// A mesh of fewer vertices, all of them the full mesh's.
#[derive(Clone, Debug, PartialEq)]
pub struct Decimated {
    /// The mesh: manifold, of the topology of the full mesh, every vertex in some face.
    pub mesh: Mesh,
    /// The full mesh's vertex of each vertex, `[n]`, strictly ascending.
    pub injection: Vec<u32>,
}

/// Why a mesh cannot be decimated.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum DecimateError {
    /// Fewer vertices than a closed surface has.
    #[error("decimation to {target} vertices leaves no surface; ask for 4 or more")]
    TargetTooSmall {
        /// The number asked for.
        target: usize,
    },
    /// An edge has more than two faces, or a vertex more than one fan of them.
    #[error("the mesh is not manifold at vertex {vertex}; repair it before the decimation")]
    NotManifold {
        /// The vertex, 0-based; an end of the edge.
        vertex: u32,
    },
    /// An option is out of range.
    #[error("evenness is {value}, but must be between 0 and 1")]
    Evenness {
        /// The value given.
        value: f64,
    },
}

/// Contracts edges of a manifold mesh, such as [`repair`](super::repair()) gives, until `target` vertices are left.
///
/// The order is that of the quadric error (Garland and Heckbert, Surface simplification using quadric error metrics,
/// 1997), in passes over all edges. An edge is contracted to one of its ends: the vertices that remain are vertices of
/// the full mesh, at their places, and the injection is exact. Only contractions that keep the topology are made (the
/// link condition of Dey, Edelsbrunner, Guha and Nekhayev, Topology preserving edge contraction, 1999): components,
/// handles and holes are kept and a manifold stays one. They make no fold and no sliver unless the target demands it.
///
/// A mesh of no more vertices comes back as it is. More than `target` are left only where the topology does not allow
/// fewer (4 for a sphere, 3 for each boundary, all of the boundary where it is locked), or where hardly an edge
/// remains whose contraction makes no face of a height below 1e-4 of its longest side. Time is `O(n log n)`.
///
/// # Errors
/// For a mesh of more than `target` vertices, if `target` is below 4, an option is out of range, or the mesh is not
/// manifold.
pub fn decimate(mesh: &Mesh, target: usize, options: &DecimateOptions) -> Result<Decimated, DecimateError> {
    if mesh.n_vertices() <= target {
        return Ok(Decimated { mesh: mesh.clone(), injection: (0..mesh.n_vertices() as u32).collect() });
    }
    if target < 4 {
        return Err(DecimateError::TargetTooSmall { target });
    }
    if !(0.0..=1.0).contains(&options.evenness) {
        return Err(DecimateError::Evenness { value: options.evenness });
    }
    let topology = Topology::new(mesh);
    let edges = topology.non_manifold_edges().into_iter().map(|e| topology.edges()[e as usize][0]);
    if let Some(vertex) = edges.chain(topology.non_manifold_vertices()).next() {
        return Err(DecimateError::NotManifold { vertex });
    }
    let mut contraction = Contraction::new(mesh, &topology, options);
    drop(topology);
    for limits in Limits::LEVELS {
        contraction.run(target, limits);
    }
    Ok(compact(mesh, &contraction.into_faces()))
}

/// The faces on the vertices they use.
fn compact(mesh: &Mesh, faces: &[[u32; 3]]) -> Decimated {
    let mut new_of_old = vec![NONE; mesh.n_vertices()];
    faces.iter().flatten().for_each(|&i| new_of_old[i as usize] = 0);
    let injection: Vec<u32> =
        (0..mesh.n_vertices() as u32).filter(|&i| new_of_old[i as usize] != NONE).collect();
    for (new, &old) in injection.iter().enumerate() {
        new_of_old[old as usize] = new as u32;
    }
    let vertices = injection.iter().map(|&i| mesh.vertices()[i as usize]).collect();
    let faces = faces.iter().map(|face| face.map(|i| new_of_old[i as usize])).collect();
    Decimated { mesh: Mesh::new(vertices, faces).expect("a part of a valid mesh is valid"), injection }
}

#[cfg(test)]
mod tests;
