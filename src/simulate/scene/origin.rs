//! Where a scene came from, and errors that point into its text.

use super::locate::{self, Key};
use crate::simulate::{Error, ErrorKind};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

/// Where a scene came from.
#[derive(Clone, Debug, Default)]
pub struct Origin {
    /// Name of the scene file, as the user gave it.
    pub file: String,
    /// Folder that relative paths start from.
    pub folder: PathBuf,
    /// The text, for messages that show the line.
    pub text: Option<Arc<str>>,
}

impl Origin {
    /// Returns a path named in the scene, seen from where the program runs; an absolute one stays as it is.
    pub(super) fn resolve(&self, file: &str) -> PathBuf {
        self.folder.join(file)
    }

    /// Returns the bytes of the value at a path, as `locate::span`; `None` for a scene that was not parsed from text.
    pub(super) fn span(&self, path: &[Key<'_>]) -> Option<Range<usize>> {
        locate::span(self.text.as_deref()?, path)
    }

    /// Makes an error about the value at `path`, with its place in the file; without a place for a scene that was not parsed from text.
    pub(super) fn error(&self, kind: ErrorKind, path: &[Key<'_>], message: impl Into<String>) -> Error {
        let error = Error::new(kind, message);
        match &self.text {
            Some(text) => error.located(&self.file, text, self.span(path)),
            None => error,
        }
    }
}
