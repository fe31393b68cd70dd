//! What is carried, what is kept, and what is said of the rest.

use crate::{run, workplace};
use fmnet::Mesh;
use fmnet::io::{
    Attributes, IntegerField, IntegerKind, Joint, NpyArray, NpyKind, Skin, Texture, read_mesh, read_npy,
    write_mesh, write_npy, write_vector,
};
use fmnet::mesh::shapes::bumpy_sphere;
use fmnet::{Matrix, mesh::shapes::transformed};

const FRAME: [[f64; 4]; 4] =
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.1, 0.2, 0.3, 1.0]];

fn skin(n: usize) -> Skin {
    Skin {
        joints: vec![Joint { name: "hip".into(), parent: None, frame: FRAME }],
        indices: vec![[0; 4]; n],
        weights: vec![[1.0, 0.0, 0.0, 0.0]; n],
    }
}

fn textured(mesh: &Mesh) -> Attributes {
    Attributes {
        corner_uvs: Some(vec![[[0.25, 0.5]; 3]; mesh.n_faces()]),
        texture: Some(Texture::Embedded { bytes: b"\x89PNG".to_vec(), mime: "image/png".into() }),
        ..Attributes::default()
    }
}

fn transfer<'a>(source: &'a str, target: &'a str, output: &'a str) -> [&'a str; 7] {
    ["transfer", source, target, "--map", "id.txt", "-o", output]
}

#[test]
fn the_receiver_keeps_what_the_giver_has_not() {
    let (work, mesh) = workplace();
    write_mesh(&work.path("scan.ply"), &mesh, &textured(&mesh)).unwrap();
    let rig = Attributes { skin: Some(skin(mesh.n_vertices())), ..Attributes::default() };
    write_mesh(&work.path("rig.glb"), &mesh, &rig).unwrap();
    let (out, err) = run(&work, &transfer("scan.ply", "rig.glb", "rigged.glb"));
    assert!(out.contains("received skin weights of 1 joints") && err.is_empty(), "{out} {err}");
    let rigged = read_mesh(&work.path("rigged.glb")).unwrap().attributes;
    assert!(rigged.skin.is_some() && rigged.texture.is_some() && rigged.corner_uvs.is_some());
    // What both have is the giver's, and that is said.
    let colors =
        |c: u8| Attributes { vertex_colors: Some(vec![[c; 4]; mesh.n_vertices()]), ..Attributes::default() };
    write_mesh(&work.path("dark.ply"), &mesh, &colors(9)).unwrap();
    write_mesh(&work.path("light.ply"), &mesh, &colors(200)).unwrap();
    let (_, err) = run(&work, &transfer("dark.ply", "light.ply", "x.ply"));
    assert!(err.contains("dark.ply: replaced") && err.contains("colours"), "{err}");
    assert_eq!(read_mesh(&work.path("x.ply")).unwrap().attributes.vertex_colors.unwrap()[0], [200; 4]);
}

#[test]
fn quads_groups_and_nothing_to_carry_are_named() {
    let (work, _) = workplace();
    let quads = "o body\ng arm\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nf 1 2 3 4\nf 2 5 6 3\n";
    std::fs::write(work.path("quads.obj"), quads).unwrap();
    std::fs::write(work.path("plain.obj"), quads.replace("g arm\n", "")).unwrap();
    std::fs::write(work.path("id.txt"), "0\n1\n2\n3\n4\n5\n").unwrap();
    let (out, err) = run(&work, &transfer("quads.obj", "plain.obj", "x.obj"));
    assert!(out.contains("0 vertices received nothing"), "{out}");
    for part in ["2 polygons", "1 groups (arm)", "plain.obj: there is nothing to carry"] {
        assert!(err.contains(part), "{part}: {err}");
    }
    let (out, _) = run(&work, &["inspect", "quads.obj"]);
    assert!(out.contains("4 faces (2 polygons of the file") && out.contains("1 groups: arm"), "{out}");
}

