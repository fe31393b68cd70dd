//! Meshes for the tests of this module.

use crate::Mesh;
use crate::mesh::shapes;
use std::collections::HashMap;

/// The unit sphere: an octahedron with every edge cut in `m`, pushed out; `4 m^2 + 2` vertices.
pub(super) fn sphere(m: usize) -> Mesh {
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    let mut numbers = HashMap::new();
    let mut number = |p: [i32; 3]| {
        *numbers.entry(p).or_insert_with(|| {
            let r = p.iter().map(|x| f64::from(x * x)).sum::<f64>().sqrt();
            vertices.push(p.map(|x| f64::from(x) / r));
            vertices.len() as u32 - 1
        })
    };
    let m = m as i32;
    let mut faces = Vec::new();
    for octant in 0..8 {
        let signs = [0, 1, 2].map(|axis| if octant >> axis & 1 == 0 { 1 } else { -1 });
        let mut add = |corners: [[i32; 2]; 3]| {
            let mut face = corners.map(|[i, j]| number([signs[0] * i, signs[1] * j, signs[2] * (m - i - j)]));
            if signs[0] * signs[1] * signs[2] < 0 {
                face.swap(1, 2);
            }
            faces.push(face);
        };
        for i in 0..m {
            for j in 0..m - i {
                add([[i, j], [i + 1, j], [i, j + 1]]);
                if i + j + 1 < m {
                    add([[i + 1, j], [i + 1, j + 1], [i, j + 1]]);
                }
            }
        }
    }
    Mesh::new(vertices, faces).unwrap()
}

/// A body without symmetry, its surface a bumpy, stretched sphere.
pub(super) fn bumpy(m: usize) -> Mesh {
    let round = sphere(m);
    let bump = |[x, y, z]: [f64; 3]| {
        let r = 1.0 + 0.3 * (3.0 * x).sin() * (2.0 * y + 1.0).cos() + 0.2 * (5.0 * z + 0.4).sin();
        [r * x, 0.7 * r * y, 1.8 * r * z]
    };
    Mesh::new(round.vertices().iter().map(|&p| bump(p)).collect(), round.faces().to_vec()).unwrap()
}

/// A rectangle `[0, width] x [0, height]` in `columns x rows` cells of two triangles.
pub(super) fn grid(columns: usize, rows: usize, width: f64, height: f64) -> Mesh {
    let at = |i: usize, j: usize| (j * (columns + 1) + i) as u32;
    let (dx, dy) = (width / columns as f64, height / rows as f64);
    let vertices =
        (0..=rows).flat_map(|j| (0..=columns).map(move |i| [i as f64 * dx, j as f64 * dy, 0.0])).collect();
    let faces = (0..rows)
        .flat_map(|j| (0..columns).map(move |i| (i, j)))
        .flat_map(|(i, j)| {
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        })
        .collect();
    Mesh::new(vertices, faces).unwrap()
}

/// `mesh` with every coordinate multiplied by `factor`.
pub(super) fn scaled(mesh: &Mesh, factor: f64) -> Mesh {
    let vertices = mesh.vertices().iter().map(|p| p.map(|x| factor * x)).collect();
    Mesh::new(vertices, mesh.faces().to_vec()).unwrap()
}

/// The crate's zoo, and what is hard on a Laplacian in particular: name, mesh.
pub(super) fn zoo() -> Vec<(&'static str, Mesh)> {
    let base = bumpy(12);
    let n = base.n_vertices() as u32;
    let with = |extra_vertices: &[[f64; 3]], extra_faces: &[[u32; 3]]| {
        Mesh::new(
            base.vertices().iter().chain(extra_vertices).copied().collect(),
            base.faces().iter().chain(extra_faces).copied().collect(),
        )
        .unwrap()
    };
    let [a, b, _] = base.faces()[9];
    let p = base.vertices()[a as usize];
    let flat = base.vertices().iter().map(|&[x, y, z]| [x, y, 1e-7 * z]).collect();
    let mut zoo = shapes::zoo();
    zoo.extend([
        ("open", Mesh::new(base.vertices().to_vec(), base.faces()[40..].to_vec()).unwrap()),
        ("face of no area on an edge", with(&[p], &[[a, b, n]])),
        ("face with equal indices", with(&[], &[[3, 3, 7]])),
        ("fin on an edge", with(&[[0.0, 0.0, 4.0]], &[[a, b, n]])),
        ("vertices at one point", with(&[p, p, p], &[[n, n + 1, n + 2]])),
        ("squashed flat", Mesh::new(flat, base.faces().to_vec()).unwrap()),
    ]);
    zoo
}
