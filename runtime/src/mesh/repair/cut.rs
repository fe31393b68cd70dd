//! Cuts sheets apart at non-manifold edges and vertices.
//!
//! At an edge of more than two faces the faces are joined in pairs: first those that were neighbours in the input
//! already, then those of fitting orientation, the flattest first. Each fan of corners so joined becomes a vertex.

use super::Sheets;
use crate::Mesh;
use crate::mesh::{Topology, vec3};
use std::collections::BTreeSet;

/// How often an edge whose pairs meet again around both its ends, so that it would still have four faces, is tried with
/// its next best pairs, before none of its faces stay joined there.
const RETRIES: usize = 3;

/// Splits the welded vertices of `kept` (input face, welded vertices) into fans, so that the result is manifold.
pub(super) fn cut_apart(mesh: &Mesh, welded: &[u32], kept: Vec<(u32, [u32; 3])>) -> Sheets {
    let (input_faces, faces): (Vec<u32>, Vec<[u32; 3]>) = kept.into_iter().unzip();
    let topology = Topology::of_faces(&faces, welded.len());
    let inner: Vec<[u32; 2]> = (0..topology.edges().len())
        .filter_map(|e| <[u32; 2]>::try_from(topology.half_edges(e)).ok())
        .collect();
    let mut complex: Vec<ComplexEdge> = topology
        .non_manifold_edges()
        .into_iter()
        .map(|e| ComplexEdge::new(mesh, &input_faces, &topology, e))
        .collect();
    let mut round = 0;
    loop {
        let pairs = inner.iter().copied().chain(complex.iter().flat_map(ComplexEdge::pairs));
        let fans = topology.fans_joined_by(pairs);
        let faces: Vec<[u32; 3]> = fans.of_corner.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        let still_complex =
            if complex.is_empty() { BTreeSet::new() } else { still_complex(&topology, &faces) };
        if still_complex.is_empty() {
            return Sheets {
                input_faces,
                faces,
                vertex_of_fan: fans.vertex_of_fan,
                dropped_faces: Vec::new(),
            };
        }
        for edge in complex.iter_mut().filter(|edge| still_complex.contains(&edge.edge)) {
            edge.skip = if round < RETRIES { edge.skip + 1 } else { usize::MAX };
        }
        round += 1;
    }
}

/// The edges of `topology` that have more than two faces although its vertices are split as `faces` says.
fn still_complex(topology: &Topology, faces: &[[u32; 3]]) -> BTreeSet<u32> {
    let n_fans = faces.iter().flatten().max().map_or(0, |&fan| fan as usize + 1);
    let split = Topology::of_faces(faces, n_fans);
    let complex = split.non_manifold_edges();
    complex.iter().map(|&e| topology.edge_of(split.half_edges(e as usize)[0])).collect()
}

/// An edge of more than two faces.
struct ComplexEdge {
    edge: u32,
    /// All pairs of its half-edges, the best to join first.
    candidates: Vec<[u32; 2]>,
    /// How many of the candidates are passed over.
    skip: usize,
}

impl ComplexEdge {
    fn new(mesh: &Mesh, input_faces: &[u32], topology: &Topology, edge: u32) -> Self {
        let lower = topology.edges()[edge as usize][0];
        let sides: Vec<Side> = topology
            .half_edges(edge as usize)
            .iter()
            .map(|&h| Side::new(mesh, input_faces, topology.ends(h)[0] == lower, h))
            .collect();
        let mut ranked = Vec::new();
        for (i, a) in sides.iter().enumerate() {
            for b in &sides[i + 1..] {
                let apart = a.input_ends != b.input_ends;
                let unfitting = a.forward == b.forward;
                let fold = vec3::dot(a.into_face, b.into_face);
                ranked.push((apart, unfitting, fold, [a.half_edge, b.half_edge]));
            }
        }
        ranked.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)).then(a.3.cmp(&b.3)));
        Self { edge, candidates: ranked.into_iter().map(|(.., pair)| pair).collect(), skip: 0 }
    }

    /// The pairs to join: the best candidate, the best of the rest without its half-edges, and so on.
    fn pairs(&self) -> Vec<[u32; 2]> {
        let mut pairs: Vec<[u32; 2]> = Vec::new();
        for &[g, h] in self.candidates.iter().skip(self.skip) {
            if pairs.iter().flatten().all(|&taken| taken != g && taken != h) {
                pairs.push([g, h]);
            }
        }
        pairs
    }
}

/// One face at an edge.
struct Side {
    half_edge: u32,
    /// Whether the face runs along the edge from its lower to its upper welded vertex.
    forward: bool,
    /// The ends of the edge as the input names them, lower welded vertex first.
    input_ends: [u32; 2],
    /// Unit vector from the edge into the face, at right angles to the edge.
    into_face: [f64; 3],
}

impl Side {
    fn new(mesh: &Mesh, input_faces: &[u32], forward: bool, half_edge: u32) -> Self {
        let input_face = input_faces[half_edge as usize / 3] as usize;
        let corner = half_edge as usize % 3;
        let [from, to, apex] = [0, 1, 2].map(|k| (corner + k) % 3);
        let vertices = mesh.faces()[input_face];
        let corners = mesh.corners(input_face);
        let along = vec3::sub(corners[to], corners[from]);
        let normal = vec3::cross(along, vec3::sub(corners[apex], corners[from]));
        let inward = vec3::cross(normal, along);
        let ends = [vertices[from], vertices[to]];
        Self {
            half_edge,
            forward,
            input_ends: if forward { ends } else { [ends[1], ends[0]] },
            into_face: vec3::scale(inward, 1.0 / vec3::norm(inward)),
        }
    }
}
