//! The same quantities of a shape through Candle, tract, onnxruntime in Rust, Python and JavaScript.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use candle_core::Device;
use fmnet::Matrix;
use fmnet::Mesh;
use fmnet::descriptor::{ShotOptions, shot};
use fmnet::io::{read_matrix, write_matrix, write_vector};
use fmnet::mesh::shapes::{bumpy_sphere, torus};
use fmnet::network::contract::Quantity;
use fmnet::network::{Backend, DescriptorNetwork, NetworkError};
use fmnet_tests::{javascript, python, relative_difference, root, run, test_metadata};
use fmnet_trainer::dataset::{Correspondence, ShapeEntry, Split};
use fmnet_trainer::export::export;
use fmnet_trainer::network::{
    BatchMoments, DiffusionNetwork, DiffusionOptions, Network, NetworkInput, NetworkOptions, Normalization,
    ResidualNetwork, ResidualOptions,
};
use fmnet_trainer::precompute::{PrepareOptions, ShapeArrays, process};
use fmnet_trainer::validate::{descriptors, network_input};
use std::path::Path;
use std::process::Command;

/// Relative to the largest output.
const TOLERANCE: f32 = 1e-4;

/// What a network takes, for Candle and by name for the others.
struct Input {
    network: NetworkInput,
    n: usize,
    arrays: Vec<(Quantity, Vec<f32>)>,
}

impl Input {
    fn of(&self, quantity: Quantity) -> &[f32] {
        &self.arrays.iter().find(|(other, _)| *other == quantity).unwrap().1
    }

    fn run(&self, network: &DescriptorNetwork) -> Matrix<f32> {
        let arrays: Vec<&[f32]> =
            network.contract().inputs.iter().map(|input| self.of(input.quantity)).collect();
        network.descriptors(self.n, &arrays).unwrap()
    }
}

fn check(name: &str, network: &dyn Network, per_shape: bool, input: &Input) {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("model.onnx");
    export(network, &test_metadata(per_shape), &model).unwrap();
    let expected = descriptors(network, &input.network).unwrap();
    let agrees = |other: &str, found: &Matrix<f32>| {
        let difference = relative_difference(&expected, found);
        eprintln!("{name}, {} vertices: candle and {other} differ by {difference:.1e}", input.n);
        assert!(difference < TOLERANCE, "{other} differs by {difference}");
    };
    agrees("tract", &input.run(&DescriptorNetwork::load(&model, Backend::Tract).unwrap()));
    let own = DescriptorNetwork::load(&model, Backend::Native).unwrap();
    let native = own.native().is_some();
    assert_eq!(native, !per_shape && name != "running", "{name}: only our DiffusionNets run natively");
    assert_eq!(own.backend(), if native { Backend::Native } else { Backend::Tract });
    agrees("native", &input.run(&own));
    check_ort(&model, input, &agrees);
    check_python(&model, input, folder.path(), &agrees);
    check_javascript(&model, input, folder.path(), &agrees, expected.cols());
}

fn check_ort(model: &Path, input: &Input, agrees: &dyn Fn(&str, &Matrix<f32>)) {
    let Some(library) = fmnet_tests::onnxruntime_library() else { return };
    // SAFETY: set before the library is loaded, always to the same value.
    unsafe { std::env::set_var("ORT_DYLIB_PATH", library) };
    agrees("ort", &input.run(&DescriptorNetwork::load(model, Backend::Ort).unwrap()));
}

/// What is built here has every back-end; what a build without one says is kept in words.
#[test]
fn a_build_without_a_back_end_names_the_feature() {
    let error = NetworkError::BackendAbsent { backend: Backend::Ort }.to_string();
    assert!(error.contains("--features ort"), "{error}");
}

fn check_python(model: &Path, input: &Input, folder: &Path, agrees: &dyn Fn(&str, &Matrix<f32>)) {
    let Some(python) = python() else { return };
    for (quantity, values) in &input.arrays {
        let path = folder.join(format!("{}.npy", quantity.name()));
        match quantity {
            Quantity::Mass | Quantity::Eigenvalues => write_vector(&path, values).unwrap(),
            _ => {
                let matrix = Matrix::from_vec(input.n, values.len() / input.n, values.clone());
                write_matrix(&path, &matrix).unwrap();
            }
        }
    }
    let output = folder.join("out.npy");
    let script = root().join("tests/python/run_model.py");
    run(Command::new(python).arg(script).args([model, folder, &output])).unwrap();
    agrees("Python's onnxruntime", &read_matrix(&output).unwrap());
}

fn check_javascript(
    model: &Path,
    input: &Input,
    folder: &Path,
    agrees: &dyn Fn(&str, &Matrix<f32>),
    outputs: usize,
) {
    let Some(packages) = javascript() else { return };
    for (quantity, values) in &input.arrays {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        std::fs::write(folder.join(format!("{}.f32", quantity.name())), bytes).unwrap();
    }
    let output = folder.join("out.f32");
    let script = root().join("tests/javascript/run_model.js");
    let mut node = Command::new("node");
    node.env("FMNET_NODE_FOLDER", packages).arg(script).args([model, folder]);
    run(node.arg(input.n.to_string()).arg(&output)).unwrap();
    let bytes = std::fs::read(&output).unwrap();
    let values = bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
    agrees("JavaScript's onnxruntime", &Matrix::from_vec(input.n, outputs, values));
}

