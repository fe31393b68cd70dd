//! The options that every bench takes, and how it tells its figures.
#![allow(dead_code, reason = "each bench uses a part of it")]

use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Instant;

const USAGE: &str = "options of a bench, after `--`:
  --json         one JSON object a line instead of a table
  --quick        small sizes, one repetition
  --largest N    leave out what has more than N vertices
  --export DIR   write the inputs and results there, a folder for each case, for the scripts in benches/peers";

/// Nothing larger is measured with `--quick`.
const QUICK_LARGEST: usize = 7000;

/// The options of a bench, and where its figures go.
pub(crate) struct Report {
    bench: &'static str,
    json: bool,
    quick: bool,
    largest: usize,
    export: Option<PathBuf>,
    /// The arguments that are not options of every bench.
    pub(crate) words: Vec<String>,
}

impl Report {
    /// Reads the command line; ends the program with a message where it makes no sense.
    pub(crate) fn from_arguments(bench: &'static str) -> Self {
        let mut report =
            Self { bench, json: false, quick: false, largest: usize::MAX, export: None, words: Vec::new() };
        let mut arguments = std::env::args().skip(1);
        while let Some(argument) = arguments.next() {
            match argument.as_str() {
                "--json" => report.json = true,
                "--quick" => {
                    report.quick = true;
                    report.largest = report.largest.min(QUICK_LARGEST);
                }
                "--largest" => {
                    let value = arguments.next().and_then(|n| n.parse().ok());
                    report.largest = report.largest.min(value.unwrap_or_else(|| fail("--largest")));
                }
                "--export" => {
                    report.export = Some(arguments.next().map_or_else(|| fail("--export"), PathBuf::from));
                }
                "--help" => {
                    println!("{USAGE}");
                    std::process::exit(0);
                }
                // What cargo itself passes.
                "--bench" => {}
                _ => report.words.push(argument),
            }
        }
        report
    }

    /// Repetitions: `wanted`, or one with `--quick`.
    pub(crate) fn runs(&self, wanted: usize) -> usize {
        if self.quick { 1 } else { wanted }
    }

    /// Whether a shape of `n` vertices is measured.
    pub(crate) fn includes(&self, n: usize) -> bool {
        n <= self.largest
    }

    /// Whether `--quick` was given.
    pub(crate) fn is_quick(&self) -> bool {
        self.quick
    }

    /// Writes what a case was computed from and what came of it to its folder, where that was asked for.
    pub(crate) fn export<E: std::fmt::Display>(
        &self,
        case: &str,
        write: impl FnOnce(&Path) -> Result<(), E>,
    ) {
        let Some(folder) = self.export.as_ref().map(|folder| folder.join(case)) else { return };
        let created = std::fs::create_dir_all(&folder).map_err(|e| e.to_string());
        let written = created.and_then(|()| write(&folder).map_err(|e| e.to_string()));
        if let Err(reason) = written {
            eprintln!("{}: {reason}", folder.display());
            std::process::exit(1);
        }
    }

    /// A line for people, without a figure of its own.
    pub(crate) fn say(&self, line: &str) {
        if !self.json {
            println!("{line}");
        }
    }

    /// A figure, for people a line and for scripts an object.
    pub(crate) fn figure(&self, line: &str, case: &str, figures: Value) {
        self.say(line);
        self.record(case, figures);
    }

    /// A figure for scripts alone: the object `figures` with the bench, the case and the threads added.
    pub(crate) fn record(&self, case: &str, mut figures: Value) {
        if !self.json {
            return;
        }
        figures["bench"] = json!(self.bench);
        figures["case"] = json!(case);
        if figures.get("threads").is_none() {
            figures["threads"] = json!(rayon::current_num_threads());
        }
        println!("{figures}");
    }
}

fn fail(option: &str) -> ! {
    eprintln!("{option} needs a value\n{USAGE}");
    std::process::exit(2);
}

/// What a piece of work cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cost {
    /// Wall-clock seconds.
    pub(crate) seconds: f64,
    /// Seconds of all threads, to a hundredth; 0 where the system does not say.
    pub(crate) cpu_seconds: f64,
    /// The largest resident size of the process meanwhile, in MB of 10^6 bytes; 0 where the system does not say.
    pub(crate) peak_mb: f64,
}

impl Cost {
    /// The cost as figures of a report.
    pub(crate) fn figures(&self) -> Value {
        json!({ "seconds": self.seconds, "cpu_seconds": self.cpu_seconds, "peak_mb": self.peak_mb })
    }
}

/// Does a piece of work and says what it cost.
pub(crate) fn measured<T>(work: impl FnOnce() -> T) -> (Cost, T) {
    reset_peak_memory();
    let (start, cpu) = (Instant::now(), cpu_seconds());
    let result = std::hint::black_box(work());
    let seconds = start.elapsed().as_secs_f64();
    (Cost { seconds, cpu_seconds: cpu_seconds() - cpu, peak_mb: peak_memory_mb() }, result)
}

/// The cost of the run that took least time, and its result.
pub(crate) fn least<T>(runs: usize, mut work: impl FnMut() -> T) -> (Cost, T) {
    let mut best = measured(&mut work);
    for _ in 1..runs {
        let run = measured(&mut work);
        if run.0.seconds < best.0.seconds {
            best = run;
        }
    }
    best
}

/// Of all threads, those that have ended included.
fn cpu_seconds() -> f64 {
    let Ok(stat) = std::fs::read_to_string("/proc/self/stat") else { return 0.0 };
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    let times = after_name.split_whitespace().skip(11).take(2); // in user mode, in the kernel
    // A tick is 1/100 s on every Linux.
    times.filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// From here on the peak is counted anew, where Linux allows it; else it is that of the whole run so far.
fn reset_peak_memory() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

fn peak_memory_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM"));
    let kibibytes = line.and_then(|line| line.split_whitespace().nth(1)?.parse::<f64>().ok());
    kibibytes.unwrap_or(0.0) * 1024e-6
}
