//! Nearest neighbours of every vertex in an embedding.

use crate::Matrix;
use crate::point_map::transport;
use rayon::prelude::*;

/// Vertices whose distances to all are computed by one product.
const BLOCK: usize = 128;

/// The nearest vertices of each vertex, itself first.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Neighborhoods {
    size: usize,
    vertices: Vec<u32>,
}

impl Neighborhoods {
    /// The `size` rows of `embedding`, `[n, d]`, nearest to each row (all, if there are fewer), nearest first, ties
    /// by index.
    ///
    /// Looks at all pairs: a partition of the rows does not help, because heat kernels tell rows apart only at short
    /// range, and all others are about equally far. Takes `8 BLOCK n` bytes for each thread.
    pub(super) fn new(embedding: &Matrix, size: usize) -> Self {
        let n = embedding.rows();
        let size = size.min(n);
        let squared: Vec<f64> = (0..n).map(|i| embedding.row(i).iter().map(|x| x * x).sum()).collect();
        let mut vertices = vec![0; n * size];
        vertices.par_chunks_mut((BLOCK * size).max(1)).enumerate().for_each(|(block, found)| {
            let members: Vec<u32> = (0..found.len() / size).map(|i| (block * BLOCK + i) as u32).collect();
            let products = transport(&embedding.select_rows(&members), embedding);
            for (i, (&vertex, found)) in members.iter().zip(found.chunks_mut(size)).enumerate() {
                let distance = |u: usize| squared[u] - 2.0 * products[(i, u)];
                found.copy_from_slice(&nearest(vertex, n, size, distance));
            }
        });
        Self { size, vertices }
    }

    /// The nearest vertices of a vertex, itself first.
    pub(super) fn of(&self, vertex: u32) -> &[u32] {
        &self.vertices[vertex as usize * self.size..(vertex as usize + 1) * self.size]
    }
}

/// The `size` of `n` vertices with the least `distance`, `vertex` itself first.
fn nearest(vertex: u32, n: usize, size: usize, distance: impl Fn(usize) -> f64) -> Vec<u32> {
    let of = |u: usize| if u == vertex as usize { f64::NEG_INFINITY } else { distance(u) };
    let mut near: Vec<(f64, u32)> = (0..n).map(|u| (of(u), u as u32)).collect();
    let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    if size < n {
        near.select_nth_unstable_by(size, order);
        near.truncate(size);
    }
    near.sort_unstable_by(order);
    near.into_iter().map(|entry| entry.1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fmap::test_basis::rectangle;
    use crate::point_map::search::squared_distance;

    #[test]
    fn neighbors_are_those_of_a_scan() {
        let embedding = rectangle(30, 40, 60).eigenvectors;
        let found = Neighborhoods::new(&embedding, 12);
        // By distance: on a regular grid many neighbours are equally far.
        let distance =
            |v: u32, u: u32| squared_distance(embedding.row(v as usize), embedding.row(u as usize)).sqrt();
        for v in 0..1200 {
            let mut all: Vec<f64> = (0..1200).map(|u| distance(v, u)).collect();
            all.sort_unstable_by(f64::total_cmp);
            let near: Vec<f64> = found.of(v).iter().map(|&u| distance(v, u)).collect();
            assert!(near.iter().zip(&all).all(|(a, b)| (a - b).abs() < 1e-6), "{v}: {near:?}");
            assert_eq!(found.of(v)[0], v);
        }
    }

    #[test]
    fn fewer_vertices_than_asked_for_are_all_there() {
        let embedding = rectangle(30, 40, 60).eigenvectors.select_rows(&[3, 9, 700]);
        let found = Neighborhoods::new(&embedding, 12);
        assert_eq!((found.of(1)[0], found.of(1).len()), (1, 3));
    }
}
