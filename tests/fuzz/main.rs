//! Hostile files: every reader gets valid files that were changed at random, and must answer with a result or an
//! error: no panic, no abort, in bounded memory and time.
//!
//! Each target runs in a process of its own, so that an abort, a runaway allocation or an endless loop is caught as
//! well; after a failure it goes on behind the culprit. Inputs are a function of target, seed and number. For a long
//! run:
//!
//! ```sh
//! FMNET_FUZZ_SECONDS=600 FMNET_FUZZ_SEED=2 cargo test --release --workspace --test fuzz -- --nocapture
//! ```
//!
//! `FMNET_FUZZ_TARGET=ply` runs one target only. A failure names the input, which is kept in the folder for temporary
//! files.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

mod allocator;
mod mutate;
mod targets;

use std::fs::File;
use std::io::{Seek, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use targets::Target;

#[global_allocator]
static ALLOCATOR: allocator::Bounded = allocator::Bounded;

/// Time for all targets together, where `FMNET_FUZZ_SECONDS` says nothing.
const DEFAULT_SECONDS: f64 = 5.0;
/// An input that takes longer counts as a hang; the least input takes milliseconds.
const HANG: Duration = Duration::from_secs(20);
/// Larger files are not tried at every length.
const MOST_TRUNCATED: usize = 4000;
/// Failures of one target after which it is given up.
const MAX_FAILURES: usize = 5;

/// What a process that runs one target is told.
struct Task {
    target: String,
    seed: u64,
    first: u64,
    seconds: f64,
    progress: PathBuf,
}

fn number<T: std::str::FromStr>(variable: &str) -> Option<T> {
    std::env::var(variable).ok()?.parse().ok()
}

#[test]
fn hostile_files_give_a_result_or_an_error() {
    let only = std::env::var("FMNET_FUZZ_TARGET").ok();
    let seed = number("FMNET_FUZZ_SEED").unwrap_or(1);
    let names: Vec<&str> =
        targets::NAMES.into_iter().filter(|name| only.as_deref().is_none_or(|only| only == *name)).collect();
    assert!(!names.is_empty(), "there is no target {only:?}; there are {:?}", targets::NAMES);
    let seconds = number("FMNET_FUZZ_SECONDS").unwrap_or(DEFAULT_SECONDS) / names.len() as f64;
    let failures: Vec<String> = names.iter().flat_map(|name| fuzz(name, seed, seconds)).collect();
    assert!(failures.is_empty(), "{} failures:\n{}", failures.len(), failures.join("\n"));
}

/// No length at which a valid file breaks off makes a reader panic.
#[test]
fn every_truncated_length() {
    let folder = fmnet_tests::scratch();
    for name in targets::NAMES {
        let target = targets::make(name, &folder.path().join(name));
        for seed in target.seeds.iter().filter(|seed| seed.len() <= MOST_TRUNCATED) {
            for length in 0..seed.len() {
                (target.run)(&seed[..length]);
            }
        }
    }
}

/// Runs a target for so long; what failed.
fn fuzz(name: &str, seed: u64, seconds: f64) -> Vec<String> {
    let folder = fmnet_tests::scratch();
    let start = Instant::now();
    let mut task =
        Task { target: name.into(), seed, first: 0, seconds, progress: folder.path().join("progress") };
    let mut failures = Vec::new();
    while let Some((index, reason)) = supervise(&task, spawn(&task)) {
        let input = targets::make(name, &folder.path().join("again")).input(seed, index);
        let kept = std::env::temp_dir().join(format!("fmnet-fuzz-{name}-{seed}-{index}"));
        std::fs::write(&kept, input).unwrap();
        failures.push(format!("{name}, seed {seed}, input {index} ({}): {reason}", kept.display()));
        (task.first, task.seconds) = (index + 1, seconds - start.elapsed().as_secs_f64());
        if failures.len() == MAX_FAILURES || task.seconds <= 0.0 {
            return failures;
        }
    }
    eprintln!(
        "{name}: {} inputs in {seconds:.1} s, {} failures",
        read_progress(&task.progress),
        failures.len()
    );
    failures
}

fn spawn(task: &Task) -> Child {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "one_target", "--ignored", "--nocapture"]);
    command.env("FMNET_FUZZ_TASK_TARGET", &task.target).env("FMNET_FUZZ_TASK_SEED", task.seed.to_string());
    // The symbols of a backtrace would not fit the memory that is allowed.
    command.env("RUST_BACKTRACE", "0").env("FMNET_FUZZ_TASK_FIRST", task.first.to_string());
    command.env("FMNET_FUZZ_TASK_SECONDS", task.seconds.to_string());
    command.env("FMNET_FUZZ_TASK_PROGRESS", &task.progress);
    let errors = File::create(task.progress.with_extension("err")).unwrap();
    command.stdout(Stdio::null()).stderr(errors).spawn().unwrap()
}

