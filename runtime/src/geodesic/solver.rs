//! Fast geodesic distances on one mesh, from many vertices.

use std::borrow::Cow;

use rayon::prelude::*;

use super::graph::LocalGraph;
use super::search::Search;
use super::surface::Surface;
use crate::mesh::{MeshError, Topology, UnionFind, vec3, weld_near};
use crate::{Matrix, Mesh};

/// How finely a [`GeodesicSolver`] works.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct GeodesicOptions {
    /// Each vertex is joined by exact straight lines to about this many nearest vertices. Twice as many take twice
    /// the time and leave a third of the error. From 8; default 150.
    pub n_neighbors: usize,
    /// Paths may turn by this angle, in radians, where they change from one straight line to the next (on top of
    /// what the curvature allows there). From 0.2 to pi; default 0.3. A larger angle is slower, and safer only on
    /// meshes whose edges vary in length by orders of magnitude.
    pub max_turn: f64,
}

impl Default for GeodesicOptions {
    fn default() -> Self {
        Self { n_neighbors: 150, max_turn: 0.3 }
    }
}

/// Geodesic distances on one mesh: exact at short range, within 0.03 % in the mean beyond it.
///
/// Building it finds the exact straight geodesics from every vertex to its neighbourhood, in parallel; a distance
/// is then the shortest chain of such lines. It is an upper bound of the exact distance ([`exact`](super::exact()))
/// and equal to it as long as the shortest path has no straight part longer than the neighbourhood.
///
/// Boundary vertices at one place, or 1e-5 of the diagonal apart, are one vertex, so meshes whose triangles share no
/// vertices are surfaces all the same. Where a closed surface touches itself, nothing is joined.
///
/// Lengths are in the mesh's unit. Vertices on another component are infinitely far. A boundary is an obstacle that
/// paths go around. Where more than two faces share an edge a path may pass between any two of them; at other
/// non-manifold vertices between any two of the fans that meet there. A face that names a vertex twice counts as the
/// edge it collapses to.
///
/// Results do not depend on the number of threads.
///
/// # Panics
/// All queries panic where an index is not a vertex of the mesh, which is a bug of the caller.
pub struct GeodesicSolver {
    graph: LocalGraph,
    positions: Vec<[f64; 3]>,
    /// For every vertex the first one at its place.
    welded: Vec<u32>,
    /// The lowest vertex of each vertex's component.
    component: Vec<u32>,
    bucket_width: f32,
    longest_edge: f32,
}

impl GeodesicSolver {
    /// Finds the straight geodesics around every vertex, in parallel. Options out of range are moved into it.
    pub fn new(mesh: &Mesh, options: &GeodesicOptions) -> Self {
        let welded = weld_boundaries(mesh);
        let component = components(mesh, &welded);
        let is_welded = welded.iter().enumerate().all(|(i, &v)| i == v as usize);
        let joined =
            if is_welded { Ok(Cow::Borrowed(mesh)) } else { with_faces(mesh, &welded).map(Cow::Owned) };
        let surface = Surface::new(joined.as_deref().unwrap_or(mesh));
        let max_turn = options.max_turn.clamp(0.2, std::f64::consts::PI);
        let graph = LocalGraph::new(&surface, options.n_neighbors.max(8), max_turn);
        let longest_edge = graph.edges.iter().fold(0.0f32, |longest, e| longest.max(e.length));
        let total: f64 = graph.edges.iter().map(|e| f64::from(e.length)).sum();
        let mean = (total / graph.edges.len().max(1) as f64) as f32;
        // Narrow enough to settle nearly in order, wide enough to keep the ring of buckets small.
        let bucket_width = (0.05 * mean).max(longest_edge / 4096.0);
        let bucket_width = if bucket_width > 0.0 { bucket_width } else { 1.0 };
        let positions = mesh.vertices().to_vec();
        Self { graph, positions, welded, component, bucket_width, longest_edge }
    }

    /// Number of vertices `n` of the mesh.
    pub fn n_vertices(&self) -> usize {
        self.graph.n_vertices()
    }

    /// Number of straight geodesics kept, counted in both directions.
    pub fn n_edges(&self) -> usize {
        self.graph.edges.len()
    }

