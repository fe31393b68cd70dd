//! All straight geodesics from one vertex to its neighbourhood.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::surface::Surface;
use super::window::{Hit, Window, open_windows};

/// Relative slack within which two lengths of the same path agree.
const ROUNDING: f64 = 1e-9;
/// Windows that one search may open, for each neighbour sought. Clean surfaces stay far below; where faces lie on
/// each other or share edges by the dozen their number would double at every crossing. Beyond it the lines found so
/// far have to do.
const WINDOWS_PER_NEIGHBOR: usize = 200;

/// Finds the straight geodesics out of one vertex after another, with working memory that is reused.
pub(super) struct LocalSearch<'a> {
    surface: &'a Surface,
    /// Edges of the mesh at each vertex as (neighbour, length).
    edges: &'a [Vec<(u32, f64)>],
    /// Upper bounds on the distance from the source; infinite where nothing is known.
    bounds: Vec<f64>,
    touched: Vec<u32>,
    heap: BinaryHeap<Nearest>,
    windows: Vec<Window>,
}

struct Nearest {
    distance: f64,
    vertex: u32,
}

impl PartialEq for Nearest {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Nearest {}

impl PartialOrd for Nearest {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Nearest {
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance.total_cmp(&self.distance).then(other.vertex.cmp(&self.vertex))
    }
}

impl<'a> LocalSearch<'a> {
    pub(super) fn new(surface: &'a Surface, edges: &'a [Vec<(u32, f64)>]) -> Self {
        Self {
            surface,
            edges,
            bounds: vec![f64::INFINITY; surface.n_vertices()],
            touched: Vec::new(),
            heap: BinaryHeap::new(),
            windows: Vec::new(),
        }
    }

    /// The straight geodesics from `source` that may be shortest paths, to within the distance along edges to its
    /// `n_neighbors`-th nearest vertex; at most one for each vertex, in the order of vertices.
    pub(super) fn straight_geodesics(&mut self, source: u32, n_neighbors: usize) -> Vec<Hit> {
        let radius = self.bound_by_edges(source, n_neighbors);
        let mut hits = Vec::new();
        self.unfold(source, radius, WINDOWS_PER_NEIGHBOR * n_neighbors, &mut hits);
        hits.retain(|hit| hit.distance <= self.bounds[hit.vertex as usize] * (1.0 + ROUNDING));
        hits.sort_by(|x, y| x.vertex.cmp(&y.vertex).then(x.distance.total_cmp(&y.distance)));
        hits.dedup_by_key(|hit| hit.vertex);
        for v in self.touched.drain(..) {
            self.bounds[v as usize] = f64::INFINITY;
        }
        hits
    }

    fn lower_bound(&mut self, vertex: u32, distance: f64) -> bool {
        let bound = &mut self.bounds[vertex as usize];
        if *bound <= distance {
            return false;
        }
        if bound.is_infinite() {
            self.touched.push(vertex);
        }
        *bound = distance;
        true
    }

    /// Dijkstra along edges up to the `n_neighbors`-th vertex, whose distance it returns.
    fn bound_by_edges(&mut self, source: u32, n_neighbors: usize) -> f64 {
        self.heap.clear();
        self.lower_bound(source, 0.0);
        self.heap.push(Nearest { distance: 0.0, vertex: source });
        let (mut settled, mut radius) = (0, 0.0);
        let edges = self.edges;
        while let Some(Nearest { distance, vertex }) = self.heap.pop() {
            if distance > self.bounds[vertex as usize] {
                continue;
            }
            radius = distance;
            if settled == n_neighbors {
                break;
            }
            settled += 1;
            for &(neighbor, length) in &edges[vertex as usize] {
                if self.lower_bound(neighbor, distance + length) {
                    self.heap.push(Nearest { distance: distance + length, vertex: neighbor });
                }
            }
        }
        radius
    }

    /// Unfolds faces breadth first, which tightens the bounds before they are needed further out.
    fn unfold(&mut self, source: u32, radius: f64, max_windows: usize, hits: &mut Vec<Hit>) {
        let surface = self.surface;
        let mut windows = std::mem::take(&mut self.windows);
        windows.clear();
        let whole = |_, angle| Some([0.0, angle]);
        open_windows(surface, source, whole, |hit| hits.push(hit), |window| windows.push(window));
        let mut next = 0;
        while next < windows.len().min(max_windows) {
            let window = windows[next];
            next += 1;
            let span = window.span();
            if span.nearest > radius {
                continue;
            }
            let distances = window.end_vertices(surface).map(|v| self.bounds[v as usize]);
            if span.is_dominated(window.ends, distances, 0.0) {
                continue;
            }
            window.cross_face(
                surface,
                |hit| {
                    if hit.distance <= radius {
                        self.lower_bound(hit.vertex, hit.distance);
                        hits.push(hit);
                    }
                },
                |window| windows.push(window),
            );
        }
        self.windows = windows;
    }
}
