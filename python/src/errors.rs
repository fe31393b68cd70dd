//! Errors and warnings as Python knows them: what the system refused is an `OSError`, everything else `fmnet.Error`,
//! a `ValueError`.

use fmnet::io::IoError;
use fmnet::network::NetworkError;
use pyo3::exceptions::{PyOSError, PyUserWarning, PyValueError};
use pyo3::prelude::*;
use std::path::Path;

pyo3::create_exception!(
    fmnet,
    Error,
    PyValueError,
    "What fmnet was given is wrong, or cannot be computed; says which element and what to do."
);
pyo3::create_exception!(
    fmnet,
    FmnetWarning,
    PyUserWarning,
    "Something about a mesh or a map that the user should know; the computation goes on."
);

/// What went wrong away from the interpreter.
pub(crate) enum Failure {
    Library(fmnet::Error),
    /// In words.
    Said(String),
}

impl<E: Into<fmnet::Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Library(error.into())
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Library(error) => of_library(&error),
            Failure::Said(text) => Error::new_err(with_arguments(&text)),
        }
    }
}

fn of_library(error: &fmnet::Error) -> PyErr {
    match innermost(error) {
        fmnet::Error::Io(io) => {
            of_io(io).unwrap_or_else(|| Error::new_err(with_arguments(&error.to_string())))
        }
        fmnet::Error::Network(NetworkError::Read { path, .. }) => match std::fs::metadata(path) {
            Err(source) => system_error(path, &source),
            Ok(_) => PyOSError::new_err(error.to_string()),
        },
        _ => Error::new_err(with_arguments(&error.to_string())),
    }
}

fn innermost(error: &fmnet::Error) -> &fmnet::Error {
    match error {
        fmnet::Error::InShape { source, .. } => innermost(source),
        other => other,
    }
}

/// The `OSError` of what the system refused; its number makes it a `FileNotFoundError` and so on.
fn of_io(error: &IoError) -> Option<PyErr> {
    let (IoError::Read { path, source } | IoError::Write { path, source }) = error else { return None };
    Some(system_error(path, source))
}

fn system_error(path: &Path, source: &std::io::Error) -> PyErr {
    match source.raw_os_error() {
        Some(number) => {
            let text = source.to_string().replace(&format!(" (os error {number})"), "");
            PyOSError::new_err((number, text, path.display().to_string()))
        }
        // Its kind makes it the right subclass as well.
        None => std::io::Error::new(source.kind(), format!("{}: {source}", path.display())).into(),
    }
}

/// The error of a file.
pub(crate) fn io_error(error: IoError) -> PyErr {
    Failure::from(error).into()
}

/// An `fmnet.Error` of anything that says what is wrong.
pub(crate) fn wrong(error: impl std::fmt::Display) -> PyErr {
    Error::new_err(error.to_string())
}

/// As [`wrong`], away from the interpreter.
pub(crate) fn said(error: impl std::fmt::Display) -> Failure {
    Failure::Said(error.to_string())
}

/// A Python warning, at the line of the caller.
pub(crate) fn warn(py: Python<'_>, text: &str) -> PyResult<()> {
    let text = std::ffi::CString::new(with_arguments(text).replace('\0', " ")).map_err(wrong)?;
    PyErr::warn(py, &py.get_type::<FmnetWarning>(), &text, 1)
}

/// Options of the program that are arguments here, and whether a value follows them.
const ARGUMENTS: [(&str, bool); 9] = [
    ("--effort", true),
    ("--refine", true),
    ("--backend", true),
    ("--decimate", true),
    ("--subdivide", true),
    ("-k", true),
    ("--landmarks", false),
    ("--adapt", false),
    ("--partial", false),
];

/// A text that names options of the program, with the arguments of functions in their place: `--effort high` becomes
/// `effort="high"`.
fn with_arguments(text: &str) -> String {
    // Maps are drawn by other packages here.
    let text = text.replace(" (-o map.html)", "");
    let mut words = text.split(' ');
    let mut said: Vec<String> = Vec::new();
    while let Some(word) = words.next() {
        let bare = word.trim_start_matches('(').trim_end_matches([')', ',', ';', '.']);
        let Some((option, takes_value)) = ARGUMENTS.iter().find(|(option, _)| *option == bare) else {
            said.push(word.to_string());
            continue;
        };
        let mut argument = word.replacen(option, option.trim_start_matches('-'), 1);
        if *takes_value && word.ends_with(bare) {
            let value = words.next().unwrap_or_default();
            let end = value.find([')', ',', ';', '.', '\n']).unwrap_or(value.len());
            let (value, tail) = value.split_at(end);
            let is_word = value.starts_with(|c: char| c.is_ascii_lowercase());
            argument += &if is_word { format!("=\"{value}\"{tail}") } else { format!("={value}{tail}") };
        }
        said.push(argument);
    }
    said.join(" ")
}
