//! Vertices with one texture coordinate each: a vertex on a seam is repeated.

use std::collections::HashMap;

use crate::Mesh;

/// A mesh split along the seams of its texture coordinates.
pub(super) struct Split {
    /// The mesh's vertex that each vertex is a copy of; the first `n` are the mesh's own, in order.
    pub(super) vertices: Vec<u32>,
    pub(super) uvs: Vec<[f32; 2]>,
    pub(super) faces: Vec<[u32; 3]>,
}

impl Split {
    pub(super) fn at_seams(mesh: &Mesh, corner_uvs: Option<&[[[f32; 2]; 3]]>) -> Self {
        let n = mesh.n_vertices();
        let mut split =
            Self { vertices: (0..n as u32).collect(), uvs: Vec::new(), faces: mesh.faces().to_vec() };
        let Some(corner_uvs) = corner_uvs else { return split };
        split.uvs = vec![[0.0; 2]; n];
        let mut is_set = vec![false; n];
        let mut copies: HashMap<(u32, [u32; 2]), u32> = HashMap::new();
        for (corner, &uv) in split.faces.as_flattened_mut().iter_mut().zip(corner_uvs.as_flattened()) {
            let vertex = *corner as usize;
            if !std::mem::replace(&mut is_set[vertex], true) {
                split.uvs[vertex] = uv;
            } else if split.uvs[vertex].map(f32::to_bits) != uv.map(f32::to_bits) {
                *corner = *copies.entry((*corner, uv.map(f32::to_bits))).or_insert_with(|| {
                    split.vertices.push(vertex as u32);
                    split.uvs.push(uv);
                    (split.vertices.len() - 1) as u32
                });
            }
        }
        split
    }
}
