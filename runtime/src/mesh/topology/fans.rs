//! Fans: the runs of faces around a vertex.

use super::{NONE, Topology};
use crate::mesh::union_find::UnionFind;

/// The corners of all faces, grouped by vertex into fans: runs of faces joined by edges. A manifold vertex has one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fans {
    /// `[3 m]` the fan of corner `3 f + c`; [`NONE`] where face `f` repeats a vertex.
    pub of_corner: Vec<u32>,
    /// The vertex of each fan, `[n_fans]`, ascending; the fans of one vertex are in the order of their first corner.
    pub vertex_of_fan: Vec<u32>,
}

impl Topology<'_> {
    /// The fans where faces are joined by edges of exactly two faces.
    pub fn fans(&self) -> Fans {
        let inner = (0..self.edges.len()).map(|e| self.half_edges(e)).filter(|h| h.len() == 2);
        self.fans_joined_by(inner.map(|h| [h[0], h[1]]))
    }

    /// The fans where faces are joined by the given pairs of half-edges, each pair along one edge.
    pub(in crate::mesh) fn fans_joined_by(&self, pairs: impl Iterator<Item = [u32; 2]>) -> Fans {
        let mut corners = UnionFind::new(3 * self.faces.len());
        for [g, h] in pairs {
            let [g_start, g_end] = corners_of(g);
            let [h_start, h_end] = corners_of(h);
            let same_direction = self.ends(g)[0] == self.ends(h)[0];
            let (start, end) = if same_direction { (h_start, h_end) } else { (h_end, h_start) };
            corners.union(g_start, start);
            corners.union(g_end, end);
        }
        self.numbered(corners)
    }

    /// Numbers the sets of corners by vertex, then by first corner.
    fn numbered(&self, mut corners: UnionFind) -> Fans {
        let n_corners = 3 * self.faces.len() as u32;
        let proper = |corner: u32| self.edge_of_half_edge[corner as usize] != NONE;
        let vertex_of = |corner: u32| self.faces[corner as usize / 3][corner as usize % 3];
        let mut roots: Vec<(u32, u32)> = (0..n_corners)
            .filter(|&corner| proper(corner) && corners.find(corner) == corner)
            .map(|corner| (vertex_of(corner), corner))
            .collect();
        roots.sort_unstable();
        let mut of_corner = vec![NONE; n_corners as usize];
        for (fan, &(_, root)) in roots.iter().enumerate() {
            of_corner[root as usize] = fan as u32;
        }
        for corner in (0..n_corners).filter(|&corner| proper(corner)) {
            of_corner[corner as usize] = of_corner[corners.find(corner) as usize];
        }
        Fans { of_corner, vertex_of_fan: roots.into_iter().map(|(vertex, _)| vertex).collect() }
    }
}

/// The corners at the start and the end of a half-edge.
fn corners_of(half_edge: u32) -> [u32; 2] {
    [half_edge, half_edge - half_edge % 3 + (half_edge % 3 + 1) % 3]
}
