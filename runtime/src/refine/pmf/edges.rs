//! Edges of the source that go to edges of the target.

use crate::Mesh;
use crate::mesh::{Adjacency, Topology};
use crate::point_map::PointMap;

/// The narrowest kernel there is: one for vertices joined by an edge, zero for others.
pub(super) struct EdgeTerm {
    source: Adjacency,
    target: Adjacency,
    weight: f64,
}

impl EdgeTerm {
    /// `weight` is the gain for each edge that goes to an edge, in squared spacings.
    pub(super) fn new([source, target]: [&Mesh; 2], weight: f64) -> Self {
        let adjacency = |mesh| Topology::new(mesh).adjacency();
        Self { source: adjacency(source), target: adjacency(target), weight }
    }

    /// What `x` gains by going to `y` while the others go where they do at `present`.
    pub(super) fn gain(&self, x: usize, y: u32, present: &[u32]) -> f64 {
        self.weight * self.kept_at(x, y, present) as f64
    }

    /// The share of the source's edges that go to edges.
    pub(super) fn kept(&self, present: &[u32]) -> f64 {
        let kept: usize = (0..present.len())
            .filter(|&x| present[x] != PointMap::UNMATCHED)
            .map(|x| self.kept_at(x, present[x], present))
            .sum();
        kept as f64 / self.source.neighbors.len().max(1) as f64
    }

    fn kept_at(&self, x: usize, y: u32, present: &[u32]) -> usize {
        let near = self.target.of(y as usize);
        self.source.of(x).iter().filter(|&&v| near.binary_search(&present[v as usize]).is_ok()).count()
    }
}
