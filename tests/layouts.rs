//! Short trainings on every layout of a dataset, each on small generated shapes.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use candle_core::Device;
use fmnet::Mesh;
use fmnet::io::{Attributes, write_mesh};
use fmnet::mesh::shapes::{bumpy_sphere, permuted, transformed};
use fmnet_trainer::config::{List, Sampling, TrainConfig};
use fmnet_trainer::dataset::{Dataset, Split};
use fmnet_trainer::events::TrainEvent;
use fmnet_trainer::network::{NetworkOptions, ResidualOptions};
use fmnet_trainer::simulate::{
    PartKind, PartOptions, ScanOptions, TriangulationOptions, cut_part, write_parts, write_scans,
    write_triangulations,
};
use fmnet_trainer::train::{METRICS, PLOT, TrainError, train};
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

/// A shape in pose number `pose`, 642 vertices.
fn shape(pose: usize) -> Mesh {
    let stretch = [[1.0 + 0.05 * pose as f64, 0.0, 0.0], [0.0, 1.0, 0.04 * pose as f64], [0.0, 0.0, 1.0]];
    transformed(&bumpy_sphere(3, 1), stretch, 1.0, [0.0; 3])
}

fn save(folder: &Path, name: &str, mesh: &Mesh) {
    write_mesh(&folder.join(name), mesh, &Attributes::default()).unwrap();
}

fn poses(folder: &Path, names: &[&str]) {
    names.iter().enumerate().for_each(|(pose, name)| save(folder, name, &shape(pose)));
}

fn config(data: &Path) -> TrainConfig {
    TrainConfig {
        dataset: List(vec![data.display().to_string()]),
        out: data.join("run"),
        steps: 3,
        k: 8,
        points: 60,
        pool: 400,
        shot_radius: 0.25,
        network: NetworkOptions::Residual(ResidualOptions { blocks: 1, ..ResidualOptions::default() }),
        validate_every: 2,
        validation_pairs: 2,
        ..TrainConfig::paper()
    }
}

/// Losses of the minibatches and errors of the validations.
fn run(config: &TrainConfig) -> (Vec<f64>, Vec<f64>) {
    let found = Mutex::new((Vec::new(), Vec::new()));
    let observer = |event| match event {
        TrainEvent::Step { stats, .. } => found.lock().unwrap().0.push(stats.loss),
        TrainEvent::Validated { mean_error, .. } => found.lock().unwrap().1.push(mean_error),
        _ => {}
    };
    train(config, &Device::Cpu, &observer, &AtomicBool::new(false)).unwrap();
    let (losses, errors) = found.into_inner().unwrap();
    assert_eq!(losses.len(), 3);
    assert!(losses.iter().chain(&errors).all(|x| x.is_finite() && *x > 0.0), "{losses:?} {errors:?}");
    (losses, errors)
}

#[test]
fn registrations_train_validate_and_leave_a_plot() {
    let folder = tempfile::tempdir().unwrap();
    poses(folder.path(), &["tr_reg_000.ply", "tr_reg_001.ply", "tr_reg_060.ply", "tr_reg_061.ply"]);
    let config = config(folder.path());
    assert_eq!(run(&config).1.len(), 2);
    let metrics = fs::read_to_string(config.out.join(METRICS)).unwrap();
    assert!(metrics.lines().count() >= 6, "{metrics}");
    let plot = fs::read_to_string(config.out.join(PLOT)).unwrap();
    assert!(plot.contains("Loss") && plot.contains("held-out pairs") && plot.ends_with("</svg>\n"));
}

#[test]
fn scans_train_with_jitter_and_holes() {
    let folder = tempfile::tempdir().unwrap();
    poses(folder.path(), &["tr_reg_000.ply", "tr_reg_001.ply", "tr_reg_060.ply", "tr_reg_061.ply"]);
    let out = folder.path().join("simulated");
    let dataset = Dataset::open(folder.path()).unwrap();
    let options =
        ScanOptions { vertices: 1500, detail: 0.012, holes: 4, hole_radius: 0.1, ..ScanOptions::default() };
    write_scans(&dataset, &[Split::Train, Split::Validation], &out, &options, &|_, _, _| {}).unwrap();
    let config = TrainConfig { jitter: 4, sampling: Sampling::Area, decimate: 1000, ..config(&out) };
    assert_eq!(run(&config).1.len(), 2);
}

#[test]
fn triangulations_train_by_points_on_the_surface() {
    let folder = tempfile::tempdir().unwrap();
    poses(folder.path(), &["tr_reg_000.ply", "tr_reg_001.ply", "tr_reg_060.ply", "tr_reg_061.ply"]);
    let out = folder.path().join("simulated");
    let options = TriangulationOptions {
        min_vertices: 700,
        typical_vertices: 800,
        max_vertices: 900,
        ..TriangulationOptions::default()
    };
    let splits = [Split::Train, Split::Validation];
    let dataset = Dataset::open(folder.path()).unwrap();
    write_triangulations(&dataset, &splits, &out, &options, &|_, _, _| {}).unwrap();
    assert_eq!(run(&config(&out)).1.len(), 2);
}

