//! The commands, a file each.

mod check;
mod demo;
mod facet;
mod info;
mod meta;
mod portion;
mod race;
mod study;
mod trace;

use crate::cli::arguments::args::Command;
use crate::cli::context::Context;
use crate::cli::{Failure, Outcome};

/// Does what a command asks for.
pub(super) fn execute(command: Command, context: &Context) -> Result<Outcome, Failure> {
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
