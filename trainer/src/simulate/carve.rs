//! Taking vertices away from a mesh, and choosing which.

use fmnet::Mesh;
use fmnet::mesh::{Adjacency, NONE, Topology, vec3};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// What remains of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Carved {
    pub(super) mesh: Mesh,
    /// The vertex of the whole mesh that each vertex is, ascending.
    pub(super) origin: Vec<u32>,
}

/// The faces all of whose vertices are kept, on the vertices they use.
pub(super) fn carve(mesh: &Mesh, keep: impl Fn(u32) -> bool) -> Carved {
    let faces: Vec<[u32; 3]> =
        mesh.faces().iter().filter(|face| face.iter().all(|&i| keep(i))).copied().collect();
    of_faces(mesh, &faces)
}

/// The component of the largest area.
pub(super) fn largest_component(mesh: &Mesh) -> Carved {
    let components = Topology::new(mesh).components();
    let mut areas = vec![0.0; components.count];
    for (vertex, area) in mesh.vertex_areas().into_iter().enumerate() {
        if let Some(sum) = areas.get_mut(components.of_vertex[vertex] as usize) {
            *sum += area;
        }
    }
    let largest = (0..areas.len()).max_by(|&a, &b| areas[a].total_cmp(&areas[b]));
    carve(mesh, |i| Some(components.of_vertex[i as usize] as usize) == largest)
}

fn of_faces(mesh: &Mesh, faces: &[[u32; 3]]) -> Carved {
    let mut place = vec![NONE; mesh.n_vertices()];
    faces.iter().flatten().for_each(|&i| place[i as usize] = 0);
    let origin: Vec<u32> = (0..mesh.n_vertices() as u32).filter(|&i| place[i as usize] != NONE).collect();
    origin.iter().enumerate().for_each(|(new, &old)| place[old as usize] = new as u32);
    let vertices = origin.iter().map(|&i| mesh.vertices()[i as usize]).collect();
    let faces = faces.iter().map(|face| face.map(|i| place[i as usize])).collect();
    Carved { mesh: Mesh::new(vertices, faces).expect("a part of a valid mesh is valid"), origin }
}

/// Vertices by their distance from `center` along edges, nearest first, for as long as `more(vertex, distance)` says
/// so.
pub(super) fn spread(
    mesh: &Mesh,
    adjacency: &Adjacency,
    center: u32,
    mut more: impl FnMut(u32, f64) -> bool,
) {
    let position = |i: u32| mesh.vertices()[i as usize];
    let mut distances = vec![f64::INFINITY; mesh.n_vertices()];
    distances[center as usize] = 0.0;
    // Non-negative distances compare like their bits.
    let mut queue = BinaryHeap::from([Reverse((0u64, center))]);
    while let Some(Reverse((bits, vertex))) = queue.pop() {
        let distance = f64::from_bits(bits);
        if distance > distances[vertex as usize] {
            continue;
        }
        if !more(vertex, distance) {
            return;
        }
        for &next in adjacency.of(vertex as usize) {
            let longer = distance + vec3::distance(position(vertex), position(next));
            if longer < distances[next as usize] {
                distances[next as usize] = longer;
                queue.push(Reverse((longer.to_bits(), next)));
            }
        }
    }
}

/// Vertices within `radius` of `center` along edges.
pub(super) fn disc(mesh: &Mesh, adjacency: &Adjacency, center: u32, radius: f64) -> Vec<u32> {
    let mut inside = Vec::new();
    spread(mesh, adjacency, center, |vertex, distance| {
        let near = distance <= radius;
        if near {
            inside.push(vertex);
        }
        near
    });
    inside
}

/// The connected patches of the vertices that are marked, each ascending, in order of their lowest vertices.
pub(super) fn patches(adjacency: &Adjacency, marked: &[bool]) -> Vec<Vec<u32>> {
    let mut seen = vec![false; marked.len()];
    let mut patches = Vec::new();
    for start in 0..marked.len() {
        if !marked[start] || std::mem::replace(&mut seen[start], true) {
            continue;
        }
        let mut patch = vec![start as u32];
        let mut next = 0;
        while let Some(&vertex) = patch.get(next) {
            next += 1;
            for &i in adjacency.of(vertex as usize) {
                if marked[i as usize] && !std::mem::replace(&mut seen[i as usize], true) {
                    patch.push(i);
                }
            }
        }
        patch.sort_unstable();
        patches.push(patch);
    }
    patches
}
