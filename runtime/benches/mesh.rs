//! Seconds of writing, reading, repairing and decimating a mesh: `cargo bench --workspace --bench mesh`.
//!
//! Two generated people, from 1K to 1M vertices. Options of every bench (`-- --help`); with `--export` the folder
//! `pair-N` has `source.ply` and `target.ply` of N vertices, for `fmnet-infer match`. Each figure is the least of
//! several runs. With `--batch` nothing is measured, and the folder `batch` has shapes for `fmnet-infer batch`.

mod support;

use fmnet::Mesh;
use fmnet::io::{Attributes, IoError, read_mesh, write_mesh};
use fmnet::mesh::{DecimateOptions, RepairOptions, decimate, repair};
use std::path::Path;
use support::report::{Report, least};
use support::shapes::{bodies, body};

const SIZES: [usize; 9] = [1000, 2000, 6890, 10_000, 20_000, 50_000, 100_000, 200_000, 1_000_000];
/// Larger meshes are measured once.
const REPEATED: usize = 200_000;
/// Vertices that the pipeline works with.
const WORKING: usize = 15_000;
/// Shapes of a batch, and with `--quick`, and the vertices of each.
const BATCH: (usize, usize) = (20, 4);
const BATCH_VERTICES: usize = 2000;

fn main() {
    let report = Report::from_arguments("mesh");
    if report.words.iter().any(|word| word == "--batch") {
        report
            .export("batch", |folder| write_batch(folder, if report.is_quick() { BATCH.1 } else { BATCH.0 }));
        return;
    }
    report.say(&format!(
        "{:>8} {:>9} {:>9} {:>9} {:>9}",
        "vertices", "write ms", "read ms", "repair ms", "decim. ms"
    ));
    for n in SIZES.into_iter().filter(|&n| report.includes(n)) {
        let [source, target] = bodies(n);
        measure(&report, &source);
        report.export(&format!("pair-{n}"), |folder| {
            for (name, mesh) in [("source.ply", &source), ("target.ply", &target)] {
                write_mesh(&folder.join(name), mesh, &Attributes::default())?;
            }
            Ok::<(), IoError>(())
        });
    }
}

/// Both people of the demo in turns, each of a triangulation of its own.
fn write_batch(folder: &Path, shapes: usize) -> Result<(), IoError> {
    (0..shapes).try_for_each(|i| {
        let mesh = body(["source", "target"][i % 2], BATCH_VERTICES, i as u64);
        write_mesh(&folder.join(format!("shape-{i:02}.ply")), &mesh, &Attributes::default())
    })
}

fn measure(report: &Report, mesh: &Mesh) {
    let n = mesh.n_vertices();
    let runs = if n > REPEATED { 1 } else { report.runs(3) };
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let file = folder.path().join("mesh.ply");
    let (write, ()) = least(runs, || {
        write_mesh(&file, mesh, &Attributes::default()).expect("a folder that can be written");
    });
    let (read, _) = least(runs, || read_mesh(&file).expect("the mesh just written"));
    let (repaired, _) = least(runs, || repair(mesh, &RepairOptions::default()).expect("a clean mesh"));
    let mut stages = vec![("write", write), ("read", read), ("repair", repaired)];
    if n > WORKING {
        let run = || decimate(mesh, WORKING, &DecimateOptions::default()).expect("bodies are manifold");
        stages.push(("decimate", least(runs, run).0));
    }
    let columns: Vec<String> = stages.iter().map(|(_, cost)| format!("{:9.2}", 1e3 * cost.seconds)).collect();
    report.say(&format!("{n:8} {}", columns.join(" ")));
    for (stage, cost) in stages {
        let mut figures = cost.figures();
        figures["vertices"] = n.into();
        report.record(&format!("mesh-{stage}-{n}"), figures);
    }
}
