//! Meshes with the defects of real scans, one kind each.

use super::{build, grid, icosphere, joined, map_vertices, open_half_sphere};
use crate::Mesh;
use crate::mesh::vec3;

/// Two spheres apart, the second of half the size and fewer vertices.
pub fn two_components() -> Mesh {
    let small = map_vertices(&icosphere(1), |p| vec3::add(vec3::scale(p, 0.5), [2.0, 0.0, 0.0]));
    joined(&[&icosphere(2), &small])
}

/// Three square sheets that meet in the z axis: every edge on the axis has three faces.
pub fn non_manifold_edge() -> Mesh {
    let n = 4;
    let sheet = grid(n, n);
    let mut vertices: Vec<[f64; 3]> = (0..=n).map(|j| [0.0, 0.0, j as f64 / n as f64]).collect();
    let mut faces = Vec::new();
    for turn in [0.0, 2.0, 4.0f64] {
        let (sin, cos) = turn.sin_cos();
        let map: Vec<u32> = (0..sheet.n_vertices())
            .map(|v| {
                let [x, y, _] = sheet.vertices()[v];
                if v % (n + 1) == 0 {
                    return (v / (n + 1)) as u32;
                }
                vertices.push([x * cos, x * sin, y]);
                vertices.len() as u32 - 1
            })
            .collect();
        faces.extend(sheet.faces().iter().map(|face| face.map(|i| map[i as usize])));
    }
    build(vertices, faces)
}

/// A large and a small sphere that share one vertex, vertex 0, which has two fans of faces.
pub fn bowtie_vertex() -> Mesh {
    let large = icosphere(2);
    let contact = large.vertices()[0];
    let small = map_vertices(&icosphere(1), |p| vec3::add(contact, vec3::scale(vec3::add(p, contact), 0.3)));
    let touching = (0..small.n_vertices())
        .min_by(|&a, &b| {
            let distance = |i: usize| vec3::distance(small.vertices()[i], contact);
            distance(a).total_cmp(&distance(b))
        })
        .expect("the sphere has vertices") as u32;
    let both = joined(&[&large, &small]);
    let offset = large.n_vertices() as u32;
    let merge = |i: u32| match i {
        i if i == offset + touching => 0,
        i if i > offset + touching => i - 1,
        i => i,
    };
    let mut vertices = both.vertices().to_vec();
    vertices.remove((offset + touching) as usize);
    build(vertices, both.faces().iter().map(|face| face.map(merge)).collect())
}

/// A sphere with two faces that repeat a vertex and one without area along an edge.
pub fn with_degenerate_faces() -> Mesh {
    let sphere = icosphere(2);
    let [a, b, c] = sphere.faces()[10];
    let mut vertices = sphere.vertices().to_vec();
    let midpoint = vertices.len() as u32;
    vertices.push(vec3::scale(vec3::add(vertices[a as usize], vertices[b as usize]), 0.5));
    let mut faces = vec![[a, a, b]];
    faces.extend_from_slice(sphere.faces());
    faces.extend([[b, c, b], [a, midpoint, b]]);
    build(vertices, faces)
}

/// A sphere of two halves with an equator each, at the same positions, and a face of each half twice, once reversed.
pub fn with_duplicates() -> Mesh {
    let upper = open_half_sphere(2);
    let lower = map_vertices(&upper, |[x, y, z]| [x, -y, -z]);
    let both = joined(&[&upper, &lower]);
    let mut faces = both.faces().to_vec();
    let [a, b, c] = faces[3];
    let [d, e, f] = faces[upper.n_faces() + 5];
    faces.extend([[b, c, a], [d, f, e]]);
    build(both.vertices().to_vec(), faces)
}

/// A sphere with a vertex that no face names before, between and after the others.
pub fn with_unreferenced_vertices() -> Mesh {
    let sphere = icosphere(2);
    let mut vertices = vec![[0.1, 0.2, 0.3]];
    vertices.extend_from_slice(sphere.vertices());
    vertices.insert(21, [9.0, 0.0, 0.0]);
    vertices.push([0.0, 9.0, 0.0]);
    let shift = |i: u32| i + 1 + u32::from(i >= 20);
    build(vertices, sphere.faces().iter().map(|face| face.map(shift)).collect())
}

/// A sphere with every fourth face the wrong way round.
pub fn flipped_faces() -> Mesh {
    let sphere = icosphere(2);
    let flip = |(i, &[a, b, c]): (usize, &[u32; 3])| if i % 4 == 1 { [a, c, b] } else { [a, b, c] };
    build(sphere.vertices().to_vec(), sphere.faces().iter().enumerate().map(flip).collect())
}

/// A sphere whose faces share no vertices, as STL files store them.
pub fn triangle_soup() -> Mesh {
    let sphere = icosphere(2);
    let vertices = (0..sphere.n_faces()).flat_map(|f| sphere.corners(f)).collect();
    build(vertices, (0..sphere.n_faces() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect())
}
