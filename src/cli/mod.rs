//! The command line: arguments, progress, exit codes, and errors that show the line at fault.
//!
//! Data goes to stdout, messages and progress to stderr. Progress appears on a terminal alone, `NO_COLOR` is respected, and
//! `--json` prints exactly one document. Known weakness: a broken pipe on stdout ends the command with code 1.

mod aim;
mod args;
mod cells;
mod check;
mod context;
mod demo;
mod engine;
mod facet;
mod failure;
mod files;
mod info;
mod job;
mod ledger;
mod load;
mod look;
mod machine;
mod meta;
mod options;
mod pairs;
mod paths;
mod portion;
mod race;
mod study;
mod suggest;
mod tables;
mod trace;
mod until;
mod witness;
mod words;

use args::{Arguments, Command};
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
    match execute(arguments.command, &context) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Incomplete) => ExitCode::from(4),
        Err(failure) => failure.show(&context),
    }
}

fn execute(command: Command, context: &Context) -> Result<Outcome, Failure> {
    match command {
        Command::Demo { output, meshing, tracing } => demo::run(&output, &meshing, &tracing, context),
        Command::Info { file, limits } => info::run(&file, limits, context),
        Command::Facet { file, output, meshing, precision, baseline, threads, limits } => {
            let asked = facet::Asked {
                file: &file,
                output: &output,
                meshing: &meshing,
                accuracy: precision.accuracy.as_deref(),
                baseline,
                threads,
                limits,
            };
            facet::run(&asked, context)
        }
        Command::Trace { scene, output, meshing, tracing, extra } => {
            trace::run(&scene, &output, &meshing, &tracing, &extra, context)
        }
        Command::Check { file, meshing, tracing, precision, output, rays_out, rays_in, disagreements, limits } => {
            let asked = check::Asked {
                file: &file,
                meshing: &meshing,
                tracing: &tracing,
                accuracy: precision.accuracy.as_deref(),
                rays_out: rays_out.as_ref(),
                rays_in: rays_in.as_ref(),
                disagreements: disagreements.as_ref(),
                output: output.as_ref(),
                limits,
            };
            check::run(&asked, context)
        }
        Command::Study { kind, file, output, meshing, tracing } => {
            let (file, output) = (file.as_deref(), output.as_ref());
            study::run(&study::Asked { kind, file, output, meshing: &meshing, tracing: &tracing }, context)
        }
        Command::Merge { parts, output } => portion::merge(&parts, &output, context),
        Command::Schema => meta::schema(),
        Command::Completions { shell } => meta::completions(shell),
        Command::Man { output } => meta::man(output.as_deref(), context),
    }
}
