//! A map carried on from triangle to triangle, where both meshes are triangulated alike.
//!
//! The filter leaves pieces that are right and pieces that are shifted by a vertex, and neither kernels nor
//! descriptors can tell which is which. Where triangles of such a piece go to triangles, the triangulations can:
//! across each edge of such a triangle lies one more triangle on either shape, whose third corners then correspond,
//! and so on until all is reached. A shifted piece soon meets what it cannot go around.

use crate::Mesh;
use crate::mesh::UnionFind;
use crate::point_map::PointMap;
use std::collections::{HashMap, VecDeque};

/// Pieces that are tried as the one to begin with, the largest first.
const ATTEMPTS: usize = 8;

/// The map of both meshes' triangulations that goes furthest from one of the pieces of `present`, and the share of
/// the source's edges that go to edges by it. Vertices that it does not reach keep their match if no other took it,
/// else are [`PointMap::UNMATCHED`].
pub(super) fn carried_on([source, target]: [&Mesh; 2], present: &[u32]) -> (Vec<u32>, f64) {
    let (source, target) = (Triangulation::new(source), Triangulation::new(target));
    let pieces = pieces(&source, &target, present);
    let attempt = |first: usize| {
        let mut growth = Growth::new(&source, &target);
        let others = pieces.iter().take(first).chain(pieces.iter().skip(first + 1));
        for piece in pieces.get(first).into_iter().chain(others) {
            growth.add(piece, present);
        }
        let share = source.edges_kept(&target, &growth.targets);
        (growth.with_others_of(present), share)
    };
    let mut best = attempt(0);
    for first in 1..pieces.len().min(ATTEMPTS) {
        let other = attempt(first);
        if other.1 > best.1 {
            best = other;
        }
    }
    best
}

/// The triangles beside each directed edge.
struct Triangulation<'a> {
    faces: &'a [[u32; 3]],
    n_vertices: usize,
    /// By the two ends of a half-edge, its triangle and that triangle's third corner; `None` where a half-edge has
    /// several.
    half_edges: HashMap<[u32; 2], Option<(u32, u32)>>,
}

impl<'a> Triangulation<'a> {
    fn new(mesh: &'a Mesh) -> Self {
        let mut half_edges = HashMap::with_capacity(3 * mesh.n_faces());
        for (f, &face) in mesh.faces().iter().enumerate() {
            for [a, b, c] in rotations(face) {
                let place = half_edges.entry([a, b]).or_insert(Some((f as u32, c)));
                if place.is_some_and(|(other, _)| other != f as u32) {
                    *place = None;
                }
            }
        }
        Self { faces: mesh.faces(), n_vertices: mesh.n_vertices(), half_edges }
    }

    /// The triangle on the left of the directed edge, and its third corner.
    fn beside(&self, a: u32, b: u32) -> Option<(u32, u32)> {
        self.half_edges.get(&[a, b]).copied().flatten()
    }

    fn is_edge(&self, a: u32, b: u32) -> bool {
        self.half_edges.contains_key(&[a, b]) || self.half_edges.contains_key(&[b, a])
    }

    /// The share of the half-edges that go to edges of `target`.
    fn edges_kept(&self, target: &Self, targets: &[u32]) -> f64 {
        let ends = self.half_edges.keys().map(|ends| ends.map(|v| targets[v as usize]));
        let kept = ends.filter(|&[a, b]| target.is_edge(a, b)).count();
        kept as f64 / self.half_edges.len().max(1) as f64
    }
}

fn rotations([a, b, c]: [u32; 3]) -> [[u32; 3]; 3] {
    [[a, b, c], [b, c, a], [c, a, b]]
}

/// The connected sets of source triangles that go to triangles, the largest first.
fn pieces(source: &Triangulation, target: &Triangulation, present: &[u32]) -> Vec<Vec<u32>> {
    let image = |v: u32| present[v as usize];
    let is_kept =
        |&[a, b, c]: &[u32; 3]| target.beside(image(a), image(b)).is_some_and(|(_, d)| d == image(c));
    let kept: Vec<bool> = source.faces.iter().map(is_kept).collect();
    let mut sets = UnionFind::new(kept.len());
    for (f, &face) in source.faces.iter().enumerate().filter(|&(f, _)| kept[f]) {
        for [a, b, _] in rotations(face) {
            if let Some((g, _)) = source.beside(b, a).filter(|&(g, _)| kept[g as usize]) {
                sets.union(f as u32, g);
            }
        }
    }
    let mut pieces: Vec<Vec<u32>> = vec![Vec::new(); kept.len()];
    (0..kept.len() as u32).filter(|&f| kept[f as usize]).for_each(|f| pieces[sets.find(f) as usize].push(f));
    pieces.retain(|piece| !piece.is_empty());
    pieces.sort_by_key(|piece| std::cmp::Reverse(piece.len()));
    pieces
}

/// A map that grows.
struct Growth<'a> {
    source: &'a Triangulation<'a>,
    target: &'a Triangulation<'a>,
    targets: Vec<u32>,
    is_taken: Vec<bool>,
    is_visited: Vec<bool>,
}

impl<'a> Growth<'a> {
    fn new(source: &'a Triangulation<'a>, target: &'a Triangulation<'a>) -> Self {
        Self {
            source,
            target,
            targets: vec![PointMap::UNMATCHED; source.n_vertices],
            is_taken: vec![false; target.n_vertices],
            is_visited: vec![false; source.faces.len()],
        }
    }

    /// Takes a piece of a map, unless it is at odds with what there is, and goes on from it.
    fn add(&mut self, piece: &[u32], present: &[u32]) {
        let vertices = || piece.iter().flat_map(|&f| self.source.faces[f as usize]);
        let is_free = |v: u32| {
            self.targets[v as usize] == PointMap::UNMATCHED && !self.is_taken[present[v as usize] as usize]
        };
        if !vertices().all(is_free) {
            return;
        }
        for v in piece.iter().flat_map(|&f| self.source.faces[f as usize]) {
            self.set(v, present[v as usize]);
        }
        piece.iter().for_each(|&f| self.is_visited[f as usize] = true);
        let mut open: VecDeque<u32> = piece.iter().copied().collect();
        while let Some(face) = open.pop_front() {
            for [a, b, _] in rotations(self.source.faces[face as usize]) {
                open.extend(self.step(a, b));
            }
        }
    }

    /// The triangle across an edge, if its corners go to those of the triangle across the image of that edge.
    fn step(&mut self, a: u32, b: u32) -> Option<u32> {
        let (face, corner) = self.source.beside(b, a)?;
        let (_, image) = self.target.beside(self.targets[b as usize], self.targets[a as usize])?;
        if self.is_visited[face as usize] {
            return None;
        }
        if self.targets[corner as usize] == PointMap::UNMATCHED && !self.is_taken[image as usize] {
            self.set(corner, image);
        }
        if self.targets[corner as usize] != image {
            return None;
        }
        self.is_visited[face as usize] = true;
        Some(face)
    }

    fn set(&mut self, vertex: u32, image: u32) {
        self.targets[vertex as usize] = image;
        self.is_taken[image as usize] = true;
    }

    /// Vertices not reached keep their match, where it is free.
    fn with_others_of(mut self, present: &[u32]) -> Vec<u32> {
        for (vertex, &image) in present.iter().enumerate() {
            let is_open = self.targets[vertex] == PointMap::UNMATCHED && image != PointMap::UNMATCHED;
            if is_open && !self.is_taken[image as usize] {
                self.set(vertex as u32, image);
            }
        }
        self.targets
    }
}
