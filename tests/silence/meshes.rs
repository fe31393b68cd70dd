//! Meshes of every kind: soup with noise, sparse ones, many small parts, vertices without measurement.

use super::{run, workplace};
use fmnet::Mesh;
use fmnet::io::{Attributes, read_mesh, write_mesh};
use fmnet::mesh::shapes::{icosphere, joined, rotation, transformed, triangle_soup};
use fmnet::mesh::{DecimateOptions, decimate, vec3};
use fmnet::point_map::PointMap;
use fmnet_tests::{Workplace, targets, train};

/// What costs least.
const SHOT: [&str; 6] = ["--descriptor", "shot", "-k", "20", "--shot-radius", "0.2"];

/// Two men of the generator, `b.ply` the second, and which vertices correspond.
fn bodies(work: &Workplace) -> ([Mesh; 2], Vec<(usize, usize)>) {
    let synth = ["synth", "bodies", "--species", "man", "--count", "2", "--quiet"];
    let output = train().current_dir(work.folder()).args(synth).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let file = |name: &str, extension: &str| work.path(&format!("bodies/man/man_{name}.{extension}"));
    let meshes = ["000", "001"].map(|name| read_mesh(&file(name, "ply")).unwrap().mesh);
    work.mesh("b.ply", &meshes[1]);
    let [points_a, points_b] = ["000", "001"].map(|name| targets(&file(name, "vts")));
    let both = points_a.into_iter().zip(points_b).filter(|(a, b)| ![*a, *b].contains(&PointMap::UNMATCHED));
    (meshes, both.map(|(a, b)| (a as usize, b as usize)).collect())
}

/// Mean distance of matches from the right vertices, in percent of the target's diagonal.
fn error(target: &Mesh, map: &[u32], truth: &[(usize, usize)]) -> f64 {
    let place = |v: usize| target.vertices()[v];
    let sum: f64 = truth.iter().map(|&(s, t)| vec3::distance(place(map[s] as usize), place(t))).sum();
    100.0 * sum / truth.len() as f64 / target.diagonal()
}

/// Up to `by` of the diagonal along each axis, from the number of the coordinate.
fn noisy(mesh: &Mesh, by: f64) -> Mesh {
    let shift = |i: usize| (((i * 2_654_435_761) % 1013) as f64 / 506.0 - 1.0) * by * mesh.diagonal();
    let moved = |(i, p): (usize, &[f64; 3])| [0, 1, 2].map(|axis| p[axis] + shift(3 * i + axis));
    let vertices = mesh.vertices().iter().enumerate().map(moved).collect();
    Mesh::new(vertices, mesh.faces().to_vec()).unwrap()
}