#[test]
fn remeshed_shapes_train_by_lists_of_vertices() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("corres")).unwrap();
    for (pose, name) in ["tr_reg_000", "tr_reg_001", "tr_reg_060", "tr_reg_061"].iter().enumerate() {
        let (mesh, place) = permuted(&shape(pose), pose as u64);
        save(folder.path(), &format!("{name}.off"), &mesh);
        let lines: String = place.iter().map(|v| format!("{}\n", v + 1)).collect();
        fs::write(folder.path().join(format!("corres/{name}.vts")), lines).unwrap();
    }
    assert_eq!(run(&config(folder.path())).1.len(), 2);
}

#[test]
fn scape_and_tosca_train() {
    for names in [["mesh000.off", "mesh001.off"], ["cat0.off", "cat1.off"]] {
        let folder = tempfile::tempdir().unwrap();
        poses(folder.path(), &names);
        assert!(run(&config(folder.path())).1.is_empty(), "there is nothing to validate on");
    }
}

#[test]
fn parts_train_as_sources() {
    let folder = tempfile::tempdir().unwrap();
    poses(folder.path(), &["dog0.off", "dog1.off", "dog2.off"]);
    let out = folder.path().join("parts");
    let options = PartOptions { test_parts: 2, ..PartOptions::default() };
    write_parts(&Dataset::open(folder.path()).unwrap(), &out, &options, &|_, _, _| {}).unwrap();
    let pairs = Mutex::new(0);
    let observer = |event| {
        if let TrainEvent::Started { pairs: found, .. } = event {
            *pairs.lock().unwrap() = found;
        }
    };
    let config = config(&out);
    train(&TrainConfig { steps: 1, ..config.clone() }, &Device::Cpu, &observer, &AtomicBool::new(false))
        .unwrap();
    assert_eq!(*pairs.lock().unwrap(), 20, "ten parts of each kind, each to the whole");
    fs::remove_dir_all(&config.out).unwrap();
    run(&config);
}

/// A whole and parts of other poses, some of them held out.
fn manifest_of_parts(folder: &Path) {
    let mut manifest = String::from("format = 1\n");
    let mut add = |name: &str, mesh: &Mesh, origin: &[u32], split: &str, partial: bool| {
        save(folder, &format!("{name}.ply"), mesh);
        let mut lines = vec![0; shape(0).n_vertices()];
        origin.iter().zip(1..).for_each(|(&point, line)| lines[point as usize] = line);
        let lines: String = lines.iter().map(|line| format!("{line}\n")).collect();
        fs::write(folder.join(format!("{name}.vts")), lines).unwrap();
        let _ = write!(
            manifest,
            "[[shape]]\nname = \"{name}\"\nmesh = \"{name}.ply\"\ngroup = \"g\"\ncorrespondence = \"{name}.vts\"\n\
             split = \"{split}\"\npartial = {partial}\n"
        );
    };
    let all: Vec<u32> = (0..shape(0).n_vertices() as u32).collect();
    add("whole", &shape(0), &all, "train", false);
    for (pose, split) in [(1, "train"), (2, "train"), (3, "validation"), (4, "validation")] {
        let part = cut_part(&shape(pose), PartKind::Cuts, &PartOptions::default(), pose as u64).unwrap();
        add(&format!("part{pose}"), &part.mesh, &part.origin, split, true);
    }
    fs::write(folder.join("dataset.toml"), manifest).unwrap();
}

#[test]
fn held_out_parts_are_matched_to_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    manifest_of_parts(folder.path());
    let (_, errors) = run(&config(folder.path()));
    assert_eq!(errors.len(), 2);
    // A map at random is off by about half the largest distance, far above what descriptors of equal shapes give.
    assert!(errors.iter().all(|&e| e < 60.0), "{errors:?}");
}

#[test]
fn a_part_with_too_few_points_makes_no_pair() {
    let folder = tempfile::tempdir().unwrap();
    poses(folder.path(), &["dog0.off", "dog1.off", "dog2.off"]);
    let out = folder.path().join("parts");
    let options = PartOptions { min_area: 0.3, max_area: 0.4, test_parts: 1, ..PartOptions::default() };
    write_parts(&Dataset::open(folder.path()).unwrap(), &out, &options, &|_, _, _| {}).unwrap();
    let config = TrainConfig { pool: 100, k: 55, points: 60, ..config(&out) };
    let error = train(&config, &Device::Cpu, &|_| {}, &AtomicBool::new(false)).unwrap_err();
    assert!(matches!(&error, TrainError::Sampler(_)) && error.to_string().contains("55 points"), "{error}");
}
