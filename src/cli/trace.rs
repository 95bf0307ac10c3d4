//! `lampyris trace`: a scene from disk.

use super::args::TraceOptions;
use super::context::{Context, print};
use super::job::{self, Job, Prepared};
use super::options::{Meshing, Tracing};
use super::{Failure, Outcome, aim, load};
use crate::report::{bytes, figures, grouped, seconds};
use serde_json::json;
use std::path::Path;

/// Rays of a run that are asked again of BVH and spline.
const RECHECKED: usize = 10_000;

pub(super) fn run(
    path: &Path,
    folder: &Path,
    meshing: &Meshing,
    tracing: &Tracing,
    extra: &TraceOptions,
    context: &Context,
) -> Result<Outcome, Failure> {
    for (given, name) in [
        (extra.shard.is_some(), "--shard"),
        (extra.resume, "--resume"),
        (extra.until_error.is_some(), "--until-error"),
    ] {
        if given {
            return Err(super::reserved(name));
        }
    }
    let (scene, loaded) = load::scene_file(path, context)?;
    let (meshing, tracing) = aim::meshing(extra.accuracy.as_deref(), meshing, tracing, &loaded.model, context)?;
    let job = Job { scene: &scene, loaded: &loaded, meshing: &meshing, tracing: &tracing, recheck: RECHECKED };
    let prepared = job::prepare(job, context)?;
    if extra.dry_run {
        return dry_run(&prepared, folder, context);
    }
    let refused = load::account(&loaded.reports, extra.limits.max_refused, context);
    let mut outcome = prepared.trace(extra.verify_pruning, context);
    if let Some(v) = &outcome.verification {
        if !v.identical {
            let message = format!(
                "the {} kernel gives other tallies than the {} one: a defect of lampyris",
                v.full, v.pruned
            );
            return Err(Failure::running(message)
                .help(format!("nothing was written; what differs: {}", v.differing.join(", "))));
        }
        context.say(format_args!(
            "the {} kernel ({}) gives the same tallies as the {} one ({}), bit by bit",
            v.full,
            seconds(v.seconds_full),
            v.pruned,
            seconds(v.seconds_pruned)
        ));
    }
    let (document, report) = prepared.write(folder, &mut outcome, Vec::new(), context)?;
    if context.json {
        print(&(serde_json::to_string_pretty(&document).map_err(|e| Failure::running(e.to_string()))? + "\n"))?;
    } else {
        closing(&report.answer, folder, &outcome.results, context);
    }
    let p = &outcome.results.power;
    let share = p.lost / p.emitted;
    if share > extra.max_lost {
        context.say(format_args!(
            "{} % of the energy was lost, more than --max-lost allows; results.json and the report say where",
            figures(100.0 * share, 2)
        ));
        return Ok(Outcome::Incomplete);
    }
    Ok(refused)
}

/// The last lines of a traced scene: what was found, which file to open.
pub(super) fn closing(answer: &str, folder: &Path, results: &crate::simulate::Results, context: &Context) {
    context.say("");
    for line in wrapped(&answer.replace("**", ""), context.width().min(96)) {
        context.say(format_args!("  {line}"));
    }
    context.say("");
    let files = job::highlights(folder, results);
    let widest = files.iter().map(|(p, _)| p.display().to_string().chars().count()).max().unwrap_or(0);
    for (k, (path, what)) in files.iter().enumerate() {
        let name = format!("{:<widest$}", path.display().to_string());
        let name = if k == 0 { context.strong(&name) } else { name };
        context.say(format_args!("  {name}  {}", context.faint(what)));
    }
}

fn dry_run(prepared: &Prepared, folder: &Path, context: &Context) -> Result<Outcome, Failure> {
    let settings = prepared.run_settings();
    let mesh = &prepared.tessellation.mesh;
    let faces: usize = prepared.job.loaded.reports.iter().map(|r| r.faces.converted).sum();
    let effects = crate::simulate::Required::by(&prepared.bound);
    if context.json {
        let document = json!({"dry_run": true, "rays": settings.rays, "seed": settings.seed, "threads": prepared.threads,
            "faces": faces, "facets": mesh.facets.len(), "mesh_bytes": mesh.bytes(),
            "intersector": prepared.choice.intersector.to_string(), "normals": prepared.choice.normals.to_string(),
            "effects": {"simulated": effects.simulated, "not_simulated": effects.not_simulated},
            "seconds": {"read": prepared.job.loaded.seconds, "tessellate": prepared.seconds}});
        print(&format!("{document:#}\n"))?;
        return Ok(Outcome::Done);
    }
    print(&format!(
        "would trace {} rays (seed {}) on {} threads through {} facets ({}) of {faces} faces, {} with {} normals,\n\
         and write into {}; reading took {}, tessellation {}\n",
        grouped(settings.rays),
        settings.seed,
        prepared.threads,
        grouped(mesh.facets.len() as u64),
        bytes(mesh.bytes() as u64),
        prepared.choice.intersector,
        prepared.choice.normals,
        folder.display(),
        seconds(prepared.job.loaded.seconds),
        seconds(prepared.seconds)
    ))?;
    for because in &effects.simulated {
        print(&format!("simulated: {:?}, because {}\n", because.effect, because.because))?;
    }
    Ok(Outcome::Done)
}

/// Words in lines of at most `width` characters.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last_mut().map(|l| (l.chars().count(), l));
        match line {
            Some((0, line)) => line.push_str(word),
            Some((n, line)) if n + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}
