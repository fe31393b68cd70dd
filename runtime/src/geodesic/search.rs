//! Dijkstra's algorithm on the graph of straight geodesics, with a bucket queue.

use super::graph::LocalGraph;

const UNQUEUED: u32 = u32::MAX;

/// Working memory of one search after another on the same graph.
pub(super) struct Search<'a> {
    graph: &'a LocalGraph,
    /// Distance to each vertex, infinite where not reached.
    distances: Vec<f32>,
    /// Bin in which the best path so far arrives.
    arrivals: Vec<u8>,
    /// Bucket in which a vertex waits.
    queued: Vec<u32>,
    touched: Vec<u32>,
    /// Ring of buckets; bucket `b` holds distances from `b width` to `(b + 1) width`.
    buckets: Vec<Vec<u32>>,
    per_width: f32,
    is_target: Vec<bool>,
}

impl<'a> Search<'a> {
    /// `width` is that of a bucket; none of the graph's edges may be longer than `longest`.
    pub(super) fn new(graph: &'a LocalGraph, width: f32, longest: f32) -> Self {
        let n = graph.n_vertices();
        Self {
            graph,
            distances: vec![f32::INFINITY; n],
            arrivals: vec![0; n],
            queued: vec![UNQUEUED; n],
            touched: Vec::new(),
            buckets: vec![Vec::new(); (longest / width).ceil() as usize + 2],
            per_width: 1.0 / width,
            is_target: vec![false; n],
        }
    }

    /// Distances from the nearest of `sources` to every vertex.
    pub(super) fn run(&mut self, sources: &[u32]) -> &[f32] {
        self.search(sources, usize::MAX);
        &self.distances
    }

    /// Distances to `targets`, in their order; searches no further than it must.
    pub(super) fn run_to(&mut self, sources: &[u32], targets: &[u32], out: &mut [f32]) {
        let mut n_targets = 0;
        for &t in targets {
            n_targets += usize::from(!std::mem::replace(&mut self.is_target[t as usize], true));
        }
        self.search(sources, n_targets);
        for (value, &t) in out.iter_mut().zip(targets) {
            *value = self.distances[t as usize];
            self.is_target[t as usize] = false;
        }
    }

    fn reset(&mut self) {
        for v in self.touched.drain(..) {
            self.distances[v as usize] = f32::INFINITY;
            self.queued[v as usize] = UNQUEUED;
        }
        self.buckets.iter_mut().for_each(Vec::clear);
    }

    /// Settles buckets in turn until `n_targets` targets are settled or nothing is left.
    ///
    /// Within a bucket vertices are taken in any order; one that improves after it was taken is taken again,
    /// so the distances are those of an exact queue.
    fn search(&mut self, sources: &[u32], n_targets: usize) {
        self.reset();
        let graph = self.graph;
        let mut waiting = 0;
        for &s in sources {
            if self.distances[s as usize] > 0.0 {
                self.distances[s as usize] = 0.0;
                self.touched.push(s);
                self.queued[s as usize] = 0;
                self.buckets[0].push(s);
                waiting += 1;
            }
        }
        let n_buckets = self.buckets.len();
        let (mut current, mut remaining) = (0u32, n_targets);
        while waiting > 0 && remaining > 0 {
            let slot = current as usize % n_buckets;
            while let Some(v) = self.buckets[slot].pop() {
                waiting -= 1;
                if self.queued[v as usize] != current {
                    continue;
                }
                self.queued[v as usize] = UNQUEUED;
                remaining -= usize::from(std::mem::take(&mut self.is_target[v as usize]));
                let distance = self.distances[v as usize];
                if distance == 0.0 {
                    waiting += self.relax(graph.edges_of(v), distance);
                    continue;
                }
                for range in graph.edges_onward(v, self.arrivals[v as usize]) {
                    waiting += self.relax(range, distance);
                }
            }
            current += 1;
        }
        if remaining > 0 {
            self.reach_the_rest();
        }
    }

    /// Distances to the vertices that no edge onward leads to, as may happen on rough surfaces: through their own
    /// edges.
    fn reach_the_rest(&mut self) {
        let mut missed: Vec<u32> = (0..self.distances.len() as u32)
            .filter(|&v| self.distances[v as usize] == f32::INFINITY)
            .collect();
        loop {
            let before = missed.len();
            missed.retain(|&v| {
                let edges = self.graph.edges[self.graph.edges_of(v)].iter();
                let through = edges.map(|edge| self.distances[edge.head as usize] + edge.length);
                let distance = through.fold(f32::INFINITY, f32::min);
                if distance < f32::INFINITY {
                    self.distances[v as usize] = distance;
                    self.touched.push(v);
                }
                distance == f32::INFINITY
            });
            if missed.len() == before {
                return;
            }
        }
    }

    fn relax(&mut self, range: std::ops::Range<usize>, distance: f32) -> usize {
        let n_buckets = self.buckets.len();
        let mut pushed = 0;
        let first = range.start;
        for (i, edge) in self.graph.edges[range].iter().enumerate() {
            let through = distance + edge.length;
            let head = edge.head as usize;
            let old = self.distances[head];
            if through < old {
                if old == f32::INFINITY {
                    self.touched.push(edge.head);
                }
                self.distances[head] = through;
                self.arrivals[head] = self.graph.arrivals[first + i];
                let bucket = (through * self.per_width) as u32;
                if self.queued[head] != bucket {
                    self.queued[head] = bucket;
                    self.buckets[bucket as usize % n_buckets].push(edge.head);
                    pushed += 1;
                }
            }
        }
        pushed
    }
}
