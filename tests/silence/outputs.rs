//! Outputs: never over an input, a set at a time, made anew where what they are made from changed.

use crate::{run, workplace};
use fmnet::io::{Attributes, Texture, write_mesh};
use fmnet::mesh::shapes::bumpy_sphere;
use fmnet_tests::{SHOT, Workplace, targets};

fn shot<'a>(arguments: &[&'a str]) -> Vec<&'a str> {
    [arguments, &SHOT].concat()
}

/// A textured mesh `scan.obj` with `body.mtl` and `skin.png`.
fn scan(work: &Workplace) {
    let mesh = bumpy_sphere(3, 1);
    std::fs::write(work.path("skin.png"), b"\x89PNG").unwrap();
    let attributes = Attributes {
        corner_uvs: Some(vec![[[0.0; 2]; 3]; mesh.n_faces()]),
        texture: Some(Texture::File(work.path("skin.png"))),
        ..Attributes::default()
    };
    write_mesh(&work.path("body.obj"), &mesh, &attributes).unwrap();
    let text = std::fs::read_to_string(work.path("body.obj")).unwrap();
    std::fs::write(work.path("scan.obj"), text).unwrap();
    std::fs::remove_file(work.path("body.obj")).unwrap();
}

#[test]
fn no_output_replaces_an_input() {
    let (work, mesh) = workplace();
    scan(&work);
    write_mesh(&work.path("a.ply"), &mesh, &Attributes::default()).unwrap();
    std::fs::create_dir(work.path("sub")).unwrap();
    std::fs::write(work.path("curve.csv"), format!("# n_source={0}, n_target={0}\n", mesh.n_vertices()))
        .unwrap();
    std::fs::write(work.path("a__b.txt"), "a.off b.off\n").unwrap();
    std::fs::write(work.path("field.npy"), []).unwrap();
    let evaluate = ["--source", "a.off", "--target", "b.off", "--ground-truth", "identity"];
    let before = |name: &str| std::fs::read(work.path(name)).unwrap();
    for (arguments, input) in [
        (shot(&["match", "a.ply", "b.off", "-o", "a.ply"]), "a.ply"),
        (shot(&["match", "a.ply", "b.off", "-o", "sub/../a.ply"]), "a.ply"),
        (shot(&["match", "scan.obj", "b.off", "-o", "skin.png"]), "skin.png"),
        (vec!["transfer", "a.ply", "b.off", "--map", "id.txt", "-o", "a.ply"], "a.ply"),
        (vec!["transfer", "b.off", "scan.obj", "--map", "id.txt", "-o", "body.obj"], "body.mtl"),
        (
            vec!["transfer", "b.off", "a.ply", "--map", "id.txt", "--values", "field.npy", "-o", "field.npy"],
            "field.npy",
        ),
        ([&["evaluate", "curve.csv", "-o", "curve.csv"][..], &evaluate].concat(), "curve.csv"),
        (shot(&["batch", "a__b.txt", "--out", "."]), "a__b.txt"),
    ] {
        let old = before(input);
        let message = work.fail(&arguments, 2);
        assert!(message.contains(input) && message.contains("overwritten"), "{arguments:?}: {message}");
        assert_eq!(before(input), old, "{arguments:?}");
    }
}

