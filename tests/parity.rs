//! The same SHOT descriptors through Candle, tract, onnxruntime in Rust, Python and JavaScript.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use candle_core::Device;
use fmnet::Matrix;
use fmnet::descriptor::{ShotOptions, shot};
use fmnet::io::{read_matrix, write_matrix};
use fmnet::mesh::shapes::bumpy_sphere;
use fmnet::network::{Backend, DescriptorNetwork};
use fmnet_tests::{javascript, python, relative_difference, root, run, test_metadata};
use fmnet_trainer::export::export;
use fmnet_trainer::network::{BatchMoments, Network, NetworkOptions, Normalization};
use fmnet_trainer::validate::descriptors;
use std::path::Path;
use std::process::Command;

/// Relative to the largest output.
const TOLERANCE: f32 = 1e-4;

fn input() -> Matrix<f32> {
    shot(&bumpy_sphere(4, 3), &ShotOptions { radius: 0.15, ..ShotOptions::default() }).unwrap().0
}

/// A network of full size with random weights and, where it uses them, made-up statistics.
fn network(normalization: Normalization) -> Network {
    let options = NetworkOptions { normalization, seed: 5, ..NetworkOptions::default() };
    let mut network = Network::new(options, &Device::Cpu).unwrap();
    let moments = |seed: usize| BatchMoments {
        mean: (0..352).map(|i| ((i * 7 + seed) as f64).sin() * 0.02).collect(),
        variance: (0..352).map(|i| 0.01 + 0.005 * ((i * 3 + seed) as f64).cos()).collect(),
    };
    network.set_running_statistics((0..7).map(|b| [moments(2 * b), moments(2 * b + 1)]).collect()).unwrap();
    network
}

fn check(normalization: Normalization) {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("model.onnx");
    let (network, shot) = (network(normalization), input());
    export(&network, &test_metadata(normalization == Normalization::PerShape), &model).unwrap();
    let expected = descriptors(&network, &shot).unwrap();
    let agrees = |name: &str, found: &Matrix<f32>| {
        let difference = relative_difference(&expected, found);
        eprintln!("{normalization:?}: candle and {name} differ by {difference:.1e}");
        assert!(difference < TOLERANCE, "{name} differs by {difference}");
    };
    agrees("tract", &DescriptorNetwork::load(&model, Backend::Tract).unwrap().descriptors(&shot).unwrap());
    check_ort(&model, &shot, &agrees);
    check_python(&model, &shot, folder.path(), &agrees);
    check_javascript(&model, &shot, folder.path(), &agrees);
}

#[cfg(feature = "ort")]
fn check_ort(model: &Path, shot: &Matrix<f32>, agrees: &dyn Fn(&str, &Matrix<f32>)) {
    let Some(library) = fmnet_tests::onnxruntime_library() else { return };
    // SAFETY: set before the library is loaded, always to the same value.
    unsafe { std::env::set_var("ORT_DYLIB_PATH", library) };
    agrees("ort", &DescriptorNetwork::load(model, Backend::Ort).unwrap().descriptors(shot).unwrap());
}

#[cfg(not(feature = "ort"))]
fn check_ort(model: &Path, _: &Matrix<f32>, _: &dyn Fn(&str, &Matrix<f32>)) {
    let error = DescriptorNetwork::load(model, Backend::Ort).unwrap_err().to_string();
    assert!(error.contains("--features ort"), "{error}");
}

fn check_python(model: &Path, shot: &Matrix<f32>, folder: &Path, agrees: &dyn Fn(&str, &Matrix<f32>)) {
    let Some(python) = python() else { return };
    let (input, output) = (folder.join("shot.npy"), folder.join("descriptors.npy"));
    write_matrix(&input, shot).unwrap();
    let script = root().join("tests/python/run_model.py");
    run(Command::new(python).arg(script).args([model, &input, &output])).unwrap();
    agrees("Python's onnxruntime", &read_matrix(&output).unwrap());
}

fn check_javascript(model: &Path, shot: &Matrix<f32>, folder: &Path, agrees: &dyn Fn(&str, &Matrix<f32>)) {
    let Some(packages) = javascript() else { return };
    let (input, output) = (folder.join("shot.f32"), folder.join("descriptors.f32"));
    std::fs::write(&input, shot.data().iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>()).unwrap();
    let script = root().join("tests/javascript/run_model.js");
    let mut node = Command::new("node");
    run(node.env("FMNET_NODE_FOLDER", packages).arg(script).args([model, &input, &output])).unwrap();
    let bytes = std::fs::read(&output).unwrap();
    let values = bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
    agrees("JavaScript's onnxruntime", &Matrix::from_vec(shot.rows(), 352, values));
}

#[test]
fn statistics_of_each_shape_stay_in_the_graph() {
    check(Normalization::PerShape);
}

#[test]
fn trained_statistics_are_folded() {
    check(Normalization::Running);
}
