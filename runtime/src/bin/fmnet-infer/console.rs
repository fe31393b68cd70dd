//! What the program prints: progress on a terminal, plain lines elsewhere, a summary for scripts.

use crate::args::Common;
use fmnet::causes;
use fmnet::events::Event;
use fmnet::io::{IoError, print_error_line, print_line};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};
use std::io::IsTerminal;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::Duration;

/// Prints on standard error; standard output is for results.
pub(crate) struct Console {
    quiet: bool,
    json: bool,
    spinner: Option<ProgressBar>,
    stages: Mutex<Vec<Value>>,
}

impl Console {
    pub(crate) fn new(common: &Common) -> Self {
        let on_terminal = std::io::stderr().is_terminal() && !common.quiet;
        let spinner = on_terminal.then(|| {
            let style = ProgressStyle::with_template("{spinner} {msg} {elapsed}");
            let bar = ProgressBar::new_spinner()
                .with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
            bar.enable_steady_tick(Duration::from_millis(100));
            bar
        });
        Self { quiet: common.quiet, json: common.json, spinner, stages: Mutex::default() }
    }

    /// Receives the library's events.
    pub(crate) fn event(&self, event: Event) {
        match event {
            Event::Started { subject, stage } => {
                if let Some(spinner) = &self.spinner {
                    spinner.set_message(format!("{subject}: {stage}"));
                }
            }
            Event::Finished { subject, stage, seconds } => {
                if self.spinner.is_none() {
                    self.say(&format!("{subject}: {stage} {seconds:.3} s"));
                }
                let record = json!({ "subject": subject, "stage": stage, "seconds": seconds });
                if let Ok(mut stages) = self.stages.lock() {
                    stages.push(record);
                }
            }
            Event::Warning(text) => self.warn(&text),
            _ => {}
        }
    }

    /// A line for people.
    pub(crate) fn say(&self, line: &str) {
        if !self.quiet {
            self.print(line);
        }
    }

    /// A warning.
    pub(crate) fn warn(&self, line: &str) {
        self.print(&format!("warning: {line}"));
    }

    /// The error that ends the program.
    pub(crate) fn error(&self, error: &anyhow::Error) {
        self.print(&format!("error: {}", causes(error.as_ref())));
    }

    /// The result: text for people, or the summary for scripts with the seconds of every stage added.
    ///
    /// A reader who has seen enough (`| head -1`) is no error.
    pub(crate) fn result(&self, text: &str, mut summary: Value) -> Result<(), IoError> {
        if let Some(spinner) = &self.spinner {
            spinner.finish_and_clear();
        }
        if self.json {
            let stages = self.stages.lock().map(|s| s.clone()).unwrap_or_default();
            summary["stages"] = Value::Array(stages);
            print_line(&format!("{summary:#}"))
        } else if !self.quiet && !text.is_empty() {
            print_line(text)
        } else {
            Ok(())
        }
    }

    fn print(&self, line: &str) {
        match &self.spinner {
            Some(spinner) => spinner.suspend(|| print_error_line(line)),
            None => print_error_line(line),
        }
    }
}

/// A path for the summary: names that are not Unicode are shown with replacement characters, which JSON cannot do
/// without.
pub(crate) fn shown(path: &Path) -> String {
    path.display().to_string()
}

/// 1 where the program or the machine failed (a file that cannot be written, a solver that did not converge), 2 for
/// bad usage or bad input.
pub(crate) fn exit_code(error: &anyhow::Error) -> ExitCode {
    if error.is::<crate::commands::Doubtful>() {
        return ExitCode::from(3);
    }
    let unwritable = matches!(error.downcast_ref(), Some(IoError::Write { .. }));
    let failed = unwritable || error.downcast_ref::<fmnet::Error>().is_some_and(fmnet::Error::is_own_failure);
    ExitCode::from(if failed { 1 } else { 2 })
}

/// Ctrl-C and termination end the program after removing half-written files.
pub(crate) fn clean_up_on_interrupt() {
    let installed = ctrlc::set_handler(|| {
        fmnet::io::remove_temporary_files();
        std::process::exit(130);
    });
    if let Err(e) = installed {
        print_error_line(&format!("warning: interrupts are not handled: {e}"));
    }
}
