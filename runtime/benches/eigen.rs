//! Seconds of the Laplacian and of the eigenbasis over the number of vertices: `cargo bench --workspace --bench eigen`.
//!
//! Options of every bench (`-- --help`); `benches/peers/eigen.py` times scipy on what `--export` wrote. Threads:
//! `RAYON_NUM_THREADS`. Each wall time is the least of several runs; processor time is that of the same run, on Linux.

mod support;

use fmnet::Mesh;
use fmnet::io::write_vector;
use fmnet::spectral::{EigenOptions, Laplacian, eigenbasis};
use support::report::{Report, least, measured};
use support::shapes::{bumpy_torus, write_arrays};

/// Vertices around and along a torus, and eigenpairs.
const SIZES: [(usize, usize, usize); 7] = [
    (40, 25, 120),
    (106, 65, 120),
    (106, 65, 200),
    (106, 65, 500),
    (150, 100, 200),
    (300, 200, 200),
    (500, 400, 100),
];

fn main() {
    let report = Report::from_arguments("eigen");
    report.say(&format!("{} threads", rayon::current_num_threads()));
    report.say(&format!(
        "{:>8} {:>4} {:>11} {:>9} {:>9} {:>9} {:>7} {:>11} {:>9}",
        "vertices", "k", "Laplacian s", "eigen s", "cpu s", "subspace", "solves", "factor 1e6", "residual"
    ));
    for (ring, tube, k) in SIZES {
        if report.includes(ring * tube) {
            measure(&report, &bumpy_torus(ring, tube), k);
        }
    }
}

fn measure(report: &Report, mesh: &Mesh, k: usize) {
    let n = mesh.n_vertices();
    let runs = report.runs(if n > 20_000 { 2 } else { 5 });
    let (assembly, laplacian) = measured(|| Laplacian::new(mesh));
    let (cost, (basis, info)) = least(runs, || {
        eigenbasis(&laplacian, k, &EigenOptions::default()).expect("a clean mesh has an eigenbasis")
    });
    let line = format!(
        "{n:8} {k:4} {:11.4} {:9.3} {:9.3} {:9} {:7} {:11.2} {:9.1e}",
        assembly.seconds,
        cost.seconds,
        cost.cpu_seconds,
        info.subspace,
        info.solves,
        info.factor_entries as f64 * 1e-6,
        info.max_residual
    );
    let case = format!("eigen-{n}-{k}");
    let mut figures = cost.figures();
    figures["vertices"] = n.into();
    figures["k"] = k.into();
    figures["laplacian_seconds"] = assembly.seconds.into();
    figures["max_residual"] = info.max_residual.into();
    report.figure(&line, &case, figures);
    report.export(&case, |folder| {
        write_arrays(folder, mesh)?;
        write_vector(&folder.join("eigenvalues.npy"), &basis.eigenvalues)
    });
}
