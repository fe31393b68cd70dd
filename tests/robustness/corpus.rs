//! Broken meshes, made by code: everything the zoo has, and what is worse than that.

use fmnet::Mesh;
use fmnet::io::{Attributes, write_mesh};
use fmnet::mesh::shapes::{bumpy_sphere, grid, icosphere, joined, torus, zoo};
use std::f64::consts::TAU;
use std::path::Path;

/// Writes every file into the folder; their names.
pub(super) fn write(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for (name, mesh) in zoo().into_iter().chain(worse()) {
        let name = format!("{name}.ply");
        write_mesh(&folder.join(&name), &mesh, &Attributes::default()).unwrap();
        names.push(name);
    }
    for (name, content) in files() {
        std::fs::write(folder.join(name), content).unwrap();
        names.push(name.into());
    }
    names
}

fn build(vertices: Vec<[f64; 3]>, faces: Vec<[u32; 3]>) -> Mesh {
    Mesh::new(vertices, faces).unwrap()
}

fn moved(mesh: &Mesh, by: impl Fn(usize, [f64; 3]) -> [f64; 3]) -> Mesh {
    let vertices = mesh.vertices().iter().enumerate().map(|(i, &p)| by(i, p)).collect();
    build(vertices, mesh.faces().to_vec())
}

/// Meshes that read well and are hard on what comes after.
fn worse() -> Vec<(&'static str, Mesh)> {
    let bumpy = bumpy_sphere(3, 1);
    let scaled = |factor: f64| moved(&bumpy, |_, p| p.map(|x| x * factor));
    vec![
        ("no_faces", build(bumpy.vertices().to_vec(), Vec::new())),
        ("one_vertex", build(vec![[1.0, 2.0, 3.0]], Vec::new())),
        ("one_triangle", build(vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]])),
        ("a_point", moved(&bumpy, |_, _| [1.0; 3])),
        ("a_line", moved(&bumpy, |_, p| [p[0], 0.0, 0.0])),
        ("flattened", moved(&bumpy, |_, p| [p[0], p[1], 0.0])),
        ("nearly_flat", moved(&bumpy, |_, p| [p[0], p[1], 1e-12 * p[2]])),
        ("tiny", scaled(1e-150)),
        ("subnormal", scaled(1e-310)),
        ("huge", scaled(1e150)),
        ("overflowing", scaled(1e307)),
        ("far_away", moved(&bumpy, |_, p| p.map(|x| x + 1e12))),
        ("one_vertex_far_away", moved(&bumpy, |i, p| if i == 7 { [1e9; 3] } else { p })),
        ("spike", moved(&bumpy, |i, p| if i == 7 { p.map(|x| 1e4 * x) } else { p })),
        ("stretched", moved(&bumpy, |_, [x, y, z]| [1e6 * x, y, z])),
        ("needles", moved(&grid(40, 10), |_, [x, y, z]| [x, 1e-9 * y, z])),
        ("folded_over_itself", moved(&grid(20, 20), |_, [x, y, z]| [(x - 0.5).abs(), y, z])),
        ("twice_the_same", joined(&[&bumpy, &bumpy])),
        ("moebius_strip", moebius(60, 4)),
        ("fan_of_high_valence", fan(600)),
        ("all_faces_twice", build(bumpy.vertices().to_vec(), [bumpy.faces(), bumpy.faces()].concat())),
        ("book_of_many_pages", book(50)),
        ("many_small_components", many(60)),
        (
            "a_giant_and_a_dwarf",
            joined(&[&bumpy, &moved(&torus(12, 8, 0.4), |_, p| p.map(|x| 1e-5 * x + 3.0))]),
        ),
        ("every_third_face", every_third(&icosphere(3))),
        ("random_faces", random_faces(&bumpy)),
    ]
}

