//! Seconds of a training step (TARGETS.md): one pair, 7 blocks of width 352, k = 120, on 1 and 2 threads.
//!
//! `cargo bench --workspace --bench step`; prints the least and the median seconds of several steps and, on Linux, the
//! least CPU seconds, which tell more on a busy machine. Options of every bench: `-- --help`.

#[path = "../../runtime/benches/support/report.rs"]
mod report;

use candle_core::Device;
use fmnet::Matrix;
use fmnet::diffusion_net::Operators;
use fmnet::fmap::FmapSolver;
use fmnet_trainer::losses::LossOptions;
use fmnet_trainer::network::{
    DiffusionNetwork, DiffusionOptions, Network, NetworkInput, ResidualNetwork, ResidualOptions,
};
use fmnet_trainer::step::{PairBatch, ShapeBatch, StepOptions, StepRunner};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use report::{Report, measured};
use serde_json::json;

const K: usize = 120;
/// Eigenfunctions of the functional map with a DiffusionNet.
const DIFFUSION_K: usize = 100;
/// Points of its contrastive loss.
const CONTRASTED: usize = 1024;
const STEPS: usize = 8;

/// Which network takes the step.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Residual,
    Diffusion,
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

/// What is optimised.
struct Setting {
    name: &'static str,
    kind: Kind,
    points: usize,
    solver: FmapSolver,
    both_directions: bool,
}

fn run(report: &Report, setting: Setting, threads: usize) {
    let Setting { name, kind, points, solver, both_directions } = setting;
    let mut generator = ChaCha8Rng::seed_from_u64(1);
    let residual = kind == Kind::Residual;
    let source = shape(kind, points, &mut generator, residual && both_directions);
    let target = shape(kind, points, &mut generator, residual);
    let truth = Matrix::from_fn(DIFFUSION_K, DIFFUSION_K, |i, j| if i == j { 1.0 } else { 0.0 });
    let ground_truth = (!residual).then(|| [truth.clone(), truth]);
    let pairs = [PairBatch { source, target, ground_truth, ..PairBatch::default() }];
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
    let options = StepOptions { functional_map: solver, loss, ..StepOptions::default() };
    let mut runner = StepRunner::new(network, options).expect("the optimiser fits its network");
    let mut step = || measured(|| runner.step(&pairs, 1e-3).expect("a step on random data succeeds")).0;
    step();
    let costs: Vec<_> = (0..report.runs(STEPS)).map(|_| step()).collect();
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
        "points": points, "k": pairs[0].source.eigenvalues.len(), "threads": threads, "seconds": least, "median_seconds": median, "cpu_seconds": cpu,
        "peak_mb": peak_mb,
    });
    report.figure(&line, &format!("step-{name}"), figures);
}

fn main() {
    let report = Report::from_arguments("step");
    for threads in [1, 2] {
        let pool =
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        pool.install(|| {
            for (name, kind, points, solver, both_directions) in [
                ("least squares", Kind::Residual, 1500, FmapSolver::LeastSquares, false),
                ("regularised", Kind::Residual, 1000, FmapSolver::default(), false),
                ("regularised, both directions", Kind::Residual, 1000, FmapSolver::default(), true),
                ("diffusion net", Kind::Diffusion, 5000, FmapSolver::default(), true),
            ] {
                run(&report, Setting { name, kind, points, solver, both_directions }, threads);
            }
        });
    }
}