fn shot_input() -> Input {
    let mut options = ShotOptions::default();
    options.radius = 0.15;
    let shot = shot(&bumpy_sphere(4, 3), &options).unwrap().0;
    Input {
        n: shot.rows(),
        arrays: vec![(Quantity::Shot, shot.data().to_vec())],
        network: NetworkInput { features: shot, ..NetworkInput::default() },
    }
}

/// A residual network of full size with random weights and, where it uses them, made-up statistics.
fn residual(normalization: Normalization) -> ResidualNetwork {
    let options = ResidualOptions { normalization, ..ResidualOptions::default() };
    let mut network = ResidualNetwork::new(options, 5, &Device::Cpu).unwrap();
    let moments = |seed: usize| BatchMoments {
        mean: (0..352).map(|i| ((i * 7 + seed) as f64).sin() * 0.02).collect(),
        variance: (0..352).map(|i| 0.01 + 0.005 * ((i * 3 + seed) as f64).cos()).collect(),
    };
    network.set_running_statistics((0..7).map(|b| [moments(2 * b), moments(2 * b + 1)]).collect()).unwrap();
    network
}

#[test]
fn statistics_of_each_shape_stay_in_the_graph() {
    check("per shape", &residual(Normalization::PerShape), true, &shot_input());
}

#[test]
fn trained_statistics_are_folded() {
    check("running", &residual(Normalization::Running), false, &shot_input());
}

/// A DiffusionNet of full size with random weights, whose diffusion reaches.
fn diffusion(options: DiffusionOptions) -> DiffusionNetwork {
    let network = DiffusionNetwork::new(options, 7, &Device::Cpu).unwrap();
    let mut values = fmnet_trainer::network::parameter_values(&network).unwrap();
    for time in network.parameters().iter().filter(|p| p.name.ends_with("time")) {
        let times = values[time.offset..time.offset + time.len()].iter_mut().enumerate();
        times.for_each(|(c, t)| *t = 1e-4 * (1.0 + (c % 50) as f32));
    }
    fmnet_trainer::network::set_parameter_values(&network, &values).unwrap();
    network
}

/// A mesh as the trainer prepares it.
fn diffusion_input(options: &DiffusionOptions, mesh: &Mesh) -> Input {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sphere.off");
    fmnet::io::write_mesh(&path, mesh, &fmnet::io::Attributes::default()).unwrap();
    let entry = ShapeEntry {
        name: "sphere".into(),
        mesh: path,
        group: "g".into(),
        correspondence: Correspondence::Identity,
        split: Split::Train,
        whole: None,
    };
    let prepare = PrepareOptions {
        shape: fmnet::shape::ShapeOptions::default(),
        k: options.eigenpairs(),
        gradients: options.eigenfunctions,
        shot: Some(ShotOptions::default()),
        distances: false,
        pool: 100,
        seed: 1,
    };
    let context = fmnet::shape::Context::SILENT;
    let processed = process(&entry, &prepare.shape, context).unwrap();
    let arrays = ShapeArrays::of(&processed.shape, &prepare, context).unwrap();
    let single = |values: &[f64]| values.iter().map(|&x| x as f32).collect::<Vec<f32>>();
    let named = vec![
        (Quantity::Shot, arrays.shot.data().to_vec()),
        (Quantity::Mass, arrays.mass.clone()),
        (Quantity::Eigenvalues, single(&arrays.eigenvalues)),
        (Quantity::Eigenvectors, arrays.eigenvectors.data().to_vec()),
        (Quantity::GradientsX, arrays.gradients_x.data().to_vec()),
        (Quantity::GradientsY, arrays.gradients_y.data().to_vec()),
    ];
    let n = arrays.n();
    Input { network: network_input(&NetworkOptions::Diffusion(options.clone()), arrays), n, arrays: named }
}

#[test]
fn a_diffusion_net_gives_the_same_everywhere_from_642_to_15000_vertices() {
    for mesh in [bumpy_sphere(3, 3), bumpy_sphere(4, 3), torus(150, 100, 0.4)] {
        let options = DiffusionOptions::default();
        check("diffusion net", &diffusion(options.clone()), false, &diffusion_input(&options, &mesh));
    }
}

#[test]
fn inputs_of_a_diffusion_net_may_be_left_out() {
    let options = [
        DiffusionOptions { wks_energies: 0, width: 32, eigenfunctions: 60, ..DiffusionOptions::default() },
        DiffusionOptions {
            shot_scale: 0.0,
            outputs: 40,
            wks_eigenfunctions: 90,
            ..DiffusionOptions::default()
        },
    ];
    for options in options {
        check(
            "one input",
            &diffusion(options.clone()),
            false,
            &diffusion_input(&options, &bumpy_sphere(3, 3)),
        );
    }
}
