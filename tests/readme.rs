//! The README and the pages in `docs` say what the programs do: their commands run, their options and links exist.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

use fmnet::mesh::shapes::bumpy_sphere;
use fmnet_tests::{Workplace, files_below, infer, javascript, python, root, run, train};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A command of a page, in words.
type Words = Vec<String>;

/// Every page for users.
fn pages() -> Vec<PathBuf> {
    let mut pages: Vec<PathBuf> = ["README.md", "CONTRIBUTING.md"].map(|page| root().join(page)).into();
    for folder in ["docs", "examples", "models"] {
        pages.extend(
            files_below(&root().join(folder))
                .into_iter()
                .filter(|f| f.extension().is_some_and(|e| e == "md")),
        );
    }
    pages.sort();
    pages.dedup();
    pages
}

/// The commands in the `sh` blocks of a page, in order.
fn commands(page: &Path) -> Vec<Words> {
    let text = std::fs::read_to_string(page).unwrap().replace("\\\n", " ");
    let mut inside = false;
    let mut commands = Vec::new();
    for line in text.lines() {
        match line.trim() {
            "```sh" => inside = true,
            "```" => inside = false,
            line if inside => {
                let line = line.split(" #").next().unwrap_or_default();
                commands.extend(line.split("&&").map(words).filter(|words| !words.is_empty()));
            }
            _ => {}
        }
    }
    commands
}

/// The words of a command, without the variables set before it.
fn words(command: &str) -> Words {
    let words = command.split_whitespace().filter(|word| !word.starts_with('#'));
    words.skip_while(|word| word.contains('=')).map(str::to_string).collect()
}

/// What a page's command is made to do here, in addition, so that it takes seconds.
fn shortened(program: &str, command: &str) -> &'static [&'static str] {
    match (program, command) {
        ("fmnet-train", "synth") => &[
            "--count",
            "3",
            "--species",
            "man,slender,dog",
            "--min-vertices",
            "4000",
            "--max-vertices",
            "4000",
        ],
        ("fmnet-train", "train") => &[
            "--steps",
            "2",
            "--set",
            "network.blocks=1",
            "--k",
            "20",
            "--points",
            "60",
            "--pool",
            "600",
            "--validation-pairs",
            "1",
            "--decimate",
            "1500",
        ],
        ("python", script) if script.ends_with("compare.py") => &["--dry-run"],
        _ => &[],
    }
}

/// The words of a command with two pairs where it asks for some.
fn fewer_pairs(words: &Words) -> Words {
    let mut fewer = words.clone();
    for i in 1..fewer.len() {
        if fewer[i - 1] == "--pairs" {
            fewer[i] = "2".into();
        }
    }
    fewer
}

/// Meshes that a page speaks of as the user's own, all of one connectivity, so that maps of some fit the others.
fn provide_meshes(work: &Workplace, words: &Words) {
    let is_mesh = |word: &&String| [".ply", ".obj", ".glb", ".off"].iter().any(|e| word.ends_with(e));
    let mut is_output = false;
    for (seed, word) in words.iter().enumerate() {
        let wanted = is_mesh(&word) && !is_output && !work.path(word).exists();
        is_output = word == "-o";
        if wanted {
            work.mesh(word, &bumpy_sphere(3, seed as u64));
        }
    }
}

/// Runs a command of a page, or an equivalent; `false` where it can only be looked at.
fn execute(work: &Workplace, words: &Words) -> bool {
    let of_repository = |word: &String| match root().join(word) {
        path if word.contains('/') && path.exists() => path.canonicalize().unwrap().display().to_string(),
        _ => word.clone(),
    };
    let rest: Words = words[1..].iter().map(of_repository).collect();
    let mut command = match words[0].as_str() {
        "fmnet-infer" => infer(),
        "fmnet-train" => train(),
        // Its own tests run them, in an environment that has the package (python/tests).
        "python" if uses_package(&words[1]) => return false,
        "python" => match python() {
            Some(python) => Command::new(python),
            None => return false,
        },
        "node" => match javascript() {
            Some(packages) => {
                let mut node = Command::new("node");
                node.env("NODE_PATH", packages.join("node_modules"));
                node
            }
            None => return false,
        },
        "cargo" => return check_cargo(work, words),
        "npm" | "pip" => return false,
        other => panic!("no one knows how to test {other:?} in {words:?}"),
    };
    provide_meshes(work, &rest);
    if words.iter().any(|w| w == "pairs.txt") {
        std::fs::write(work.path("pairs.txt"), "a.ply b.ply\n").unwrap();
        provide_meshes(work, &["a.ply".into(), "b.ply".into()].into());
    }
    if words.iter().any(|w| w == "landmarks.txt") {
        std::fs::write(work.path("landmarks.txt"), "0 0\n200 200\n").unwrap();
    }
    let name = rest.first().map_or("", String::as_str);
    command.args(fewer_pairs(&rest)).args(shortened(&words[0], name)).current_dir(work.folder());
    run(&mut command).unwrap_or_else(|e| panic!("{}: {e}", words.join(" ")));
    true
}

