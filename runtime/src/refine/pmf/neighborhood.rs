//! Nearest neighbours of every vertex in an embedding.

use crate::Matrix;
use crate::point_map::search::{SearchError, nearest_rows, squared_distance};
use rayon::prelude::*;

/// Vertices in a cell, about.
const CELL: usize = 24;
/// Cells that are searched, the vertex's own among them.
const CELLS_SEARCHED: usize = 12;

/// The nearest vertices of each vertex, itself first.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Neighborhoods {
    size: usize,
    vertices: Vec<u32>,
}

impl Neighborhoods {
    /// The `size` rows of `embedding`, `[n, d]`, nearest to each row (all, if there are fewer), nearest first; `centers` are some
    /// of the rows, evenly spread.
    ///
    /// Rows are looked for in the Voronoi cells of the centres next to the row's own, which finds all but a few.
    pub(super) fn new(embedding: &Matrix, centers: &[u32], size: usize) -> Result<Self, SearchError> {
        let n = embedding.rows();
        let size = size.min(n);
        let center_rows = embedding.select_rows(centers);
        let mut cells = vec![Vec::new(); centers.len()];
        for (vertex, &cell) in nearest_rows(embedding, &center_rows)?.index.iter().enumerate() {
            cells[cell as usize].push(vertex as u32);
        }
        let of_cell = |cell: usize| {
            let around = members_around(&center_rows, &cells, cell, size);
            let near = |&vertex: &u32| (vertex, nearest_among(embedding, vertex, &around, size));
            cells[cell].iter().map(near).collect::<Vec<_>>()
        };
        let found: Vec<_> = (0..cells.len()).into_par_iter().map(of_cell).collect();
        let mut vertices = vec![0; n * size];
        for (vertex, near) in found.into_iter().flatten() {
            vertices[vertex as usize * size..(vertex as usize + 1) * size].copy_from_slice(&near);
        }
        Ok(Self { size, vertices })
    }

    /// The nearest vertices of a vertex, itself first.
    pub(super) fn of(&self, vertex: u32) -> &[u32] {
        &self.vertices[vertex as usize * self.size..(vertex as usize + 1) * self.size]
    }
}

/// A number of centres that makes cells of the size that [`Neighborhoods::new`] is fast with.
pub(super) fn n_centers(n: usize) -> usize {
    n.div_ceil(CELL)
}

/// The vertices of the cells nearest to a cell, itself first; more cells where they hold fewer than `size` vertices.
fn members_around(centers: &Matrix, cells: &[Vec<u32>], cell: usize, size: usize) -> Vec<u32> {
    let mut order: Vec<(f64, usize)> = (0..cells.len())
        .map(|other| (squared_distance(centers.row(cell), centers.row(other)), other))
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut members = Vec::new();
    for (rank, &(_, other)) in order.iter().enumerate() {
        if rank >= CELLS_SEARCHED && members.len() >= size {
            break;
        }
        members.extend_from_slice(&cells[other]);
    }
    members
}

fn nearest_among(embedding: &Matrix, vertex: u32, among: &[u32], size: usize) -> Vec<u32> {
    let here = embedding.row(vertex as usize);
    let distance = |&other: &u32| (squared_distance(here, embedding.row(other as usize)), other);
    let mut near: Vec<(f64, u32)> = among.iter().map(distance).collect();
    let itself = |entry: &(f64, u32)| entry.1 != vertex;
    let order = |a: &(f64, u32), b: &(f64, u32)| {
        itself(a).cmp(&itself(b)).then(a.0.total_cmp(&b.0)).then(a.1.cmp(&b.1))
    };
    if near.len() > size {
        near.select_nth_unstable_by(size - 1, order);
        near.truncate(size);
    }
    near.sort_unstable_by(order);
    near.into_iter().map(|entry| entry.1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fmap::test_basis::rectangle;
    use crate::refine::sampling::farthest_points;

    #[test]
    fn neighbors_are_those_of_a_scan() {
        let basis = rectangle(30, 40, 60);
        let centers = farthest_points(&basis, n_centers(basis.n()));
        // High frequencies count little, as in the embeddings of the filter.
        let weight = |j: usize| 1.0 / (basis.eigenvalues[j] + basis.eigenvalues[1]);
        let embedding = Matrix::from_fn(basis.n(), basis.k(), |i, j| basis.eigenvectors[(i, j)] * weight(j));
        let found = Neighborhoods::new(&embedding, &centers, 12).unwrap();
        let all: Vec<u32> = (0..1200).collect();
        // On a grid many neighbours are equally far, so what counts is how far they are.
        let is_near = |v: u32, other: u32| {
            let distance = |w: u32| squared_distance(embedding.row(v as usize), embedding.row(w as usize));
            let last = nearest_among(&embedding, v, &all, 12)[11];
            distance(other) <= distance(last) * (1.0 + 1e-9)
        };
        let near: usize = (0..1200).map(|v| found.of(v).iter().filter(|&&w| is_near(v, w)).count()).sum();
        assert!(near as f64 > 0.99 * (1200.0 * 12.0), "{near} of {}", 1200 * 12);
        assert!((0..1200).all(|v| found.of(v)[0] == v));
        let few = Neighborhoods::new(&embedding.select_rows(&[3, 9, 700]), &[0, 2], 12).unwrap();
        assert_eq!(few.of(1)[0], 1);
        assert_eq!(few.of(1).len(), 3);
    }
}