#[test]
fn triangles_whose_corners_nearly_meet_hang_together() {
    let (work, mesh) = workplace();
    let corners = mesh.faces().iter().flatten().map(|&v| mesh.vertices()[v as usize]).collect();
    let faces = (0..mesh.n_faces() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    let soup = Mesh::new(corners, faces).unwrap();
    work.mesh("soup.ply", &noisy(&soup, 1e-6));
    let (_, err) = run(&work, &[&["match", "soup.ply", "a.off", "-o", "m.txt"][..], &SHOT].concat());
    assert!(!err.contains("warning"), "{err}");
    let truth: Vec<(usize, usize)> =
        mesh.faces().iter().flatten().enumerate().map(|(corner, &v)| (corner, v as usize)).collect();
    let found = error(&mesh, &targets(&work.path("m.txt")), &truth);
    assert!(found < 1.0, "{found} % of the diagonal");
    let (out, _) = run(&work, &["inspect", "soup.ply"]);
    assert!(out.contains("duplicate vertices welded"), "{out}");
    // What does not hang together for more than noise is said.
    work.mesh("apart.ply", &noisy(&soup, 1e-3));
    let (_, err) = run(&work, &[&["match", "apart.ply", "a.off", "-o", "m.txt"][..], &SHOT].concat());
    assert!(err.contains("apart.ply: the mesh is 1280 pieces"), "{err}");
}

#[test]
fn a_small_soup_has_as_many_eigenfunctions_as_its_surface() {
    let work = Workplace::new();
    work.mesh("soup.ply", &triangle_soup());
    work.mesh("sphere.ply", &icosphere(0));
    for name in ["soup.ply", "sphere.ply"] {
        run(&work, &["match", name, name, "-o", "m.txt", "--descriptor", "shot", "-k", "120"]);
    }
}

#[test]
fn meshes_of_games_match() {
    let work = Workplace::new();
    let ([source, target], points) = bodies(&work);
    let sparse = decimate(&source, 400, &DecimateOptions::default()).unwrap();
    work.mesh("a.ply", &sparse.mesh);
    let vertex_of_full = |full: usize| sparse.injection.iter().position(|&f| f as usize == full);
    let truth: Vec<(usize, usize)> =
        points.into_iter().filter_map(|(a, b)| Some((vertex_of_full(a)?, b))).collect();
    assert!(truth.len() > 50, "{}", truth.len());
    run(&work, &["match", "a.ply", "b.ply", "-o", "m.txt"]);
    let map = targets(&work.path("m.txt"));
    assert_eq!(map.len(), sparse.mesh.n_vertices());
    let found = error(&target, &map, &truth);
    assert!(found < 3.0, "{found} % of the diagonal");
    // And the other way round: matches are vertices that the sparse mesh has.
    run(&work, &["match", "b.ply", "a.ply", "-o", "m.txt"]);
    let back: Vec<(usize, usize)> = truth.iter().map(|&(s, t)| (t, s)).collect();
    let found = error(&sparse.mesh, &targets(&work.path("m.txt")), &back);
    assert!(found < 5.0, "{found} % of the diagonal");
    // The features of a subdivided mesh name the file's vertices.
    run(
        &work,
        &["features", "a.ply", "--out", "f", "--descriptor", "shot", "-k", "20", "--subdivide", "2000"],
    );
    let vertices = fmnet::io::read_vector::<i32>(&work.path("f/vertices.npy")).unwrap();
    assert_eq!(vertices.len(), 2000);
    assert!(vertices.iter().all(|&v| (v as usize) < sparse.mesh.n_vertices()));
}

#[test]
fn small_parts_do_not_spoil_the_body_and_are_matched() {
    let work = Workplace::new();
    let ([source, target], truth) = bodies(&work);
    // Twenty buttons in front of the source, none on the target.
    let radius = (0.003 * source.area() / (4.0 * std::f64::consts::PI)).sqrt();
    let buttons: Vec<Mesh> = (0..20)
        .map(|i| {
            let [x, y, z] = source.vertices()[40 * i];
            let turn = rotation([0.0, 0.0, 1.0], 0.1 * i as f64);
            transformed(&icosphere(2), turn, radius, [x + 2.0 * radius, y, z])
        })
        .collect();
    let all: Vec<&Mesh> = std::iter::once(&source).chain(&buttons).collect();
    work.mesh("a.ply", &joined(&all));
    let (_, err) = run(&work, &["match", "a.ply", "b.ply", "-o", "m.txt"]);
    assert!(err.contains("a.ply: 3240 of ") && err.contains("vertices, of 20 small pieces, follow"), "{err}");
    let map = targets(&work.path("m.txt"));
    assert!(map.iter().all(|&t| t != PointMap::UNMATCHED));
    let found = error(&target, &map, &truth);
    assert!(found < 3.0, "{found} % of the diagonal");
}

#[test]
fn vertices_without_measurement_stay_without_a_match() {
    let (work, mesh) = workplace();
    write_mesh(&work.path("whole.ply"), &mesh, &Attributes::default()).unwrap();
    let mut text = format!("OFF\n{} {} 0\n", mesh.n_vertices() + 2, mesh.n_faces());
    text.push_str("nan nan nan\n");
    mesh.vertices().iter().for_each(|[x, y, z]| text.push_str(&format!("{x} {y} {z}\n")));
    text.push_str("nan nan nan\n");
    mesh.faces().iter().for_each(|f| text.push_str(&format!("3 {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1)));
    std::fs::write(work.path("organised.off"), text).unwrap();
    let (_, err) = run(&work, &[&["match", "organised.off", "whole.ply", "-o", "m.txt"][..], &SHOT].concat());
    assert!(err.contains("organised.off: 2 of 644 vertices, the first 0 "), "{err}");
    let map = targets(&work.path("m.txt"));
    assert_eq!([map[0], map[643]], [PointMap::UNMATCHED; 2]);
    let exact = (0..642).filter(|&v| map[v + 1] == v as u32).count();
    assert!(exact > 600, "{exact} of 642");
}
