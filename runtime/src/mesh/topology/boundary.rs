//! Boundary loops.

use super::Topology;

impl Topology<'_> {
    /// The boundary loops as vertices in order, each begun at its lowest half-edge and in that one's direction.
    ///
    /// A loop follows the rim of the faces: two holes that touch in a vertex are one loop that passes it twice. At a
    /// non-manifold edge a loop ends, and what lies on the other side is a loop of its own.
    pub fn boundary_loops(&self) -> Vec<Vec<u32>> {
        let mut seen = vec![false; self.edges.len()];
        let mut starts: Vec<u32> =
            self.boundary_edges().iter().map(|&e| self.half_edges(e as usize)[0]).collect();
        starts.sort_unstable();
        let mut loops = Vec::new();
        for start in starts {
            if !seen[self.edge_of(start) as usize] {
                loops.push(self.loop_from(start, &mut seen));
            }
        }
        loops
    }

    fn loop_from(&self, start: u32, seen: &mut [bool]) -> Vec<u32> {
        let [first, mut head] = self.ends(start);
        let mut vertices = vec![first];
        let mut half_edge = start;
        seen[self.edge_of(start) as usize] = true;
        while let Some(next) = self.next_on_boundary(half_edge, head) {
            let edge = self.edge_of(next) as usize;
            if seen[edge] {
                return vertices;
            }
            seen[edge] = true;
            vertices.push(head);
            head = other_end(self.edges[edge], head);
            half_edge = next;
        }
        vertices.push(head);
        vertices
    }

    /// Turns about `pivot` from a boundary half-edge through the faces to the next boundary half-edge; `None` at a
    /// non-manifold edge. Faces may be of either orientation.
    fn next_on_boundary(&self, half_edge: u32, pivot: u32) -> Option<u32> {
        let mut current = half_edge;
        loop {
            let crossed = self.edge_of(current);
            let face = current - current % 3;
            let next = (face..face + 3)
                .find(|&h| self.edge_of(h) != crossed && self.ends(h).contains(&pivot))
                .expect("two sides of a proper face meet in each corner");
            match *self.half_edges(self.edge_of(next) as usize) {
                [_] => return Some(next),
                [g, h] => current = if g == next { h } else { g },
                _ => return None,
            }
        }
    }
}

fn other_end([i, j]: [u32; 2], end: u32) -> u32 {
    if i == end { j } else { i }
}
