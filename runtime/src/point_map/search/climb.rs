//! Nearest neighbours from a guess, along the edges of a mesh.

use super::SearchError;
use super::kernels::Kernels;
use super::mutual::{Rows, check_pair};
use crate::mesh::Adjacency;
use rayon::prelude::*;

/// For each row of `queries`, `[q, d]`, a row of `targets`, `[n, d]`, that none of its neighbours is nearer than: downhill from
/// the best of its own guess, `starts[i]`, and of the guesses of the query's neighbours. Of equally near ones the lowest is taken.
///
/// On a surface in a space of many dimensions distances fall towards the nearest point over many edges, so that a guess a few
/// edges off leads to it. It costs some ten products a query, where a search costs `n`.
fn climb(
    [queries, targets]: [&Rows; 2],
    starts: &[u32],
    [around_query, around_target]: [&Adjacency; 2],
) -> Vec<u32> {
    let kernels = Kernels::detect();
    let from_guesses = |(i, &start): (usize, &u32)| {
        let row = queries.row(i);
        let mut known: Vec<u32> = Vec::with_capacity(64);
        let mut improve = |best: &mut (f32, u32), candidate: u32| {
            if known.contains(&candidate) {
                return;
            }
            known.push(candidate);
            let mut product = [0.0];
            kernels.inner_products(targets.row(candidate as usize), row, &mut product);
            let value = targets.half_square(candidate as usize) - product[0];
            if (value, candidate) < *best {
                *best = (value, candidate);
            }
        };
        let mut best = (f32::INFINITY, start);
        improve(&mut best, start);
        around_query.of(i).iter().for_each(|&neighbor| improve(&mut best, starts[neighbor as usize]));
        loop {
            let from = best.1;
            around_target.of(from as usize).iter().for_each(|&neighbor| improve(&mut best, neighbor));
            if best.1 == from {
                return from;
            }
        }
    };
    starts.par_iter().enumerate().map(from_guesses).collect()
}

/// For each row of `a` one of `b` that none of its neighbours is nearer than, and the other way round, from guesses in both
/// directions, a few edges off. The same for any number of threads.
///
/// # Errors
/// If a set is empty, an entry is not finite, or the widths differ.
pub(crate) fn mutual_climb(
    [a, b]: [&Rows; 2],
    [forth, back]: [&[u32]; 2],
    [around_a, around_b]: [&Adjacency; 2],
) -> Result<[Vec<u32>; 2], SearchError> {
    check_pair([a, b])?;
    Ok([climb([a, b], forth, [around_a, around_b]), climb([b, a], back, [around_b, around_a])])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Matrix;
    use crate::mesh::Topology;
    use crate::mesh::shapes::{bumpy_sphere, permuted};
    use crate::point_map::search::{nearest_rows, squared_norms};

    /// From guesses some edges off, the vertices of a lifted surface are found as by a search through all.
    #[test]
    fn guesses_lead_to_the_nearest_row() {
        let source = bumpy_sphere(4, 1);
        let (target, new_of_old) = permuted(&source, 3);
        let rows = |mesh: &crate::mesh::Mesh| {
            let lift = |p: [f64; 3], j: usize| [p[0], p[1], p[2], 0.3 * p[0] * p[1], (0.5 * p[2]).sin()][j];
            Matrix::from_fn(mesh.n_vertices(), 5, |i, j| lift(mesh.vertices()[i], j))
        };
        let (a, b) = (rows(&source).map(|x| 1.01 * x), rows(&target));
        let around = [&source, &target].map(|mesh| Topology::new(mesh).adjacency());
        let guesses = |found: &[u32], around: &Adjacency| -> Vec<u32> {
            let step = |v: u32| around.of(v as usize)[v as usize % 3];
            found.iter().map(|&v| step(step(step(step(v))))).collect()
        };
        let [forth, back] = [nearest_rows(&a, &b).unwrap().index, nearest_rows(&b, &a).unwrap().index];
        let starts = [guesses(&new_of_old, &around[1]), guesses(&back, &around[0])];
        assert!(starts[0] != forth);
        let sets = [&a, &b].map(|rows| Rows::rounded(rows, &squared_norms(rows)));
        let found = mutual_climb(sets.each_ref(), [&starts[0], &starts[1]], around.each_ref()).unwrap();
        assert_eq!(found, [forth, back]);
    }
}
