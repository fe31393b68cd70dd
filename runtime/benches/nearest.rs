//! Seconds of the exact nearest neighbour search between two spectral embeddings, from 1K to 200K points.
//!
//! The embeddings are those of a long rectangle, sampled at random, moved by a functional map with as much
//! noise as signal. Peers to compare with: a matrix product of the two embeddings and the row-wise minimum,
//! in NumPy.
//!
//! `cargo bench --bench nearest -- [n ...]`; `RAYON_NUM_THREADS` sets the threads.

use fmnet::Matrix;
use fmnet::point_map::search::NearestRows;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::Instant;

fn main() {
    let asked: Vec<usize> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    let sizes = if asked.is_empty() { vec![1000, 6890, 25_000, 200_000] } else { asked };
    println!("{:>8} {:>4} {:>6} {:>10} {:>10}", "n", "k", "noise", "prepare s", "search s");
    for n in sizes {
        for noise in [0.0, 1.0] {
            measure(n, if n < 20_000 { 120 } else { 100 }, noise);
        }
    }
}

fn measure(n: usize, k: usize, noise: f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let targets = embedding(n, k, &mut rng);
    let source = embedding(n, k, &mut rng);
    let entry = noise * (3.0 / k as f64).sqrt();
    let disturbance = Matrix::from_fn(k, k, |_, _| entry * rng.random_range(-1.0..1.0));
    let mut queries = source.clone();
    for i in 0..n {
        for (t, x) in queries.row_mut(i).iter_mut().enumerate() {
            *x += disturbance.row(t).iter().zip(source.row(i)).map(|(c, x)| c * x).sum::<f64>();
        }
    }
    let (mut prepare, mut search) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..if n < 50_000 { 5 } else { 1 } {
        let start = Instant::now();
        let tree = NearestRows::new(&targets).expect("targets are finite");
        prepare = prepare.min(start.elapsed().as_secs_f64());
        let start = Instant::now();
        let found = tree.nearest(&queries).expect("queries are finite");
        search = search.min(start.elapsed().as_secs_f64());
        assert_eq!(found.index.len(), n);
    }
    println!("{n:>8} {k:>4} {noise:>6} {prepare:>10.4} {search:>10.4}");
}

/// The first `k` Neumann eigenfunctions of a 1 x 6 rectangle at `n` random points, `[n, k]`.
fn embedding(n: usize, k: usize, rng: &mut ChaCha8Rng) -> Matrix {
    let mut modes: Vec<(usize, usize)> = (0..k * k).map(|m| (m % k, m / k)).collect();
    modes.sort_by_key(|&(a, b)| 36 * a * a + b * b);
    let mut points = Matrix::zeros(n, k);
    for i in 0..n {
        let (u, v): (f64, f64) = (rng.random(), rng.random());
        for (x, &(a, b)) in points.row_mut(i).iter_mut().zip(&modes) {
            let wave = |order: usize, at: f64| (std::f64::consts::PI * order as f64 * at).cos();
            let norm = if a > 0 { 2f64.sqrt() } else { 1.0 } * if b > 0 { 2f64.sqrt() } else { 1.0 };
            *x = norm * wave(a, u) * wave(b, v);
        }
    }
    points
}
