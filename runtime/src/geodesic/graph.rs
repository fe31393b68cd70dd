//! The graph of straight geodesics between near vertices.
//!
//! On a polyhedral surface a shortest path is a chain of straight lines that bends only at vertices of negative
//! curvature and at the boundary, so that the graph of *all* straight lines holds every exact distance (Ying,
//! Wang and He 2013, "Saddle vertex graph"). Kept are those to the nearest vertices: exact at short range, and
//! beyond it off only by the small turns where a path changes from one line to the next.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::local::LocalSearch;
use super::surface::{Fan, Surface};

/// Directions at a vertex are told apart in this many equal parts of its total angle.
pub(super) const N_BINS: usize = 64;

/// A straight geodesic seen from its tail.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub(super) head: u32,
    pub(super) length: f32,
}

/// Edges sorted by tail and by direction at the tail.
pub(super) struct LocalGraph {
    pub(super) edges: Vec<Edge>,
    /// Bin at the head in which each edge arrives.
    pub(super) arrivals: Vec<u8>,
    /// First edge of each bin, `[n N_BINS + 1]`.
    bin_starts: Vec<u32>,
    turns: Vec<Turn>,
}

/// The directions in which a path may leave a vertex, relative to the bin in which it arrived.
#[derive(Clone, Copy, Debug)]
enum Turn {
    /// Any.
    Free,
    /// Bins at least this far away on both sides around the ring.
    Ring(u8),
    /// Bins at least this far away in the strip; more than `N_BINS` where the path cannot go on.
    Strip(u8),
}

/// An edge with all it needs to be put in its place.
#[derive(Clone, Copy)]
struct Directed {
    tail: u32,
    head: u32,
    length: f32,
    departure: u8,
    arrival: u8,
}

impl Turn {
    fn new(fan: Fan, max_turn: f64) -> Self {
        let bins = |angle: f64, total: f64| (angle / total * N_BINS as f64).floor() as i64;
        match fan {
            Fan::Irregular => Turn::Free,
            Fan::Closed(total) => {
                // A cone sharper than the tolerance still lets the path straight through.
                let away = bins((PI - max_turn).min(total / 2.0), total) - 1;
                if away <= 0 { Turn::Free } else { Turn::Ring(away.min(N_BINS as i64 / 2 - 1) as u8) }
            }
            Fan::Open(total) => {
                let away = bins(PI - max_turn, total) - 1;
                if away <= 0 { Turn::Free } else { Turn::Strip(away.min(N_BINS as i64 + 1) as u8) }
            }
        }
    }
}

impl LocalGraph {
    pub(super) fn new(surface: &Surface, n_neighbors: usize, max_turn: f64) -> Self {
        let n = surface.n_vertices();
        let mut directed = straight_lines(surface, n_neighbors);
        directed.sort_unstable_by_key(|e| (e.tail, e.head, e.length.to_bits()));
        directed.dedup_by_key(|e| (e.tail, e.head));
        directed.sort_unstable_by_key(|e| (e.tail, e.departure, e.head));
        let mut bin_starts = vec![0u32; n * N_BINS + 1];
        for e in &directed {
            bin_starts[e.tail as usize * N_BINS + e.departure as usize + 1] += 1;
        }
        for i in 1..bin_starts.len() {
            bin_starts[i] += bin_starts[i - 1];
        }
        Self {
            edges: directed.iter().map(|e| Edge { head: e.head, length: e.length }).collect(),
            arrivals: directed.iter().map(|e| e.arrival).collect(),
            bin_starts,
            turns: (0..n as u32).map(|v| Turn::new(surface.fan(v), max_turn)).collect(),
        }
    }

    pub(super) fn n_vertices(&self) -> usize {
        self.turns.len()
    }

    /// All edges out of `vertex`, as a range.
    pub(super) fn edges_of(&self, vertex: u32) -> std::ops::Range<usize> {
        self.bins(vertex, 0, N_BINS)
    }

