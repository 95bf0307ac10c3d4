//! The commands, one file each.

mod assess;
mod bvh_benchmark;
mod cache;
mod check;
mod demo;
mod dry_run;
mod faces;
mod facet;
mod info;
mod init;
mod licences;
mod material_rules;
mod media;
mod merge;
mod meta;
mod ray_range;
mod replay;
mod study;
mod study_options;
mod trace;
mod trace_until;
mod verdicts;

use crate::cli::arguments::command::Command;
use crate::cli::console::Console;
use crate::cli::{completion::Completion, failure::Failure};
use crate::pipeline::RayRange;

/// Runs the command that was asked for, and returns how it ended or why it failed.
pub(super) fn execute(command: Command, console: &Console) -> Result<Completion, Failure> {
    refuse_ray_range(&command)?;
    match command {
        Command::Demo { output, report, meshing, tracing } => {
            demo::run(&output, meshing.settings(), tracing.settings(), report, console)
        }
        Command::Info { file, faces, limits, placed } => info::run(&file, faces, limits, placed, console),
        Command::Facet(command) => facet::run(&command, console),
        Command::Trace { scene, output, meshing, tracing, extra } => {
            let command = trace::TraceCommand {
                scene: &scene,
                folder: &output,
                meshing: meshing.settings(),
                tracing: tracing.settings(),
                extra: &extra,
            };
            trace::run(&command, console)
        }
        Command::Check(command) => check::run(&command, console),
        Command::Study { kind, file, output, rays_in, embree, report, meshing, tracing } => {
            let command = study_options::StudyCommand {
                kind,
                file: file.as_deref(),
                output: output.as_ref(),
                rays_in: rays_in.as_deref(),
                embree: embree.as_deref(),
                report,
                meshing: meshing.settings(),
                tracing: tracing.settings(),
            };
            study::run(&command, console)
        }
        Command::Merge { parts, output, scene, wait, rays, until_error, max_lost, cache, report, limits } => {
            let command = merge::MergeCommand {
                parts: &parts,
                folder: &output,
                scene: scene.as_deref(),
                wait,
                rays,
                until_error: until_error.as_deref(),
                max_lost,
                cache: &cache,
                with_report: report.is_wanted(),
                limits,
            };
            merge::run(&command, console)
        }
        Command::Cache { folder, clear } => cache::run(&folder, clear, console),
        Command::Init { file, output, limits, placed } => {
            init::run(&file, output.as_deref(), limits, placed, console)
        }
        Command::Media => media::run(console),
        Command::Licences => licences::run(console),
        Command::Assess { list: true, .. } => assess::list(console),
        Command::Assess { result, regulation, receiver, left_hand, as_placed, list: _ } => {
            let command = assess::AssessCommand {
                result: result.as_deref(),
                regulation: regulation.as_deref(),
                receiver: receiver.as_deref(),
                left_hand,
                as_placed,
            };
            assess::run(&command, console)
        }
        Command::Schema { text } => {
            refuse_json(console, text, "schema --text")?;
            meta::schema(text)
        }
        Command::Completions { shell } => {
            refuse_json(console, true, "completions")?;
            meta::completions(shell)
        }
        Command::Man { output } => {
            refuse_json(console, true, "man")?;
            meta::man(output.as_deref(), console)
        }
    }
}

/// Refuses `--json` where a page for people, or text for a shell, `is_asked` for.
fn refuse_json(console: &Console, is_asked: bool, command: &str) -> Result<(), Failure> {
    if console.json && is_asked {
        return Err(Failure::arguments(format!("{command} has no JSON document")).with_help("leave --json out"));
    }
    Ok(())
}

/// Refuses a range of rays where it would be taken for their number: only `trace` begins behind the first ray.
fn refuse_ray_range(command: &Command) -> Result<(), Failure> {
    let (name, tracing) = match command {
        Command::Demo { tracing, .. } => ("demo", tracing),
        Command::Check(command) => ("check", &command.tracing),
        Command::Study { tracing, .. } => ("study", tracing),
        _ => return Ok(()),
    };
    let Some(RayRange { first: Some(first), end }) = tracing.ray_range else { return Ok(()) };
    let failure = Failure::arguments(format!("{name} does not take a range of rays, --rays {first}..{end}"));
    Err(failure
        .with_help(format!("give their number, as in --rays {}; `lampyris trace` takes ranges", end - first)))
}
