//! Connectivity: edges with their faces, what is not manifold, orientation, components, boundaries.
//!
//! A *half-edge* `3 f + c` is the side of face `f` from its corner `c` to the next one. Everything is in sorted arrays,
//! so that the same faces give the same answers in the same order. Faces that repeat a vertex have no sides and are
//! left out throughout.

mod boundary;
mod components;
mod fans;

pub use components::Components;
pub(super) use components::components;
pub use fans::Fans;

use super::Mesh;

/// Stands for "none" in label arrays: a vertex of no component, a corner of no fan, a half-edge of no edge.
pub const NONE: u32 = u32::MAX;

/// The edges of a mesh and the faces around each. Queries panic where there is no such edge or half-edge.
#[derive(Clone, Debug)]
pub struct Topology<'a> {
    faces: &'a [[u32; 3]],
    n_vertices: usize,
    edges: Vec<[u32; 2]>,
    offsets: Vec<u32>,
    half_edges: Vec<u32>,
    edge_of_half_edge: Vec<u32>,
}

/// The neighbours of every vertex, in compressed rows: those of `i` are `neighbors[offsets[i]..offsets[i + 1]]`,
/// ascending.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Adjacency {
    /// `[n + 1]` row starts.
    pub offsets: Vec<u32>,
    /// `[2 n_edges]` neighbours.
    pub neighbors: Vec<u32>,
}

impl Adjacency {
    /// The neighbours of vertex `i`, ascending.
    pub fn of(&self, i: usize) -> &[u32] {
        &self.neighbors[self.offsets[i] as usize..self.offsets[i + 1] as usize]
    }
}

impl<'a> Topology<'a> {
    /// Finds the edges of a mesh. Time and memory are linear in its size.
    pub fn new(mesh: &'a Mesh) -> Self {
        Self::of_faces(mesh.faces(), mesh.n_vertices())
    }

    /// As [`Topology::new`], for faces whose indices are all below `n_vertices`.
    pub(super) fn of_faces(faces: &'a [[u32; 3]], n_vertices: usize) -> Self {
        let (starts, mut keyed) = half_edges_by_lower_vertex(faces, n_vertices);
        let mut topology = Self {
            faces,
            n_vertices,
            edges: Vec::with_capacity(keyed.len() / 2),
            offsets: Vec::with_capacity(keyed.len() / 2 + 1),
            half_edges: Vec::with_capacity(keyed.len()),
            edge_of_half_edge: vec![NONE; 3 * faces.len()],
        };
        for i in 0..n_vertices {
            let bucket = &mut keyed[starts[i] as usize..starts[i + 1] as usize];
            bucket.sort_unstable();
            for (n, &(upper, half_edge)) in bucket.iter().enumerate() {
                if n == 0 || bucket[n - 1].0 != upper {
                    topology.edges.push([i as u32, upper]);
                    topology.offsets.push(topology.half_edges.len() as u32);
                }
                topology.edge_of_half_edge[half_edge as usize] = topology.edges.len() as u32 - 1;
                topology.half_edges.push(half_edge);
            }
        }
        topology.offsets.push(topology.half_edges.len() as u32);
        topology
    }

    /// The edges as `[i, j]` with `i < j`, in lexicographic order, `[n_edges, 2]`.
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    /// The half-edges along edge `edge`, ascending. Half-edge `h` belongs to face `h / 3`.
    pub fn half_edges(&self, edge: usize) -> &[u32] {
        &self.half_edges[self.offsets[edge] as usize..self.offsets[edge + 1] as usize]
    }

    /// How many faces edge `edge` has: 1 on the boundary, 2 inside, more where it is not manifold.
    pub fn n_faces_of(&self, edge: usize) -> usize {
        self.half_edges(edge).len()
    }

    /// The edge of half-edge `3 f + c`; [`NONE`] where face `f` repeats a vertex.
    pub fn edge_of(&self, half_edge: u32) -> u32 {
        self.edge_of_half_edge[half_edge as usize]
    }

    /// The vertices from and to which a half-edge runs.
    pub fn ends(&self, half_edge: u32) -> [u32; 2] {
        let (face, corner) = (self.faces[half_edge as usize / 3], half_edge as usize % 3);
        [face[corner], face[(corner + 1) % 3]]
    }

    /// Edges of more than two faces, as places in [`Topology::edges`], ascending.
    pub fn non_manifold_edges(&self) -> Vec<u32> {
        self.edges_where(|half_edges| half_edges.len() > 2)
    }

