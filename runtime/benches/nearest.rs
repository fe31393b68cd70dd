//! Seconds of the exact nearest neighbour search between two spectral embeddings, from 1K to 200K points.
//!
//! The embeddings are those of a long rectangle, sampled at random, moved by a functional map with as much noise as
//! signal. `benches/peers/nearest.py` times a matrix product with the row-wise minimum in NumPy, and SciPy's kd-tree.
//!
//! `cargo bench --workspace --bench nearest -- [n ...]`, and the options of every bench (`-- --help`);
//! `RAYON_NUM_THREADS` sets the threads.

mod support;

use fmnet::Matrix;
use fmnet::io::{write_matrix, write_vector};
use fmnet::point_map::search::NearestRows;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use support::report::{Report, least, measured};

/// A brute force takes the same time whatever the noise; of larger embeddings only the noisy ones are exported.
const EXPORT_BOTH: usize = 20_000;

fn main() {
    let report = Report::from_arguments("nearest");
    let asked: Vec<usize> = report.words.iter().filter_map(|word| word.parse().ok()).collect();
    let sizes = if asked.is_empty() { vec![1000, 6890, 25_000, 200_000] } else { asked };
    report.say(&format!("{:>8} {:>4} {:>6} {:>10} {:>10}", "n", "k", "noise", "prepare s", "search s"));
    for n in sizes.into_iter().filter(|&n| report.includes(n)) {
        for noise in [0.0, 1.0] {
            measure(&report, n, if n < 20_000 { 120 } else { 100 }, noise);
        }
    }
}

fn measure(report: &Report, n: usize, k: usize, noise: f64) {
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
    drop(source);
    let run = || {
        let (prepare, tree) = measured(|| NearestRows::new(&targets).expect("targets are finite"));
        (prepare.seconds, tree.nearest(&queries).expect("queries are finite"))
    };
    let (cost, (prepare, found)) = least(report.runs(if n < 50_000 { 5 } else { 1 }), run);
    assert_eq!(found.index.len(), n);
    let case = format!("nearest-{n}-{k}-{noise}");
    let line = format!("{n:>8} {k:>4} {noise:>6} {prepare:>10.4} {:>10.4}", cost.seconds - prepare);
    let mut figures = cost.figures();
    figures["vertices"] = n.into();
    figures["k"] = k.into();
    figures["noise"] = noise.into();
    figures["prepare_seconds"] = prepare.into();
    report.figure(&line, &case, figures);
    if n <= EXPORT_BOTH || noise > 0.0 {
        let index: Vec<i32> = found.index.iter().map(|&i| i as i32).collect();
        report.export(&case, |folder| {
            write_matrix(&folder.join("targets.npy"), &targets)?;
            write_matrix(&folder.join("queries.npy"), &queries)?;
            write_vector(&folder.join("index.npy"), &index)
        });
    }
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
