//! Accuracy and time of geodesic distances.
//!
//! `cargo bench --workspace --bench geodesic [-- MESH...]`, and the options of every bench (`-- --help`); without
//! meshes, generated ones and those of the research data that are at hand. Times are for one thread, the least of
//! several runs. `benches/peers/geodesic.py` times potpourri3d and pygeodesic on what `--export` wrote.

mod support;

use fmnet::geodesic::{GeodesicOptions, GeodesicSolver, exact};
use fmnet::io::{read_mesh, write_matrix, write_vector};
use fmnet::{Matrix, Mesh};
use serde_json::json;
use std::path::PathBuf;
use support::report::{Report, least, measured};
use support::shapes::{bodies, write_arrays};

const REPETITIONS: usize = 5;
const MESHES: [&str; 4] = [
    "faust/registrations/tr_reg_060.ply",
    "faust/remeshed_5k/tr_reg_060.off",
    "faust/scans_7k/test_scan_000.off",
    "tosca/dog/dog0.off",
];

fn main() {
    let report = Report::from_arguments("geodesic");
    let named: Vec<PathBuf> =
        report.words.iter().filter(|word| !word.starts_with("--")).map(PathBuf::from).collect();
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread");
    one_thread.install(|| {
        if named.is_empty() {
            for (name, mesh) in generated().into_iter().filter(|(_, mesh)| report.includes(mesh.n_vertices()))
            {
                measure(&report, name, &mesh);
            }
        }
        let data = std::env::var_os("FMNET_DATA").map_or_else(
            || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"),
            PathBuf::from,
        );
        let files = if named.is_empty() { MESHES.map(|m| data.join(m)).to_vec() } else { named };
        for file in files.iter().filter(|f| f.exists()) {
            match read_mesh(file) {
                Ok(read) if report.includes(read.mesh.n_vertices()) => {
                    let name = file.file_stem().unwrap_or_default().to_string_lossy();
                    measure(&report, &name, &read.mesh);
                }
                Ok(_) => {}
                Err(error) => eprintln!("{error}"),
            }
        }
    });
}

fn generated() -> Vec<(&'static str, Mesh)> {
    let [body, _] = bodies(6890);
    vec![("terrain", terrain(32)), ("body", body), ("terrain", terrain(100)), ("terrain", terrain(320))]
}

fn measure(report: &Report, name: &str, mesh: &Mesh) {
    let n = mesh.n_vertices();
    // The exact distances take most of the time.
    let n_sources = report.runs((100_000 / n).clamp(2, 12)).max(2);
    let sources: Vec<u32> = (0..n_sources).map(|i| (i * n / n_sources) as u32).collect();
    let mut exact_seconds = f64::MAX;
    let truth: Vec<Vec<f64>> = sources
        .iter()
        .map(|&s| {
            let (cost, distances) = measured(|| exact(mesh, s));
            exact_seconds = exact_seconds.min(cost.seconds);
            distances
        })
        .collect();
    let runs = report.runs(REPETITIONS.min(200_000 / n + 1));
    let (build, solver) = least(runs, || GeodesicSolver::new(mesh, &GeodesicOptions::default()));
    let many: Vec<u32> = (0..200).map(|i| (i * n / 200) as u32).collect();
    let solve_seconds = least(runs, || solver.from_sources(&many)).0.seconds / many.len() as f64;
    let all_pairs = build.seconds + solve_seconds * n as f64;
    report.say(&format!(
        "{name}: {n} vertices, {:.0} straight lines each\n  exact {:.1} ms a source (least of {n_sources})\n  \
         solver {:.2} s to build, {:.3} ms a source, all pairs {all_pairs:.1} s",
        solver.n_edges() as f64 / n as f64,
        1e3 * exact_seconds,
        build.seconds,
        1e3 * solve_seconds,
    ));
    let near: Vec<(u32, u32)> = mesh.faces().iter().step_by(2).map(|f| (f[0], f[1])).collect();
    let (near_cost, _) = measured(|| solver.pair_distances(&near));
    report.say(&format!("  {} pairs of neighbours in {:.1} ms", near.len(), 1e3 * near_cost.seconds));
    let rows = solver.from_sources(&sources);
    let mean_error = errors(report, &rows, &truth, mesh.scale());
    report_asymmetry(report, &sources, &truth, mesh.scale());
    let case = format!("geodesic-{name}-{n}");
    report.record(&format!("{case}-exact"), json!({ "vertices": n, "seconds": exact_seconds }));
    let solver_figures = json!({
        "vertices": n, "seconds": all_pairs, "build_seconds": build.seconds, "source_seconds": solve_seconds,
        "peak_mb": build.peak_mb, "mean_error": mean_error,
    });
    report.record(&format!("{case}-all-pairs"), solver_figures);
    report.export(&case, |folder| {
        write_arrays(folder, mesh)?;
        let sources: Vec<i32> = sources.iter().map(|&s| s as i32).collect();
        write_vector(&folder.join("sources.npy"), &sources)?;
        write_matrix(&folder.join("exact.npy"), &Matrix::from_fn(sources.len(), n, |i, j| truth[i][j]))?;
        write_matrix(&folder.join("solver.npy"), &rows)
    });
}

/// Tells the errors of the rows of distances; the mean over all, as a share.
fn errors(report: &Report, rows: &Matrix<f32>, truth: &[Vec<f64>], scale: f64) -> f64 {
    let mut means = Vec::new();
    for (range, limit) in [("all", f64::INFINITY), ("below 0.05 sqrt(area)", 0.05 * scale)] {
        let (mut sum, mut worst, mut count) = (0.0, 0.0f64, 0usize);
        for (i, row) in truth.iter().enumerate() {
            for (&fast, &exact) in rows.row(i).iter().zip(row) {
                if exact > 0.0 && exact < limit {
                    let error = (f64::from(fast) - exact) / exact;
                    (sum, worst, count) = (sum + error, worst.max(error), count + 1);
                }
            }
        }
        means.push(sum / count as f64);
        report.say(&format!(
            "  error, {range}: mean {:.4} %, max {:.3} %",
            100.0 * sum / count as f64,
            100.0 * worst
        ));
    }
    means[0]
}

fn report_asymmetry(report: &Report, sources: &[u32], truth: &[Vec<f64>], scale: f64) {
    let pairs = sources.iter().enumerate().flat_map(|(i, _)| (0..i).map(move |j| (i, j)));
    let worst = pairs
        .map(|(i, j)| (truth[i][sources[j] as usize], truth[j][sources[i] as usize]))
        .filter(|(d, _)| d.is_finite())
        .fold(0.0f64, |worst, (d, e)| worst.max((d - e).abs() / scale));
    report.say(&format!("  exact distances there and back differ by at most {worst:.1e} sqrt(area)"));
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
