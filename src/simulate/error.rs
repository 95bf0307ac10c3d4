//! Errors of scenes: which file, which line, which key, and what to do.

use std::ops::Range;
use std::sync::Arc;

/// Kinds of errors of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The scene file, or a file it names, cannot be read.
    Unreadable,
    /// Not TOML, or a key or type that the scene does not have.
    Syntax,
    /// A value out of range, or keys that do not go together.
    Value,
    /// A rule, name or point that nothing in the model answers to.
    NoMatch,
    /// A physical effect that is not simulated.
    Unsupported,
    /// The model has no geometry to trace, or more than a table can hold.
    Model,
}

/// Why a scene cannot be simulated: names the file, the key, and what to do.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{}{message}{}", self.place(), self.advice_clause())]
pub struct Error {
    kind: ErrorKind,
    message: String,
    help: Option<String>,
    file: String,
    text: Option<Arc<str>>,
    span: Option<Range<usize>>,
}

impl Error {
    /// Makes an error without a place in a file and without advice.
    pub(crate) fn new(kind: ErrorKind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into(), help: None, file: String::new(), text: None, span: None }
    }

    /// Returns the error with this advice, in place of any it had.
    pub(crate) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Returns the error with the file and text of the scene, and the bytes of the text that are meant, where these are known.
    pub(crate) fn located(mut self, file: &str, text: &Arc<str>, span: Option<Range<usize>>) -> Self {
        self.file = file.into();
        self.text = Some(text.clone());
        self.span = span;
        self
    }

    /// Returns what kind of mistake it is.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// Returns the message alone, without file, line and advice.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// Returns what to do about it; `None` where there is nothing to say.
    pub fn advice(&self) -> Option<&str> {
        self.help.as_deref()
    }

    /// Returns the scene file, as it was named; empty for a scene that came from no file.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Returns the whole text of the scene file; `None` for an error that was not located.
    pub fn text(&self) -> Option<&str> {
        self.text.as_deref()
    }

    /// Returns the bytes of [`Error::text`] that are meant; `None` where no place is.
    pub fn span(&self) -> Option<Range<usize>> {
        self.span.clone()
    }

    /// Returns line and column of the place that is meant, both from 1 and the column in characters; `None` where no place is.
    pub fn line_and_column(&self) -> Option<(usize, usize)> {
        let (text, span) = (self.text.as_deref()?, self.span.as_ref()?);
        let before = text.get(..span.start)?;
        let line = before.matches('\n').count() + 1;
        // Columns in characters, as editors count them.
        Some((line, before.rsplit('\n').next().unwrap_or("").chars().count() + 1))
    }

    /// Returns the advice behind a semicolon; empty without one.
    fn advice_clause(&self) -> String {
        self.help.as_ref().map_or_else(String::new, |h| format!("; {h}"))
    }

    /// Returns file, line and column as far as they are known, to stand before the message.
    fn place(&self) -> String {
        match (self.file.is_empty(), self.line_and_column()) {
            (true, None) => String::new(),
            (true, Some((l, c))) => format!("line {l}, column {c}: "),
            (false, None) => format!("{}: ", self.file),
            (false, Some((l, c))) => format!("{}:{l}:{c}: ", self.file),
        }
    }
}
