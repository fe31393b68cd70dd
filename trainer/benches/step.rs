//! Seconds of a training step (TARGETS.md): one pair, 7 blocks of width 352, k = 120, on 1 and 2 threads.
//!
//! `cargo bench --workspace --bench step`; prints the least and the median seconds of several steps and, on Linux, the
//! least CPU seconds, which tell more on a busy machine. Options of every bench: `-- --help`.

#[path = "../../runtime/benches/support/report.rs"]
mod report;

use candle_core::Device;
use fmnet::Matrix;
use fmnet::fmap::FmapSolver;
use fmnet_trainer::network::{Network, NetworkOptions};
use fmnet_trainer::step::{PairBatch, ShapeBatch, StepOptions, StepRunner};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use report::{Report, measured};
use serde_json::json;

const K: usize = 120;
const STEPS: usize = 8;

/// Random descriptors and bases: the time does not depend on the values.
fn shape(points: usize, generator: &mut ChaCha8Rng, both_directions: bool) -> ShapeBatch {
    let mut random = |low: f32, high: f32| generator.random_range(low..high);
    ShapeBatch {
        shot: Matrix::from_fn(points, 352, |_, _| random(0.0, 0.2)),
        basis: Matrix::from_fn(points, K, |_, _| random(-1.0, 1.0)),
        mass: vec![1.0 / points as f32; points],
        eigenvalues: (0..K).map(|l| 12.6 * l as f64).collect(),
        distances: both_directions.then(|| Matrix::from_fn(points, points, |_, _| random(0.0, 1.5))),
    }
}

/// What is optimised.
struct Setting {
    name: &'static str,
    points: usize,
    solver: FmapSolver,
    both_directions: bool,
}

fn run(report: &Report, setting: Setting, threads: usize) {
    let Setting { name, points, solver, both_directions } = setting;
    let mut generator = ChaCha8Rng::seed_from_u64(1);
    let source = shape(points, &mut generator, both_directions);
    let target = shape(points, &mut generator, true);
    let pairs = [PairBatch { source, target, source_is_part: false, negatives: Vec::new() }];
    let network =
        Network::new(NetworkOptions::default(), &Device::Cpu).expect("the default network is valid");
    let options = StepOptions { functional_map: solver, ..StepOptions::default() };
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
        "points": points, "k": K, "threads": threads, "seconds": least, "median_seconds": median, "cpu_seconds": cpu,
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
            for (name, points, solver, both_directions) in [
                ("least squares", 1500, FmapSolver::LeastSquares, false),
                ("regularised", 1000, FmapSolver::default(), false),
                ("regularised, both directions", 1000, FmapSolver::default(), true),
            ] {
                run(&report, Setting { name, points, solver, both_directions }, threads);
            }
        });
    }
}
