//! Connected components.

use super::{NONE, Topology};
use crate::mesh::union_find::UnionFind;

/// The connected components of the vertices, where the vertices of a face are connected.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Components {
    /// `[n]` the component of each vertex; [`NONE`] for a vertex of no face.
    pub of_vertex: Vec<u32>,
    /// How many components there are; they are numbered by their lowest vertex.
    pub count: usize,
}

impl Topology<'_> {
    /// The connected components of the vertices.
    pub fn components(&self) -> Components {
        let proper = |f: &usize| self.edge_of_half_edge[3 * f] != NONE;
        components((0..self.faces.len()).filter(proper).map(|f| self.faces[f]), self.n_vertices)
    }
}

/// The connected components of the vertices, below `n_vertices`, of some faces.
pub(in crate::mesh) fn components(faces: impl Iterator<Item = [u32; 3]>, n_vertices: usize) -> Components {
    let mut sets = UnionFind::new(n_vertices);
    let mut of_vertex = vec![NONE; n_vertices];
    for [i, j, k] in faces {
        sets.union(i, j);
        sets.union(i, k);
        // Any label but NONE: the vertex has a face.
        [i, j, k].iter().for_each(|&v| of_vertex[v as usize] = 0);
    }
    let mut count = 0;
    for vertex in 0..n_vertices as u32 {
        if of_vertex[vertex as usize] == NONE {
            continue;
        }
        // The root is the lowest vertex of its set, so it is labelled before the others ask for its label.
        let root = sets.find(vertex);
        of_vertex[vertex as usize] = if root == vertex {
            count += 1;
            count - 1
        } else {
            of_vertex[root as usize]
        };
    }
    Components { of_vertex, count: count as usize }
}