/// Whether a script, which has to be there, imports the package `fmnet`.
fn uses_package(script: &str) -> bool {
    std::fs::read_to_string(root().join(script)).is_ok_and(|text| text.contains("\nimport fmnet"))
}

/// `cargo run` runs the program; of the others (install, test, bench) the paths and names are checked.
fn check_cargo(work: &Workplace, words: &Words) -> bool {
    let value = |option: &str| words.iter().position(|w| w == option).map(|i| words[i + 1].clone());
    if words[1] == "run" {
        let arguments = words.iter().skip_while(|w| *w != "--").skip(1).cloned();
        return execute(work, &value("--bin").into_iter().chain(arguments).collect());
    }
    if let Some(path) = value("--path") {
        assert!(root().join(&path).join("Cargo.toml").is_file(), "{words:?}: no crate at {path}");
    }
    for (option, table) in [("--bench", "bench"), ("--test", "test")] {
        if let Some(name) = value(option) {
            let declared = |c: &str| std::fs::read_to_string(root().join(c).join("Cargo.toml")).unwrap();
            let wanted = format!("[[{table}]]\nname = \"{name}\"");
            let found = ["runtime", "trainer", "tests"].into_iter().any(|c| declared(c).contains(&wanted));
            assert!(found, "{words:?}: there is no {table} {name}");
        }
    }
    assert!(["install", "test", "bench", "doc", "build"].contains(&words[1].as_str()), "{words:?}");
    false
}

#[test]
fn the_commands_of_every_page_run() {
    for page in pages() {
        let work = Workplace::new();
        let commands = commands(&page);
        let ran = commands.iter().filter(|words| execute(&work, words)).count();
        eprintln!("{}: {} commands, {ran} run", page.display(), commands.len());
    }
    assert!(commands(&root().join("README.md")).len() > 10);
}

/// Text within backticks or code blocks.
fn code(page: &Path) -> String {
    let text = std::fs::read_to_string(page).unwrap();
    let mut code = String::new();
    for (i, block) in text.split("```").enumerate() {
        if i % 2 == 1 {
            code += block;
        } else {
            block.split('`').skip(1).step_by(2).for_each(|span| code += &format!("{span}\n"));
        }
    }
    code
}

fn options(text: &str) -> BTreeSet<String> {
    let is_part = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    let word = |part: &str| part.chars().take_while(|&c| is_part(c)).collect::<String>();
    let separators = |c: char| c.is_whitespace() || "`[(|,".contains(c);
    text.split(separators).filter_map(|w| w.strip_prefix("--")).map(word).filter(|w| w.len() > 1).collect()
}

#[test]
fn every_option_that_a_page_names_exists() {
    let mut known: BTreeSet<String> = BTreeSet::new();
    let help = |mut program: Command, arguments: &[&str]| {
        let output = program.args(arguments).output().unwrap();
        assert!(output.status.success(), "{arguments:?}");
        options(&String::from_utf8(output.stdout).unwrap())
    };
    for command in ["demo", "match", "batch", "transfer", "features", "evaluate", "inspect"] {
        known.extend(help(infer(), &[command, "--help"]));
    }
    for command in
        ["synth", "preprocess", "train", "calibrate", "export", "evaluate", "reproduce", "simulate"]
    {
        known.extend(help(train(), &[command, "--help"]));
    }
    for kind in ["parts", "scans", "triangulations"] {
        known.extend(help(train(), &["simulate", kind, "--help"]));
    }
    // Of cargo, its test harness and the scripts.
    let others = [
        "release",
        "workspace",
        "path",
        "bin",
        "bench",
        "example",
        "test",
        "features",
        "no-default-features",
        "no-deps",
        "quick",
        "only",
        "subdivisions",
    ];
    known.extend(
        others.into_iter().chain(["meshes", "corres", "nocapture", "open", "dressed"]).map(str::to_string),
    );
    let declared = |script: PathBuf| {
        let text = std::fs::read_to_string(script).unwrap();
        text.split("\"--")
            .skip(1)
            .map(|rest| rest.split('"').next().unwrap_or("").to_owned())
            .collect::<Vec<_>>()
    };
    let scripts = files_below(&root().join("examples/python"));
    let is_script = |path: &PathBuf| path.extension().is_some_and(|e| e == "py");
    known.extend(scripts.into_iter().filter(is_script).flat_map(declared));
    for page in pages() {
        for option in options(&code(&page)) {
            assert!(known.contains(&option), "{}: no program has an option --{option}", page.display());
        }
    }
}

#[test]
fn every_link_within_the_repository_leads_somewhere() {
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        for part in text.split("](").skip(1) {
            let link = part.split(')').next().unwrap_or_default();
            let path = link.split('#').next().unwrap_or_default();
            let outside = path.starts_with("http") || path.is_empty();
            assert!(outside || page.parent().unwrap().join(path).exists(), "{}: {link}", page.display());
        }
    }
}
