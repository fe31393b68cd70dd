//! What can go wrong with a file, and where in it.

use std::borrow::Cow;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Why a file could not be read or written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum IoError {
    /// The operating system refused to read the file.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The operating system refused to write the file.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// Neither the extension nor the content is one of the known formats.
    #[error("{}: this format is not known; use one of {known}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// The extensions that are.
        known: &'static str,
    },
    /// The content breaks the format's rules.
    #[error("{}, {at}: {problem}; {remedy}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Where in the file.
        at: Position,
        /// What is wrong.
        problem: String,
        /// What to do about it.
        remedy: Cow<'static, str>,
    },
    /// What was asked to be written does not fit together or into the format.
    #[error("cannot write {}: {problem}; {remedy}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        problem: String,
        /// What to do about it.
        remedy: &'static str,
    },
}

/// A place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Position {
    /// A line of a text file, 1-based.
    Line(usize),
    /// A byte of a binary file, 0-based.
    Byte(usize),
    /// A named part, such as `accessor 3` or `header`.
    Part(String),
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
            Self::Part(part) => f.write_str(part),
        }
    }
}

/// The remedy where a file ends too early.
pub(super) const TRUNCATED: &str = "the file is truncated: copy or download it again";
/// The remedy where a file breaks its format's rules.
pub(super) const REEXPORT: &str = "repair this place or export the file again";

/// A malformed place, before the file's name is known.
#[derive(Debug)]
pub(super) struct ParseError {
    at: Position,
    problem: String,
    remedy: Cow<'static, str>,
}

/// The result of a decoder.
pub(super) type Parsed<T> = Result<T, ParseError>;

impl ParseError {
    pub(super) fn new(
        at: Position,
        problem: impl Into<String>,
        remedy: impl Into<Cow<'static, str>>,
    ) -> Self {
        Self { at, problem: problem.into(), remedy: remedy.into() }
    }

    pub(super) fn line(line: usize, problem: impl Into<String>) -> Self {
        Self::new(Position::Line(line), problem, REEXPORT)
    }

    /// A file that is whole, but not what is needed here.
    pub(super) fn with_remedy(mut self, remedy: &'static str) -> Self {
        self.remedy = remedy.into();
        self
    }

    pub(super) fn byte(byte: usize, problem: impl Into<String>) -> Self {
        Self::new(Position::Byte(byte), problem, REEXPORT)
    }

    pub(super) fn part(part: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::new(Position::Part(part.into()), problem, REEXPORT)
    }

    /// Says in which element the place is.
    pub(super) fn within(mut self, element: impl fmt::Display) -> Self {
        self.problem = format!("{element}: {}", self.problem);
        self
    }

    pub(super) fn in_file(self, path: &Path) -> IoError {
        IoError::Malformed { path: path.into(), at: self.at, problem: self.problem, remedy: self.remedy }
    }
}
