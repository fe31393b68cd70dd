//! Who neighbours whom on a triangle mesh, and paths along its edges.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use fmnet::mesh::vec3;

use super::math::Vec3;

/// For each vertex the vertices it shares an edge with, ascending.
pub(super) struct Adjacency {
    first: Vec<u32>,
    neighbors: Vec<u32>,
}

impl Adjacency {
    pub(super) fn new(n_vertices: usize, faces: &[[u32; 3]]) -> Self {
        let edges = faces.iter().flat_map(|&[a, b, c]| [(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)]);
        let mut lists: Vec<Vec<u32>> = vec![Vec::with_capacity(14); n_vertices];
        for (from, to) in edges {
            lists[from as usize].push(to);
        }
        let (mut first, mut neighbors) = (vec![0], Vec::with_capacity(3 * faces.len()));
        for list in &mut lists {
            list.sort_unstable();
            list.dedup();
            neighbors.extend_from_slice(list);
            first.push(neighbors.len() as u32);
        }
        Self { first, neighbors }
    }

    /// Neighbours of vertex `i`.
    pub(super) fn of(&self, i: usize) -> &[u32] {
        &self.neighbors[self.first[i] as usize..self.first[i + 1] as usize]
    }

    /// Mean of a function over the neighbours of vertex `i`, which has some.
    pub(super) fn mean(&self, i: usize, values: &[f32]) -> f32 {
        let around = self.of(i);
        around.iter().map(|&j| values[j as usize]).sum::<f32>() / around.len().max(1) as f32
    }

    /// Shortest paths along edges from any of `sources`: for each vertex the length of its path and the index in
    /// `sources` of where it starts, or infinity and `None` beyond `limit`. Ties go to the earlier source.
    pub(super) fn nearest_sources(
        &self,
        points: &[Vec3],
        sources: &[u32],
        limit: f64,
    ) -> Vec<(f64, Option<u32>)> {
        let mut result = vec![(f64::INFINITY, None); points.len()];
        // Non-negative distances compare like their bits.
        let mut queue = BinaryHeap::with_capacity(2 * sources.len());
        for (index, &source) in sources.iter().enumerate() {
            if result[source as usize].1.is_none() {
                result[source as usize] = (0.0, Some(index as u32));
                queue.push(Reverse((0u64, index as u32, source)));
            }
        }
        while let Some(Reverse((bits, index, vertex))) = queue.pop() {
            let distance = f64::from_bits(bits);
            if result[vertex as usize] != (distance, Some(index)) {
                continue;
            }
            for &next in self.of(vertex as usize) {
                let longer = distance + vec3::distance(points[vertex as usize], points[next as usize]);
                if longer <= limit && longer < result[next as usize].0 {
                    result[next as usize] = (longer, Some(index));
                    queue.push(Reverse((longer.to_bits(), index, next)));
                }
            }
        }
        result
    }
}

/// For each vertex the label of its connected component; labels count up from 0 in order of first vertices.
pub(super) fn components(n_vertices: usize, faces: &[[u32; 3]]) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..n_vertices as u32).collect();
    fn root(parent: &mut [u32], mut i: u32) -> u32 {
        while parent[i as usize] != i {
            parent[i as usize] = parent[parent[i as usize] as usize];
            i = parent[i as usize];
        }
        i
    }
    for &[a, b, c] in faces {
        for (i, j) in [(a, b), (b, c)] {
            let (i, j) = (root(&mut parent, i), root(&mut parent, j));
            parent[i.max(j) as usize] = i.min(j);
        }
    }
    let mut labels = vec![0; n_vertices];
    let mut count = 0;
    for i in 0..n_vertices {
        let r = root(&mut parent, i as u32) as usize;
        if r == i {
            labels[i] = count;
            count += 1;
        } else {
            labels[i] = labels[r];
        }
    }
    labels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_triangles_are_two_components() {
        assert_eq!(components(6, &[[0, 2, 4], [1, 3, 5]]), [0, 1, 0, 1, 0, 1]);
    }

    #[test]
    fn nearest_sources_follow_edges() {
        let points: Vec<Vec3> = (0..4).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        let strip = Adjacency::new(4, &[[0, 1, 1], [1, 2, 2], [2, 3, 3]]);
        let paths = strip.nearest_sources(&points, &[3, 0], 1.5);
        assert_eq!(paths, [(0.0, Some(1)), (1.0, Some(1)), (1.0, Some(0)), (0.0, Some(0))]);
    }
}
