//! Why a command stops: the message, what to do, the line at fault, the exit code.

use super::console::Console;
use crate::formats::{printable, printable_in_place, printable_line};
use crate::{pipeline, regulation, simulate, step};
use annotate_snippets::renderer::DecorStyle;
use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
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
    file: String,
    text: String,
    span: Range<usize>,
    label: String,
}

impl Failure {
    /// Makes a failure; control codes that the message quotes are written out.
    fn new(code: u8, message: impl Into<String>) -> Self {
        Self { code, message: printable(&message.into()).into_owned(), help: None, excerpt: None }
    }

    /// Makes a failure while running: exit code 1.
    pub(crate) fn running(message: impl Into<String>) -> Self {
        Self::new(1, message)
    }

    /// Makes the failure of wrong arguments or a wrong scene: exit code 2.
    pub(crate) fn arguments(message: impl Into<String>) -> Self {
        Self::new(2, message)
    }

    /// Makes the failure of an input that cannot be read: exit code 3.
    pub(crate) fn input(message: impl Into<String>) -> Self {
        Self::new(3, message)
    }

    /// Adds advice on what to do about it, in place of any before.
    pub(crate) fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(printable(&help.into()).into_owned());
        self
    }

    /// Adds advice on a line of its own below any there was before.
    pub(crate) fn with_further_help(self, help: impl Into<String>) -> Self {
        let further = help.into();
        let help = self.help.as_ref().map_or_else(|| further.clone(), |first| format!("{first}\n{further}"));
        self.with_help(help)
    }

    /// Adds a stretch of a text file, bytes `span` of its `text`, to be shown with a label.
    pub(crate) fn with_excerpt(mut self, file: &str, text: &str, span: Range<usize>, label: &str) -> Self {
        // A span beyond the text, which only a message about another file could have, is cut to it.
        let span = span.start.min(text.len())..span.end.min(text.len());
        let [file, label] = [file, label].map(|text| printable_line(text).into_owned());
        // In place: spans are bytes of this text.
        let text = printable_in_place(text).into_owned();
        self.excerpt = Some(Box::new(Excerpt { file, text, span, label }));
        self
    }

    /// Prints the failure on stderr, even if quiet, and returns the exit code.
    pub(crate) fn print(&self, console: &Console) -> ExitCode {
        let renderer = if console.has_colour() { Renderer::styled() } else { Renderer::plain() };
        let renderer = renderer.decor_style(DecorStyle::Unicode).term_width(console.width());
        let message = wrap_lines(&self.message, console.width());
        let help = self.help.as_ref().map(|help| wrap_lines(help, console.width()));
        let snippet = self.excerpt.as_ref().map(|excerpt| {
            let label = AnnotationKind::Primary.span(excerpt.span.clone()).label(&excerpt.label);
            Snippet::source(&excerpt.text).path(&excerpt.file).annotation(label)
        });
        let report = Level::ERROR.primary_title(&message).elements(snippet);
        let report = report.elements(help.as_ref().map(|help| Level::HELP.message(help)));
        let text = renderer.render(&[report]) + "\n";
        // A closed stderr changes nothing of the exit code.
        let _ = std::io::stderr().lock().write_all(text.as_bytes());
        ExitCode::from(self.code)
    }
}

/// Breaks lines longer than the width, less the room for `error: `, at spaces where there are any. Lines of the text stay lines.
fn wrap_lines(text: &str, width: usize) -> String {
    const LABEL: usize = "error: ".len();
    const NARROWEST: usize = 20;
    let width = width.saturating_sub(LABEL).max(NARROWEST);
    let mut out = String::new();
    for (k, line) in text.lines().enumerate() {
        if k > 0 {
            out.push('\n');
        }
        let mut length = 0;
        // At single spaces, so that runs of them keep their length.
        for (k, word) in line.split(' ').enumerate() {
            let letters = word.chars().count();
            if length > 0 && length + 1 + letters > width {
                out.push('\n');
                length = 0;
            } else if k > 0 {
                // Also before the first word of a line that begins with spaces, which stay.
                out.push(' ');
                length += 1;
            }
            out += word;
            length += letters;
        }
    }
    out
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

impl From<pipeline::Error> for Failure {
    fn from(e: pipeline::Error) -> Self {
        // Settings are called on the command line as in the scene, but for the line in the middle.
        let option = e.setting_name().map_or_else(String::new, |name| format!("--{} ", name.replace('_', "-")));
        let message = option + e.message();
        let mut failure = match e.kind() {
            pipeline::ErrorKind::Input => Self::input(message),
            _ => Self::arguments(message),
        };
        if let Some(advice) = e.advice() {
            failure = failure.with_help(advice);
        }
        match e.excerpt() {
            Some(x) => failure.with_excerpt(&x.file, &x.text, x.span.clone(), x.label),
            None => failure,
        }
    }
}

impl From<regulation::Error> for Failure {
    fn from(e: regulation::Error) -> Self {
        Self::arguments(e.to_string())
    }
}

impl From<simulate::Error> for Failure {
    fn from(e: simulate::Error) -> Self {
        pipeline::Error::from(e).into()
    }
}

impl From<step::Error> for Failure {
    fn from(e: step::Error) -> Self {
        let is_limit = matches!(e.kind(), step::ErrorKind::TooManyPlaced { .. });
        let failure: Self = pipeline::Error::from(e).into();
        if is_limit {
            failure.with_help("`info`, `facet`, `check` and `init` take --max-placed COUNT")
        } else {
            failure
        }
    }
}

impl From<std::io::Error> for Failure {
    fn from(e: std::io::Error) -> Self {
        Self::running(e.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn further_help_stands_below_the_first() {
        let help = |failure: Failure| failure.with_further_help("nothing is lost").help;
        assert_eq!(help(Failure::running("no room")).as_deref(), Some("nothing is lost"));
        let failure = Failure::running("no room").with_help("make room");
        assert_eq!(help(failure).as_deref(), Some("make room\nnothing is lost"));
    }

    #[test]
    fn long_messages_are_broken_at_spaces_and_keep_their_lines() {
        assert_eq!(wrap_lines("one two three four five six", 27), "one two three four\nfive six");
        assert_eq!(wrap_lines("one\n  two", 80), "one\n  two");
        assert_eq!(wrap_lines(&"x".repeat(50), 30), "x".repeat(50));
    }
}
