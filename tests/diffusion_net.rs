//! A DiffusionNet that was trained elsewhere: its descriptors through the kernels, Candle and an exported model file.
//! Needs the folder `reference` beside the research data.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use candle_core::Device;
use fmnet::Matrix;
use fmnet::diffusion_net::{Architecture, Operators, forward};
use fmnet::io::read_mesh;
use fmnet::network::{Backend, DescriptorNetwork};
use fmnet::pipeline::{MatchOptions, Matcher, ModelSource, Resize};
use fmnet_tests::{relative_difference, research_data, skipped, test_metadata};
use fmnet_trainer::export::export;
use fmnet_trainer::network::{
    DiffusionNetwork, DiffusionOptions, Network, NetworkInput, set_parameter_values,
};
use fmnet_trainer::validate::descriptors;
use npyz::npz::NpzArchive;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

type Archive = NpzArchive<BufReader<File>>;

fn folder() -> Option<PathBuf> {
    let folder = research_data()?.join("../reference/diffusion_net");
    if !folder.is_dir() {
        skipped(format!("{} is absent", folder.display()));
        return None;
    }
    Some(folder)
}

fn array(archive: &mut Archive, name: &str) -> Vec<f32> {
    archive.by_name(name).unwrap().unwrap_or_else(|| panic!("no {name}")).into_vec().unwrap()
}

/// The weights in the order of [`Architecture::parameters`]; a linear layer is stored as `[out, in]` there.
fn weights(folder: &Path) -> Vec<f32> {
    let mut archive: Archive = NpzArchive::open(folder.join("weights.npz")).unwrap();
    let mut flat = Vec::new();
    for parameter in Network::parameters(&network()) {
        let name = parameter
            .name
            .replace("input.", "a.")
            .replace("output.", "b.")
            .replace("blocks.", "bl.")
            .replace("time", "t")
            .replace("gradient.real", "re.weight")
            .replace("gradient.imaginary", "im.weight")
            .replace("mlp", "m");
        let values = array(&mut archive, &name);
        match parameter.shape[..] {
            [inputs, outputs] => {
                let entry = |at: usize| values[(at % outputs) * inputs + at / outputs];
                flat.extend((0..inputs * outputs).map(entry));
            }
            _ => flat.extend(values),
        }
    }
    flat
}

fn network() -> DiffusionNetwork {
    DiffusionNetwork::new(DiffusionOptions::default(), 1, &Device::Cpu).unwrap()
}

fn trained(folder: &Path) -> DiffusionNetwork {
    let network = network();
    set_parameter_values(&network, &weights(folder)).unwrap();
    network
}

/// The stored input and operators, and the descriptors that they should give.
fn stored(folder: &Path) -> (NetworkInput, Matrix<f32>) {
    let mut archive: Archive = NpzArchive::open(folder.join("tr_reg_060_1500.npz")).unwrap();
    let operators = Operators {
        mass: array(&mut archive, "mass"),
        eigenvalues: array(&mut archive, "eigenvalues"),
        eigenvectors: array(&mut archive, "eigenvectors"),
        gradients_x: array(&mut archive, "gradients_x"),
        gradients_y: array(&mut archive, "gradients_y"),
    };
    let n = operators.n();
    let input = array(&mut archive, "input");
    let expected = Matrix::from_vec(n, 128, array(&mut archive, "descriptors"));
    (NetworkInput { features: Matrix::from_vec(n, 480, input), operators }, expected)
}

#[test]
fn its_descriptors_come_out_of_the_kernels_and_of_candle() {
    let Some(folder) = folder() else { return };
    let (input, expected) = stored(&folder);
    let architecture = Architecture { inputs: 480, blocks: 4, width: 128, outputs: 128 };
    let (out, _) =
        forward(&architecture, &weights(&folder), input.features.data(), &input.operators, false).unwrap();
    let kernels = relative_difference(&expected, &Matrix::from_vec(expected.rows(), 128, out));
    let candle = relative_difference(&expected, &descriptors(&trained(&folder), &input).unwrap());
    eprintln!("kernels {kernels:.1e}, candle {candle:.1e}");
    assert!(kernels < 1e-4 && candle < 1e-4);
}

#[test]
fn its_descriptors_come_out_of_the_mesh_through_the_exported_file() {
    let Some(folder) = folder() else { return };
    let (_, expected) = stored(&folder);
    let temporary = tempfile::tempdir().unwrap();
    // Kept on demand, to be used as a model file.
    let model = std::env::var_os("FMNET_KEEP_MODEL")
        .map_or_else(|| temporary.path().join("reference.onnx"), PathBuf::from);
    let mut metadata = test_metadata(false);
    (metadata.k, metadata.solver) = (100, fmnet::fmap::FmapSolver::Joint { weight: 0.1 });
    export(&trained(&folder), &metadata, &model).unwrap();
    DescriptorNetwork::load(&model, Backend::Tract).unwrap();
    let options = MatchOptions::default().model(ModelSource::File(model)).subdivide(Resize::Never);
    let matcher = Matcher::new(&options).unwrap();
    let mesh = read_mesh(&folder.join("tr_reg_060_1500.off")).unwrap().mesh;
    let described = matcher.describe("reference", &mesh, &fmnet::events::ignore).unwrap();
    let difference = relative_difference(&expected, &described.descriptors);
    eprintln!("from the mesh: {difference:.1e}");
    // Eigenvectors and SHOT are computed anew; where a sign vote of SHOT is tied, a few vertices differ.
    let close = |row: usize| {
        let pair = expected.row(row).iter().zip(described.descriptors.row(row));
        let (apart, length) =
            pair.fold((0.0f32, 0.0f32), |(d, l), (a, b)| (d + (a - b) * (a - b), l + a * a));
        apart < 1e-4 * length
    };
    let share = (0..expected.rows()).filter(|&row| close(row)).count() as f64 / expected.rows() as f64;
    assert!(share > 0.98, "{share} of the rows agree");
}
