//! How a command talks: messages and progress on stderr, data on stdout, colours where the terminal has them.

use crate::formats::{printable, printable_line};
use crate::report::Provenance;
use crate::text::grouped;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::collections::BTreeSet;
use std::ffi::OsString;
use std::io::{self, IsTerminal, Write};
use std::sync::Mutex;
use std::time::{Instant, SystemTime};

/// Bold, dim, and normal again (ECMA-48, SGR).
const EMPHASIS: [&str; 3] = ["\x1b[1m", "\x1b[2m", "\x1b[0m"];

/// Columns for messages where neither `COLUMNS` nor a terminal says how many there are.
const DEFAULT_WIDTH: usize = 120;
/// Columns between which messages stay readable.
const READABLE_WIDTHS: std::ops::RangeInclusive<usize> = 60..=140;
/// Steps of a progress bar over shares of a work.
const STAGE_STEPS: u64 = 1000;

/// How a command talks: what was asked for, what the terminal can do.
pub(crate) struct Console {
    /// One JSON document on stdout.
    pub(crate) json: bool,
    /// Nothing on stderr but errors.
    pub(crate) quiet: bool,
    /// How much more to say: how often -v was given.
    pub(crate) verbose: u8,
    /// The command as typed, quoted for a shell.
    pub(crate) command: String,
    /// When it began.
    pub(crate) started: Instant,
    colour: bool,
    terminal: bool,
    /// Messages that are not repeated.
    said: Mutex<BTreeSet<String>>,
}

impl Console {
    /// Makes a console from the options that every command has and the command line as typed, and starts the clock of the command. Asks for
    /// `NO_COLOR`, `TERM` and whether stderr is a terminal.
    pub(crate) fn new(json: bool, quiet: bool, verbose: u8, typed: &[OsString]) -> Self {
        // https://no-color.org: set and not empty, whatever its value.
        let no_colour = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
        let dumb = std::env::var_os("TERM").is_some_and(|t| t == "dumb");
        let terminal = io::stderr().is_terminal();
        Self {
            json,
            quiet,
            verbose,
            command: command_line(typed),
            started: Instant::now(),
            colour: terminal && !no_colour && !dumb,
            terminal: terminal && !dumb,
            said: Mutex::default(),
        }
    }

    /// Writes a message for people to stderr, with what a terminal would obey written out; nothing if quiet.
    pub(crate) fn say(&self, message: impl std::fmt::Display) {
        if !self.quiet {
            self.insist(message);
        }
    }

    /// Writes a message as [`Self::say`] does, once however often it comes.
    pub(crate) fn say_once(&self, message: &str) {
        let is_new = self.said.lock().unwrap_or_else(|e| e.into_inner()).insert(message.to_owned());
        if is_new {
            self.say(message);
        }
    }

    /// Writes a message for people to stderr, quiet or not: why a run that was done does not end with exit code 0.
    pub(crate) fn insist(&self, message: impl std::fmt::Display) {
        // A closed stderr is no reason to stop working.
        let _ = writeln!(io::stderr().lock(), "{}", self.shown(&message.to_string()));
    }

    /// Writes a message for people to stderr, quiet or not where it is why the exit code is not 0.
    pub(crate) fn say_or_insist(&self, is_reason: bool, message: impl std::fmt::Display) {
        if is_reason { self.insist(message) } else { self.say(message) }
    }

    /// Whether a run ends with lines for people, which give its answer: neither in silence nor with a document on stdout.
    pub(crate) fn has_closing_lines(&self) -> bool {
        !self.quiet && !self.json
    }

    /// Returns the text as a terminal may be given it: names are data, so that all it would obey is written out, but for our own emphasis.
    pub(crate) fn shown(&self, text: &str) -> String {
        if !self.colour {
            return printable(text).into_owned();
        }
        let mut shown = String::with_capacity(text.len());
        let mut rest = text;
        // The earliest of our own codes; what stands between them is data.
        while let Some((at, code)) = EMPHASIS.iter().filter_map(|code| Some((rest.find(code)?, code))).min() {
            shown += &printable(&rest[..at]);
            shown += code;
            rest = &rest[at + code.len()..];
        }
        shown + &printable(rest)
    }

    /// Returns the text in bold, where messages may be coloured; else as it is.
    pub(crate) fn bold(&self, text: &str) -> String {
        if self.colour { format!("\x1b[1m{text}\x1b[0m") } else { text.to_owned() }
    }

    /// Returns the text dimmed, where messages may be coloured; else as it is.
    pub(crate) fn dim(&self, text: &str) -> String {
        if self.colour { format!("\x1b[2m{text}\x1b[0m") } else { text.to_owned() }
    }

    /// Whether messages may be coloured: stderr is a terminal that can, and `NO_COLOR` is not set.
    pub(crate) fn has_colour(&self) -> bool {
        self.colour
    }

    /// Returns the columns for messages: as `COLUMNS` says, as the terminal has, or [`DEFAULT_WIDTH`] where there is none; kept within
    /// [`READABLE_WIDTHS`].
    pub(crate) fn width(&self) -> usize {
        let requested = std::env::var("COLUMNS").ok().and_then(|c| c.parse::<usize>().ok());
        let of_terminal =
            || if self.terminal { comfy_table::Table::new().use_stderr().width().map(usize::from) } else { None };
        let width = requested.or_else(of_terminal).unwrap_or(DEFAULT_WIDTH);
        width.clamp(*READABLE_WIDTHS.start(), *READABLE_WIDTHS.end())
    }

