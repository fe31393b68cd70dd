//! Shapes of any size that the benches run on.
#![allow(dead_code, reason = "each bench uses a part of it")]

use fmnet::io::{IoError, read_mesh, write_matrix};
use fmnet::mesh::{DecimateOptions, decimate, shapes};
use fmnet::{Matrix, Mesh};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

/// A torus with bumps of several wavelengths, without symmetry; `ring * tube` vertices.
pub(crate) fn bumpy_torus(ring: usize, tube: usize) -> Mesh {
    let torus = shapes::torus(ring, tube, 0.4);
    let bump = |[x, y, z]: [f64; 3]| {
        let r = 1.0 + 0.2 * (3.0 * x + 0.3).sin() * (2.0 * y + 1.0).cos() + 0.1 * (5.0 * z + 4.0 * x).sin();
        [r * x, 0.8 * r * y, 1.5 * r * z]
    };
    let vertices = torus.vertices().iter().map(|&p| bump(p)).collect();
    Mesh::new(vertices, torus.faces().to_vec()).expect("the faces are those of the torus")
}

/// Source and target: the two people of the demo, of exactly `n` vertices each and triangulated on their own.
pub(crate) fn bodies(n: usize) -> [Mesh; 2] {
    [body("source", n, 1), body("target", n, 2)]
}

/// The `source` or the `target` of the demo, closed, of exactly `n` vertices; the seed decides the triangulation.
pub(crate) fn body(name: &str, n: usize, seed: u64) -> Mesh {
    let mut mesh = demo_body(name);
    while 4 * mesh.n_vertices() < 5 * n {
        mesh = shapes::subdivide(&mesh);
    }
    // Without the displacement the faces of a subdivided triangle are coplanar, as those of no scan are.
    let dense = displaced(mesh, seed);
    decimate(&dense, n, &DecimateOptions::default()).expect("bodies are manifold").mesh
}

/// The `source` or the `target` of the demo.
pub(crate) fn demo_body(name: &str) -> Mesh {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("demo/{name}.ply"));
    read_mesh(&file).expect("the demo's bodies are in the repository").mesh
}

/// Every vertex moved along its normal by up to a tenth of the mean edge.
pub(crate) fn displaced(mesh: Mesh, seed: u64) -> Mesh {
    let mut normals = vec![[0.0; 3]; mesh.n_vertices()];
    for (f, face) in mesh.faces().iter().enumerate() {
        let cross = mesh.face_cross(f);
        for &v in face {
            (0..3).for_each(|d| normals[v as usize][d] += cross[d]);
        }
    }
    let amplitude = 0.1 * (mesh.area() / mesh.n_vertices() as f64).sqrt();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let moved = mesh.vertices().iter().zip(&normals).map(|(p, n)| {
        let length = n.iter().map(|x| x * x).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let step = amplitude * rng.random_range(-1.0..1.0) / length;
        [p[0] + step * n[0], p[1] + step * n[1], p[2] + step * n[2]]
    });
    Mesh::new(moved.collect(), mesh.faces().to_vec()).expect("small steps keep vertices finite")
}

/// Writes `vertices.npy` `[n, 3]` and `faces.npy` `[m, 3]`.
pub(crate) fn write_arrays(folder: &Path, mesh: &Mesh) -> Result<(), IoError> {
    let vertices = Matrix::from_fn(mesh.n_vertices(), 3, |i, j| mesh.vertices()[i][j]);
    let faces = Matrix::from_fn(mesh.n_faces(), 3, |i, j| mesh.faces()[i][j] as i32);
    write_matrix(&folder.join("vertices.npy"), &vertices)?;
    write_matrix(&folder.join("faces.npy"), &faces)
}