    /// Distances from `source` to every vertex, `[n]`.
    pub fn from_source(&self, source: u32) -> Vec<f32> {
        self.from_nearest(&[source])
    }

    /// Writes the distances from `source` to every vertex into `distances`, which panics where that is not `[n]`.
    pub fn from_source_into(&self, source: u32, distances: &mut [f32]) {
        self.copy(self.search().run(&[self.welded[source as usize]]), distances);
    }

    /// Distances from the nearest of `sources` to every vertex, `[n]`; infinite without sources.
    pub fn from_nearest(&self, sources: &[u32]) -> Vec<f32> {
        let mut distances = vec![0.0; self.n_vertices()];
        self.copy(self.search().run(&self.at_places(sources)), &mut distances);
        distances
    }

    /// Distances from each of `sources` to every vertex, `[s, n]`, in parallel.
    pub fn from_sources(&self, sources: &[u32]) -> Matrix<f32> {
        let n = self.n_vertices();
        let mut distances = Matrix::zeros(sources.len(), n);
        self.fill_rows(&mut distances, sources, |row, all| self.copy(all, row));
        distances
    }

    /// Distances from `source` to `targets`, `[t]` in their order; looks no further than the farthest of them.
    pub fn to_targets(&self, source: u32, targets: &[u32]) -> Vec<f32> {
        let mut distances = vec![0.0; targets.len()];
        self.search().run_to(&[self.welded[source as usize]], &self.at_places(targets), &mut distances);
        distances
    }

    /// Whether there is a path between two vertices.
    pub fn are_connected(&self, a: u32, b: u32) -> bool {
        self.component[a as usize] == self.component[b as usize]
    }

    /// The distance of two vertices through space.
    fn straight_distance(&self, a: u32, b: u32) -> f64 {
        vec3::distance(self.positions[a as usize], self.positions[b as usize])
    }

    /// Distances between the vertices of a sample, symmetric `[m, m]`, in parallel.
    pub fn distances_between(&self, sample: &[u32]) -> Matrix<f32> {
        let mut distances = Matrix::zeros(sample.len(), sample.len());
        self.fill_rows(&mut distances, sample, |row, all| {
            for (value, &v) in row.iter_mut().zip(sample) {
                *value = all[self.welded[v as usize] as usize];
            }
        });
        symmetrize(&mut distances);
        distances
    }

    /// Distances between all vertices, symmetric `[n, n]`, in parallel; takes `4 n^2` bytes.
    pub fn all_pairs(&self) -> Matrix<f32> {
        let all: Vec<u32> = (0..self.n_vertices() as u32).collect();
        self.distances_between(&all)
    }

    /// Distance of each pair of vertices, `[pairs]`, in parallel. Between components no path leads, and the straight
    /// line through space counts: for matches, of which some are on the wrong component, that is the rule.
    ///
    /// Pairs are grouped by whichever of their vertices gives fewer groups, by the second where it does not matter,
    /// and each search ends at the farthest other vertex of its group: the distances of nearly correct matches to the
    /// correct ones cost next to nothing, and so do those of a map that sends everything to a few vertices.
    pub fn pair_distances(&self, pairs: &[(u32, u32)]) -> Vec<f32> {
        let mut pairs: Vec<(u32, u32)> =
            pairs.iter().map(|&(a, b)| (self.welded[a as usize], self.welded[b as usize])).collect();
        let distinct = |vertex: fn(&(u32, u32)) -> u32| {
            let mut vertices: Vec<u32> = pairs.iter().map(vertex).collect();
            vertices.sort_unstable();
            vertices.dedup();
            vertices.len()
        };
        if distinct(|pair| pair.0) < distinct(|pair| pair.1) {
            pairs.iter_mut().for_each(|(a, b)| std::mem::swap(a, b));
        }
        let mut distances = vec![0.0; pairs.len()];
        // No search reaches another component, and none is needed for a vertex itself.
        let mut order: Vec<u32> = Vec::with_capacity(pairs.len());
        for (i, &(a, b)) in pairs.iter().enumerate() {
            match self.are_connected(a, b) {
                true if a == b => {}
                true => order.push(i as u32),
                false => distances[i] = self.straight_distance(a, b) as f32,
            }
        }
        order.sort_unstable_by_key(|&i| (pairs[i as usize].1, i));
        let groups: Vec<&[u32]> =
            order.chunk_by(|&i, &j| pairs[i as usize].1 == pairs[j as usize].1).collect();
        let per_group: Vec<Vec<f32>> = groups
            .par_iter()
            .map_init(
                || self.search(),
                |search, group| {
                    let targets: Vec<u32> = group.iter().map(|&i| pairs[i as usize].0).collect();
                    let mut found = vec![0.0; targets.len()];
                    search.run_to(&[pairs[group[0] as usize].1], &targets, &mut found);
                    found
                },
            )
            .collect();
        for (&i, distance) in order.iter().zip(per_group.into_iter().flatten()) {
            distances[i as usize] = distance;
        }
        distances
    }

