//! Nearest neighbours from guesses, along the edges of two meshes.
//!
//! On a surface in a space of many dimensions distances fall towards the nearest point over many edges, so that a guess a few
//! edges off leads to it. It costs some ten products a query, where a search costs as many as there are targets.

use super::SearchError;
use super::kernels::Kernels;
use super::mutual::{Rows, check_pair, mutual_nearest};
use crate::mesh::{Adjacency, Mesh, Topology, area_weighted_sampling};
use rayon::prelude::*;

/// Vertices of each shape that are compared with each other where the guesses may be wrong.
const SAMPLES: usize = 1000;

/// What the search begins with.
#[derive(Clone, Copy)]
pub(crate) enum Guesses<'a> {
    /// The nearest samples of the other shape to samples of this one, which all vertices around follow.
    Samples,
    /// These matches, source to target first.
    Matches(&'a [Vec<u32>; 2]),
    /// Both.
    MatchesAndSamples(&'a [Vec<u32>; 2]),
}

/// The edges of a pair of meshes, source and target, and samples of their vertices.
pub(crate) struct AlongEdges {
    shapes: [Edges; 2],
}

impl AlongEdges {
    /// Of two meshes and the areas of their vertices.
    pub(crate) fn new(meshes: [&Mesh; 2], areas: [&[f64]; 2]) -> Self {
        Self { shapes: [Edges::new(meshes[0], areas[0]), Edges::new(meshes[1], areas[1])] }
    }

    /// For each row of the source one of the target that none of its neighbours is nearer than, and the other way round. Of
    /// equally near ones the lowest is taken. The same for any number of threads.
    ///
    /// # Errors
    /// If a set is empty, an entry is not finite, or the widths differ.
    pub(crate) fn nearest(&self, [a, b]: [&Rows; 2], guesses: Guesses) -> Result<[Vec<u32>; 2], SearchError> {
        check_pair([a, b])?;
        let [edges_a, edges_b] = &self.shapes;
        let (own, sampled) = match guesses {
            Guesses::Samples => (None, Some(self.of_samples([a, b])?)),
            Guesses::Matches(own) => (Some(own), None),
            Guesses::MatchesAndSamples(own) => (Some(own), Some(self.of_samples([a, b])?)),
        };
        let of = |direction: usize| {
            let sets = own.into_iter().chain(&sampled).map(|both| &both[direction][..]);
            sets.collect::<Vec<_>>()
        };
        Ok([climb([a, b], &of(0), [edges_a, edges_b]), climb([b, a], &of(1), [edges_b, edges_a])])
    }

    /// For each vertex of both shapes the match of the sample that it follows.
    fn of_samples(&self, [a, b]: [&Rows; 2]) -> Result<[Vec<u32>; 2], SearchError> {
        let [samples_a, samples_b] = self.shapes.each_ref().map(|shape| &shape.samples);
        let [forth, back] = mutual_nearest([&a.select(samples_a), &b.select(samples_b)])?;
        let follow = |shape: &Edges, found: &[u32], others: &[u32]| -> Vec<u32> {
            shape.sample_of.iter().map(|&sample| others[found[sample as usize] as usize]).collect()
        };
        let [edges_a, edges_b] = &self.shapes;
        Ok([follow(edges_a, &forth, samples_b), follow(edges_b, &back, samples_a)])
    }
}

/// The edges of a mesh, and samples of its vertices.
struct Edges {
    around: Adjacency,
    /// Vertices drawn by area.
    samples: Vec<u32>,
    /// For each vertex the index of the sample that is the fewest edges away; the first where there is none.
    sample_of: Vec<u32>,
}

impl Edges {
    fn new(mesh: &Mesh, areas: &[f64]) -> Self {
        let around = Topology::new(mesh).adjacency();
        let samples = area_weighted_sampling(areas, SAMPLES, 0);
        let sample_of = nearest_by_edges(&around, &samples);
        Self { around, samples, sample_of }
    }
}

/// For each vertex the index of the sample that is the fewest edges away, of several one; 0 where none can be reached.
fn nearest_by_edges(around: &Adjacency, samples: &[u32]) -> Vec<u32> {
    const NONE: u32 = u32::MAX;
    let mut nearest = vec![NONE; around.offsets.len() - 1];
    samples.iter().enumerate().for_each(|(i, &sample)| nearest[sample as usize] = i as u32);
    let mut front = samples.to_vec();
    while !front.is_empty() {
        let mut next = Vec::new();
        for &from in &front {
            for &to in around.of(from as usize) {
                if nearest[to as usize] == NONE {
                    nearest[to as usize] = nearest[from as usize];
                    next.push(to);
                }
            }
        }
        front = next;
    }
    nearest.into_iter().map(|sample| if sample == NONE { 0 } else { sample }).collect()
}

/// For each row of `queries`, `[q, d]`, a row of `targets`, `[n, d]`, that none of its neighbours is nearer than: downhill from
/// the best of its own guesses, one in each of `guesses`, `[q]`, and of those of the query's neighbours.
fn climb([queries, targets]: [&Rows; 2], guesses: &[&[u32]], [of_query, of_target]: [&Edges; 2]) -> Vec<u32> {
    let kernels = Kernels::detect();
    let from_guesses = |i: usize| {
        let row = queries.row(i);
        let mut known: Vec<u32> = Vec::with_capacity(64);
        let mut best = (f32::INFINITY, guesses[0][i]);
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
        for guesses in guesses {
            improve(&mut best, guesses[i]);
            of_query.around.of(i).iter().for_each(|&near| improve(&mut best, guesses[near as usize]));
        }
        loop {
            let from = best.1;
            of_target.around.of(from as usize).iter().for_each(|&near| improve(&mut best, near));
            if best.1 == from {
                return from;
            }
        }
    };
    (0..queries.n()).into_par_iter().map(from_guesses).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Matrix;
    use crate::mesh::shapes::{bumpy_sphere, permuted};
    use crate::point_map::search::{nearest_rows, squared_norms};

    /// From guesses some edges off, or from samples, the vertices of a lifted surface are found as by a search through all.
    #[test]
    fn guesses_lead_to_the_nearest_row() {
        let source = bumpy_sphere(4, 1);
        let (target, new_of_old) = permuted(&source, 3);
        let rows = |mesh: &Mesh| {
            let lift = |p: [f64; 3], j: usize| [p[0], p[1], p[2], 0.3 * p[0] * p[1], (0.5 * p[2]).sin()][j];
            Matrix::from_fn(mesh.n_vertices(), 5, |i, j| lift(mesh.vertices()[i], j))
        };
        let (a, b) = (rows(&source).map(|x| 1.01 * x), rows(&target));
        let exact = [nearest_rows(&a, &b).unwrap().index, nearest_rows(&b, &a).unwrap().index];
        let areas = vec![1.0; source.n_vertices()];
        let edges = AlongEdges::new([&source, &target], [&areas, &areas]);
        let off = |found: &[u32], around: &Adjacency| -> Vec<u32> {
            let step = |v: u32| around.of(v as usize)[v as usize % 3];
            found.iter().map(|&v| step(step(step(step(v))))).collect()
        };
        let near = [off(&new_of_old, &edges.shapes[1].around), off(&exact[1], &edges.shapes[0].around)];
        assert!(near[0] != exact[0]);
        let far = [&b, &a].map(|rows| vec![0; rows.rows()]);
        let sets = [&a, &b].map(|rows| Rows::rounded(rows, &squared_norms(rows)));
        for guesses in [Guesses::Matches(&near), Guesses::Samples, Guesses::MatchesAndSamples(&far)] {
            assert_eq!(edges.nearest(sets.each_ref(), guesses).unwrap(), exact);
        }
    }

    /// Every vertex follows the sample that the fewest edges lead to; where none leads to one, the first.
    #[test]
    fn vertices_follow_the_nearest_sample() {
        let strip = |first: u32| (first..first + 3).map(|i| [i, i + 1, i + 2]);
        let vertices = (0..10).map(|i| [f64::from(i / 2), f64::from(i % 2), 0.0]).collect();
        let mesh = Mesh::new(vertices, strip(0).chain(strip(5)).collect()).unwrap();
        let around = Topology::new(&mesh).adjacency();
        assert_eq!(nearest_by_edges(&around, &[4, 0]), [1, 1, 0, 0, 0, 0, 0, 0, 0, 0]);
    }
}
