//! What a long computation tells its caller while it runs: the library itself never prints.

use std::time::Instant;

/// One thing that happened.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Event {
    /// A stage begins.
    Started {
        /// The shape or pair it works on.
        subject: String,
        /// The stage's name, as in the pipeline.
        stage: &'static str,
    },
    /// A stage ended.
    Finished {
        /// The shape or pair it worked on.
        subject: String,
        /// The stage's name, as in the pipeline.
        stage: &'static str,
        /// Wall-clock seconds it took; 0 in WebAssembly, whose host has the clock.
        seconds: f64,
    },
    /// Something the user should know; the computation goes on.
    Warning(String),
}

/// Receives events, possibly from several threads.
pub type Observer<'a> = &'a (dyn Fn(Event) + Sync);

/// An observer that ignores everything.
pub fn ignore(_: Event) {}

/// Runs a stage between its two events.
pub fn timed<T>(observer: Observer, subject: &str, stage: &'static str, run: impl FnOnce() -> T) -> T {
    observer(Event::Started { subject: subject.to_string(), stage });
    let start = now();
    let result = run();
    let seconds = start.map_or(0.0, |start| start.elapsed().as_secs_f64());
    observer(Event::Finished { subject: subject.to_string(), stage, seconds });
    result
}

/// The time, where the standard library has one.
fn now() -> Option<Instant> {
    (!cfg!(all(target_family = "wasm", target_os = "unknown"))).then(Instant::now)
}