    /// Edges out of `vertex` that go on from a path which arrived in bin `arrival`, as two ranges.
    pub(super) fn edges_onward(&self, vertex: u32, arrival: u8) -> [std::ops::Range<usize>; 2] {
        let arrival = arrival as usize;
        match self.turns[vertex as usize] {
            Turn::Free => [self.edges_of(vertex), 0..0],
            Turn::Ring(away) => {
                let (from, to) = (arrival + away as usize, arrival + N_BINS - away as usize + 1);
                if from >= N_BINS {
                    [self.bins(vertex, from - N_BINS, to - N_BINS), 0..0]
                } else if to > N_BINS {
                    [self.bins(vertex, from, N_BINS), self.bins(vertex, 0, to - N_BINS)]
                } else {
                    [self.bins(vertex, from, to), 0..0]
                }
            }
            Turn::Strip(away) => {
                let away = away as usize;
                let below = (arrival + 1).saturating_sub(away);
                let above = (arrival + away).min(N_BINS);
                [self.bins(vertex, 0, below), self.bins(vertex, above, N_BINS)]
            }
        }
    }

    fn bins(&self, vertex: u32, from: usize, to: usize) -> std::ops::Range<usize> {
        let first = vertex as usize * N_BINS;
        self.bin_starts[first + from] as usize..self.bin_starts[first + to] as usize
    }
}

/// Edges of the mesh at each vertex as (neighbour, length).
fn mesh_edges(surface: &Surface) -> Vec<Vec<(u32, f64)>> {
    let mut edges = vec![Vec::new(); surface.n_vertices()];
    for v in 0..surface.n_vertices() as u32 {
        for &corner in surface.corners_of(v) {
            for side in surface.corner(corner).2 {
                let [first, second] = surface.ends(side);
                edges[v as usize].push((if first == v { second } else { first }, surface.length(side)));
            }
        }
    }
    for &(a, b, length) in surface.loose_edges() {
        edges[a as usize].push((b, length));
        edges[b as usize].push((a, length));
    }
    for list in &mut edges {
        list.sort_by(|x, y| x.0.cmp(&y.0).then(x.1.total_cmp(&y.1)));
        list.dedup_by_key(|e| e.0);
    }
    edges
}

/// Every straight line found from either of its ends, in both directions.
fn straight_lines(surface: &Surface, n_neighbors: usize) -> Vec<Directed> {
    let edges = mesh_edges(surface);
    let bin = |vertex: u32, direction: f64| {
        let bin = direction / surface.fan(vertex).total_angle() * N_BINS as f64;
        match surface.fan(vertex) {
            Fan::Closed(_) => (bin as usize % N_BINS) as u8,
            Fan::Open(_) => (bin as usize).min(N_BINS - 1) as u8,
            Fan::Irregular => 0,
        }
    };
    let found: Vec<Vec<Directed>> = (0..surface.n_vertices() as u32)
        .into_par_iter()
        .map_init(
            || LocalSearch::new(surface, &edges),
            |search, tail| {
                let hits = search.straight_geodesics(tail, n_neighbors);
                hits.into_iter()
                    .flat_map(|hit| {
                        let (head, length) = (hit.vertex, hit.distance as f32);
                        let (departure, arrival) = (bin(tail, hit.departure), bin(head, hit.arrival));
                        let there = Directed { tail, head, length, departure, arrival };
                        [
                            there,
                            Directed {
                                tail: head,
                                head: tail,
                                departure: arrival,
                                arrival: departure,
                                ..there
                            },
                        ]
                    })
                    .filter(|e| e.tail != e.head)
                    .collect()
            },
        )
        .collect();
    let loose = surface.loose_edges().iter().flat_map(|&(a, b, length)| {
        let there = Directed { tail: a, head: b, length: length as f32, departure: 0, arrival: 0 };
        [there, Directed { tail: b, head: a, ..there }]
    });
    found.into_iter().flatten().chain(loose).collect()
}
