//! Maps say what they are worth: by exit status, summary and warning, on the demo's bodies and copies of them.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use fmnet::Mesh;
use fmnet::io::{read_mesh, read_point_map};
use fmnet::mesh::shapes::{bumpy_sphere, permuted};
use fmnet_tests::{Workplace, infer, root, targets};
use serde_json::Value;

fn man() -> Mesh {
    read_mesh(&root().join("runtime/demo/source.ply")).unwrap().mesh
}

fn quality(work: &Workplace, arguments: &[&str]) -> Value {
    let summary: Value = serde_json::from_str(&work.succeed(arguments)).unwrap();
    summary["quality"].clone()
}

#[test]
fn an_inside_out_mesh_is_turned_and_a_mirrored_one_matched_without_reversal() {
    let work = Workplace::new();
    let man = man();
    let (copy, _) = permuted(&man, 5);
    let inside_out = copy.faces().iter().map(|&[a, b, c]| [a, c, b]).collect();
    let inside_out = Mesh::new(copy.vertices().to_vec(), inside_out).unwrap();
    let mirrored = copy.vertices().iter().map(|&[x, y, z]| [-x, y, z]).collect();
    let mirrored = Mesh::new(mirrored, copy.faces().to_vec()).unwrap();
    work.mesh("man.ply", &man);
    work.mesh("copy.ply", &copy);
    work.mesh("inside_out.ply", &inside_out);
    work.mesh("mirrored.ply", &mirrored);
    let right = quality(&work, &["match", "man.ply", "copy.ply", "-o", "copy.txt", "--json"]);
    assert!(right["expected_error"].as_f64().unwrap() < 3.0 && right["doubtful"] == false, "{right}");
    work.succeed(&["match", "man.ply", "inside_out.ply", "-o", "inside_out.txt", "--strict"]);
    let same = targets(&work.path("copy.txt"))
        .iter()
        .zip(targets(&work.path("inside_out.txt")))
        .filter(|(a, b)| **a == *b)
        .count();
    assert!(same as f64 > 0.99 * man.n_vertices() as f64, "{same} of {}", man.n_vertices());
    let other = quality(&work, &["match", "man.ply", "mirrored.ply", "-o", "mirrored.csv", "--json"]);
    // Left goes to left: nothing is reversed, or it is said.
    assert!(other["reversed"].as_f64().unwrap() < 0.2 || other["mirrored"] == true, "{other}");
}

#[test]
fn unlike_shapes_are_doubtful_and_strict_says_so() {
    let work = Workplace::new();
    work.mesh("man.ply", &man());
    work.mesh("ball.ply", &bumpy_sphere(4, 1));
    let arguments =
        ["match", "ball.ply", "man.ply", "-o", "map.csv", "--effort", "low", "--strict", "--json"];
    let output = infer().args(arguments).current_dir(work.folder()).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{errors}");
    assert!(errors.contains("doubtful") && errors.contains("expected mean error"), "{errors}");
    let map = read_point_map(&work.path("map.csv"), None).unwrap();
    let confidence = map.confidence.unwrap();
    assert!(confidence.iter().sum::<f32>() < 0.7 * confidence.len() as f32);
    assert!(map.points.unwrap().iter().all(Option::is_some));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["quality"]["doubtful"], true);
    assert_eq!(summary["candidates"].as_array().unwrap().len(), 1);
}

#[test]
fn every_candidate_is_listed_and_one_is_taken() {
    let work = Workplace::new();
    work.mesh("man.ply", &man());
    work.mesh("copy.ply", &permuted(&man(), 2).0);
    let arguments =
        ["match", "man.ply", "copy.ply", "-o", "map.txt", "--effort", "high", "--adapt", "1", "--json"];
    let summary: Value = serde_json::from_str(&work.succeed(&arguments)).unwrap();
    let candidates = summary["candidates"].as_array().unwrap();
    let names: Vec<&str> = candidates.iter().map(|c| c["name"].as_str().unwrap()).collect();
    for name in ["default", "without descriptors beside", "features alone", "adapted"] {
        assert!(names.contains(&name), "{names:?}");
    }
    let taken: Vec<&Value> = candidates.iter().filter(|c| c["taken"] == true).collect();
    assert_eq!(taken.len(), 1);
    let least =
        candidates.iter().map(|c| c["expected_error"].as_f64().unwrap()).fold(f64::INFINITY, f64::min);
    assert!(taken[0]["expected_error"].as_f64().unwrap() <= least / 0.9);
    assert_eq!(summary["quality"]["expected_error"], taken[0]["expected_error"]);
}
