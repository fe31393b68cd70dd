//! Seconds of the built-in descriptor network: `cargo bench --workspace --bench network`.
//!
//! The library's own kernels and tract, on generated people of 2000, 6890 and 15000 vertices, on 1 and 2 threads.
//! Computing the inputs is not counted. Options of every bench (`-- --help`); `benches/peers/network.py` times
//! onnxruntime on the same file and the inputs that `--export` wrote. Each figure is the least of several runs.

mod support;

use fmnet::Matrix;
use fmnet::io::{IoError, write_matrix, write_vector};
use fmnet::network::contract::ModelInput;
use fmnet::network::{Backend, DescriptorNetwork};
use fmnet::pipeline::{MatchOptions, Matcher, Resize};
use fmnet::shape::{Context, Shape};
use std::path::Path;
use support::report::{Report, least};
use support::shapes::body;

const SIZES: [usize; 3] = [2000, 6890, 15_000];
const RUNS: usize = 5;

/// What the network takes, an array for each of its inputs.
type Inputs = Vec<(ModelInput, Vec<f32>)>;

fn main() {
    let report = Report::from_arguments("network");
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("model.onnx");
    let networks = [("native", Backend::Native), ("tract", Backend::Tract)]
        .map(|(name, backend)| (name, DescriptorNetwork::load(&model, backend).expect("the built-in model")));
    for n in SIZES.into_iter().filter(|&n| report.includes(n)) {
        let inputs = inputs(n);
        report.export(&format!("network-{n}"), |folder| write_inputs(folder, n, &inputs));
        for (name, network) in &networks {
            for threads in [1, 2] {
                measure(&report, name, network, n, &inputs, threads);
            }
        }
    }
}

/// The inputs of a generated person of `n` vertices, as matching computes them.
fn inputs(n: usize) -> Inputs {
    let options = MatchOptions::default().decimate(Resize::Never).subdivide(Resize::Never);
    let matcher = Matcher::new(&options).expect("the built-in model");
    let mesh = body("source", n, 1);
    let shape = Shape::new("body", &mesh, matcher.shape_options(), Context::SILENT).expect("a clean mesh");
    let descriptor = matcher.network_descriptor().expect("descriptors are learned");
    descriptor.inputs(&shape, Context::SILENT).expect("quantities of a clean mesh")
}

fn measure(
    report: &Report,
    name: &str,
    network: &DescriptorNetwork,
    n: usize,
    inputs: &Inputs,
    threads: usize,
) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    let arrays: Vec<&[f32]> = inputs.iter().map(|(_, values)| values.as_slice()).collect();
    let run = || pool.install(|| network.descriptors(n, &arrays)).expect("inputs of the right sizes");
    let (cost, output) = least(report.runs(RUNS), run);
    let mut figures = cost.figures();
    figures["vertices"] = n.into();
    figures["threads"] = threads.into();
    let line = format!("{name:<8} {n:>6} vertices, {threads} threads: {:.3} s", cost.seconds);
    report.figure(&line, &format!("network-{name}-{n}"), figures);
    report
        .export(&format!("network-{n}"), |folder| write_matrix(&folder.join(format!("{name}.npy")), &output));
}

/// Writes `input-NAME.npy` for each input.
fn write_inputs(folder: &Path, n: usize, inputs: &Inputs) -> Result<(), IoError> {
    for (input, values) in inputs {
        let file = folder.join(format!("input-{}.npy", input.quantity.name()));
        if values.len() == n * input.width && input.width > 1 {
            write_matrix(&file, &Matrix::from_vec(n, input.width, values.clone()))?;
        } else {
            write_vector(&file, values)?;
        }
    }
    Ok(())
}
