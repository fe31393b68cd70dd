//! The examples in Python and JavaScript give the map of the program.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use fmnet::Matrix;
use fmnet::io::read_matrix;
use fmnet::mesh::shapes::{bumpy_sphere, permuted};
use fmnet_tests::{Workplace, javascript, python, root, run, targets};
use std::process::Command;

/// How much farther than the program's match another one may be and still count as a tie: descriptors are rounded to
/// f32.
const TIE: f64 = 1e-3;

/// A pair with features, and the program's map and functional maps.
fn matched_pair() -> (Workplace, String) {
    let work = Workplace::new();
    let model = root().join("models/bodies/model.onnx").canonicalize().unwrap().display().to_string();
    work.mesh("a.off", &bumpy_sphere(4, 1));
    work.mesh("b.off", &permuted(&bumpy_sphere(4, 2), 5).0);
    for name in ["a", "b"] {
        work.succeed(&["features", &format!("{name}.off"), "--out", name, "--model", &model]);
    }
    // The map back is solved for on its own, as the one forth of the exchanged pair.
    for (source, target, map, functional_map) in
        [("a.off", "b.off", "map.txt", "forth.npy"), ("b.off", "a.off", "back.txt", "back.npy")]
    {
        let outputs = ["-o", map, "--save-functional-map", functional_map];
        let pair = ["match", source, target, "--refine", "none", "--model", &model];
        work.succeed(&[&pair[..], &outputs].concat());
    }
    (work, model)
}

/// Eigenvectors of a shape at unit area, as many as the functional map takes.
fn eigenvectors(work: &Workplace, folder: &str, k: usize) -> Matrix {
    read_matrix::<f64>(&work.path(folder).join("eigenvectors.npy")).unwrap().first_cols(k)
}

/// Both maps agree, or their matches are equally near in the joint embedding where they do not.
fn assert_same_map(work: &Workplace, found: &str) {
    let (expected, found) = (targets(&work.path("map.txt")), targets(&work.path(found)));
    assert_eq!(expected.len(), found.len());
    let [forth, back] = ["forth.npy", "back.npy"].map(|name| read_matrix::<f64>(&work.path(name)).unwrap());
    let k = forth.rows();
    let (phi, psi) = (eigenvectors(work, "a", k), eigenvectors(work, "b", k));
    let apart = |c: &Matrix, from: &[f64], to: &[f64]| -> f64 {
        let image = (0..k).map(|i| c.row(i).iter().zip(from).map(|(a, b)| a * b).sum::<f64>());
        image.zip(to).map(|(a, b)| (a - b).powi(2)).sum()
    };
    let distance = |x: usize, y: u32| {
        let (phi, psi) = (phi.row(x), psi.row(y as usize));
        (apart(&forth, phi, psi) + apart(&back, psi, phi)).sqrt()
    };
    let others: Vec<usize> = (0..found.len()).filter(|&x| found[x] != expected[x]).collect();
    eprintln!("{} of {} matches differ", others.len(), found.len());
    assert!(others.len() < found.len() / 100, "{} of {} matches differ", others.len(), found.len());
    for x in others {
        let (nearest, other) = (distance(x, expected[x]), distance(x, found[x]));
        assert!(other < nearest * (1.0 + TIE), "source vertex {x}: {other} instead of {nearest}");
    }
}

#[test]
fn python_gives_the_same_map() {
    let Some(python) = python() else { return };
    let (work, model) = matched_pair();
    let script = root().join("examples/python/match.py").canonicalize().unwrap();
    let arguments = ["a", "b", &model, "python.txt"];
    run(Command::new(python).current_dir(work.folder()).arg(script).args(arguments)).unwrap();
    assert_same_map(&work, "python.txt");
}

#[test]
fn javascript_gives_the_same_map() {
    let Some(packages) = javascript() else { return };
    let (work, model) = matched_pair();
    let script = root().join("examples/javascript/match.js").canonicalize().unwrap();
    let arguments = ["a", "b", &model, "javascript.txt"];
    let mut node = Command::new("node");
    node.env("NODE_PATH", packages.join("node_modules")).current_dir(work.folder());
    run(node.arg(script).args(arguments)).unwrap();
    assert_same_map(&work, "javascript.txt");
}
