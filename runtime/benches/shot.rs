//! Time of SHOT on one thread, over the number of vertices: `cargo bench -p fmnet-runtime --bench shot`.
//!
//! Generated shapes, and the meshes with a reference where the data is present, at the radius of the reference. Each
//! figure is the least of several runs.

use std::time::Instant;

use fmnet::{
    Mesh,
    descriptor::{ShotOptions, shot},
    mesh::shapes,
};

#[path = "../tests/support/reference_data.rs"]
mod reference_data;

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread");
    pool.install(|| {
        println!("{:28} {:>9} {:>10} {:>9} {:>14}", "mesh", "vertices", "neighbours", "ms", "ns/neighbour");
        for subdivisions in 4..=6 {
            bench(
                &format!("bumpy sphere, {subdivisions}"),
                &shapes::bumpy_sphere(subdivisions, 1),
                ShotOptions::default().radius,
            );
        }
        for name in ["faust_tr_reg_060", "faust_5k_tr_reg_060", "scan_7k_000"] {
            if let Some((mesh, ..)) = reference_data::reference_rows(name) {
                bench(name, &mesh, reference_data::reference_radius(name));
            }
        }
    });
}

fn bench(name: &str, mesh: &Mesh, radius: f64) {
    let options = ShotOptions { radius, ..Default::default() };
    let run = || {
        let start = Instant::now();
        let (_, info) = shot(mesh, &options).expect("a mesh with an area");
        (start.elapsed().as_secs_f64(), info)
    };
    let (seconds, info) = (0..7).map(|_| run()).min_by(|a, b| a.0.total_cmp(&b.0)).expect("several runs");
    let neighbors = info.mean_neighbors * mesh.n_vertices() as f64;
    println!(
        "{name:28} {:9} {:10.1} {:9.2} {:14.1}",
        mesh.n_vertices(),
        info.mean_neighbors,
        1e3 * seconds,
        1e9 * seconds / neighbors
    );
}