#[test]
fn what_a_format_cannot_hold_is_named_for_each_output() {
    let (work, mesh) = workplace();
    let n = mesh.n_vertices();
    let attributes = Attributes {
        vertex_scalars: vec![("quality".into(), vec![0.5; n])],
        skin: Some(skin(n)),
        ..textured(&mesh)
    };
    write_mesh(&work.path("giver.glb"), &mesh, &attributes).unwrap();
    std::fs::write(work.path("id.txt"), (0..n).map(|i| format!("{i}\n")).collect::<String>()).unwrap();
    for (output, lost) in [
        ("x.off", &["texture coordinates", "'quality'", "skin weights"][..]),
        ("x.obj", &["'quality'", "skin weights"]),
        ("x.ply", &["skin weights"]),
        ("x.glb", &[]),
    ] {
        let (_, err) = run(&work, &transfer("a.off", "giver.glb", output));
        let warnings: Vec<&str> = err.lines().filter(|line| line.contains("cannot hold")).collect();
        assert_eq!(warnings.len(), lost.len(), "{output}: {err}");
        lost.iter().for_each(|what| assert!(err.contains(what), "{what}: {err}"));
    }
}

#[test]
fn labels_keep_their_type_and_are_never_mixed() {
    let (work, _) = workplace();
    let (coarse, fine) = (bumpy_sphere(2, 1), bumpy_sphere(4, 1));
    let nearest = fmnet::mesh::nearest_vertices(coarse.vertices(), fine.vertices());
    std::fs::write(work.path("id.txt"), nearest.iter().map(|t| format!("{t}\n")).collect::<String>())
        .unwrap();
    work.mesh("fine.off", &fine);
    let labels: Vec<i64> = coarse.vertices().iter().map(|p| if p[0] > 0.0 { 31 } else { 1 }).collect();
    let field = IntegerField { name: "label".into(), kind: IntegerKind::U16, values: labels.clone() };
    let attributes = Attributes { vertex_integers: vec![field], ..Attributes::default() };
    write_mesh(&work.path("coarse.ply"), &coarse, &attributes).unwrap();
    run(&work, &transfer("fine.off", "coarse.ply", "x.ply"));
    let moved = &read_mesh(&work.path("x.ply")).unwrap().attributes.vertex_integers[0];
    assert!(moved.kind == IntegerKind::U16 && moved.values.iter().all(|x| [1, 31].contains(x)));
    for kind in [NpyKind::U1, NpyKind::I2, NpyKind::I8] {
        write_npy(
            &work.path("l.npy"),
            &NpyArray::Integers(Matrix::from_vec(labels.len(), 1, labels.clone()), kind),
        )
        .unwrap();
        let arguments =
            [&transfer("fine.off", "coarse.ply", "l_out.npy")[..], &["--values", "l.npy"]].concat();
        run(&work, &arguments);
        let NpyArray::Integers(moved, moved_kind) = read_npy(&work.path("l_out.npy")).unwrap() else {
            panic!()
        };
        assert!(moved_kind == kind && moved.data().iter().all(|x| [1, 31].contains(x)));
    }
    let singles: Vec<f32> = labels.iter().map(|&x| x as f32).collect();
    write_vector(&work.path("f.npy"), &singles).unwrap();
    run(&work, &[&transfer("fine.off", "coarse.ply", "f_out.npy")[..], &["--values", "f.npy"]].concat());
    let NpyArray::Floats(moved, NpyKind::F4) = read_npy(&work.path("f_out.npy")).unwrap() else { panic!() };
    assert!(moved.data().iter().any(|&x| x > 1.5 && x < 30.5), "numbers are mixed");
}

