//! Milliseconds of the functional map solves and of the refinements, on generated shapes.
//!
//! `cargo bench --bench fmap`; `RAYON_NUM_THREADS` sets the threads.

use fmnet::Matrix;
use fmnet::fmap::{FmapSolver, functional_map, functional_map_of};
use fmnet::point_map::{PointMap, recover};
use fmnet::refine::{IcpOptions, ZoomOutOptions, ZoomOutSamples, icp, zoomout};
use fmnet::spectral::Eigenbasis;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::Instant;

/// Descriptors, as many as SHOT has bins.
const DESCRIPTORS: usize = 352;

fn main() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for k in [70, 120, 200] {
        let basis = rectangle(65, 106, k);
        let mut random = || Matrix::from_fn(k, DESCRIPTORS, |_, _| rng.random_range(-1.0..1.0));
        let (f, g) = (random(), random());
        let solve = |solver| functional_map(&basis, &basis, &f, &g, solver).expect("a finite system");
        time(&format!("least squares, k = {k}"), 5, || solve(FmapSolver::LeastSquares));
        let regularized = FmapSolver::Regularized { weight: FmapSolver::DEFAULT_MASK_WEIGHT };
        time(&format!("regularised, k = {k}"), 5, || solve(regularized));
    }
    let basis = rectangle(65, 106, 200);
    let n = basis.n();
    let map = PointMap::new((0..n as u32).collect(), n);
    let truncated = basis.truncated(120);
    let c = functional_map_of(&map, &truncated, &truncated).expect("a map of the shape");
    time("recover, n = 6890, k = 120", 3, || {
        recover(&c, &truncated, &truncated).expect("a map of the shape")
    });
    let icp_options = IcpOptions { max_iterations: 3 };
    time("icp, 3 rounds", 1, || icp(&c, &truncated, &truncated, &icp_options).expect("a map of the shape"));
    for samples in [ZoomOutSamples::All, ZoomOutSamples::Farthest(1000)] {
        let options = ZoomOutOptions { samples, ..ZoomOutOptions::default() };
        let name = format!("zoomout 30 to 200, {samples:?}");
        time(&name, 1, || zoomout(&map, &basis, &basis, &options).expect("a map of the shape"));
    }
}

fn time<T>(name: &str, repetitions: usize, mut run: impl FnMut() -> T) {
    let mut best = f64::INFINITY;
    for _ in 0..repetitions {
        let start = Instant::now();
        std::hint::black_box(run());
        best = best.min(start.elapsed().as_secs_f64());
    }
    println!("{name:<36} {:>9.2} ms", 1e3 * best);
}

/// The first `k` Neumann eigenfunctions of a rectangle at the centres of `nx` x `ny` cells.
fn rectangle(nx: usize, ny: usize, k: usize) -> Eigenbasis {
    let wave = |order: usize| std::f64::consts::PI * order as f64;
    let norm = |order: usize| if order == 0 { 1.0 } else { 2f64.sqrt() };
    let height = ny as f64 / nx as f64;
    let mut modes: Vec<(f64, usize, usize)> = (0..nx * ny)
        .map(|m| (m % nx, m / nx))
        .map(|(a, b)| (wave(a).powi(2) + (wave(b) / height).powi(2), a, b))
        .collect();
    modes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let eigenvectors = Matrix::from_fn(nx * ny, k, |vertex, j| {
        let (_, a, b) = modes[j];
        let (u, v) = ((vertex % nx) as f64 + 0.5, (vertex / nx) as f64 + 0.5);
        let value = (wave(a) * u / nx as f64).cos() * (wave(b) * v / ny as f64).cos();
        value * norm(a) * norm(b) / height.sqrt()
    });
    let eigenvalues = modes[..k].iter().map(|mode| mode.0).collect();
    Eigenbasis { eigenvalues, eigenvectors, mass: vec![height / (nx * ny) as f64; nx * ny] }
}
