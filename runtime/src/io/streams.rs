//! Lines for people and scripts on the standard streams. The library prints nothing by itself; its programs do.

use super::IoError;
use std::io::{ErrorKind, Write};

/// A line on standard output. A reader who has seen enough (`| head -1`) is no error.
///
/// # Errors
/// If it cannot be written, as on a full device.
pub fn print_line(line: &str) -> Result<(), IoError> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{line}").and_then(|()| out.flush()) {
        Err(source) if source.kind() != ErrorKind::BrokenPipe => {
            Err(IoError::Write { path: "standard output".into(), source })
        }
        _ => Ok(()),
    }
}

/// A line on standard error; nobody is left to be told that it cannot be written.
pub fn print_error_line(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}