/// Waits for the process; the input it failed on and how, if it did.
fn supervise(task: &Task, mut child: Child) -> Option<(u64, String)> {
    let (mut last, mut since) = (u64::MAX, (Instant::now(), 0.0));
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        std::thread::sleep(Duration::from_millis(20));
        let now = read_progress(&task.progress);
        let worked = processor_seconds(child.id());
        if now != last {
            (last, since) = (now, (Instant::now(), worked.unwrap_or(0.0)));
            continue;
        }
        let waited = since.0.elapsed();
        // On a busy machine a process waits for its turn, which is no fault of its own.
        if worked.map_or(waited > HANG, |seconds| seconds - since.1 > HANG.as_secs_f64())
            || waited > 30 * HANG
        {
            child.kill().unwrap();
            child.wait().unwrap();
            return Some((now, format!("took longer than {} s", HANG.as_secs())));
        }
    };
    let said = std::fs::read(task.progress.with_extension("err")).unwrap_or_default();
    let said = String::from_utf8_lossy(&said).into_owned();
    let told =
        said.lines().find(|l| l.contains("panicked") || l.contains("memory") || l.contains("overflow"));
    let next = told.and_then(|told| said.lines().skip_while(|l| *l != told).nth(1)).unwrap_or_default();
    (!status.success())
        .then(|| (read_progress(&task.progress), format!("{status}: {} {next}", told.unwrap_or(&said))))
}

/// Seconds that a process had a processor for; `None` where the system does not say.
fn processor_seconds(process: u32) -> Option<f64> {
    let text = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // Behind the name, which may hold anything; in ticks, 100 a second on every Linux.
    let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |at: usize| fields.get(at)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / 100.0)
}

fn read_progress(path: &Path) -> u64 {
    let bytes = std::fs::read(path).unwrap_or_default();
    bytes.try_into().map_or(0, u64::from_le_bytes)
}

/// The process that runs one target; does nothing where nobody asks.
#[test]
#[ignore = "run by the other test, in a process of its own"]
fn one_target() {
    let Ok(name) = std::env::var("FMNET_FUZZ_TASK_TARGET") else { return };
    let seed = number("FMNET_FUZZ_TASK_SEED").unwrap();
    let first: u64 = number("FMNET_FUZZ_TASK_FIRST").unwrap();
    let seconds = Duration::from_secs_f64(number("FMNET_FUZZ_TASK_SECONDS").unwrap());
    let mut progress = File::create(std::env::var("FMNET_FUZZ_TASK_PROGRESS").unwrap()).unwrap();
    let folder = fmnet_tests::scratch();
    let target: Target = targets::make(&name, folder.path());
    let start = Instant::now();
    for index in first.. {
        progress.rewind().unwrap();
        progress.write_all(&index.to_le_bytes()).unwrap();
        let input = target.input(seed, index);
        let limit = target.memory + target.memory_per_byte * input.len();
        let accepted = allocator::within(limit, || (target.run)(&input));
        assert!(accepted || index >= target.seeds.len() as u64, "the unchanged file {index} was refused");
        if start.elapsed() > seconds && index >= target.seeds.len() as u64 {
            return;
        }
    }
}