    /// Edges of exactly one face, as places in [`Topology::edges`], ascending.
    pub fn boundary_edges(&self) -> Vec<u32> {
        self.edges_where(|half_edges| half_edges.len() == 1)
    }

    /// Edges of two faces that run along it in the same direction, so that one of the two is the wrong way round; as
    /// places in [`Topology::edges`], ascending.
    pub fn inconsistent_edges(&self) -> Vec<u32> {
        self.edges_where(|h| h.len() == 2 && self.ends(h[0])[0] == self.ends(h[1])[0])
    }

    /// Vertices with more than one fan of faces, where surfaces touch in a point. The ends of non-manifold edges are
    /// not counted. Ascending.
    pub fn non_manifold_vertices(&self) -> Vec<u32> {
        let mut n_fans = vec![0u32; self.n_vertices];
        for &vertex in &self.fans().vertex_of_fan {
            n_fans[vertex as usize] += 1;
        }
        for edge in self.non_manifold_edges() {
            for vertex in self.edges[edge as usize] {
                n_fans[vertex as usize] = 0;
            }
        }
        (0..self.n_vertices as u32).filter(|&v| n_fans[v as usize] > 1).collect()
    }

    /// Whether every edge has one or two faces and every vertex at most one fan.
    pub fn is_manifold(&self) -> bool {
        self.non_manifold_edges().is_empty() && self.non_manifold_vertices().is_empty()
    }

    /// Whether there are edges and each has exactly two faces.
    pub fn is_closed(&self) -> bool {
        !self.edges.is_empty() && (0..self.edges.len()).all(|e| self.n_faces_of(e) == 2)
    }

    /// Vertices minus edges plus faces, where only vertices of some face count. Closed and orientable of genus `g`:
    /// `2 - 2 g`.
    pub fn euler_characteristic(&self) -> i64 {
        let mut used = vec![false; self.n_vertices];
        for &vertex in self.edges.iter().flatten() {
            used[vertex as usize] = true;
        }
        let n_used = used.iter().filter(|&&u| u).count() as i64;
        n_used - self.edges.len() as i64 + (self.half_edges.len() / 3) as i64
    }

    /// The neighbours of every vertex.
    pub fn adjacency(&self) -> Adjacency {
        let mut offsets = vec![0u32; self.n_vertices + 1];
        for &[i, j] in &self.edges {
            offsets[i as usize + 1] += 1;
            offsets[j as usize + 1] += 1;
        }
        accumulate(&mut offsets);
        let mut next = offsets.clone();
        let mut neighbors = vec![0u32; 2 * self.edges.len()];
        let mut place = |i: u32, j: u32| {
            neighbors[next[i as usize] as usize] = j;
            next[i as usize] += 1;
        };
        // Lexicographic order puts the lower neighbours of a vertex before its upper ones if they go in first.
        self.edges.iter().for_each(|&[i, j]| place(j, i));
        self.edges.iter().for_each(|&[i, j]| place(i, j));
        Adjacency { offsets, neighbors }
    }

    fn edges_where(&self, predicate: impl Fn(&[u32]) -> bool) -> Vec<u32> {
        (0..self.edges.len()).filter(|&e| predicate(self.half_edges(e))).map(|e| e as u32).collect()
    }
}

/// Counting sort: for every vertex the pairs (upper vertex, half-edge) whose lower vertex it is, and the row starts.
fn half_edges_by_lower_vertex(faces: &[[u32; 3]], n_vertices: usize) -> (Vec<u32>, Vec<(u32, u32)>) {
    let sides = || {
        let proper = faces.iter().enumerate().filter(|(_, [a, b, c])| a != b && b != c && c != a);
        proper.flat_map(|(f, &[a, b, c])| {
            let first = 3 * f as u32;
            [(a, b, first), (b, c, first + 1), (c, a, first + 2)]
        })
    };
    let mut starts = vec![0u32; n_vertices + 1];
    sides().for_each(|(i, j, _)| starts[i.min(j) as usize + 1] += 1);
    accumulate(&mut starts);
    let mut next = starts.clone();
    let mut keyed = vec![(0, 0); starts[n_vertices] as usize];
    for (i, j, half_edge) in sides() {
        let slot = &mut next[i.min(j) as usize];
        keyed[*slot as usize] = (i.max(j), half_edge);
        *slot += 1;
    }
    (starts, keyed)
}

/// Counts, shifted by one, to row starts.
fn accumulate(counts: &mut [u32]) {
    for i in 1..counts.len() {
        counts[i] += counts[i - 1];
    }
}

#[cfg(test)]
mod tests;
