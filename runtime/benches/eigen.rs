//! Seconds of the Laplacian and of the eigenbasis over the number of vertices: `cargo bench -p fmnet-runtime
//! --bench eigen`.
//!
//! Arguments after `--`: `--quick` leaves the meshes above 20K vertices out; `--export DIR` writes each mesh
//! as `.off`, and the eigenvalues found as `.txt`, for `benches/peers/eigen.py` to time scipy on. Threads:
//! `RAYON_NUM_THREADS`. Each wall time is the least of several runs; processor time is that of the same run,
//! on Linux.

use fmnet::Mesh;
use fmnet::mesh::shapes;
use fmnet::spectral::{EigenInfo, EigenOptions, Eigenbasis, Laplacian, eigenbasis};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

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
    let arguments: Vec<String> = std::env::args().collect();
    let quick = arguments.iter().any(|a| a == "--quick");
    let export =
        arguments.iter().position(|a| a == "--export").and_then(|i| arguments.get(i + 1)).map(PathBuf::from);
    println!("{} threads", rayon::current_num_threads());
    println!(
        "{:>8} {:>4} {:>11} {:>9} {:>9} {:>9} {:>7} {:>11} {:>9}",
        "vertices", "k", "Laplacian s", "eigen s", "cpu s", "subspace", "solves", "factor 1e6", "residual"
    );
    for (ring, tube, k) in SIZES {
        if quick && ring * tube > 20_000 {
            continue;
        }
        let mesh = bumpy_torus(ring, tube);
        let basis = bench(&mesh, k);
        if let Some(folder) = &export {
            write_case(folder, &mesh, &basis).expect("the folder of --export can be written to");
        }
    }
}

fn bench(mesh: &Mesh, k: usize) -> Eigenbasis {
    let runs = if mesh.n_vertices() > 20_000 { 2 } else { 5 };
    let (seconds, cpu, assembly, basis, info) =
        (0..runs).map(|_| run(mesh, k)).min_by(|a, b| a.0.total_cmp(&b.0)).expect("several runs");
    println!(
        "{:8} {k:4} {assembly:11.4} {seconds:9.3} {cpu:9.3} {:9} {:7} {:11.2} {:9.1e}",
        mesh.n_vertices(),
        info.subspace,
        info.solves,
        info.factor_entries as f64 * 1e-6,
        info.max_residual
    );
    basis
}

/// Wall and processor seconds of the eigenbasis, seconds of the Laplacian, and the result.
fn run(mesh: &Mesh, k: usize) -> (f64, f64, f64, Eigenbasis, EigenInfo) {
    let start = Instant::now();
    let laplacian = Laplacian::new(mesh);
    let assembly = start.elapsed().as_secs_f64();
    let (start, cpu) = (Instant::now(), processor_seconds());
    let (basis, info) =
        eigenbasis(&laplacian, k, &EigenOptions::default()).expect("a clean mesh has an eigenbasis");
    (start.elapsed().as_secs_f64(), processor_seconds() - cpu, assembly, basis, info)
}

/// Seconds of processor time of this process in user mode; NaN where the system does not say.
fn processor_seconds() -> f64 {
    let ticks = std::fs::read_to_string("/proc/self/stat").ok().and_then(|stat| {
        let after_name = stat.rsplit(')').next()?.to_owned();
        after_name.split_whitespace().nth(11)?.parse::<f64>().ok()
    });
    // A tick is 1/100 s on every Linux.
    ticks.map_or(f64::NAN, |t| t / 100.0)
}

/// A torus with bumps of several wavelengths, without symmetry.
fn bumpy_torus(ring: usize, tube: usize) -> Mesh {
    let torus = shapes::torus(ring, tube, 0.4);
    let bump = |[x, y, z]: [f64; 3]| {
        let r = 1.0 + 0.2 * (3.0 * x + 0.3).sin() * (2.0 * y + 1.0).cos() + 0.1 * (5.0 * z + 4.0 * x).sin();
        [r * x, 0.8 * r * y, 1.5 * r * z]
    };
    let vertices = torus.vertices().iter().map(|&p| bump(p)).collect();
    Mesh::new(vertices, torus.faces().to_vec()).expect("the faces are those of the torus")
}

/// Writes `eigen_N_K.off` and `eigen_N_K.txt`, one eigenvalue a line.
fn write_case(folder: &Path, mesh: &Mesh, basis: &Eigenbasis) -> std::io::Result<()> {
    let mut off = format!("OFF\n{} {} 0\n", mesh.n_vertices(), mesh.n_faces());
    for [x, y, z] in mesh.vertices() {
        writeln!(off, "{x} {y} {z}").expect("writing to a string succeeds");
    }
    for [a, b, c] in mesh.faces() {
        writeln!(off, "3 {a} {b} {c}").expect("writing to a string succeeds");
    }
    let values: Vec<String> = basis.eigenvalues.iter().map(f64::to_string).collect();
    std::fs::create_dir_all(folder)?;
    let name = format!("eigen_{}_{}", mesh.n_vertices(), basis.k());
    std::fs::write(folder.join(format!("{name}.off")), off)?;
    std::fs::write(folder.join(format!("{name}.txt")), values.join("\n"))
}
