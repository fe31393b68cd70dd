//! Nearest neighbours from guesses, along the edges of two meshes.
//!
//! On a surface in a space of many dimensions distances fall towards the nearest point over many edges, so that a
//! guess a few edges off leads to it. It costs some ten products a query, where a search costs as many as there are
//! targets. The guesses come from samples of both meshes, which are compared with each other.

use super::SearchError;
use super::kernels::Kernels;
use super::mutual::{Rows, check_pair, mutual_nearest};
use crate::mesh::{Adjacency, Mesh, Topology, farthest_point_sampling};
use crate::point_map::PointMap;
use rayon::prelude::*;

/// Samples for each eigenfunction that maps are told by, and fewest samples: from 5 on maps are as good as those of
/// all vertices.
const SAMPLES_OF_EACH: usize = 5;
const FEWEST_SAMPLES: usize = 1000;

/// The edges of a pair of meshes, source and target, and samples of their vertices.
pub(crate) struct AlongEdges {
    shapes: [Edges; 2],
}

impl AlongEdges {
    /// Of two meshes, with samples enough for `k` eigenfunctions.
    pub(crate) fn new([source, target]: [&Mesh; 2], k: usize) -> Self {
        let count = FEWEST_SAMPLES.max(SAMPLES_OF_EACH * k);
        let (source, target) = rayon::join(|| Edges::new(source, count), || Edges::new(target, count));
        Self { shapes: [source, target] }
    }

    /// Whether the samples are a part of the vertices of both meshes, so that it pays to begin with them.
    pub(crate) fn pays(&self) -> bool {
        self.shapes.iter().all(|shape| 2 * shape.follows.len() > 3 * shape.samples.len())
    }

    /// The samples of source and target.
    pub(crate) fn samples(&self) -> [&[u32]; 2] {
        self.shapes.each_ref().map(|shape| &shape.samples[..])
    }

    /// The matches of the samples in maps of all vertices, source to target first; none where one of them has no match.
    pub(crate) fn images_of_samples(&self, maps: [&PointMap; 2]) -> Option<[Vec<u32>; 2]> {
        let of = |i: usize| {
            let image = |&sample: &u32| maps[i].get(sample as usize);
            self.shapes[i].samples.iter().map(image).collect::<Option<Vec<u32>>>()
        };
        Some([of(0)?, of(1)?])
    }

    /// The area around each sample of source and target, of areas of their vertices: that of the vertices that follow
    /// it.
    pub(crate) fn areas(&self, of_vertices: [&[f64]; 2]) -> [Vec<f64>; 2] {
        std::array::from_fn(|i| self.shapes[i].areas(of_vertices[i]))
    }

    /// For each sample of the source a row of the target that none of its neighbours is nearer than, and the other
    /// way round; downhill from the match before, and from the nearest of the other shape's samples.
    ///
    /// `queries` are the rows of the samples, `targets` those of all vertices of source and target. The queries of
    /// the source and the target's rows are in one space, those of the target and the source's rows in one, which may
    /// be another one. The same for any number of threads.
    ///
    /// # Errors
    /// If a set is empty, an entry is not finite, or the widths differ.
    pub(crate) fn nearest_of_samples(
        &self,
        queries: [&Rows; 2],
        targets: [&Rows; 2],
        before: [&[u32]; 2],
    ) -> Result<[Vec<u32>; 2], SearchError> {
        check_pair([queries[0], targets[1]])?;
        check_pair([queries[1], targets[0]])?;
        let [source, target] = &self.shapes;
        let samples = mutual_nearest([queries[0], &targets[1].select(&target.samples)])?;
        let of = |i: usize, other: &Edges| {
            let guesses = |query: usize, out: &mut Vec<u32>| {
                out.push(before[i][query]);
                out.push(other.samples[samples[i][query] as usize]);
            };
            climb(queries[i], targets[1 - i], &other.around, &guesses)
        };
        Ok([of(0, target), of(1, source)])
    }

    /// For each row of the source one of the target that none of its neighbours is nearer than, and the other way
    /// round; downhill from the matches of the samples that the vertices around follow. Of equally near ones the
    /// lowest is taken. The same for any number of threads.
    ///
    /// # Errors
    /// If a set is empty, an entry is not finite, or the widths differ.
    pub(crate) fn nearest(
        &self,
        [a, b]: [&Rows; 2],
        of_samples: [&[u32]; 2],
    ) -> Result<[Vec<u32>; 2], SearchError> {
        check_pair([a, b])?;
        let [source, target] = &self.shapes;
        let of = |own: &Edges, other: &Edges, [queries, targets]: [&Rows; 2], found: &[u32]| {
            let match_of = |vertex: u32| found[own.follows[vertex as usize] as usize];
            let guesses = |query: usize, out: &mut Vec<u32>| {
                out.push(match_of(query as u32));
                out.extend(own.around.of(query).iter().map(|&near| match_of(near)));
            };
            climb(queries, targets, &other.around, &guesses)
        };
        Ok([of(source, target, [a, b], of_samples[0]), of(target, source, [b, a], of_samples[1])])
    }