    /// Returns a progress bar with rate and remaining time; invisible where stderr is no terminal.
    pub(crate) fn progress_bar(&self, label: &str, unit: &str, total: u64) -> ProgressBar {
        let bar = ProgressBar::new(total);
        // Hidden and not left out: the work reports to it all the same.
        if !self.terminal || self.quiet {
            bar.set_draw_target(ProgressDrawTarget::hidden());
            return bar;
        }
        let template =
            format!("  {{msg:<12}} {{bar:30}} {{percent:>3}} %  {{count}} {unit}  {{rate}}  {{eta}} left");
        let rate = |state: &ProgressState, text: &mut dyn std::fmt::Write| {
            let _ = write!(text, "{}/s", grouped(state.per_sec() as u64));
        };
        let count = |state: &ProgressState, text: &mut dyn std::fmt::Write| {
            let _ = write!(text, "{}", grouped(state.pos()));
        };
        let style = ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar());
        let style = style.with_key("rate", rate).with_key("count", count);
        bar.set_style(style.progress_chars("━╸ "));
        bar.set_message(printable_line(label).into_owned());
        bar
    }

    /// Returns a progress bar of length [`STAGE_STEPS`] for a job that reports its stages and remaining time; hidden with `--quiet` and off
    /// a terminal.
    pub(crate) fn stage_bar(&self, label: &str) -> ProgressBar {
        let bar = ProgressBar::new(STAGE_STEPS);
        if !self.terminal || self.quiet {
            bar.set_draw_target(ProgressDrawTarget::hidden());
            return bar;
        }
        let style = ProgressStyle::with_template("  {prefix:<14} {bar:30} {percent:>3} %  {msg}");
        let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
        bar.set_style(style.progress_chars("━╸ "));
        bar.set_prefix(printable_line(label).into_owned());
        bar
    }

    /// Returns a sign of life for work of unknown length; invisible where stderr is no terminal. It turns until it is finished.
    pub(crate) fn spinner(&self, label: &str) -> ProgressBar {
        let spinner = ProgressBar::new_spinner();
        if !self.terminal || self.quiet {
            spinner.set_draw_target(ProgressDrawTarget::hidden());
            return spinner;
        }
        let style = ProgressStyle::with_template("  {spinner} {msg}  {elapsed}");
        spinner.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
        spinner.set_message(printable_line(label).into_owned());
        // Drawn by a thread of its own: the work does not tick.
        spinner.enable_steady_tick(std::time::Duration::from_millis(100));
        spinner
    }

    /// Returns where the numbers of this command come from: command, program and machine. `seed` is `None` for a command without random
    /// numbers.
    pub(crate) fn provenance(&self, seed: Option<u64>, threads: usize) -> Provenance {
        Provenance {
            command: self.command.clone(),
            traced_by: Vec::new(),
            time: super::machine::utc_text(SystemTime::now() - self.started.elapsed()),
            version: env!("CARGO_PKG_VERSION").into(),
            commit: env!("LAMPYRIS_COMMIT").into(),
            hardware: super::machine::hardware(),
            threads,
            seed,
        }
    }
}

/// Writes data to stdout, with what a terminal would obey written out. A reader that has gone away (`| head`) is no failure: what was to be
/// written to files is there all the same.
pub(crate) fn print(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    let written = out.write_all(printable(text).as_bytes()).and_then(|()| out.flush());
    match written {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        Err(e) => Err(io::Error::new(e.kind(), format!("standard output: cannot be written: {e}"))),
        Ok(()) => Ok(()),
    }
}

/// Returns the command line, whose first word is the program's name, as a person would type it again.
fn command_line(line: &[OsString]) -> String {
    let words = line.iter().skip(1).map(|word| shell_word(&word.to_string_lossy()));
    std::iter::once("lampyris".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

/// Returns a word as a POSIX shell takes it for one, in quotes where it needs them.
pub(crate) fn shell_word(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=,:%@+".contains(c);
    // Letters of any script need no quotes; what a shell reads as more does.
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// Sets a stage bar to a study's progress: its stage, the remaining time if known, and its share, cut to 1.
pub(crate) fn show_progress(bar: &ProgressBar, p: &crate::study::Progress) {
    let remaining = p.remaining_seconds.map_or(String::new(), |s| format!(", {} left", crate::report::seconds(s)));
    bar.set_message(printable_line(&format!("{}{remaining}", p.stage)).into_owned());
    // A share a little beyond 1 would make the bar wrap.
    bar.set_position((STAGE_STEPS as f64 * p.done.clamp(0.0, 1.0)) as u64);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_our_own_emphasis_reaches_a_terminal() {
        let mut console = Console::new(false, false, 0, &[]);
        console.colour = true;
        let line = format!("{} \x1b]0;x\x07 \u{9b}2J", console.bold("lens"));
        assert_eq!(console.shown(&line), "\x1b[1mlens\x1b[0m \\u{1b}]0;x\\u{7} \\u{9b}2J");
        console.colour = false;
        assert_eq!(console.shown("\x1b[1mlens"), "\\u{1b}[1mlens");
    }

    #[test]
    fn the_command_can_be_typed_again() {
        let line = ["/usr/bin/lampyris", "info", "my part.stp", "it's"].map(OsString::from);
        assert_eq!(command_line(&line), r"lampyris info 'my part.stp' 'it'\''s'");
    }
}
