//! Time of the descriptor network through tract: `cargo bench -p fmnet-runtime --bench network [-- --export DIR]`.
//!
//! The built-in model on the SHOT descriptors of a generated shape of 6890 vertices or so. With `--export DIR` the descriptors are
//! written to DIR/shot.npy, for `benches/peers/network.py` to time onnxruntime on the same. Each figure is the least of several
//! runs.

use fmnet::descriptor::{ShotOptions, shot};
use fmnet::io::write_matrix;
use fmnet::mesh::shapes::torus;
use fmnet::network::{Backend, DescriptorNetwork};
use std::path::{Path, PathBuf};
use std::time::Instant;

fn main() {
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/bodies/model.onnx");
    let network = DescriptorNetwork::load(&model, Backend::Tract).expect("the built-in model");
    let mesh = torus(130, 53, 0.4);
    let (descriptors, _) = shot(&mesh, &ShotOptions::default()).expect("a mesh with an area");
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(at) = arguments.iter().position(|a| a == "--export") {
        let folder = PathBuf::from(arguments.get(at + 1).expect("--export needs a folder"));
        std::fs::create_dir_all(&folder).expect("a folder that can be written");
        write_matrix(&folder.join("shot.npy"), &descriptors).expect("a folder that can be written");
    }
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let run = || {
            let start = Instant::now();
            pool.install(|| network.descriptors(&descriptors)).expect("descriptors of the right width");
            start.elapsed().as_secs_f64()
        };
        let seconds = (0..5).map(|_| run()).fold(f64::INFINITY, f64::min);
        println!("tract, {} vertices, {threads} threads: {seconds:.3} s", mesh.n_vertices());
    }
}
