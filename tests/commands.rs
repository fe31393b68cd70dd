//! The commands as a user runs them, on generated meshes.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use fmnet::Matrix;
use fmnet::io::{Attributes, Texture, read_matrix, read_mesh, read_vector, write_mesh, write_vector};
use fmnet::mesh::shapes::{bumpy_sphere, permuted, transformed};
use fmnet_tests::{SHOT, Workplace, targets};

#[test]
fn a_permuted_moved_and_scaled_copy_is_matched_exactly() {
    let work = Workplace::new();
    let mesh = bumpy_sphere(4, 1);
    let (copy, _) = permuted(&mesh, 7);
    let (sine, cosine) = 0.7f64.sin_cos();
    let turn = [[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]];
    work.mesh("a.off", &mesh);
    work.mesh("b.ply", &copy);
    work.mesh("c.obj", &transformed(&copy, turn, 250.0, [3.0, -2.0, 10.0]));
    let match_pair = |target: &str, map: &str| {
        work.succeed(&[&["match", "a.off", target, "-o", map][..], &SHOT].concat());
        targets(&work.path(map))
    };
    let map = match_pair("b.ply", "ab.txt");
    for (source, &target) in map.iter().enumerate() {
        assert_eq!(mesh.vertices()[source], copy.vertices()[target as usize], "source vertex {source}");
    }
    assert_eq!(match_pair("c.obj", "ac.txt"), map);
}

#[test]
fn every_kind_of_output_is_written_and_agrees() {
    let work = Workplace::new();
    work.mesh("a.off", &bumpy_sphere(3, 1));
    work.mesh("b.off", &permuted(&bumpy_sphere(3, 1), 2).0);
    let outputs = ["m.txt", "m.vts", "m.npy", "m.csv", "m.ply", "m.glb", "m.html"];
    let mut arguments = vec!["match", "a.off", "b.off", "--save-functional-map", "c.npy", "--json"];
    outputs.iter().for_each(|o| arguments.extend(["-o", o]));
    arguments.extend(SHOT);
    let summary: serde_json::Value = serde_json::from_str(&work.succeed(&arguments)).unwrap();
    assert!(summary["stages"].as_array().unwrap().iter().any(|s| s["stage"] == "eigenbasis"));
    let map = targets(&work.path("m.txt"));
    for name in &outputs[1..4] {
        assert_eq!(targets(&work.path(name)), map, "{name}");
    }
    let pair = read_mesh(&work.path("m.ply")).unwrap();
    assert_eq!(pair.mesh.n_vertices(), 2 * map.len());
    assert!(pair.attributes.vertex_colors.is_some());
    assert_eq!(read_matrix::<f64>(&work.path("c.npy")).unwrap().rows(), 40);
    assert!(work.temporary_files().is_empty());
}

#[test]
fn the_number_of_threads_does_not_change_a_byte() {
    let work = Workplace::new();
    work.mesh("a.off", &bumpy_sphere(4, 1));
    work.mesh("b.off", &bumpy_sphere(4, 2));
    let files = |threads: &str, refinement: &[&str]| {
        let (map, c) = (format!("m{threads}.csv"), format!("c{threads}.npy"));
        let arguments =
            ["match", "a.off", "b.off", "--threads", threads, "-o", &map, "--save-functional-map", &c];
        work.succeed(&[&arguments[..], &SHOT, refinement].concat());
        (std::fs::read(work.path(&map)).unwrap(), std::fs::read(work.path(&c)).unwrap())
    };
    for refinement in [&["--refine", "zoomout"][..], &["--refine", "wavelet", "--fm", "joint"]] {
        assert_eq!(files("1", refinement), files("2", refinement), "{refinement:?}");
    }
}

