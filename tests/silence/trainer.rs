//! `fmnet-train`: paths of any name, closed pipes, full devices.

use fmnet_tests::{Workplace, skipped, train};
use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStringExt;
use std::path::Path;
use std::process::{Output, Stdio};

const SYNTH: [&str; 5] = ["synth", "--species", "man", "--count", "2"];

fn run(work: &Workplace, arguments: &[&OsStr]) -> Output {
    train().current_dir(work.folder()).args(arguments).output().unwrap()
}

#[test]
fn every_place_of_a_path_takes_any_name_or_is_refused_by_name() {
    let work = Workplace::new();
    let folder = OsString::from_vec(b"k\xf6rper".to_vec());
    if std::fs::create_dir(work.folder().join(&folder)).is_err() {
        return skipped("this disk takes no names but Unicode");
    }
    let os = |words: &[&str]| -> Vec<OsString> { words.iter().map(OsString::from).collect() };
    let synth = [os(&SYNTH), os(&["--json"]), vec![folder.clone()]].concat();
    let commands = [
        (synth, 0),
        (
            [os(&["preprocess"]), vec![folder.clone()], os(&["--json", "--cache"]), vec![folder.clone()]]
                .concat(),
            2,
        ),
        (
            [os(&["simulate", "parts"]), vec![folder.clone()], vec![folder.clone()], os(&["--json"])]
                .concat(),
            2,
        ),
        (
            [os(&["train", "--dataset", "none", "--steps", "1", "--json", "--out"]), vec![folder.clone()]]
                .concat(),
            2,
        ),
        ([os(&["export", "--json"]), vec![folder.clone()], os(&["-o"]), vec![folder.clone()]].concat(), 2),
        (
            [
                os(&["evaluate"]),
                vec![folder.clone()],
                os(&["--shot", "--json", "--pairs", "1", "--splits", "train,validation", "--out"]),
                vec![folder],
            ]
            .concat(),
            0,
        ),
    ];
    for (arguments, code) in commands {
        let arguments: Vec<&OsStr> = arguments.iter().map(OsString::as_os_str).collect();
        let output = run(&work, &arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(!stderr.contains("panicked"), "{arguments:?}: {stderr}");
        let found = output.status.code();
        assert!(found == Some(code) || (code == 2 && found == Some(0)), "{arguments:?}: {found:?}: {stderr}");
    }
}

#[test]
fn a_closed_pipe_is_no_fault_and_a_full_device_is_named() {
    let work = Workplace::new();
    let synth = |folder: &str, out: Stdio| {
        let mut command = train();
        command.current_dir(work.folder()).args(SYNTH).args(["--json", folder]);
        command.stdout(out).stderr(Stdio::piped()).spawn().unwrap()
    };
    let mut child = synth("a", Stdio::piped());
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    if !Path::new("/dev/full").exists() {
        return skipped("no /dev/full here");
    }
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = synth("b", Stdio::from(full)).wait_with_output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("standard output") && !stderr.contains("panicked"), "{stderr}");
}
