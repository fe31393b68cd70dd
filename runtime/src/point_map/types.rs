//! A map from vertices to vertices, or to points on the surface.

use crate::mesh::SurfacePoint;

/// A point map `T: source -> target`: for each source vertex a target vertex, or none.
#[derive(Clone, Debug, PartialEq)]
pub struct PointMap {
    /// The target vertex of each source vertex, `[n_source]`, 0-based; [`PointMap::UNMATCHED`] where there is none.
    pub targets: Vec<u32>,
    /// How far each match can be trusted, `[n_source]`, from 0 to 1; `None` where that is not known.
    pub confidence: Option<Vec<f32>>,
    /// The point on the target's surface that each source vertex goes to, `[n_source]`, finer than its vertex; none
    /// where a vertex has no match. `None` where the map is not known finer than to a vertex.
    pub points: Option<Vec<Option<SurfacePoint>>>,
    /// Source vertices, ascending, that repair left out, of small pieces and of faces without area: each has the
    /// match of the nearest vertex that it kept.
    pub followers: Vec<u32>,
    /// Number of target vertices.
    pub n_target: usize,
}

impl PointMap {
    /// Stands for the target of a source vertex that has none.
    pub const UNMATCHED: u32 = u32::MAX;

    /// A map without confidences.
    pub fn new(targets: Vec<u32>, n_target: usize) -> Self {
        Self { targets, confidence: None, points: None, followers: Vec::new(), n_target }
    }

    /// Number of source vertices.
    pub fn len(&self) -> usize {
        self.targets.len()
    }

    /// Whether there are no source vertices.
    pub fn is_empty(&self) -> bool {
        self.targets.is_empty()
    }

    /// The target vertex of source vertex `source`, if there is such a vertex and it has one.
    pub fn get(&self, source: usize) -> Option<u32> {
        self.targets.get(source).copied().filter(|&target| target != Self::UNMATCHED)
    }

    /// Whether source vertex `source` has the match of another.
    pub fn follows(&self, source: usize) -> bool {
        u32::try_from(source).is_ok_and(|source| self.followers.binary_search(&source).is_ok())
    }

    /// The target of each source vertex in turn, `None` where it has none.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Option<u32>> + '_ {
        self.targets.iter().map(|&target| Some(target).filter(|&target| target != Self::UNMATCHED))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unmatched_vertices_have_no_target() {
        let map = PointMap::new(vec![1, PointMap::UNMATCHED], 2);
        assert_eq!((map.len(), map.is_empty()), (2, false));
        assert_eq!((map.get(0), map.get(1), map.get(2)), (Some(1), None, None));
        assert_eq!(map.iter().collect::<Vec<_>>(), [Some(1), None]);
    }
}