/// The network, its inputs and the joint map too; three threads cut the work otherwise than one or two do.
#[test]
fn the_learned_path_is_the_same_on_any_number_of_threads() {
    let work = Workplace::new();
    work.mesh("a.off", &bumpy_sphere(4, 1));
    work.mesh("b.off", &bumpy_sphere(4, 2));
    let files = |threads: &str| {
        work.succeed(&["match", "a.off", "b.off", "-o", "m.csv", "--threads", threads]);
        work.succeed(&["features", "a.off", "--out", "f", "--threads", threads]);
        ["m.csv", "f/descriptors.npy", "f/gradients_x.npy"]
            .map(|name| std::fs::read(work.path(name)).unwrap())
    };
    let one = files("1");
    assert!(one == files("2") && one == files("3"), "threads change the result");
}

/// Only `shared-triangulation` follows what both meshes share, and says so where they share nothing.
#[test]
fn refinements_do_what_their_names_say() {
    let work = Workplace::new();
    let mesh = bumpy_sphere(3, 1);
    let (copy, _) = permuted(&mesh, 5);
    work.mesh("a.off", &mesh);
    work.mesh("b.off", &copy);
    work.mesh("other.off", &bumpy_sphere(4, 1));
    let refined = |target: &str, refinement: &[&str]| -> serde_json::Value {
        let arguments = ["match", "a.off", target, "-o", "m.txt", "--json"];
        serde_json::from_str(&work.succeed(&[&arguments[..], &SHOT, refinement].concat())).unwrap()
    };
    for name in ["wavelet", "pmf", "pmf-geometry", "shared-triangulation"] {
        let summary = refined("b.off", &["--refine", name]);
        let matches = targets(&work.path("m.txt"));
        let exact = (mesh.vertices().iter().zip(&matches))
            .filter(|&(vertex, &target)| *vertex == copy.vertices()[target as usize]);
        assert_eq!(exact.count(), mesh.n_vertices(), "{name}");
        assert_eq!(summary["pmf"]["edges_kept"].is_number(), name == "shared-triangulation", "{name}");
    }
    refined("b.off", &["--refine", "wavelet", "--fm", "two-way"]);
    let arguments = ["match", "a.off", "other.off", "-o", "m.txt", "--refine", "shared-triangulation"];
    let warned = work.run(&[&arguments[..], &SHOT].concat());
    let message = String::from_utf8_lossy(&warned.stderr).to_string();
    assert!(warned.status.success() && message.contains("not triangulated alike"), "{message}");
}

#[test]
fn features_describe_the_mesh() {
    let work = Workplace::new();
    let mesh = bumpy_sphere(3, 1);
    work.mesh("a.ply", &mesh);
    work.succeed(&[&["features", "a.ply", "--out", "f"][..], &SHOT].concat());
    let file = |name: &str| work.path("f").join(name);
    let (mass, eigenvalues) = (
        read_vector::<f64>(&file("mass.npy")).unwrap(),
        read_vector::<f64>(&file("eigenvalues.npy")).unwrap(),
    );
    assert!((mass.iter().sum::<f64>() - 1.0).abs() < 1e-6, "areas are at unit area");
    assert!(eigenvalues[0].abs() < 1e-9 && eigenvalues.is_sorted());
    let vectors: Matrix = read_matrix(&file("eigenvectors.npy")).unwrap();
    assert_eq!((vectors.rows(), vectors.cols()), (mesh.n_vertices(), 40));
    assert_eq!(read_matrix::<f32>(&file("shot.npy")).unwrap().cols(), 352);
    assert!(!file("vertices.npy").exists());
}

#[test]
fn a_decimated_pair_is_upscaled() {
    let work = Workplace::new();
    let mesh = bumpy_sphere(5, 1);
    let (copy, _) = permuted(&mesh, 3);
    work.mesh("a.off", &mesh);
    work.mesh("b.off", &copy);
    let arguments = ["match", "a.off", "b.off", "-o", "m.npy", "--decimate", "2500", "--refine", "zoomout"];
    work.succeed(&[&arguments[..], &SHOT].concat());
    let map = targets(&work.path("m.npy"));
    let scale = mesh.scale();
    let error = |(s, &t): (usize, &u32)| {
        fmnet::mesh::vec3::distance(mesh.vertices()[s], copy.vertices()[t as usize]) / scale
    };
    let mean = map.iter().enumerate().map(error).sum::<f64>() / map.len() as f64;
    assert!(mean < 0.02, "mean error {mean}");
}

