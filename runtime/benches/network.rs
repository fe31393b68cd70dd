//! Seconds of the descriptor network through tract: `cargo bench --workspace --bench network`.
//!
//! The built-in model on the SHOT descriptors of a generated shape of 6890 vertices, on 1 and 2 threads. Options of every bench
//! (`-- --help`); `benches/peers/network.py` times onnxruntime on what `--export` wrote. Each figure is the least of several
//! runs.

mod support;

use fmnet::descriptor::{ShotOptions, shot};
use fmnet::io::write_matrix;
use fmnet::network::{Backend, DescriptorNetwork};
use std::path::Path;
use support::report::{Report, least};
use support::shapes::bumpy_torus;

fn main() {
    let report = Report::from_arguments("network");
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("model.onnx");
    let network = DescriptorNetwork::load(&model, Backend::Tract).expect("the built-in model");
    let mesh = bumpy_torus(106, 65);
    let n = mesh.n_vertices();
    let (descriptors, _) = shot(&mesh, &ShotOptions::default()).expect("a mesh with an area");
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let run = || {
            pool.install(|| network.descriptors(descriptors.rows(), &[descriptors.data()]))
                .expect("rows of the right width")
        };
        let (cost, output) = least(report.runs(5), run);
        let case = format!("network-{n}");
        let mut figures = cost.figures();
        figures["vertices"] = n.into();
        figures["threads"] = threads.into();
        report.figure(
            &format!("tract, {n} vertices, {threads} threads: {:.3} s", cost.seconds),
            &case,
            figures,
        );
        report.export(&case, |folder| {
            write_matrix(&folder.join("shot.npy"), &descriptors)?;
            write_matrix(&folder.join("descriptors.npy"), &output)
        });
    }
}
