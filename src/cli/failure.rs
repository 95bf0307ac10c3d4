//! Why a command stops: the message, what to do, the line at fault, the exit code.

use super::console::Console;
use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource, SourceCode};
use std::io::Write;
use std::ops::Range;
use std::process::ExitCode;

/// Why a command stopped: a message, what to do, the line at fault where there is one, and the exit code.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub(crate) struct Failure {
    code: u8,
    message: String,
    help: Option<String>,
    excerpt: Option<Box<Excerpt>>,
}

/// A stretch of a text file.
#[derive(Debug)]
struct Excerpt {
    source: NamedSource<String>,
    span: Range<usize>,
    label: String,
}

impl Failure {
    fn new(code: u8, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), help: None, excerpt: None }
    }

    /// Exit code 1.
    pub(crate) fn running(message: impl Into<String>) -> Self {
        Self::new(1, message)
    }

    /// Exit code 2.
    pub(crate) fn arguments(message: impl Into<String>) -> Self {
        Self::new(2, message)
    }

    /// Exit code 3.
    pub(crate) fn input(message: impl Into<String>) -> Self {
        Self::new(3, message)
    }

    /// Adds what to do about it.
    pub(crate) fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Shows this stretch of a text file.
    pub(crate) fn with_excerpt(mut self, file: &str, text: &str, span: Range<usize>, label: &str) -> Self {
        let source = NamedSource::new(file, text.to_owned());
        self.excerpt = Some(Box::new(Excerpt { source, span, label: label.to_owned() }));
        self
    }

    /// Prints the failure on stderr.
    pub(crate) fn print(&self, console: &Console) -> ExitCode {
        let theme =
            if console.has_colour() { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
        let handler = GraphicalReportHandler::new_themed(theme).with_width(console.width()).with_context_lines(1);
        let mut text = String::new();
        if handler.render_report(&mut text, self).is_err() {
            text = format!("{self}\n");
        }
        let _ = std::io::stderr().lock().write_all(text.trim_start_matches('\n').as_bytes());
        ExitCode::from(self.code)
    }
}

impl Diagnostic for Failure {
    fn help<'a>(&'a self) -> Option<Box<dyn std::fmt::Display + 'a>> {
        self.help.as_ref().map(|h| Box::new(h) as Box<dyn std::fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.excerpt.as_ref().map(|p| &p.source as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let Excerpt { span, label, .. } = self.excerpt.as_deref()?;
        let label = LabeledSpan::new(Some(label.clone()), span.start, span.len());
        Some(Box::new(std::iter::once(label)))
    }
}

impl From<crate::formats::Error> for Failure {
    fn from(e: crate::formats::Error) -> Self {
        use crate::formats::ErrorKind;
        match e.kind() {
            ErrorKind::Extension { .. } => Self::arguments(e.to_string()),
            ErrorKind::Read(_) => Self::input(e.to_string()),
            _ => Self::running(e.to_string()),
        }
    }
}

impl From<std::io::Error> for Failure {
    fn from(e: std::io::Error) -> Self {
        Self::running(e.to_string())
    }
}
