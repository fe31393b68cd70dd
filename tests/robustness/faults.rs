//! Interrupts, full and read-only disks, processes that share a cache, too little memory.

use fmnet::io::read_mesh;
use fmnet::mesh::shapes::{bumpy_sphere, grid};
use fmnet_tests::{SHOT, Workplace, files_below, infer, skipped, targets};
use std::io::{BufRead, BufReader};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Instant;

fn pair(work: &Workplace, subdivisions: u32) {
    work.mesh("a.off", &bumpy_sphere(subdivisions, 1));
    work.mesh("b.off", &bumpy_sphere(subdivisions, 2));
}

fn matching<'a>(outputs: &[&'a str]) -> Vec<&'a str> {
    let outputs = outputs.iter().flat_map(|output| ["-o", output]);
    ["match", "a.off", "b.off"].into_iter().chain(outputs).chain(SHOT).collect()
}

/// Runs `fmnet-infer` from a shell that first does something about its limits.
fn run_limited(work: &Workplace, limits: &str, arguments: &[&str]) -> Output {
    let program = infer();
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("{limits}; exec \"$0\" \"$@\"")]).arg(program.get_program()).args(arguments);
    shell.current_dir(work.folder()).output().unwrap()
}

fn assert_failed(output: &Output, code: i32, parts: &[&str]) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    parts.iter().for_each(|part| assert!(stderr.contains(part), "{part:?} is not in: {stderr}"));
}

#[test]
fn a_full_device_is_named() {
    if !Path::new("/dev/full").exists() {
        skipped("no /dev/full here");
        return;
    }
    let work = Workplace::new();
    pair(&work, 3);
    for name in ["full.txt", "full.npy", "full.csv", "full.ply", "full.glb", "full.html"] {
        symlink("/dev/full", work.path(name)).unwrap();
        assert_failed(&work.run(&matching(&[name])), 1, &[name, "No space left"]);
    }
}

#[test]
fn a_full_disk_leaves_no_part_of_a_file() {
    let work = Workplace::new();
    pair(&work, 4);
    // The system refuses to let any file grow beyond 1 or 2 KiB, as a full disk does.
    let limits = "trap '' XFSZ; ulimit -f 2";
    for name in ["m.txt", "m.csv", "m.ply", "m.html"] {
        assert_failed(&run_limited(&work, limits, &matching(&[name])), 1, &[name]);
        assert!(!work.path(name).exists(), "{name}");
    }
    let features = [&["features", "a.off", "--out", "f"][..], &SHOT].concat();
    assert_failed(&run_limited(&work, limits, &features), 1, &["eigenvectors.npy"]);
    assert!(!work.path("f/eigenvectors.npy").exists());
    let cached = [&matching(&["c.txt"])[..], &["--cache", "cache"]].concat();
    assert_failed(&run_limited(&work, limits, &cached), 1, &["cache"]);
    assert!(work.temporary_files().is_empty(), "{:?}", work.temporary_files());

    // An old file survives.
    work.succeed(&matching(&["m.txt"]));
    let old = std::fs::read(work.path("m.txt")).unwrap();
    assert_failed(&run_limited(&work, limits, &matching(&["m.txt"])), 1, &["m.txt"]);
    assert_eq!(std::fs::read(work.path("m.txt")).unwrap(), old);
}

#[test]
fn a_read_only_folder_is_named() {
    let work = Workplace::new();
    pair(&work, 3);
    let folder = work.path("locked");
    std::fs::create_dir(&folder).unwrap();
    std::fs::set_permissions(&folder, std::fs::Permissions::from_mode(0o555)).unwrap();
    if std::fs::write(folder.join("probe"), "").is_ok() {
        skipped("this user (root?) may write to read-only folders");
        return;
    }
    assert_failed(&work.run(&matching(&["locked/m.txt"])), 1, &["locked/m.txt", "ermission denied"]);
    let batch = [&["batch", "pairs.txt", "--out", "locked/maps"][..], &SHOT].concat();
    std::fs::write(work.path("pairs.txt"), "a.off b.off\n").unwrap();
    assert_failed(&work.run(&batch), 1, &["locked/maps"]);
    let features = [&["features", "a.off", "--out", "locked/f"][..], &SHOT].concat();
    assert_failed(&work.run(&features), 1, &["locked/f"]);
}

/// `/proc` refuses every new file, whoever asks.
#[test]
fn a_folder_that_takes_no_files_is_named() {
    let Ok(true) = Path::new("/proc/self").try_exists() else { return skipped("no /proc here") };
    let work = Workplace::new();
    pair(&work, 3);
    assert_failed(&work.run(&matching(&["/proc/m.txt"])), 1, &["/proc/m.txt"]);
    let features = [&["features", "a.off", "--out", "/proc/f"][..], &SHOT].concat();
    assert_failed(&work.run(&features), 1, &["/proc/f"]);
    let cached = [&matching(&["m.txt"])[..], &["--cache", "/proc/cache"]].concat();
    assert_failed(&work.run(&cached), 1, &["/proc/cache"]);
}