/// A strip of one side: no orientation fits.
fn moebius(around: usize, across: usize) -> Mesh {
    let width = across + 1;
    let point = |i: usize, j: usize| {
        let (angle, offset) = (TAU * i as f64 / around as f64, j as f64 / across as f64 - 0.5);
        let radius = 1.0 + 0.5 * offset * (0.5 * angle).cos();
        [radius * angle.cos(), radius * angle.sin(), 0.5 * offset * (0.5 * angle).sin()]
    };
    let vertices = (0..around * width).map(|v| point(v / width, v % width)).collect();
    let at = |i: usize, j: usize| match i == around {
        true => (across - j) as u32,
        false => (i * width + j) as u32,
    };
    let cells = (0..around).flat_map(|i| (0..across).map(move |j| (i, j)));
    let faces = cells.flat_map(|(i, j)| {
        [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
    });
    build(vertices, faces.collect())
}

/// A disc whose centre is in every triangle.
fn fan(rim: u32) -> Mesh {
    let on_rim = |i: u32| {
        let angle = TAU * f64::from(i) / f64::from(rim);
        [angle.cos(), angle.sin(), 0.1 * (5.0 * angle).sin()]
    };
    let vertices = std::iter::once([0.0; 3]).chain((0..rim).map(on_rim)).collect();
    build(vertices, (0..rim).map(|i| [0, 1 + i, 1 + (i + 1) % rim]).collect())
}

/// Many sheets that share one edge.
fn book(pages: u32) -> Mesh {
    let page = |i: u32| {
        let angle = TAU * f64::from(i) / f64::from(pages);
        [angle.cos(), angle.sin(), 0.5]
    };
    let vertices = [[0.0; 3], [0.0, 0.0, 1.0]].into_iter().chain((0..pages).map(page)).collect();
    build(vertices, (0..pages).map(|i| [0, 1, 2 + i]).collect())
}

fn many(count: usize) -> Mesh {
    let one = icosphere(0);
    let copies: Vec<Mesh> =
        (0..count).map(|i| moved(&one, |_, p| [p[0] + 3.0 * i as f64, p[1], p[2]])).collect();
    joined(&copies.iter().collect::<Vec<_>>())
}

fn every_third(mesh: &Mesh) -> Mesh {
    build(mesh.vertices().to_vec(), mesh.faces().iter().copied().step_by(3).collect())
}

/// Triangles between vertices that have nothing to do with each other.
fn random_faces(mesh: &Mesh) -> Mesh {
    let n = mesh.n_vertices() as u32;
    let at = |i: u32| i.wrapping_mul(2_654_435_761) % n;
    build(mesh.vertices().to_vec(), (0..2 * n).map(|i| [at(3 * i), at(3 * i + 1), at(3 * i + 2)]).collect())
}

/// Files that do not read well, or not at all.
fn files() -> Vec<(&'static str, &'static [u8])> {
    vec![
        ("empty.off", b""),
        ("empty.ply", b""),
        ("empty.obj", b""),
        ("empty.glb", b""),
        ("empty.stl", b""),
        ("no_extension", b"nothing that is known"),
        ("a_picture.png", b"\x89PNG\r\n\x1a\n"),
        ("a_picture.ply", b"\x89PNG\r\n\x1a\n"),
        ("not_a_number.off", b"OFF\n3 1 0\n0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n"),
        ("infinite.obj", b"v 0 0 inf\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        ("index_too_large.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
        ("negative_index.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -2\n"),
        ("promises_too_much.off", b"OFF\n4000000000 4000000000 0\n0 0 0\n"),
        ("truncated.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n"),
        (
            "promises_too_much.ply",
            b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n\
              property float z\nelement face 4000000000\nproperty list uchar int vertex_indices\nend_header\n",
        ),
        ("no_header.ply", b"0 0 0\n"),
        ("only_points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\np 1 2 3\n"),
        ("text.gltf", b"{ \"asset\": { \"version\": \"2.0\" } }"),
        ("not_json.gltf", b"{ \"asset\": "),
        ("truncated.glb", b"glTF\x02\x00\x00\x00\xff\xff\xff\x7f"),
    ]
}
