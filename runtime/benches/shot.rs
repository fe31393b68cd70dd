//! Time of SHOT over the number of vertices: `cargo bench --workspace --bench shot`.
//!
//! Generated shapes, and the meshes with a reference where the data is present, at the radius of the reference.
//! Options of every bench (`-- --help`); threads: `RAYON_NUM_THREADS`, 1 where it is not set. Each figure is the
//! least of several runs.

mod support;

use fmnet::Mesh;
use fmnet::descriptor::{ShotOptions, shot};
use support::report::{Report, least};
use support::shapes::bumpy_torus;

#[path = "../tests/support/reference_data.rs"]
mod reference_data;

/// Vertices around and along a torus.
const SIZES: [(usize, usize); 6] = [(40, 25), (106, 65), (200, 100), (250, 200), (400, 250), (500, 400)];

fn main() {
    let report = Report::from_arguments("shot");
    let threads = std::env::var("RAYON_NUM_THREADS").ok().and_then(|n| n.parse().ok()).unwrap_or(1);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool of threads");
    pool.install(|| {
        let heads = ["vertices", "neighbours", "ms", "ns/neighbour"];
        report
            .say(&format!("{:28} {:>9} {:>10} {:>9} {:>14}", "mesh", heads[0], heads[1], heads[2], heads[3]));
        for (ring, tube) in SIZES.into_iter().filter(|(ring, tube)| report.includes(ring * tube)) {
            measure(&report, "torus", &bumpy_torus(ring, tube), ShotOptions::default().radius);
        }
        for name in ["faust_tr_reg_060", "faust_5k_tr_reg_060", "scan_7k_000"] {
            if let Some((mesh, ..)) = reference_data::reference_rows(name) {
                measure(&report, name, &mesh, reference_data::reference_radius(name));
            }
        }
    });
}

fn measure(report: &Report, name: &str, mesh: &Mesh, radius: f64) {
    let mut options = ShotOptions::default();
    options.radius = radius;
    let n = mesh.n_vertices();
    let runs = report.runs(if n > 20_000 { 2 } else { 7 });
    let (cost, info) = least(runs, || shot(mesh, &options).expect("a mesh with an area").1);
    let line = format!(
        "{name:28} {n:9} {:10.1} {:9.2} {:14.1}",
        info.mean_neighbors,
        1e3 * cost.seconds,
        1e9 * cost.seconds / (info.mean_neighbors * n as f64)
    );
    let mut figures = cost.figures();
    figures["vertices"] = n.into();
    figures["neighbors"] = info.mean_neighbors.into();
    report.figure(&line, &format!("shot-{name}-{n}"), figures);
}
