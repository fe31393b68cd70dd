//! `fmnet-train evaluate` as a user runs it, and an experiment end to end, on generated shapes.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use fmnet::Mesh;
use fmnet::io::{Attributes, write_mesh};
use fmnet::mesh::shapes::{bumpy_sphere, transformed};
#[cfg(unix)]
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::Command;
#[cfg(unix)]
use std::process::Stdio;

fn train() -> Command {
    Command::new(env!("CARGO_BIN_EXE_fmnet-train"))
}

fn succeed(command: &mut Command) -> String {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Turned copies of a shape: any descriptor that no motion changes matches them exactly.
fn copies(folder: &Path, names: &[&str], level: u32) -> Vec<PathBuf> {
    std::fs::create_dir_all(folder).unwrap();
    let mesh = bumpy_sphere(level, 3);
    let turned = |angle: f64| -> Mesh {
        let (s, c) = angle.sin_cos();
        transformed(&mesh, [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], 1.0 + angle, [angle, 0.0, 1.0])
    };
    let write = |(i, name): (usize, &&str)| {
        let path = folder.join(name);
        write_mesh(&path, &turned(i as f64), &Attributes::default()).unwrap();
        path
    };
    names.iter().enumerate().map(write).collect()
}

fn csv_row(csv: &str, method: &str) -> Vec<f64> {
    let line = csv.lines().find(|l| l.starts_with(&format!("\"{method}\","))).expect("the method has a row");
    line.split(',').skip(1).map(|cell| cell.parse().unwrap()).collect()
}

#[test]
fn methods_are_compared_with_the_ground_truth() {
    let work = tempfile::tempdir().unwrap();
    let data = work.path().join("scape");
    copies(&data, &["mesh000.off", "mesh001.off", "mesh002.off"], 3);
    let maps = work.path().join("maps");
    std::fs::create_dir(&maps).unwrap();
    let n = bumpy_sphere(3, 3).n_vertices();
    let identity: String = (0..n).map(|i| format!("{i}\n")).collect();
    // All vertices to the first one: the worst competitor.
    let constant = "0\n".repeat(n);
    for (text, method) in [(&identity, "right"), (&constant, "constant")] {
        let folder = maps.join(method);
        std::fs::create_dir(&folder).unwrap();
        for (s, t) in [(0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)] {
            std::fs::write(folder.join(format!("mesh00{s}__mesh00{t}.txt")), text).unwrap();
        }
    }
    let out = work.path().join("out");
    let named = |method: &str| format!("{method}={}", maps.join(method).display());
    let text = succeed(
        train()
            .arg("evaluate")
            .arg(&data)
            .arg("--out")
            .arg(&out)
            .args([
                "--shot", "-k", "30", "--refine", "none", "--splits", "train", "--pairs", "6", "--json",
                "--quiet",
            ])
            .args(["--maps", &named("right"), "--maps", &named("constant")]),
    );
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["pairs"], 6);
    let csv = std::fs::read_to_string(out.join("summary.csv")).unwrap();
    let (shot, right, constant) = (csv_row(&csv, "SHOT"), csv_row(&csv, "right"), csv_row(&csv, "constant"));
    // Columns: pairs, mean, median, exact, within 0.05, ...
    assert_eq!((right[0], right[1], right[3], right[4]), (6.0, 0.0, 100.0, 100.0));
    assert!(shot[3] > 99.0, "turned copies: {csv}");
    assert!(constant[1] > 30.0 && constant[3] < 1.0, "{csv}");
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("data:image/png;base64,") && report.contains("<svg"));
    for file in ["pairs.csv", "curves.csv", "curves.svg", "cmc.svg", "histogram.svg"] {
        assert!(out.join(file).is_file(), "{file} is missing");
    }
    let map = std::fs::read_to_string(out.join("maps/SHOT/mesh000__mesh001.txt")).unwrap();
    assert_eq!(map.lines().filter(|l| !l.starts_with('#')).count(), n);
}

#[test]
fn an_experiment_trains_tests_and_reports_and_does_nothing_twice() {
    let work = tempfile::tempdir().unwrap();
    let data = work.path().join("data");
    let names = ["tr_reg_000.ply", "tr_reg_001.ply", "tr_reg_060.ply", "tr_reg_061.ply"];
    copies(&data.join("faust/registrations"), &names, 3);
    copies(&data.join("faust/remeshed_5k"), &names, 3);
    copies(&data.join("scape"), &["mesh000.off", "mesh001.off"], 3);
    let out = work.path().join("out");
    let reproduce = || {
        let mut command = train();
        command.args(["reproduce", "scape-transfer", "--steps", "2", "--pairs", "2", "--json"]);
        command.arg("--data").arg(&data).arg("--out").arg(&out);
        command
    };
    #[cfg(unix)]
    is_interrupted_after(&mut reproduce(), "evaluated", &out);
    let run = || succeed(&mut reproduce());
    let json: serde_json::Value = serde_json::from_str(&run()).unwrap();
    let report = PathBuf::from(json["report"].as_str().unwrap());
    let html = std::fs::read_to_string(&report).unwrap();
    assert!(html.contains("FMNet + ZoomOut") && html.contains("data:image/png;base64,"));
    let checkpoint = out.join("trainings/faust/last.safetensors");
    let metrics = || std::fs::read_to_string(out.join("trainings/faust/metrics.jsonl")).unwrap();
    let steps = |text: &str| text.lines().filter(|l| l.contains("\"event\":\"step\"")).count();
    assert!(checkpoint.is_file());
    assert_eq!(steps(&metrics()), 2);
    run();
    assert_eq!(steps(&metrics()), 2, "the second call trains again");
}

/// Interrupts a command when it says `word`: it must end with status 130, without a report or a half-written file.
#[cfg(unix)]
fn is_interrupted_after(command: &mut Command, word: &str, out: &Path) {
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    assert!(lines.any(|line| line.unwrap().contains(word)), "it never says {word:?}");
    let signal = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(signal.success());
    lines.for_each(drop);
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let mut folders = vec![out.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            assert!(
                path.extension().is_none_or(|e| e != "tmp" && e != "html"),
                "{} is there",
                path.display()
            );
            folders.extend(path.is_dir().then_some(path));
        }
    }
}
