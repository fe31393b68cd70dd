//! Exact geodesic distances on the polyhedral surface.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::PI;

use super::surface::{Fan, Surface};
use super::window::{Hit, Window, open_windows};
use crate::Mesh;

/// Widening of the shadow of a vertex, in radians, so that rounding leaves no gap at its borders.
const SHADOW_MARGIN: f64 = 1e-7;
/// Windows that are followed, for each vertex. Clean surfaces stay far below; where faces of other vertices lie on
/// each other and share edges their number doubles at every crossing.
const WINDOWS_PER_VERTEX: usize = 2000;

/// Exact geodesic distances from `source` to every vertex, `[n]`, in the mesh's unit; infinite on other
/// components.
///
/// Windows are propagated in the order of their distance, as Chen and Han's algorithm with the priority queue and the
/// window filter of Xin and Wang (2009). A vertex where a path can bend (total angle above 2 pi, on the boundary, or
/// non-manifold) becomes the source of windows into the directions in its shadow. Where surfaces lie on each other
/// and share edges the work is bounded: beyond 2000 windows for each vertex paths go on along edges, which makes
/// upper bounds. Takes about 0.06 s for 7000 vertices; [`GeodesicSolver`](super::GeodesicSolver) is some fifty times
/// faster.
///
/// # Panics
/// If `source` is not a vertex of the mesh.
pub fn exact(mesh: &Mesh, source: u32) -> Vec<f64> {
    assert!((source as usize) < mesh.n_vertices(), "source {source} is not a vertex of the mesh");
    let surface = Surface::new(mesh);
    let mut propagation = Propagation::new(&surface);
    propagation.run(source);
    propagation.distances
}

struct Propagation<'a> {
    surface: &'a Surface,
    distances: Vec<f64>,
    /// Direction in which the best path so far arrives at each vertex.
    arrivals: Vec<f64>,
    queue: BinaryHeap<Event>,
    /// Windows waiting in the queue, with the distance of their source.
    windows: Vec<(Window, f64)>,
    free: Vec<u32>,
    loose: Vec<Vec<(u32, f64)>>,
}

#[derive(Clone, Copy, PartialEq)]
enum What {
    /// A vertex at the distance of the event.
    Vertex(u32),
    /// A window by its place in the list.
    Window(u32),
}

#[derive(Clone, Copy, PartialEq)]
struct Event {
    distance: f64,
    what: What,
}

impl Eq for Event {}

impl PartialOrd for Event {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Event {
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance.total_cmp(&self.distance)
    }
}

impl<'a> Propagation<'a> {
    fn new(surface: &'a Surface) -> Self {
        let mut loose = vec![Vec::new(); surface.n_vertices()];
        for &(a, b, length) in surface.loose_edges() {
            loose[a as usize].push((b, length));
            loose[b as usize].push((a, length));
        }
        Self {
            surface,
            distances: vec![f64::INFINITY; surface.n_vertices()],
            arrivals: vec![0.0; surface.n_vertices()],
            queue: BinaryHeap::new(),
            windows: Vec::new(),
            free: Vec::new(),
            loose,
        }
    }

    fn run(&mut self, source: u32) {
        self.distances[source as usize] = 0.0;
        self.open(source, |_, angle| Some([0.0, angle]));
        let mut left = WINDOWS_PER_VERTEX * self.distances.len();
        while let Some(event) = self.queue.pop() {
            if left == 0 {
                return self.go_on_along_edges();
            }
            match event.what {
                What::Vertex(v) if event.distance == self.distances[v as usize] => self.bend(v),
                What::Vertex(_) => {}
                What::Window(slot) => {
                    left -= 1;
                    self.advance(slot);
                }
            }
        }
    }

