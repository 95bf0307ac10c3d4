//! The command line: arguments, progress, exit codes, and errors that show the line at fault.
//!
//! Data goes to stdout, messages and progress to stderr. Progress appears on a terminal alone, `NO_COLOR` is respected, and
//! `--json` prints exactly one document. A reader of stdout that goes away is no failure: files are written all the same. Names out of
//! files are data: control sequences in them are escaped. Known weakness: on Windows no signal saves a run.
//!
//! The order of the modules, each of which uses only those before it, is in `tests/architecture/layers.rs`.

mod arguments;
mod commands;
mod completion;
mod console;
mod failure;
mod interruption;
mod machine;
mod output;
mod work;

use crate::formats::{is_unprintable, printable};
use crate::math::huge_pages;
use crate::tessellate::is_panic_guarded;
use crate::truck::baseline;
use arguments::command::Arguments;
use clap::Parser;
use completion::Completion;
use console::Console;
use std::ffi::OsString;
use std::io::{ErrorKind, Write};
use std::process::ExitCode;

/// Runs the command with these arguments (the first is the program's name) and returns how it ended.
///
/// Exit codes: 0 done, 1 failed while running, 2 wrong arguments or scene, 3 input unreadable or not STEP, 4 done but more
/// was refused or lost than `--max-refused` and `--max-lost` allow.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    huge_pages::prepare_heap();
    let typed: Vec<OsString> = arguments.into_iter().collect();
    let arguments = match Arguments::try_parse_from(&typed) {
        Ok(arguments) => arguments,
        Err(e) => {
            // Help and version go to stdout with code 0, mistakes to stderr with code 2.
            let code = e.exit_code();
            let shown = e.render().to_string();
            if shown.contains(is_unprintable) {
                // What was typed holds terminal codes: said without them, and so without colours of our own.
                let _ = writeln!(std::io::stderr().lock(), "{}", printable(&shown));
            } else {
                // A reader that has seen enough, such as `head`, is content.
                let is_failure = |failure: &std::io::Error| failure.kind() != ErrorKind::BrokenPipe;
                if let Some(failure) = e.print().err().filter(is_failure) {
                    let _ = writeln!(std::io::stderr().lock(), "error: {failure}");
                    return ExitCode::FAILURE;
                }
            }
            return ExitCode::from(u8::try_from(code).unwrap_or(2));
        }
    };
    let Arguments { command, json, quiet, verbose } = arguments;
    let console = Console::new(json, quiet, verbose, &typed);
    // Before any work, so that no file is begun unwatched.
    interruption::watch();
    keep_caught_panics_quiet();
    match commands::execute(command, &console) {
        Ok(Completion::Complete) => ExitCode::SUCCESS,
        Ok(Completion::Incomplete) => ExitCode::from(4),
        Err(failure) => failure.print(&console),
    }
}

/// Sets a panic hook that says nothing of panics that are caught and cost one face, or one row of a comparison: they are counted and named
/// where they are caught, and their messages and places in source are no news to a user.
fn keep_caught_panics_quiet() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        // A panic that is caught is guarded by a mark of its thread, or runs in a thread of truck's.
        let caught = is_panic_guarded() || std::thread::current().name() == Some(baseline::THREAD);
        if !caught {
            usual(panic);
        }
    }));
}