    /// The first vertices at the places of these.
    fn at_places(&self, vertices: &[u32]) -> Vec<u32> {
        vertices.iter().map(|&v| self.welded[v as usize]).collect()
    }

    /// Gives every vertex the distance of its place.
    fn copy(&self, of_places: &[f32], distances: &mut [f32]) {
        assert_eq!(distances.len(), self.n_vertices(), "a distance for every vertex");
        distances.iter_mut().zip(&self.welded).for_each(|(d, &place)| *d = of_places[place as usize]);
    }

    fn search(&self) -> Search<'_> {
        Search::new(&self.graph, self.bucket_width, self.longest_edge)
    }

    fn fill_rows(&self, rows: &mut Matrix<f32>, sources: &[u32], write: impl Fn(&mut [f32], &[f32]) + Sync) {
        if rows.cols() == 0 {
            return;
        }
        let cols = rows.cols();
        rows.data_mut().par_chunks_mut(cols).zip(sources).for_each_init(
            || self.search(),
            |search, (row, &source)| write(row, search.run(&[self.welded[source as usize]])),
        );
    }
}

/// For every vertex the first one at its place, where both are on a boundary; else itself.
fn weld_boundaries(mesh: &Mesh) -> Vec<u32> {
    let places = weld_near(mesh);
    let mut welded: Vec<u32> = (0..mesh.n_vertices() as u32).collect();
    if places == welded {
        return welded;
    }
    let topology = Topology::new(mesh);
    let mut on_boundary = vec![false; mesh.n_vertices()];
    for edge in topology.boundary_edges() {
        topology.edges()[edge as usize].iter().for_each(|&v| on_boundary[v as usize] = true);
    }
    // The first boundary vertex of each place.
    let mut first = vec![None; mesh.n_vertices()];
    for v in (0..mesh.n_vertices()).filter(|&v| on_boundary[v]) {
        welded[v] = *first[places[v] as usize].get_or_insert(v as u32);
    }
    welded
}

/// The mesh with other faces of the same vertices.
fn with_faces(mesh: &Mesh, welded: &[u32]) -> Result<Mesh, MeshError> {
    let faces = mesh.faces().iter().map(|face| face.map(|v| welded[v as usize])).collect();
    Mesh::new(mesh.vertices().to_vec(), faces)
}

/// The lowest vertex of each vertex's component.
fn components(mesh: &Mesh, welded: &[u32]) -> Vec<u32> {
    let mut sets = UnionFind::new(mesh.n_vertices());
    for face in mesh.faces() {
        let [a, b, c] = face.map(|v| welded[v as usize]);
        sets.union(a, b);
        sets.union(a, c);
    }
    welded.iter().map(|&v| sets.find(v)).collect()
}

/// Takes the shorter of the two directions: both are upper bounds.
fn symmetrize(distances: &mut Matrix<f32>) {
    const TILE: usize = 64;
    let n = distances.rows();
    let data = distances.data_mut();
    for (i0, j0) in (0..n).step_by(TILE).flat_map(|i| (0..=i).step_by(TILE).map(move |j| (i, j))) {
        for i in i0..(i0 + TILE).min(n) {
            for j in j0..(j0 + TILE).min(i) {
                let shorter = data[i * n + j].min(data[j * n + i]);
                (data[i * n + j], data[j * n + i]) = (shorter, shorter);
            }
        }
    }
}
