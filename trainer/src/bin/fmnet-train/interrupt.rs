//! Ctrl-C and termination.

use std::sync::atomic::{AtomicBool, Ordering};

static STOP: AtomicBool = AtomicBool::new(false);

/// Whether the user asked the run to stop: set by the first interrupt of a run that watches it.
pub(crate) fn stop() -> &'static AtomicBool {
    &STOP
}

/// Handles interrupts from here on. Where the command can `stop_in_order`, the first one asks it to (with a checkpoint); any other
/// ends the program at once, after removing half-written files.
pub(crate) fn watch(stop_in_order: bool) {
    let installed = ctrlc::set_handler(move || {
        if STOP.swap(true, Ordering::Relaxed) || !stop_in_order {
            fmnet::io::remove_temporary_files();
            std::process::exit(130);
        }
    });
    if let Err(e) = installed {
        eprintln!("warning: interrupts are not handled: {e}");
    }
}