fn start(work: &Workplace, arguments: &[&str]) -> Child {
    let mut command = infer();
    command.current_dir(work.folder()).args(arguments).stdout(Stdio::null()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

/// Interrupts a program once it has said something, which is after it began to listen to interrupts. Its exit status
/// must be that of an interrupted one.
fn interrupt_after(mut child: Child, said: &str) {
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
    let heard = lines.find(|line| line.contains(said));
    assert!(heard.is_some(), "it ended without saying {said:?}");
    let status = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(status.success());
    let rest: Vec<String> = lines.collect();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{rest:?}");
}

/// A file that whoever reads it waits for without end: what comes before it is done, and nothing after.
fn endless(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

#[test]
fn an_interrupted_batch_leaves_whole_files_and_goes_on() {
    let work = Workplace::new();
    let names: Vec<String> = (0..6).map(|i| format!("s{i}.off")).collect();
    for (seed, name) in names.iter().enumerate() {
        work.mesh(name, &bumpy_sphere(4, seed as u64));
    }
    let ordered = names.iter().flat_map(|s| names.iter().filter(move |t| *t != s).map(move |t| (s, t)));
    let pairs: String = ordered.map(|(s, t)| format!("{s} {t}\n")).collect();
    let pairs = format!("{pairs}s0.off last.off\n");
    std::fs::write(work.path("pairs.txt"), &pairs).unwrap();
    endless(&work.path("last.off"));
    let arguments = [&["batch", "pairs.txt", "--out", "maps"][..], &SHOT].concat();
    // Once while shapes are written to the cache, once while maps are.
    for said in ["s1.off: repair", " of 31: maps/"] {
        interrupt_after(start(&work, &arguments), said);
        assert!(work.temporary_files().is_empty(), "{:?}", work.temporary_files());
        for file in files_below(&work.path("maps")).iter().filter(|f| f.extension().unwrap() == "txt") {
            assert_eq!(targets(file).len(), 2562, "{}", file.display());
        }
    }
    std::fs::remove_file(work.path("last.off")).unwrap();
    work.mesh("last.off", &bumpy_sphere(4, 9));
    work.succeed(&arguments);
    // Beside each map its key, and the cache.
    assert_eq!(std::fs::read_dir(work.path("maps")).unwrap().count(), 2 * pairs.lines().count() + 1);
}

#[test]
fn an_interrupted_match_leaves_nothing() {
    let work = Workplace::new();
    work.mesh("a.off", &grid(200, 200));
    work.mesh("b.off", &grid(201, 199));
    let arguments = [&matching(&["m.txt"])[..], &["--decimate", "off", "--cache", "cache"]].concat();
    interrupt_after(start(&work, &arguments), ".off: repair");
    assert!(!work.path("m.txt").exists() && work.temporary_files().is_empty());
}

#[test]
fn processes_share_a_cache() {
    let work = Workplace::new();
    pair(&work, 4);
    let outputs: Vec<String> = (0..4).map(|i| format!("m{i}.csv")).collect();
    let start_one = |output: &String| {
        start(&work, &[&matching(&[output])[..], &["--cache", "shared", "--refine", "zoomout"]].concat())
    };
    for child in outputs.iter().map(start_one).collect::<Vec<_>>() {
        let output = child.wait_with_output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && !stderr.contains("damaged"), "{stderr}");
    }
    let first = std::fs::read(work.path("m0.csv")).unwrap();
    assert!(outputs[1..].iter().all(|output| std::fs::read(work.path(output)).unwrap() == first));
    assert!(work.temporary_files().is_empty());
    // A damaged entry is told of, computed again and mended.
    for entry in files_below(&work.path("shared")) {
        let bytes = std::fs::read(&entry).unwrap();
        std::fs::write(&entry, &bytes[..bytes.len() / 2]).unwrap();
    }
    let again = [&matching(&["m4.csv"])[..], &["--cache", "shared", "--refine", "zoomout"]].concat();
    let output = work.run(&again);
    assert!(output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("damaged cache entry"));
    assert_eq!(std::fs::read(work.path("m4.csv")).unwrap(), first);
    assert!(!String::from_utf8_lossy(&work.run(&again).stderr).contains("damaged"));
}

#[cfg(target_os = "linux")]
#[test]
fn what_does_not_fit_the_memory_is_refused_before_the_work() {
    let work = Workplace::new();
    work.mesh("a.ply", &grid(500, 500));
    let features =
        ["features", "a.ply", "--out", "f", "--descriptor", "shot", "--decimate", "off", "-k", "300"];
    let start = Instant::now();
    // Two threads, as each one's arena counts towards the address space.
    let output = run_limited(&work, "ulimit -v 1000000", &[&features[..], &["--threads", "2"]].concat());
    assert_failed(&output, 1, &["a.ply", "would take about", "GiB", "--decimate"]);
    eprintln!("refused after {:.1} s", start.elapsed().as_secs_f64());
    assert!(!work.path("f/eigenvectors.npy").exists());
    // The same mesh, decimated, fits. Products pack their panels in buffers of the size of the last-level cache for
    // each thread, which on large machines takes some hundred MiB of address space.
    let limited = [&features[..6], &["--decimate", "3000", "-k", "40", "--threads", "2"]].concat();
    assert!(run_limited(&work, "ulimit -v 4000000", &limited).status.success());
    assert_eq!(read_mesh(&work.path("a.ply")).unwrap().mesh.n_vertices(), 251_001);
}
