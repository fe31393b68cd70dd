//! Seconds of a training step on one pair, on 1 and 2 threads: `cargo bench --workspace --bench step`.
//!
//! A DiffusionNet (4 blocks of width 128, 128 eigenfunctions) on whole meshes of 5000 vertices, functional maps of
//! both directions, the spectral loss and InfoNCE; and the paper's network (7 blocks of width 352, k = 120) on
//! points. Prints the least and the median seconds of several steps and, on Linux, the least CPU seconds. Options of
//! every bench: `-- --help`; `runtime/benches/peers/step.py` takes the DiffusionNet's step in PyTorch on what
//! `--export` wrote.

#[path = "../../runtime/benches/support/report.rs"]
mod report;

use candle_core::Device;
use fmnet::Matrix;
use fmnet::diffusion_net::Operators;
use fmnet::fmap::FmapSolver;
use fmnet::io::{IoError, write_matrix, write_vector};
use fmnet_trainer::losses::LossOptions;
use fmnet_trainer::network::{
    DiffusionNetwork, DiffusionOptions, Network, NetworkInput, ResidualNetwork, ResidualOptions,
    parameter_values,
};
use fmnet_trainer::step::{PairBatch, ShapeBatch, StepOptions, StepRunner};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use report::{Report, measured};
use serde_json::json;
use std::path::Path;

/// Eigenfunctions of the functional map with the paper's network.
const K: usize = 120;
/// Eigenfunctions of the functional map with a DiffusionNet.
const DIFFUSION_K: usize = 100;
/// Points of its contrastive loss.
const CONTRASTED: usize = 1024;
const STEPS: usize = 8;
const LEARNING_RATE: f64 = 1e-3;

/// Which network takes the step.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Residual,
    Diffusion,
}

/// What is optimised.
struct Setting {
    name: &'static str,
    kind: Kind,
    points: usize,
    solver: FmapSolver,
    both_directions: bool,
}

fn main() {
    let report = Report::from_arguments("step");
    for threads in [1, 2] {
        let pool =
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        pool.install(|| {
            for (name, kind, points, solver, both_directions) in [
                ("diffusion net", Kind::Diffusion, 5000, FmapSolver::default(), true),
                ("paper, least squares", Kind::Residual, 1500, FmapSolver::LeastSquares, false),
                ("paper, regularised", Kind::Residual, 1000, FmapSolver::default(), true),
            ] {
                run(&report, Setting { name, kind, points, solver, both_directions }, threads);
            }
        });
    }
}