#[test]
fn a_batch_resumes_and_one_failure_does_not_stop_the_rest() {
    let work = Workplace::new();
    work.mesh("a.off", &bumpy_sphere(3, 1));
    work.mesh("b.off", &bumpy_sphere(3, 2));
    std::fs::write(
        work.path("pairs.txt"),
        "# two good, one bad\na.off b.off\na.off missing.off\nb.off a.off\n",
    )
    .unwrap();
    let arguments = [&["batch", "pairs.txt", "--out", "maps", "--json"][..], &SHOT].concat();
    let message = work.fail(&arguments, 2);
    assert!(message.contains("missing.off") && message.contains("1 of 3 pairs failed"), "{message}");
    assert!(work.path("maps/a__b.txt").is_file() && work.path("maps/b__a.txt").is_file());
    work.mesh("missing.off", &bumpy_sphere(3, 4));
    let summary: serde_json::Value = serde_json::from_str(&work.succeed(&arguments)).unwrap();
    assert_eq!((&summary["matched"], &summary["skipped"]), (&1.into(), &2.into()));
}

#[test]
fn transfer_and_evaluation_follow_the_map() {
    let work = Workplace::new();
    let mesh = bumpy_sphere(3, 1);
    work.mesh("a.off", &mesh);
    work.mesh("b.off", &mesh);
    let identity: String = (0..mesh.n_vertices()).map(|i| format!("{i}\n")).collect();
    std::fs::write(work.path("id.txt"), identity).unwrap();
    std::fs::write(work.path("marks.txt"), "5\n17\n").unwrap();
    work.succeed(&[
        "transfer",
        "a.off",
        "b.off",
        "--map",
        "id.txt",
        "--values",
        "marks.txt",
        "-o",
        "moved.txt",
    ]);
    assert_eq!(std::fs::read_to_string(work.path("moved.txt")).unwrap(), "5\n17\n");
    let arguments =
        ["evaluate", "id.txt", "--source", "a.off", "--target", "b.off", "--ground-truth", "identity"];
    let text = work.succeed(&[&arguments[..], &["-o", "curve.csv", "-o", "curve.svg", "--json"]].concat());
    let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(summary["maps"][0]["summary"]["exact"], 1.0);
    assert!(std::fs::read_to_string(work.path("curve.svg")).unwrap().starts_with("<svg"));
}

/// A textured OBJ to another mesh, as OBJ and GLB; and values beside it.
#[test]
fn a_texture_and_values_are_carried_over() {
    let work = Workplace::new();
    let mesh = bumpy_sphere(3, 1);
    let uvs = (0..mesh.n_faces()).map(|f| mesh.corners(f).map(|p| [0.25 * p[0] as f32, 0.25 * p[1] as f32]));
    std::fs::write(work.path("skin.png"), b"\x89PNG, as far as a reference goes").unwrap();
    let attributes = Attributes {
        corner_uvs: Some(uvs.collect()),
        texture: Some(Texture::File(work.path("skin.png"))),
        ..Attributes::default()
    };
    write_mesh(&work.path("giver.obj"), &mesh, &attributes).unwrap();
    work.mesh("a.off", &mesh);
    let identity: String = (0..mesh.n_vertices()).map(|i| format!("{i}\n")).collect();
    std::fs::write(work.path("id.txt"), identity).unwrap();
    let field: Vec<f32> = (0..mesh.n_vertices()).map(|v| v as f32).collect();
    write_vector(&work.path("field.npy"), &field).unwrap();
    let transfer = ["transfer", "a.off", "giver.obj", "--map", "id.txt"];
    let outputs = ["-o", "t.obj", "-o", "t.glb", "--values", "field.npy", "-o", "moved.npy"];
    work.succeed(&[&transfer[..], &outputs].concat());
    let obj = read_mesh(&work.path("t.obj")).unwrap();
    assert_eq!(
        obj.attributes,
        Attributes { texture: Some(Texture::File(work.path("skin.png"))), ..attributes.clone() }
    );
    let glb = read_mesh(&work.path("t.glb")).unwrap();
    // glTF counts v from the top.
    let uvs_of = |attributes: &Attributes| attributes.corner_uvs.clone().unwrap().into_flattened();
    let pairs = uvs_of(&glb.attributes).into_iter().zip(uvs_of(&attributes));
    assert!(pairs.into_iter().all(|(a, b)| a[0] == b[0] && (a[1] - b[1]).abs() < 1e-6));
    assert!(matches!(glb.attributes.texture, Some(Texture::Embedded { .. })));
    assert_eq!(read_vector::<f32>(&work.path("moved.npy")).unwrap(), field);
    for (outputs, culprit) in [
        (&["-o", "t.ply", "--values", "field.npy"][..], "no output is left"),
        (&["-o", "moved.npy"], "no --values file is left"),
        (&["-o", "moved.txt", "--values", "field.npy"], ".npy file"),
        (&["-o", "moved.csv", "--values", "field.npy"], "unknown kind of output"),
        (&["-o", "absent/t.ply"], "does not exist"),
    ] {
        let message = work.fail(&[&transfer[..], outputs].concat(), 2);
        assert!(message.contains(culprit), "{outputs:?}: {message}");
        assert!(!work.path("t.ply").exists());
    }
    std::fs::remove_file(work.path("giver.mtl")).unwrap();
    let warned = work.run(&[&transfer[..], &["-o", "t.ply"]].concat());
    assert!(String::from_utf8_lossy(&warned.stderr).contains("giver.mtl"));
}

