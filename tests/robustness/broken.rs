//! Every broken mesh through every command: a result, or an error that names the file.

use super::corpus;
use fmnet::mesh::shapes::bumpy_sphere;
use fmnet_tests::Workplace;

/// What costs least and still runs every stage.
const SMALL: [&str; 6] = ["--descriptor", "shot", "-k", "8", "--shot-radius", "0.3"];

/// Runs a command on a file: exit status 0, or 2 with an error that names the file. Returns whether it succeeded.
fn check(work: &Workplace, file: &str, arguments: &[&str]) -> bool {
    let output = work.run(arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    match output.status.code() {
        Some(0) => true,
        Some(2) => {
            assert!(stderr.contains("error: "), "{arguments:?}: {stderr}");
            assert!(stderr.contains(file), "{arguments:?} does not name {file}: {stderr}");
            false
        }
        code => panic!("{arguments:?}: exit status {code:?}: {stderr}"),
    }
}

fn corpus() -> (Workplace, Vec<String>) {
    let work = Workplace::new();
    let names = corpus::write(work.folder());
    work.mesh("good.off", &bumpy_sphere(3, 5));
    (work, names)
}

/// Prints what came of it, for `docs/robustness.md`.
fn tell(command: &str, outcomes: &[(String, bool)]) {
    let refused: Vec<&str> = outcomes.iter().filter(|o| !o.1).map(|o| o.0.as_str()).collect();
    eprintln!("{command}: {} files, refused {}: {}", outcomes.len(), refused.len(), refused.join(", "));
    assert!(refused.len() < outcomes.len(), "{command} refuses everything");
}

fn each(command: &str, names: &[String], run: impl Fn(&str) -> bool) {
    let outcomes: Vec<(String, bool)> = names.iter().map(|name| (name.clone(), run(name))).collect();
    tell(command, &outcomes);
}

#[test]
fn inspect_and_features() {
    let (work, names) = corpus();
    each("inspect", &names, |name| check(&work, name, &["inspect", name, "--json"]));
    each("features", &names, |name| {
        check(&work, name, &[&["features", name, "--out", "f"][..], &SMALL].concat())
    });
}

#[test]
fn match_in_both_directions() {
    let (work, names) = corpus();
    let pair = |name: &str, source: &str, target: &str| {
        let arguments = ["match", source, target, "-o", "m.txt", "-o", "m.html", "-o", "m.ply"];
        check(&work, name, &[&arguments[..], &SMALL, &["--refine", "icp"]].concat())
    };
    each("match as source", &names, |name| pair(name, name, "good.off"));
    each("match as target", &names, |name| pair(name, "good.off", name));
}

#[test]
fn match_with_the_model_and_decimation() {
    let (work, names) = corpus();
    each("match with itself, model", &names, |name| {
        let arguments = ["match", name, name, "-o", "m.csv", "-k", "8", "--decimate", "150"];
        check(&work, name, &arguments)
    });
}

#[test]
fn batch_transfer_and_evaluate() {
    let (work, names) = corpus();
    let mut stems = std::collections::BTreeSet::new();
    let stem = |name: &str| name.split('.').next().unwrap_or(name).to_string();
    let distinct: Vec<&String> = names.iter().filter(|name| stems.insert(stem(name))).collect();
    let pairs: String = distinct.iter().map(|name| format!("{name}\tgood.off\n")).collect();
    std::fs::write(work.path("pairs.txt"), pairs).unwrap();
    let output = work.run(&[&["batch", "pairs.txt", "--out", "maps"][..], &SMALL].concat());
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    for name in &distinct {
        let map = work.path(&format!("maps/{}__good.txt", stem(name)));
        assert!(map.is_file() || stderr.contains(name.as_str()), "nothing is said of {name}: {stderr}");
    }

    each("transfer", &names, |name| {
        let map = format!("maps/{}__good.txt", stem(name));
        let usable = work.path(&map).is_file() && distinct.iter().any(|d| *d == name);
        let map = if usable { map } else { "absent.txt".into() };
        let there = ["transfer", name, "good.off", "--map", &map, "-o", "t.ply"];
        let back = ["transfer", name, "good.off", "--map", &map, "--to", "target", "-o", "t.obj"];
        let named = if usable { name } else { "" };
        check(&work, named, &there) & check(&work, named, &back)
    });
    each("evaluate", &names, |name| {
        let truth = ["--source", name, "--target", name, "--ground-truth", "identity"];
        std::fs::write(work.path("zero.txt"), "0\n").unwrap();
        let matched = work.run(&[&["match", name, name, "-o", "self.txt", "--quiet"][..], &SMALL].concat());
        let map = if matched.status.success() { "self.txt" } else { "zero.txt" };
        check(&work, "", &[&["evaluate", map, "-o", "c.svg", "-o", "c.csv"][..], &truth].concat())
    });
}
