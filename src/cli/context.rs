use super::arguments::args::Arguments;
use crate::report::Provenance;
use indicatif::{HumanCount, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::ffi::OsString;
use std::io::{self, IsTerminal, Write};

/// How a command talks: what was asked for, what the terminal can do.
pub(crate) struct Context {
    /// One JSON document on stdout.
    pub(crate) json: bool,
    /// Nothing on stderr but errors.
    pub(crate) quiet: bool,
    /// How much more to say.
    pub(crate) verbose: u8,
    /// The command as typed.
    pub(crate) command: String,
    colour: bool,
    terminal: bool,
}

impl Context {
    pub(crate) fn new(arguments: &Arguments, line: &[OsString]) -> Self {
        let no_colour = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
        let dumb = std::env::var_os("TERM").is_some_and(|t| t == "dumb");
        let terminal = io::stderr().is_terminal();
        Self {
            json: arguments.json,
            quiet: arguments.quiet,
            verbose: arguments.verbose,
            command: command_line(line),
            colour: terminal && !no_colour && !dumb,
            terminal: terminal && !dumb,
        }
    }

    /// A message for people, on stderr.
    pub(crate) fn say(&self, message: impl std::fmt::Display) {
        if !self.quiet {
            // A closed stderr is no reason to stop working.
            let _ = writeln!(io::stderr().lock(), "{message}");
        }
    }

    /// Emphasis, where the terminal has it.
    pub(crate) fn strong(&self, text: &str) -> String {
        if self.colour { format!("\x1b[1m{text}\x1b[0m") } else { text.to_owned() }
    }

    /// Less than normal, where the terminal has it.
    pub(crate) fn faint(&self, text: &str) -> String {
        if self.colour { format!("\x1b[2m{text}\x1b[0m") } else { text.to_owned() }
    }

    /// Whether messages may be coloured.
    pub(crate) fn colours(&self) -> bool {
        self.colour
    }

    /// Columns for messages: as `COLUMNS` says, as the terminal has, or 120 where there is none.
    pub(crate) fn width(&self) -> usize {
        let asked = std::env::var("COLUMNS").ok().and_then(|c| c.parse::<usize>().ok());
        let own =
            || if self.terminal { comfy_table::Table::new().use_stderr().width().map(usize::from) } else { None };
        asked.or_else(own).unwrap_or(120).clamp(60, 140)
    }

    /// A progress bar with rate and remaining time; invisible where stderr is no terminal.
    pub(crate) fn bar(&self, label: &str, unit: &str, total: u64) -> ProgressBar {
        let bar = ProgressBar::new(total);
        if !self.terminal || self.quiet {
            bar.set_draw_target(ProgressDrawTarget::hidden());
            return bar;
        }
        let template =
            format!("  {{msg:<12}} {{bar:30}} {{percent:>3}} %  {{human_pos}} {unit}  {{rate}}  {{eta}} left");
        let rate = |state: &ProgressState, text: &mut dyn std::fmt::Write| {
            let _ = write!(text, "{}/s", HumanCount(state.per_sec() as u64));
        };
        let style = ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar());
        let style = style.with_key("rate", rate);
        bar.set_style(style.progress_chars("━╸ "));
        bar.set_message(label.to_owned());
        bar
    }

    /// A progress bar over shares of a work whose stages and remaining time it is told; of length 1000.
    pub(crate) fn stages(&self, label: &str) -> ProgressBar {
        let bar = ProgressBar::new(1000);
        if !self.terminal || self.quiet {
            bar.set_draw_target(ProgressDrawTarget::hidden());
            return bar;
        }
        let style = ProgressStyle::with_template("  {prefix:<14} {bar:30} {percent:>3} %  {msg}");
        let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
        bar.set_style(style.progress_chars("━╸ "));
        bar.set_prefix(label.to_owned());
        bar
    }

    /// A sign of life for work of unknown length.
    pub(crate) fn spinner(&self, label: &str) -> ProgressBar {
        let spinner = ProgressBar::new_spinner();
        if !self.terminal || self.quiet {
            spinner.set_draw_target(ProgressDrawTarget::hidden());
            return spinner;
        }
        let style = ProgressStyle::with_template("  {spinner} {msg}  {elapsed}");
        spinner.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
        spinner.set_message(label.to_owned());
        spinner.enable_steady_tick(std::time::Duration::from_millis(100));
        spinner
    }

    /// Where the numbers of this command come from.
    pub(crate) fn provenance(&self, seed: Option<u64>, threads: usize) -> Provenance {
        Provenance {
            command: self.command.clone(),
            version: env!("CARGO_PKG_VERSION").into(),
            commit: env!("LAMPYRIS_COMMIT").into(),
            hardware: super::machine::hardware(),
            threads,
            seed,
        }
    }
}

/// Data on stdout. A reader that has gone away (`| head`) is no failure of ours to explain.
pub(crate) fn print(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.flush()
}

/// The command as a person would type it again.
fn command_line(line: &[OsString]) -> String {
    let quote = |word: &OsString| {
        let word = word.to_string_lossy();
        let plain = |c: char| c.is_alphanumeric() || "-_./=,:%@+".contains(c);
        if !word.is_empty() && word.chars().all(plain) {
            word.into_owned()
        } else {
            format!("'{}'", word.replace('\'', r"'\''"))
        }
    };
    std::iter::once("lampyris".to_owned()).chain(line.iter().skip(1).map(quote)).collect::<Vec<_>>().join(" ")
}

/// The bar follows the study's own clock, remaining time included.
pub(crate) fn show(bar: &ProgressBar, p: &crate::study::Progress) {
    let left = p.remaining_seconds.map_or(String::new(), |s| format!(", {} left", crate::report::seconds(s)));
    bar.set_message(format!("{}{left}", p.stage));
    bar.set_position((1000.0 * p.done.clamp(0.0, 1.0)) as u64);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_can_be_typed_again() {
        let line = ["/usr/bin/lampyris", "info", "my part.stp", "it's"].map(OsString::from);
        assert_eq!(command_line(&line), r"lampyris info 'my part.stp' 'it'\''s'");
    }
}
