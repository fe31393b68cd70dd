//! Accuracy and time of geodesic distances.
//!
//! `cargo bench -p fmnet-runtime --no-default-features --bench geodesic [-- MESH...]`; without meshes, those of the
//! research data that are at hand, else generated ones. Times are for one thread, the least of several runs.

use std::path::PathBuf;
use std::time::Instant;

use fmnet::Mesh;
use fmnet::geodesic::{GeodesicOptions, GeodesicSolver, exact};
use fmnet::io::read_mesh;

const REPETITIONS: usize = 5;
const MESHES: [&str; 4] = [
    "faust/registrations/tr_reg_060.ply",
    "faust/remeshed_5k/tr_reg_060.off",
    "faust/scans_7k/test_scan_000.off",
    "tosca/dog/dog0.off",
];

fn main() {
    let named: Vec<PathBuf> =
        std::env::args().skip(1).filter(|a| !a.starts_with("--")).map(PathBuf::from).collect();
    let data = std::env::var_os("FMNET_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let files = if named.is_empty() { MESHES.map(|m| data.join(m)).to_vec() } else { named };
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread");
    one_thread.install(|| {
        for file in files.iter().filter(|f| f.exists()) {
            match read_mesh(file) {
                Ok(file_of) => measure(&file.display().to_string(), &file_of.mesh),
                Err(error) => eprintln!("{error}"),
            }
        }
        for size in [32, 100, 320] {
            measure(&format!("terrain of {size} x {size} vertices"), &terrain(size));
        }
    });
}

fn measure(name: &str, mesh: &Mesh) {
    let n = mesh.n_vertices();
    // The exact distances take most of the time.
    let n_sources = (100_000 / n).clamp(2, 12);
    let sources: Vec<u32> = (0..n_sources).map(|i| (i * n / n_sources) as u32).collect();
    let (mut exact_seconds, mut build_seconds, mut solve_seconds) = (f64::MAX, f64::MAX, f64::MAX);
    let truth: Vec<Vec<f64>> = sources
        .iter()
        .map(|&s| {
            let (seconds, distances) = timed(|| exact(mesh, s));
            exact_seconds = exact_seconds.min(seconds);
            distances
        })
        .collect();
    let build = || GeodesicSolver::new(mesh, &GeodesicOptions::default());
    let solver = build();
    let many: Vec<u32> = (0..200).map(|i| (i * n / 200) as u32).collect();
    for _ in 0..REPETITIONS.min(200_000 / n + 1) {
        build_seconds = build_seconds.min(timed(build).0);
        solve_seconds = solve_seconds.min(timed(|| solver.from_sources(&many)).0 / many.len() as f64);
    }
    println!("{name}: {n} vertices, {:.0} straight lines each", solver.n_edges() as f64 / n as f64);
    println!("  exact {:.1} ms a source (least of {n_sources})", 1e3 * exact_seconds);
    println!(
        "  solver {build_seconds:.2} s to build, {:.3} ms a source, all pairs {:.1} s",
        1e3 * solve_seconds,
        build_seconds + solve_seconds * n as f64
    );
    let near: Vec<(u32, u32)> = mesh.faces().iter().step_by(2).map(|f| (f[0], f[1])).collect();
    let (seconds, _) = timed(|| solver.pair_distances(&near));
    println!("  {} pairs of neighbours in {:.1} ms", near.len(), 1e3 * seconds);
    report_errors(&solver, &sources, &truth, mesh.scale());
}

fn report_errors(solver: &GeodesicSolver, sources: &[u32], truth: &[Vec<f64>], scale: f64) {
    for (range, limit) in [("all", f64::INFINITY), ("below 0.05 sqrt(area)", 0.05 * scale)] {
        let (mut sum, mut worst, mut count) = (0.0, 0.0f64, 0usize);
        for (&source, row) in sources.iter().zip(truth) {
            for (fast, &exact) in solver.from_source(source).into_iter().zip(row) {
                if exact > 0.0 && exact < limit {
                    let error = (f64::from(fast) - exact) / exact;
                    (sum, worst, count) = (sum + error, worst.max(error), count + 1);
                }
            }
        }
        println!("  error, {range}: mean {:.4} %, max {:.3} %", 100.0 * sum / count as f64, 100.0 * worst);
    }
    let asymmetry = sources.iter().enumerate().flat_map(|(i, _)| (0..i).map(move |j| (i, j)));
    let asymmetry = asymmetry
        .map(|(i, j)| (truth[i][sources[j] as usize], truth[j][sources[i] as usize]))
        .filter(|(d, _)| d.is_finite())
        .fold(0.0f64, |worst, (d, e)| worst.max((d - e).abs() / scale));
    println!("  exact distances there and back differ by at most {asymmetry:.1e} sqrt(area)");
}

fn timed<T>(run: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let result = run();
    (start.elapsed().as_secs_f64(), result)
}

/// A hilly square.
fn terrain(size: usize) -> Mesh {
    let height =
        |x: f64, y: f64| 0.1 * (9.0 * x).sin() * (7.0 * y).cos() + 0.03 * (31.0 * x + 23.0 * y).sin();
    let position = |i: usize| {
        let (x, y) = ((i % size) as f64 / size as f64, (i / size) as f64 / size as f64);
        [x, y, height(x, y)]
    };
    let corner = |x: usize, y: usize| (y * size + x) as u32;
    let squares = (0..(size - 1) * (size - 1)).map(|i| (i % (size - 1), i / (size - 1)));
    let faces = squares.flat_map(|(x, y)| {
        let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)];
        if (x + y) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
    });
    Mesh::new((0..size * size).map(position).collect(), faces.collect()).expect("indices are in range")
}
