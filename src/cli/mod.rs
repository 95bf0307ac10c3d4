//! The command line: arguments, progress, exit codes, and errors that show the line at fault.
//!
//! Data goes to stdout, messages and progress to stderr. Progress appears on a terminal alone, `NO_COLOR` is respected, and
//! `--json` prints exactly one document. Known weakness: a broken pipe on stdout ends the command with code 1.
//!
//! What is asked (`arguments`) becomes files read, facets, intersectors and runs (`work`), which are shown and written (`output`);
//! a command (`commands`) puts these together.

mod arguments;
mod commands;
mod context;
mod failure;
mod machine;
mod output;
mod work;

use arguments::args::Arguments;
use clap::Parser;
use context::Context;
use failure::Failure;
use std::ffi::OsString;
use std::process::ExitCode;

/// How a command ended, where it ended without an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    /// Exit code 0.
    Done,
    /// Exit code 4: done, but more was refused or lost than allowed.
    Incomplete,
}

/// Runs the command with these arguments (the first is the program's name) and tells how it ended.
///
/// Exit codes: 0 done, 1 failed while running, 2 wrong arguments or scene, 3 input unreadable or not STEP, 4 done but more
/// was refused or lost than `--max-refused` and `--max-lost` allow.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let line: Vec<OsString> = arguments.into_iter().collect();
    let arguments = match Arguments::try_parse_from(&line) {
        Ok(a) => a,
        Err(e) => {
            // Help and version go to stdout with code 0, mistakes to stderr with code 2.
            let code = e.exit_code();
            let _ = e.print();
            return ExitCode::from(u8::try_from(code).unwrap_or(2));
        }
    };
    let context = Context::new(&arguments, &line);
    match commands::execute(arguments.command, &context) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Incomplete) => ExitCode::from(4),
        Err(failure) => failure.show(&context),
    }
}
