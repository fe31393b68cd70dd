//! Seconds of a training step (TARGETS.md): one pair, 7 blocks of width 352, k = 120, on 1 and 2 threads.
//!
//! `cargo bench -p fmnet-trainer --bench step`; prints the least and the median seconds of several steps and, on Linux, the
//! least CPU seconds, which tell more on a busy machine.

use candle_core::Device;
use fmnet::Matrix;
use fmnet_trainer::fm_layer::FmSolver;
use fmnet_trainer::network::{Network, NetworkOptions};
use fmnet_trainer::step::{PairBatch, ShapeBatch, StepOptions, StepRunner};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::Instant;

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

/// CPU seconds of all threads so far; 0 where the system does not say.
fn cpu_seconds() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
    let nanoseconds = |task: std::fs::DirEntry| -> Option<f64> {
        std::fs::read_to_string(task.path().join("schedstat")).ok()?.split(' ').next()?.parse().ok()
    };
    tasks.flatten().filter_map(nanoseconds).sum::<f64>() * 1e-9
}

fn run(name: &str, points: usize, solver: FmSolver, both_directions: bool, threads: usize) {
    let mut generator = ChaCha8Rng::seed_from_u64(1);
    let source = shape(points, &mut generator, both_directions);
    let target = shape(points, &mut generator, true);
    let pairs = [PairBatch { source, target, source_is_part: false, negatives: Vec::new() }];
    let network =
        Network::new(NetworkOptions::default(), &Device::Cpu).expect("the default network is valid");
    let options = StepOptions { functional_map: solver, ..StepOptions::default() };
    let mut runner = StepRunner::new(network, options).expect("the optimiser fits its network");
    let mut step = || {
        let (start, cpu) = (Instant::now(), cpu_seconds());
        runner.step(&pairs, 1e-3).expect("a step on random data succeeds");
        (start.elapsed().as_secs_f64(), cpu_seconds() - cpu)
    };
    step();
    let (mut seconds, cpu): (Vec<f64>, Vec<f64>) = (0..STEPS).map(|_| step()).unzip();
    seconds.sort_by(f64::total_cmp);
    let cpu = cpu.into_iter().fold(f64::INFINITY, f64::min);
    println!(
        "{name}, {points} points, {threads} threads: {:.3} s, median {:.3} s, CPU {cpu:.3} s",
        seconds[0],
        seconds[STEPS / 2]
    );
}

fn main() {
    for threads in [1, 2] {
        let pool =
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        pool.install(|| {
            run("least squares", 1500, FmSolver::least_squares(), false, threads);
            run("regularised", 1000, FmSolver::regularized(), false, threads);
            run("regularised, both directions", 1000, FmSolver::regularized(), true, threads);
        });
    }
}
