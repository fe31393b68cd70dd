//! Ctrl-C and termination.

use std::sync::atomic::{AtomicBool, Ordering};

/// Exit status after an interrupt, as shells have it: 128 and the number of the signal.
pub(crate) const INTERRUPTED: u8 = 130;

static STOP: AtomicBool = AtomicBool::new(false);

/// Whether the user asked the run to stop: set by the first interrupt of a run that watches it.
pub(crate) fn stop() -> &'static AtomicBool {
    &STOP
}

/// Ends the program if the user asked for it: for work that has no order of its own to stop in, between two pieces of
/// it.
pub(crate) fn end_if_asked() {
    if STOP.load(Ordering::Relaxed) {
        end();
    }
}

fn end() -> ! {
    fmnet::io::remove_temporary_files();
    std::process::exit(INTERRUPTED.into());
}

/// Handles interrupts from here on. Where the command can `stop_in_order`, the first one asks it to (with a
/// checkpoint); any other ends the program at once, after removing half-written files.
pub(crate) fn watch(stop_in_order: bool) {
    let installed = ctrlc::set_handler(move || {
        if STOP.swap(true, Ordering::Relaxed) || !stop_in_order {
            end();
        }
    });
    if let Err(e) = installed {
        fmnet::io::print_error_line(&format!("warning: interrupts are not handled: {e}"));
    }
}
