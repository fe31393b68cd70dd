//! Progress on a terminal, plain lines elsewhere.

use crate::args::Common;
use fmnet::events::Event;
use fmnet::io::{IoError, print_error_line, print_line};
use fmnet_trainer::events::TrainEvent;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::Value;
use std::io::IsTerminal;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Steps between plain lines.
const LINE_EVERY: u64 = 50;

/// Shows the events of a run.
pub(crate) struct Progress {
    quiet: bool,
    bar: Option<ProgressBar>,
    averages: Mutex<Averages>,
}

/// Running averages for display.
#[derive(Default)]
struct Averages {
    loss: Option<f64>,
    hard_error: Option<f64>,
    seconds: Option<f64>,
    steps: u64,
}

impl Averages {
    fn add(slot: &mut Option<f64>, value: f64) -> f64 {
        let average = slot.map_or(value, |old| old + 0.05 * (value - old));
        *slot = Some(average);
        average
    }
}

impl Progress {
    pub(crate) fn new(common: &Common) -> Self {
        let on_terminal = std::io::stderr().is_terminal() && !common.quiet;
        let style = ProgressStyle::with_template("{wide_bar} {pos}/{len} {msg}");
        let bar = on_terminal
            .then(|| ProgressBar::new(0).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar())));
        Self { quiet: common.quiet, bar, averages: Mutex::default() }
    }

    pub(crate) fn event(&self, event: TrainEvent) {
        match event {
            TrainEvent::Prepared { done, total, shape } => self.prepared(done, total, &shape),
            TrainEvent::Started { step, steps, pairs } => {
                self.lock().steps = steps;
                self.at(step, steps);
                self.say(&format!("{pairs} ordered pairs; minibatches {} to {steps}", step + 1));
            }
            TrainEvent::Step { step, stats, seconds, .. } => self.stepped(step, stats.loss, stats.hard_error, seconds),
            TrainEvent::Validated { step, mean_error, exact, within_5, best } => self.say(&format!(
                "{step}: held-out pairs, raw: mean error x 100 {mean_error:.2}, exact {:.1} %, within 0.05 {:.1} %{}",
                100.0 * exact,
                100.0 * within_5,
                if best { " (best so far)" } else { "" }
            )),
            TrainEvent::Checkpoint { .. } => {}
            TrainEvent::Warning { text } => self.print(&format!("warning: {text}")),
        }
    }

    /// Shows a stage of the runtime's or of an evaluation.
    pub(crate) fn stage(&self, event: Event) {
        match event {
            Event::Finished { subject, stage, seconds } => {
                self.say(&format!("{subject}: {stage}, {seconds:.2} s"));
            }
            Event::Warning(text) => self.print(&format!("warning: {text}")),
            _ => {}
        }
    }

    /// An observer that counts finished stages up to `total`.
    pub(crate) fn counting(&self, total: usize) -> impl Fn(Event) + Sync {
        let done = AtomicUsize::new(0);
        move |event| match (&self.bar, event) {
            (Some(bar), Event::Finished { subject, .. }) => {
                self.at(done.fetch_add(1, Ordering::Relaxed) as u64 + 1, total as u64);
                bar.set_message(subject);
            }
            (_, event) => self.stage(event),
        }
    }

    /// Takes the bar away.
    pub(crate) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    fn prepared(&self, done: usize, total: usize, shape: &str) {
        self.at(done as u64, total as u64);
        match &self.bar {
            Some(bar) => bar.set_message(format!("prepared {shape}")),
            None => self.say(&format!("prepared {done} of {total}: {shape}")),
        }
    }

    fn stepped(&self, step: u64, loss: f64, hard_error: f64, seconds: f64) {
        let mut averages = self.lock();
        let loss = Averages::add(&mut averages.loss, loss);
        let hard_error = 100.0 * Averages::add(&mut averages.hard_error, hard_error);
        let seconds = Averages::add(&mut averages.seconds, seconds);
        let left = (averages.steps.saturating_sub(step)) as f64 * seconds / 60.0;
        // Some losses need no map, so that there is no error to tell.
        let error =
            if hard_error.is_nan() { String::new() } else { format!(", error x 100 {hard_error:.2}") };
        let text = format!("loss {loss:.5}{error}, {:.2} steps/s, {left:.0} min left", 1.0 / seconds);
        match &self.bar {
            Some(bar) => {
                bar.set_position(step);
                bar.set_message(text);
            }
            None if step.is_multiple_of(LINE_EVERY) => self.say(&format!("{step}: {text}")),
            None => {}
        }
    }

    fn at(&self, position: u64, length: u64) {
        if let Some(bar) = &self.bar {
            bar.set_length(length);
            bar.set_position(position);
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Averages> {
        self.averages.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    pub(crate) fn say(&self, line: &str) {
        if !self.quiet {
            self.print(line);
        }
    }

    fn print(&self, line: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| print_error_line(line)),
            None => print_error_line(line),
        }
    }
}

/// The summary for scripts.
pub(crate) fn print_summary(summary: &Value) -> Result<(), IoError> {
    print_line(&format!("{summary:#}"))
}

/// A path for the summary: names that are not Unicode are shown with replacement characters, which JSON cannot do
/// without.
pub(crate) fn shown(path: &Path) -> String {
    path.display().to_string()
}
