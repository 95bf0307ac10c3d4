//! Why a job cannot be done, and what to do about it.

use crate::{regulation, simulate, step};
use std::ops::Range;

/// What kind of mistake an [`Error`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The settings or the scene ask for what cannot be.
    Request,
    /// A file cannot be read, or is not what it should be.
    Input,
}

/// Why a job cannot be done: names the setting, the file or the key, and what to do.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{}{message}{}", self.place(), self.advice_clause())]
pub struct Error {
    kind: ErrorKind,
    setting: Option<&'static str>,
    message: String,
    help: Option<String>,
    excerpt: Option<Box<Excerpt>>,
}

/// The stretch of a text file that an error is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Excerpt {
    /// The file, as it was named.
    pub file: String,
    /// All of its text.
    pub text: String,
    /// The bytes of `text` that are meant.
    pub span: Range<usize>,
    /// A word or two about them.
    pub label: &'static str,
}

impl Error {
    /// Makes an error without advice and excerpt.
    fn new(kind: ErrorKind, setting: Option<&'static str>, message: impl Into<String>) -> Self {
        Self { kind, setting, message: message.into(), help: None, excerpt: None }
    }

    /// Makes an error of the request itself.
    pub(crate) fn request(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Request, None, message)
    }

    /// Makes an error of a setting's value; the message goes on after its name.
    pub(crate) fn setting(setting: &'static str, message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Request, Some(setting), message)
    }

    /// Makes an error of a file that is read.
    pub(crate) fn input(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Input, None, message)
    }

    /// Returns the error with this advice, in place of any it had.
    pub(crate) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Returns the error with a place in a file's text: file, text and range of bytes; `label` says what is there.
    pub(crate) fn excerpt_of(
        mut self,
        (file, text, span): (&str, &str, Range<usize>),
        label: &'static str,
    ) -> Self {
        self.excerpt = Some(Box::new(Excerpt { file: file.into(), text: text.into(), span, label }));
        self
    }

    /// Returns what kind of mistake it is.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// Returns the setting that it is about, as `part`, `rays` or `until_error`; `None` where it is about none.
    pub fn setting_name(&self) -> Option<&'static str> {
        self.setting
    }

    /// Returns the message, without the setting before it and the advice behind it.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// Returns what to do about it; `None` where there is nothing to say.
    pub fn advice(&self) -> Option<&str> {
        self.help.as_deref()
    }

    /// Returns the place in a text file that is at fault; `None` where there is none.
    pub fn excerpt(&self) -> Option<&Excerpt> {
        self.excerpt.as_deref()
    }

    /// Returns the setting, to stand before the message; empty without one.
    fn place(&self) -> String {
        self.setting.map_or_else(String::new, |setting| format!("{setting} "))
    }

    /// Returns the advice behind a semicolon; empty without one.
    fn advice_clause(&self) -> String {
        self.help.as_ref().map_or_else(String::new, |help| format!("; {help}"))
    }
}

impl From<step::Error> for Error {
    fn from(e: step::Error) -> Self {
        Self::input(e.to_string())
    }
}

impl From<regulation::Error> for Error {
    fn from(e: regulation::Error) -> Self {
        Self::request(e.to_string())
    }
}

impl From<simulate::Error> for Error {
    fn from(e: simulate::Error) -> Self {
        let place = match (e.file(), e.line_and_column()) {
            // Scenes that came from memory have no file.
            ("", _) => String::new(),
            (file, None) => format!("{file}: "),
            (file, Some((line, column))) => format!("{file}:{line}:{column}: "),
        };
        let mut error = match e.kind() {
            // The message of a file that cannot be read names it already.
            simulate::ErrorKind::Unreadable => Self::input(e.message()),
            _ => Self::request(format!("{place}{}", e.message())),
        };
        error.help = e.advice().map(str::to_owned);
        match (e.text(), e.span()) {
            (Some(text), Some(span)) => error.excerpt_of((e.file(), text, span), "here"),
            _ => error,
        }
    }
}
