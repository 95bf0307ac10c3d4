//! `lampyris trace`: a scene from disk.

use super::portion::{self, Checkpoint};
use crate::cli::arguments::args::TraceOptions;
use crate::cli::arguments::options::{Meshing, Tracing};
use crate::cli::context::{Context, print};
use crate::cli::work::job::{self, Job, Prepared, Ways};
use crate::cli::work::paths::Paths;
use crate::cli::work::{aim, ledger, load, until};
use crate::cli::{Failure, Outcome};
use crate::report::{bytes, figures, grouped, seconds};
use crate::simulate::Portion;
use serde_json::json;
use std::path::Path;

/// Rays of a run that are asked again of BVH and spline.
pub(crate) const RECHECKED: usize = 10_000;

pub(crate) fn run(
    path: &Path,
    folder: &Path,
    meshing: &Meshing,
    tracing: &Tracing,
    extra: &TraceOptions,
    context: &Context,
) -> Result<Outcome, Failure> {
    let shard = extra.shard.as_deref().map(portion::shard).transpose()?;
    let replay = ledger::asked(&extra.replay)?;
    if extra.checkpoint.is_nan() || extra.checkpoint < 0.0 {
        return Err(Failure::arguments(format!("--checkpoint {}: not a number of seconds", extra.checkpoint)));
    }
    let (scene, loaded) = load::scene_file(path, context)?;
    if extra.precision.accuracy.is_some() && (shard.is_some() || extra.resume) {
        let message = "--accuracy chooses by times that it measures, which differ from run to run: parts would not fit together";
        return Err(Failure::arguments(message).help("give --tolerance and --normals with --shard and --resume"));
    }
    let options = (meshing, tracing);
    let (meshing, tracing, aimed) =
        aim::meshing(extra.precision.accuracy.as_deref(), options, Some(&scene), &loaded.model, context)?;
    let aimed = aimed.as_ref();
    let job =
        Job { scene: &scene, loaded: &loaded, meshing: &meshing, tracing: &tracing, recheck: RECHECKED, aimed };
    let mut prepared = job::prepare(job, context)?;
    let until = extra.until_error.as_deref().map(|text| until::Until::new(text, &scene)).transpose()?;
    ledger::warn(&prepared, context);
    if extra.dry_run {
        return dry_run(&prepared, folder, context);
    }
    let refused = load::account(&loaded.reports, extra.limits.max_refused, context);
    if !replay.is_empty() {
        ledger::run(&prepared, &replay, folder, context)?;
        return Ok(refused);
    }
    if let Some(shard @ [_, n]) = shard {
        let replicates = prepared.replicates();
        if n > replicates {
            let message =
                format!("--shard: the run has {replicates} replicates and so at most as many shards, not {n}");
            return Err(Failure::arguments(message).help("raise `replicates` in [run] of the scene"));
        }
        let file = portion::shard_file(folder, shard);
        let checkpoint = Checkpoint::new(&prepared, path, file, Some(shard), extra.checkpoint, context);
        let from = if extra.resume { checkpoint.read()? } else { None };
        portion::trace_shard(&prepared, &checkpoint, from, shard, context)?;
        return Ok(refused);
    }
    let (mut traced, mut reached) = (None, None);
    if let Some(until) = &until {
        let (portion, answer) = until.trace(&mut prepared, context);
        (traced, reached) = (Some(portion), Some(answer));
    }
    let checkpoint =
        Checkpoint::new(&prepared, path, folder.join(portion::CHECKPOINT), None, extra.checkpoint, context);
    let from = if extra.resume { checkpoint.read()? } else { None };
    if extra.resume {
        context.say(match &from {
            Some(p) => format!("going on from {} of {} replicates", p.done.len(), p.replicates),
            None => format!("{} holds no interrupted run: starting from the beginning", folder.display()),
        });
    }
    let paths = extra.paths.as_deref().map(Paths::create).transpose()?;
    let finished = |p: &Portion| checkpoint.finished(p);
    let ways = Ways {
        verify: extra.verify_pruning,
        from: traced.or(from),
        finished: until.is_none().then_some(&finished),
        every: checkpoint.often(),
        paths: paths.as_ref(),
        ..Ways::default()
    };
    let mut outcome = prepared.trace(ways, context);
    if let (Some(paths), Some(file)) = (paths, &extra.paths) {
        let vertices = paths.finish()?;
        context.say(format_args!("wrote {} ({} vertices)", file.display(), grouped(vertices)));
    }
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
    let said = until.iter().zip(&reached).map(|(u, answer)| u.sentence(answer)).collect();
    let (mut document, report) = prepared.write(folder, &mut outcome, said, context)?;
    if let Some(answer) = &reached {
        document["until_error"] = serde_json::to_value(answer).map_err(|e| Failure::running(e.to_string()))?;
    }
    tell(&document, &report.answer, folder, &outcome.results, context)?;
    checkpoint.remove();
    if reached.is_some_and(|answer| !answer.reached) {
        return Ok(Outcome::Incomplete);
    }
    let p = &outcome.results.power;
    let share = p.lost / p.emitted;
    if share > extra.max_lost {
        context.say(format_args!(
            "{} % of the energy was lost, more than --max-lost allows: {}; {} names every ray",
            figures(100.0 * share, 2),
            ledger::reasons(&outcome.results, &prepared),
            folder.join(ledger::LEDGER).display()
        ));
        return Ok(Outcome::Incomplete);
    }
    Ok(refused)
}

/// The results on stdout as JSON, or the closing lines.
pub(crate) fn tell(
    document: &serde_json::Value,
    answer: &str,
    folder: &Path,
    results: &crate::simulate::Results,
    context: &Context,
) -> Result<(), Failure> {
    if context.json {
        let text = serde_json::to_string_pretty(document).map_err(|e| Failure::running(e.to_string()))?;
        return Ok(print(&(text + "\n"))?);
    }
    closing(answer, folder, results, context);
    Ok(())
}

/// The last lines of a traced scene: what was found, which file to open.
pub(crate) fn closing(answer: &str, folder: &Path, results: &crate::simulate::Results, context: &Context) {
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
