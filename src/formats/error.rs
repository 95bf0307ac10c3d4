//! What can be wrong with a file: which, at which line, and what to do.

use std::io;
use std::path::{Path, PathBuf};

/// What went wrong with a file, and where.
#[derive(Debug, thiserror::Error)]
#[error("{}: {kind}", self.place())]
pub struct Error {
    path: PathBuf,
    line: Option<usize>,
    #[source]
    kind: Box<ErrorKind>,
}

/// What went wrong with a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The file could not be read.
    #[error("cannot read: {0}")]
    Read(io::Error),
    /// The file could not be written.
    #[error("cannot write: {0}; check that the folder exists and may be written")]
    Write(io::Error),
    /// The name says nothing about the format.
    #[error("the extension '{given}' names no format; use one of {known}")]
    Extension {
        /// What was given.
        given: String,
        /// The extensions that are known, for people.
        known: &'static str,
    },
    /// The content is not what the format says.
    #[error("{0}")]
    Malformed(String),
}

impl Error {
    /// An error about a whole file.
    pub fn new(path: &Path, kind: ErrorKind) -> Self {
        Self { path: path.to_owned(), line: None, kind: Box::new(kind) }
    }

    /// An error about the content of a file ([`ErrorKind::Malformed`]) at a line, counted from 1.
    pub fn at_line(path: &Path, line: usize, message: impl Into<String>) -> Self {
        Self { path: path.to_owned(), line: Some(line), kind: Box::new(ErrorKind::Malformed(message.into())) }
    }

    /// What went wrong.
    pub fn kind(&self) -> &ErrorKind {
        &self.kind
    }

    /// The path and, where it is known, the line, for people: `scene.csv:12`.
    fn place(&self) -> String {
        match self.line {
            Some(line) => format!("{}:{line}", self.path.display()),
            None => self.path.display().to_string(),
        }
    }

    /// The file concerned.
    pub fn path(&self) -> &Path {
        &self.path
    }
}
