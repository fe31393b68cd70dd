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
        let mut sets = UnionFind::new(self.n_vertices);
        let mut of_vertex = vec![NONE; self.n_vertices];
        for &[i, j] in &self.edges {
            sets.union(i, j);
            // Any label but NONE: the vertex has a face.
            of_vertex[i as usize] = 0;
            of_vertex[j as usize] = 0;
        }
        let mut count = 0;
        for vertex in 0..self.n_vertices as u32 {
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
}