    /// Shortens the distances along edges, from wherever a path has arrived.
    fn go_on_along_edges(&mut self) {
        let mut edges = std::mem::take(&mut self.loose);
        for side in 0..self.surface.n_sides() {
            let ([a, b], length) = (self.surface.ends(side), self.surface.length(side));
            edges[a as usize].push((b, length));
            edges[b as usize].push((a, length));
        }
        self.queue.clear();
        for (v, &distance) in self.distances.iter().enumerate().filter(|(_, d)| d.is_finite()) {
            self.queue.push(Event { distance, what: What::Vertex(v as u32) });
        }
        while let Some(Event { distance, what: What::Vertex(v) }) = self.queue.pop() {
            if distance > self.distances[v as usize] {
                continue;
            }
            for &(neighbor, length) in &edges[v as usize] {
                if distance + length < self.distances[neighbor as usize] {
                    let distance = distance + length;
                    self.distances[neighbor as usize] = distance;
                    self.queue.push(Event { distance, what: What::Vertex(neighbor) });
                }
            }
        }
    }

    fn reach(&mut self, hit: Hit, base: f64) {
        let (v, distance) = (hit.vertex as usize, base + hit.distance);
        if distance < self.distances[v] {
            self.distances[v] = distance;
            self.arrivals[v] = hit.arrival;
            if self.surface.fan(hit.vertex).bends_paths() {
                self.queue.push(Event { distance, what: What::Vertex(hit.vertex) });
            }
        }
    }

    fn enqueue(&mut self, window: Window, base: f64) {
        let span = window.span();
        let ends = window.end_vertices(self.surface).map(|v| self.distances[v as usize]);
        if span.is_dominated(window.ends, ends, base) {
            return;
        }
        let slot = self.free.pop().unwrap_or(self.windows.len() as u32);
        if slot as usize == self.windows.len() {
            self.windows.push((window, base));
        } else {
            self.windows[slot as usize] = (window, base);
        }
        self.queue.push(Event { distance: base + span.nearest, what: What::Window(slot) });
    }

    fn open(&mut self, source: u32, sector: impl Fn(f64, f64) -> Option<[f64; 2]>) {
        let base = self.distances[source as usize];
        let (mut hits, mut opened) = (Vec::new(), Vec::new());
        open_windows(self.surface, source, sector, |hit| hits.push(hit), |window| opened.push(window));
        for &(vertex, distance) in &self.loose[source as usize] {
            hits.push(Hit { vertex, distance, departure: 0.0, arrival: 0.0 });
        }
        hits.into_iter().for_each(|hit| self.reach(hit, base));
        opened.into_iter().for_each(|window| self.enqueue(window, base));
    }

    /// Makes `vertex` the source of windows into its shadow: the directions that make an angle of at least pi with
    /// the arriving path on both sides (on its only side at the boundary).
    fn bend(&mut self, vertex: u32) {
        let arrival = self.arrivals[vertex as usize];
        let clip = |from: f64, to: f64, start: f64, angle: f64| {
            let (from, to) =
                ((from - SHADOW_MARGIN - start).max(0.0), (to + SHADOW_MARGIN - start).min(angle));
            (from < to).then_some([from, to])
        };
        match self.surface.fan(vertex) {
            Fan::Irregular => self.open(vertex, |_, angle| Some([0.0, angle])),
            Fan::Open(total) => self.open(vertex, move |start, angle| {
                clip(arrival + PI, total, start, angle).or_else(|| clip(0.0, arrival - PI, start, angle))
            }),
            Fan::Closed(total) => self.open(vertex, move |start, angle| {
                let (from, to) = (arrival + PI, arrival - PI + total);
                clip(from, to, start, angle).or_else(|| clip(from - total, to - total, start, angle))
            }),
        }
    }

    fn advance(&mut self, slot: u32) {
        let (window, base) = self.windows[slot as usize];
        self.free.push(slot);
        let ends = window.end_vertices(self.surface).map(|v| self.distances[v as usize]);
        if window.span().is_dominated(window.ends, ends, base) {
            return;
        }
        let (mut hit, mut beyond) = (None, [None; 2]);
        let mut more = Vec::new();
        window.cross_face(
            self.surface,
            |h| hit = Some(h),
            |w| match beyond.iter_mut().find(|b| b.is_none()) {
                Some(place) => *place = Some(w),
                None => more.push(w),
            },
        );
        if let Some(hit) = hit {
            self.reach(hit, base);
        }
        for window in beyond.into_iter().flatten().chain(more) {
            self.enqueue(window, base);
        }
    }
}
