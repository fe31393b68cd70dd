//! Names of files that are no Unicode, and readers of the output who leave early.
#![cfg(unix)]

use crate::workplace;
use fmnet_tests::{SHOT, Workplace, infer};
use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStringExt;
use std::path::Path;
use std::process::{Output, Stdio};

/// `kXrper.EXT` in Latin-1, as old archives hold names.
fn latin1(extension: &str) -> OsString {
    OsString::from_vec([&b"k\xf6rper."[..], extension.as_bytes()].concat())
}

fn run(work: &Workplace, arguments: &[&OsStr]) -> Output {
    infer().current_dir(work.folder()).args(arguments).output().unwrap()
}

fn words(words: &[&str]) -> Vec<OsString> {
    words.iter().map(OsString::from).collect()
}

#[test]
fn every_place_of_a_path_takes_any_name() {
    let (work, _) = workplace();
    let at = |name: &OsStr| work.folder().join(name);
    if std::fs::copy(work.path("a.off"), at(&latin1("off"))).is_err() {
        fmnet_tests::skipped("this disk takes no names but Unicode");
        return;
    }
    std::fs::copy(work.path("id.txt"), at(&latin1("txt"))).unwrap();
    std::fs::copy(work.path("id.txt"), at(&latin1("vts"))).unwrap();
    let folder = OsString::from_vec(b"f\xf6".to_vec());
    std::fs::create_dir(at(&folder)).unwrap();
    std::fs::copy(work.path("a.off"), at(&folder).join("a.off")).unwrap();
    std::fs::write(work.path("list.txt"), [&b"k\xf6rper.off b.off\n"[..], b"absent.off b.off\n"].concat())
        .unwrap();
    let name = |extension: &str| latin1(extension);
    let with = |first: &[&str], paths: &[OsString], rest: &[&str]| -> Vec<OsString> {
        [words(first), paths.to_vec(), words(rest)].concat()
    };
    let shot = &SHOT[..];
    let commands: Vec<(Vec<OsString>, i32)> = vec![
        (with(&["inspect"], &[name("off")], &[]), 0),
        (with(&["match"], &[name("off"), "b.off".into(), "-o".into(), name("npy")], shot), 0),
        (with(&["match", "a.off", "b.off", "-o", "m.txt", "--save-functional-map"], &[name("npy")], shot), 0),
        (
            with(&["match", "a.off", "b.off", "-o", "m.txt", "--cache"], std::slice::from_ref(&folder), shot),
            0,
        ),
        (with(&["match", "a.off", "b.off", "-o"], &[name("html")], shot), 0),
        (with(&["match", "a.off", "b.off", "-o", "m.txt", "--model"], &[name("onnx")], &[]), 2),
        (
            with(
                &["transfer"],
                &[name("off"), "b.off".into(), "--map".into(), name("txt"), "-o".into(), name("ply")],
                &[],
            ),
            0,
        ),
        (with(&["features"], &[name("off"), "--out".into(), folder.clone()], shot), 0),
        (
            with(
                &["evaluate", "id.txt", "--target", "b.off", "--source"],
                &[name("off"), "--ground-truth".into(), name("txt"), "-o".into(), name("svg")],
                &[],
            ),
            0,
        ),
        (
            with(
                &["evaluate", "id.txt", "--source", "a.off", "--target", "b.off", "--ground-truth"],
                &[OsString::from_vec([&b"k\xf6rper.vts,k\xf6rper.vts"[..]].concat())],
                &[],
            ),
            0,
        ),
        (with(&["batch", "list.txt", "--out"], std::slice::from_ref(&folder), shot), 2),
        (with(&["batch", "list.txt", "--out", "o", "--root"], &[folder], shot), 2),
    ];
    for (arguments, code) in commands {
        for json in [&[][..], &["--json".into()]] {
            let arguments: Vec<&OsStr> = arguments.iter().chain(json).map(OsString::as_os_str).collect();
            let output = run(&work, &arguments);
            let stderr = String::from_utf8_lossy(&output.stderr);
            assert!(!stderr.contains("panicked"), "{arguments:?}: {stderr}");
            assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
        }
    }
    // The map of the list's first pair has its name.
    let map = OsString::from_vec(b"f\xf6/k\xf6rper__b.txt".to_vec());
    assert!(at(&map).is_file());
}

#[test]
fn materials_and_images_keep_any_name() {
    let (work, _) = workplace();
    let read = |path: &Path| fmnet::io::read_mesh(path).unwrap();
    let image = OsString::from_vec(b"h\xe4ut.png".to_vec());
    if std::fs::write(work.folder().join(&image), b"\x89PNG").is_err() {
        return fmnet_tests::skipped("this disk takes no names but Unicode");
    }
    std::fs::write(work.path("a.mtl"), b"newmtl a\nmap_Kd h\xe4ut.png\n").unwrap();
    std::fs::write(
        work.path("a.obj"),
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n",
    )
    .unwrap();
    let file = read(&work.path("a.obj"));
    let texture = file.attributes.texture.clone();
    assert_eq!(texture, Some(fmnet::io::Texture::File(work.folder().join(&image))));
    for extension in ["obj", "ply"] {
        let path = work.folder().join(latin1(extension));
        fmnet::io::write_mesh(&path, &file.mesh, &file.attributes).unwrap();
        assert_eq!(read(&path).attributes.texture, texture, "{extension}");
    }
}

#[test]
fn who_reads_the_output_may_leave_early() {
    let (work, _) = workplace();
    let mut child = infer();
    child.current_dir(work.folder()).args(["inspect", "--json", "a.off"]);
    let mut child = child.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), output.stderr.as_slice()), (Some(0), &b""[..]));
}

#[test]
fn a_full_device_behind_the_output_is_an_error() {
    if !Path::new("/dev/full").exists() {
        return fmnet_tests::skipped("no /dev/full here");
    }
    let (work, _) = workplace();
    let full = || Stdio::from(std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap());
    let inspect = |out: Stdio, err: Stdio| {
        let mut command = infer();
        command
            .current_dir(work.folder())
            .args(["inspect", "a.off"])
            .stdout(out)
            .stderr(err)
            .output()
            .unwrap()
    };
    let output = inspect(full(), Stdio::piped());
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr.contains("standard output") && stderr.contains("No space left"), "{stderr}");
    // Nor does a standard error that takes nothing end the program.
    assert_eq!(inspect(full(), full()).status.code(), Some(1));
}
