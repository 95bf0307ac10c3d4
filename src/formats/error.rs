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
    #[error("cannot write: {0}{advice}", advice = writing_advice(.0))]
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

/// Returns what to do about a file that could not be written, as the end of a sentence; empty where the error already says all that is
/// known.
fn writing_advice(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::NotFound => "; check that the folder exists",
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => "; name another place",
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "; make room there, or name another place",
        _ => "",
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_advice_is_about_what_went_wrong() {
        let said = |kind: io::ErrorKind| Error::new(Path::new("a.csv"), ErrorKind::Write(kind.into())).to_string();
        assert!(said(io::ErrorKind::NotFound).ends_with("the folder exists"));
        assert!(said(io::ErrorKind::StorageFull).ends_with("make room there, or name another place"));
        assert!(said(io::ErrorKind::ReadOnlyFilesystem).ends_with("; name another place"));
        assert!(!said(io::ErrorKind::BrokenPipe).contains(';'));
    }
}