#[test]
fn outputs_that_cannot_be_written_are_found_before_the_work() {
    let (work, _) = workplace();
    let evaluate =
        ["evaluate", "id.txt", "--source", "a.off", "--target", "b.off", "--ground-truth", "identity"];
    std::fs::write(work.path("file"), "").unwrap();
    std::fs::write(work.path("pairs.txt"), "a.off b.off\n").unwrap();
    let matching =
        |rest: &[&'static str]| shot(&[&["match", "a.off", "b.off", "-o", "x.txt"][..], rest].concat());
    for (arguments, part) in [
        (matching(&["--save-functional-map", "x.txt"]), ".npy"),
        (matching(&["--save-functional-map", "C.csv"]), ".npy"),
        (matching(&["--save-functional-map", "absent/C.npy"]), "absent does not exist"),
        (matching(&["-o", "./x.txt"]), "same file"),
        (matching(&["-o", "."]), "unknown kind"),
        ([&evaluate[..], &["-o", "absent/x.csv"]].concat(), "absent does not exist"),
        (shot(&["features", "a.off", "--out", "file"]), "file is a file"),
        (shot(&["batch", "pairs.txt", "--out", "maps", "--root", "absent"]), "no such folder"),
        (vec!["demo", "-o", "absent/demo.html"], "absent does not exist"),
    ] {
        let message = work.fail(&arguments, 2);
        assert!(message.contains(part) && !message.contains("eigenbasis"), "{arguments:?}: {message}");
        assert!(!work.path("x.txt").exists());
    }
}

#[test]
fn features_replace_the_whole_set() {
    let (work, _) = workplace();
    // A soup of triangles is welded, so its rows are not its vertices.
    let mesh = bumpy_sphere(2, 1);
    let corners = (0..mesh.n_faces()).flat_map(|f| mesh.corners(f)).collect::<Vec<_>>();
    let faces = (0..mesh.n_faces() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    work.mesh("soup.off", &fmnet::Mesh::new(corners, faces).unwrap());
    run(&work, &shot(&["features", "soup.off", "--out", "f"]));
    std::fs::write(work.path("f/descriptors.npy"), "of an earlier run").unwrap();
    std::fs::write(work.path("f/notes.txt"), "mine").unwrap();
    assert!(work.path("f/vertices.npy").exists());
    run(&work, &shot(&["features", "a.off", "--out", "f"]));
    assert!(!work.path("f/vertices.npy").exists() && !work.path("f/descriptors.npy").exists());
    assert!(work.path("f/notes.txt").exists() && work.path("f/mass.npy").exists());
}

#[test]
fn a_batch_makes_maps_anew_where_anything_changed() {
    let (work, mesh) = workplace();
    std::fs::write(work.path("pairs.txt"), "a.off b.off\n").unwrap();
    let summary = |options: &[&str]| -> [u64; 3] {
        let arguments =
            [&["batch", "pairs.txt", "--out", "maps", "--json", "--descriptor", "shot"], options].concat();
        let (out, _) = run(&work, &arguments);
        let summary: serde_json::Value = serde_json::from_str(&out).unwrap();
        ["matched", "renewed", "skipped"].map(|name| summary[name].as_u64().unwrap())
    };
    let k30 = ["-k", "30", "--shot-radius", "0.2"];
    assert_eq!(summary(&k30), [1, 0, 0]);
    assert_eq!(summary(&k30), [0, 0, 1]);
    assert_eq!(summary(&["-k", "10", "--shot-radius", "0.2"]), [1, 1, 0]);
    assert_eq!(summary(&["-k", "10", "--shot-radius", "0.25"]), [1, 1, 0]);
    assert_eq!(summary(&["-k", "10", "--shot-radius", "0.25", "--partial"]), [1, 1, 0]);
    assert_eq!(summary(&k30), [1, 1, 0]);
    // Another mesh under the same name, and the same mesh in another file.
    let other = bumpy_sphere(2, 3);
    work.mesh("a.off", &other);
    assert_eq!(summary(&k30), [1, 1, 0]);
    assert_eq!(targets(&work.path("maps/a__b.txt")).len(), other.n_vertices());
    std::fs::write(
        work.path("a.off"),
        [&b"# the same\n"[..], &std::fs::read(work.path("a.off")).unwrap()].concat(),
    )
    .unwrap();
    assert_eq!(summary(&k30), [0, 0, 1]);
    // A map without a key may be of anything.
    std::fs::remove_file(work.path("maps/a__b.txt.key")).unwrap();
    assert_eq!(summary(&k30), [1, 1, 0]);
    assert!(mesh.n_vertices() > other.n_vertices());
}

#[test]
fn shapes_of_one_name_and_lists_of_every_kind() {
    let (work, mesh) = workplace();
    for (name, seed, level) in [("s1/body.off", 1, 3), ("s2/body.off", 2, 2)] {
        std::fs::create_dir(work.path(name).parent().unwrap()).unwrap();
        work.mesh(name, &bumpy_sphere(level, seed));
    }
    std::fs::write(work.path("pairs.txt"), "s1/body.off b.off\ns2/body.off b.off\n").unwrap();
    run(&work, &shot(&["batch", "pairs.txt", "--out", "maps"]));
    let length = |name: &str| targets(&work.path(name)).len();
    assert_eq!(length("maps/s1_body.off__b.off.txt"), mesh.n_vertices());
    assert_eq!(length("maps/s2_body.off__b.off.txt"), bumpy_sphere(2, 2).n_vertices());
    work.mesh("scan #1.off", &mesh);
    let text = "\u{feff}\"scan #1.off\",b.off\r\n# a.off b.off\r\n";
    let utf16: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    std::fs::write(work.path("list.txt"), utf16).unwrap();
    run(&work, &shot(&["batch", "list.txt", "--out", "maps"]));
    assert_eq!(length("maps/scan #1__b.txt"), mesh.n_vertices());
}