fn run(report: &Report, setting: Setting, threads: usize) {
    let Setting { name, kind, points, solver, both_directions } = setting;
    let pairs = [pair(kind, points, both_directions)];
    let (network, loss): (Box<dyn Network>, LossOptions) = match kind {
        Kind::Residual => {
            let network = ResidualNetwork::new(ResidualOptions::default(), 0, &Device::Cpu);
            (Box::new(network.expect("the default network is valid")), LossOptions::soft_error())
        }
        Kind::Diffusion => {
            let network = DiffusionNetwork::new(DiffusionOptions::default(), 0, &Device::Cpu);
            (Box::new(network.expect("the default network is valid")), LossOptions::default())
        }
    };
    if kind == Kind::Diffusion {
        report.export("step", |folder| write(folder, network.as_ref(), &pairs[0]));
    }
    let options = StepOptions { functional_map: solver, loss, ..StepOptions::default() };
    let mut runner = StepRunner::new(network, options).expect("the optimiser fits its network");
    let mut step =
        || measured(|| runner.step(&pairs, LEARNING_RATE).expect("a step on random data succeeds"));
    let first = step().1;
    if kind == Kind::Diffusion {
        report.export("step", |folder| write_vector(&folder.join("loss.npy"), &[first.loss]));
    }
    let costs: Vec<_> = (0..report.runs(STEPS)).map(|_| step().0).collect();
    let sorted = |of: fn(&report::Cost) -> f64| {
        let mut values: Vec<f64> = costs.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let (seconds, cpu) = (sorted(|cost| cost.seconds), sorted(|cost| cost.cpu_seconds)[0]);
    let (least, median) = (seconds[0], seconds[seconds.len() / 2]);
    let peak_mb = sorted(|cost| cost.peak_mb)[costs.len() - 1];
    let line = format!(
        "{name}, {points} points, {threads} threads: {least:.3} s, median {median:.3} s, CPU {cpu:.3} s"
    );
    let figures = json!({
        "vertices": points, "k": pairs[0].source.eigenvalues.len(), "threads": threads, "seconds": least,
        "median_seconds": median, "cpu_seconds": cpu, "peak_mb": peak_mb,
    });
    report.figure(&line, &format!("step-{name}"), figures);
}

fn pair(kind: Kind, points: usize, both_directions: bool) -> PairBatch {
    let mut generator = ChaCha8Rng::seed_from_u64(1);
    let residual = kind == Kind::Residual;
    let source = shape(kind, points, &mut generator, residual && both_directions);
    let target = shape(kind, points, &mut generator, residual);
    let truth = Matrix::from_fn(DIFFUSION_K, DIFFUSION_K, |i, j| if i == j { 1.0 } else { 0.0 });
    let ground_truth = (!residual).then(|| [truth.clone(), truth]);
    PairBatch { source, target, ground_truth, ..PairBatch::default() }
}

/// Random descriptors and bases: the time does not depend on the values.
fn shape(kind: Kind, points: usize, generator: &mut ChaCha8Rng, distances: bool) -> ShapeBatch {
    let mut random = |low: f32, high: f32| generator.random_range(low..high);
    let diffusion = DiffusionOptions::default();
    let (inputs, k) = match kind {
        Kind::Residual => (352, K),
        Kind::Diffusion => (diffusion.inputs(), DIFFUSION_K),
    };
    let features = Matrix::from_fn(points, inputs, |_, _| random(0.0, 0.2));
    let mass = vec![1.0 / points as f32; points];
    let operators = match kind {
        Kind::Residual => Operators::default(),
        Kind::Diffusion => Operators {
            mass: mass.clone(),
            eigenvalues: (0..diffusion.eigenfunctions).map(|l| 12.6 * l as f32).collect(),
            eigenvectors: (0..points * diffusion.eigenfunctions).map(|_| random(-1.0, 1.0)).collect(),
            gradients_x: (0..points * diffusion.eigenfunctions).map(|_| random(-9.0, 9.0)).collect(),
            gradients_y: (0..points * diffusion.eigenfunctions).map(|_| random(-9.0, 9.0)).collect(),
        },
    };
    let drawn = if kind == Kind::Diffusion { CONTRASTED.min(points) } else { points };
    ShapeBatch {
        input: NetworkInput { features, operators },
        basis: Matrix::from_fn(points, k, |_, _| random(-1.0, 1.0)),
        mass,
        eigenvalues: (0..k).map(|l| 12.6 * l as f64).collect(),
        points: (0..drawn as u32).collect(),
        places: None,
        distances: distances.then(|| Matrix::from_fn(points, points, |_, _| random(0.0, 1.5))),
    }
}

/// Writes the weights as `parameter-NAME.npy`, and what the step is given of both shapes.
fn write(folder: &Path, network: &dyn Network, pair: &PairBatch) -> Result<(), IoError> {
    let values = parameter_values(network).expect("parameters of the CPU");
    for parameter in network.parameters() {
        let own = values[parameter.offset..parameter.offset + parameter.len()].to_vec();
        let file = folder.join(format!("parameter-{}.npy", parameter.name));
        match parameter.shape[..] {
            [inputs, outputs] => write_matrix(&file, &Matrix::from_vec(inputs, outputs, own))?,
            _ => write_vector(&file, &own)?,
        }
    }
    for (side, shape) in [("source", &pair.source), ("target", &pair.target)] {
        let file = |what: &str| folder.join(format!("{side}-{what}.npy"));
        let operators = &shape.input.operators;
        let (n, k) = (operators.n(), operators.eigenvalues.len());
        write_matrix(&file("features"), &shape.input.features)?;
        write_matrix(&file("basis"), &shape.basis)?;
        write_vector(&file("mass"), &operators.mass)?;
        write_vector(&file("eigenvalues"), &operators.eigenvalues)?;
        let of_map: Vec<f32> = shape.eigenvalues.iter().map(|&value| value as f32).collect();
        write_vector(&file("map-eigenvalues"), &of_map)?;
        for (name, values) in [
            ("eigenvectors", &operators.eigenvectors),
            ("gradients_x", &operators.gradients_x),
            ("gradients_y", &operators.gradients_y),
        ] {
            write_matrix(&file(name), &Matrix::from_vec(n, k, values.clone()))?;
        }
    }
    Ok(())
}