#[test]
fn a_skeleton_in_another_unit_is_fitted_and_that_is_said() {
    let (work, mesh) = workplace();
    let turn = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    let receiver = transformed(&mesh, turn, 100.0, [50.0, 0.0, 0.0]);
    work.mesh("scan.off", &receiver);
    let rig = Attributes { skin: Some(skin(mesh.n_vertices())), ..Attributes::default() };
    write_mesh(&work.path("rig.glb"), &mesh, &rig).unwrap();
    let (_, err) = run(&work, &transfer("scan.off", "rig.glb", "rigged.glb"));
    assert!(err.contains("the skeleton was fitted") && err.contains("scaled by 100.0"), "{err}");
    let joint = read_mesh(&work.path("rigged.glb")).unwrap().attributes.skin.unwrap().joints[0].frame[3];
    // (0.1, 0.2, 0.3) turned, scaled and moved.
    for (found, expected) in joint.iter().zip([30.0, 10.0, 30.0]) {
        assert!((found - expected).abs() < 1e-3, "{joint:?}");
    }
}

#[test]
fn nothing_to_measure_is_said() {
    let (work, mesh) = workplace();
    let n = mesh.n_vertices();
    std::fs::write(work.path("none.txt"), "-1\n".repeat(n)).unwrap();
    let pair = ["--source", "a.off", "--target", "a.off", "--ground-truth"];
    let evaluate =
        |map: &'static str, truth: &'static str| [&["evaluate", map][..], &pair, &[truth]].concat();
    let (out, _) = run(&work, &evaluate("none.txt", "identity"));
    assert!(out.contains("nothing to measure") && !out.contains("0.000"), "{out}");
    let (out, _) = run(&work, &[&evaluate("none.txt", "identity")[..], &["--json"]].concat());
    let summary: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert!(summary["maps"][0]["summary"]["mean"].is_null());
    let message = work.fail(&evaluate("id.txt", "none.txt"), 2);
    assert!(
        message.contains("--ground-truth none.txt") && message.contains("nothing to measure"),
        "{message}"
    );
    // Lengths name the file.
    std::fs::write(work.path("short.txt"), "0\n".repeat(n - 3)).unwrap();
    let message = work.fail(&evaluate("short.txt", "identity"), 2);
    assert!(message.contains("short.txt has") && message.contains("a.off has"), "{message}");
    // Columns of maps of one name are told apart.
    for folder in ["run1", "run2"] {
        std::fs::create_dir(work.path(folder)).unwrap();
        std::fs::copy(work.path("id.txt"), work.path(folder).join("map.txt")).unwrap();
    }
    run(&work, &[&evaluate("run1/map.txt", "identity")[..], &["run2/map.txt", "-o", "x.csv"]].concat());
    let header = std::fs::read_to_string(work.path("x.csv")).unwrap().lines().next().unwrap().to_owned();
    assert_eq!(header, "threshold,run1/map.txt,run2/map.txt");
}

#[test]
fn matches_on_another_body_count() {
    let (work, mesh) = workplace();
    let n = mesh.n_vertices() as u32;
    let moved = transformed(&mesh, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], 1.0, [5.0, 0.0, 0.0]);
    work.mesh("two.off", &fmnet::mesh::shapes::joined(&[&mesh, &moved]));
    let cross: String = (0..2 * n).map(|i| format!("{}\n", if i < n { i + n } else { i })).collect();
    std::fs::write(work.path("cross.txt"), cross).unwrap();
    let arguments = [
        "evaluate",
        "cross.txt",
        "--source",
        "two.off",
        "--target",
        "two.off",
        "--ground-truth",
        "identity",
        "--json",
    ];
    let (out, _) = run(&work, &arguments);
    let summary: serde_json::Value = serde_json::from_str(&out).unwrap();
    let (map, scale) = (&summary["maps"][0], (2.0 * mesh.area()).sqrt());
    assert_eq!(map["on_another_component"], n);
    // Half of the vertices are 5 away from where they belong, the other half are right.
    assert!((map["summary"]["mean"].as_f64().unwrap() - 2.5 / scale).abs() < 1e-5, "{map}");
    assert_eq!(map["summary"]["exact"], 0.5);
}