/// What only matters to matching is refused, not ignored.
#[test]
fn features_take_no_options_of_matching() {
    let work = Workplace::new();
    work.mesh("a.off", &bumpy_sphere(2, 1));
    for option in
        [["--refine", "icp"], ["--upscale", "l21"], ["--fm", "bidirectional"], ["--mask-weight", "0.1"]]
    {
        let message = work.fail(&[&["features", "a.off", "--out", "f"][..], &option].concat(), 2);
        assert!(message.contains(option[0]), "{message}");
    }
}

#[test]
fn bad_usage_and_bad_input_exit_with_2_and_name_the_culprit() {
    let work = Workplace::new();
    work.mesh("a.off", &bumpy_sphere(2, 1));
    std::fs::write(work.path("broken.off"), "OFF\n3 1 0\n0 0 0\n1 0 0\n").unwrap();
    std::fs::write(work.path("text.onnx"), "no model").unwrap();
    let shot = |arguments: &[&'static str]| [arguments, &["--descriptor", "shot"]].concat();
    for (arguments, culprit) in [
        (vec!["match", "a.off"], "TARGET"),
        (vec!["match", "a.off", "a.off", "-o", "m.txt", "--decimate", "3"], "100 or more"),
        (shot(&["match", "a.off", "a.off", "-o", "m.jpg"]), "m.jpg"),
        (shot(&["match", "a.off", "a.off", "-o", "absent/m.txt"]), "absent"),
        (shot(&["match", "a.off", "broken.off", "-o", "m.txt"]), "broken.off"),
        (shot(&["match", "a.off", "absent.ply", "-o", "m.txt"]), "absent.ply"),
        (shot(&["match", "a.off", "a.off", "-o", "m.txt", "-k", "500", "--subdivide", "off"]), "k"),
        (vec!["match", "a.off", "a.off", "-o", "m.txt", "--model", "text.onnx"], "text.onnx"),
        (vec!["inspect", "text.onnx"], "text.onnx"),
    ] {
        let message = work.fail(&arguments, 2);
        assert!(message.contains(culprit), "{arguments:?}: {message}");
        assert!(!work.path("m.txt").exists());
    }
}

#[test]
fn inspect_tells_what_is_wrong() {
    let work = Workplace::new();
    for (name, mesh) in fmnet::mesh::shapes::zoo() {
        work.mesh("z.ply", &mesh);
        let report: serde_json::Value =
            serde_json::from_str(&work.succeed(&["inspect", "z.ply", "--json"])).unwrap();
        assert_eq!(report["report"]["n_vertices"], mesh.n_vertices(), "{name}");
    }
}