    /// Maps of all vertices from matches among the samples, source to target first; all but the samples are unmatched.
    pub(crate) fn maps_of_samples(&self, found: [Vec<u32>; 2]) -> [PointMap; 2] {
        std::array::from_fn(|i| {
            let (own, other) = (&self.shapes[i], &self.shapes[1 - i]);
            let mut targets = vec![PointMap::UNMATCHED; own.follows.len()];
            for (&sample, &image) in own.samples.iter().zip(&found[i]) {
                targets[sample as usize] = other.samples[image as usize];
            }
            PointMap::new(targets, other.follows.len())
        })
    }
}

/// The edges of a mesh, and samples of its vertices.
struct Edges {
    around: Adjacency,
    /// Vertices as far from each other as so many can be.
    samples: Vec<u32>,
    /// For each vertex the index of the sample that is the fewest edges away; the first where there is none.
    follows: Vec<u32>,
}

impl Edges {
    fn new(mesh: &Mesh, count: usize) -> Self {
        let around = Topology::new(mesh).adjacency();
        let samples = farthest_point_sampling(mesh, count, 0);
        let follows = nearest_by_edges(&around, &samples);
        Self { around, samples, follows }
    }

    fn areas(&self, of_vertices: &[f64]) -> Vec<f64> {
        let mut areas = vec![0.0; self.samples.len()];
        self.follows.iter().zip(of_vertices).for_each(|(&sample, area)| areas[sample as usize] += area);
        areas
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

/// For each row of `queries`, `[q, d]`, a row of `targets`, `[n, d]`, that none of its neighbours is nearer than:
/// downhill from the best of what `guesses` gives for its index.
fn climb(
    queries: &Rows,
    targets: &Rows,
    around: &Adjacency,
    guesses: &(dyn Fn(usize, &mut Vec<u32>) + Sync),
) -> Vec<u32> {
    let kernels = Kernels::detect();
    let from_guesses = |(known, given): &mut (Vec<u32>, Vec<u32>), i: usize| {
        let row = queries.row(i);
        known.clear();
        given.clear();
        guesses(i, given);
        let mut best = (f32::INFINITY, given[0]);
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
        given.iter().for_each(|&guess| improve(&mut best, guess));
        loop {
            let from = best.1;
            around.of(from as usize).iter().for_each(|&near| improve(&mut best, near));
            if best.1 == from {
                return from;
            }
        }
    };
    (0..queries.n()).into_par_iter().map_init(Default::default, from_guesses).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Matrix;
    use crate::mesh::shapes::{bumpy_sphere, permuted};
    use crate::point_map::search::{nearest_rows, squared_norms};

    fn lifted(mesh: &Mesh) -> Matrix {
        let lift = |p: [f64; 3], j: usize| [p[0], p[1], p[2], 0.3 * p[0] * p[1], (0.5 * p[2]).sin()][j];
        Matrix::from_fn(mesh.n_vertices(), 5, |i, j| lift(mesh.vertices()[i], j))
    }

    /// The vertices of a lifted surface are found from samples as by a search through all, and so are the samples,
    /// whatever their guess.
    #[test]
    fn samples_lead_to_the_nearest_row() {
        let source = bumpy_sphere(4, 1);
        let target = permuted(&source, 3).0;
        let (a, b) = (lifted(&source).map(|x| 1.01 * x), lifted(&target));
        let exact = [nearest_rows(&a, &b).unwrap().index, nearest_rows(&b, &a).unwrap().index];
        let edges = AlongEdges::new([&source, &target], 10);
        assert!(edges.pays() && edges.samples().iter().all(|samples| samples.len() == 1000));
        let [a, b] = [&a, &b].map(|rows| Rows::rounded(rows, &squared_norms(rows)));
        let queries = [a.select(edges.samples()[0]), b.select(edges.samples()[1])];
        let among = edges.maps_of_samples(mutual_nearest(queries.each_ref()).unwrap());
        let found = edges.images_of_samples(among.each_ref()).unwrap();
        assert_eq!(edges.nearest([&a, &b], [&found[0], &found[1]]).unwrap(), exact);
        let nowhere = vec![0; 1000];
        let found = edges.nearest_of_samples(queries.each_ref(), [&a, &b], [&nowhere, &nowhere]).unwrap();
        for i in 0..2 {
            let expected: Vec<u32> = edges.samples()[i].iter().map(|&s| exact[i][s as usize]).collect();
            assert_eq!(found[i], expected);
        }
    }

    #[test]
    fn the_areas_around_the_samples_are_those_of_the_vertices() {
        let mesh = bumpy_sphere(4, 2);
        let edges = AlongEdges::new([&mesh, &mesh], 300);
        let areas = mesh.vertex_areas();
        let [around, _] = edges.areas([&areas, &areas]);
        assert_eq!(around.len(), 1500);
        assert!((around.iter().sum::<f64>() - areas.iter().sum::<f64>()).abs() < 1e-9);
        assert!(around.iter().all(|&area| area > 0.0));
        let identity = PointMap::new((0..mesh.n_vertices() as u32).collect(), mesh.n_vertices());
        let images = edges.images_of_samples([&identity, &identity]).unwrap();
        assert_eq!([&images[0][..], &images[1][..]], edges.samples());
        let mut hole = identity.clone();
        hole.targets[edges.samples()[1][7] as usize] = PointMap::UNMATCHED;
        assert_eq!(edges.images_of_samples([&identity, &hole]), None);
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
