//! Nearest vertices in space, by a k-d tree.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use std::num::NonZeroUsize;

/// For each query point the index of the nearest of `points`, `[q]`. Ties go to any of the nearest.
///
/// # Panics
/// If `points` is empty or has a coordinate that is not finite while there are queries.
pub fn nearest_vertices(points: &[[f64; 3]], queries: &[[f64; 3]]) -> Vec<u32> {
    nearest_k_vertices(points, queries, 1)
}

/// For each query point the indices of the `count` nearest of `points`, nearest first, `[q, count]`; where there are
/// fewer points the last one repeats.
///
/// # Panics
/// If `points` is empty or has a coordinate that is not finite while there are queries, or `count` is 0.
pub fn nearest_k_vertices(points: &[[f64; 3]], queries: &[[f64; 3]], count: usize) -> Vec<u32> {
    if queries.is_empty() {
        return Vec::new();
    }
    let tree: ImmutableKdTree<f64, 3> =
        ImmutableKdTree::new_from_slice(points).expect("finite points make a tree");
    let wanted = NonZeroUsize::new(count).expect("count is at least 1");
    let mut nearest = Vec::with_capacity(queries.len() * count);
    for query in queries {
        let found = tree.query(query).nearest_n::<SquaredEuclidean<f64>>(wanted).execute();
        let last = found.last().expect("there are points").item;
        nearest.extend(found.iter().map(|n| n.item));
        nearest.extend((found.len()..count).map(|_| last));
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::bumpy_sphere;
    use crate::mesh::vec3;

    #[test]
    fn the_tree_finds_what_a_scan_finds() {
        let mesh = bumpy_sphere(2, 1);
        let queries: Vec<[f64; 3]> =
            mesh.vertices().iter().map(|p| [p[0] + 0.03, p[1] - 0.02, p[2] * 1.1]).collect();
        let found = nearest_k_vertices(mesh.vertices(), &queries, 3);
        for (q, query) in queries.iter().enumerate() {
            let mut all: Vec<f64> = mesh.vertices().iter().map(|p| vec3::distance(*p, *query)).collect();
            let distance = |i: usize| all[found[3 * q + i] as usize];
            let three = [distance(0), distance(1), distance(2)];
            all.sort_by(f64::total_cmp);
            assert_eq!(three.to_vec(), all[..3], "query {q}");
        }
    }
}
