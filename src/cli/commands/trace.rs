//! `lampyris trace`: a scene from disk.

use super::trace_until::{SearchedRun, Until, trace_until};
use super::{dry_run, ray_range, replay, verdicts};
use crate::cli::arguments::command::TraceOptions;
use crate::cli::completion::Completion;
use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::cli::output::closing;
use crate::cli::output::sentences::plain_sentence;
use crate::cli::work::cache_folder;
use crate::cli::work::checkpoint::{CHECKPOINT, Checkpoint, SavePlace, continued_settings, refuse_overwriting};
use crate::cli::work::input_guard::InputGuard;
use crate::cli::work::output_place::{
    OutputPlace, folder_of, require_space, try_claim, try_file, try_folder, try_new_file,
};
use crate::cli::work::path_file::PathFile;
use crate::cli::work::results_folder::RunRemarks;
use crate::cli::work::terminal_monitor::TerminalMonitor;
use crate::cli::work::threads::set_threads;
use crate::cli::work::{end_file, input_files, lost_rays, results_folder, shards, tally_file};
use crate::pipeline::{
    AccurateSettings, ErrorTarget, MeshingSettings, PreparedScene, SceneJob, SceneResults, TraceRequest,
    TracingSettings, is_accuracy_asked, read_cached_scene, refuse_facet_normals, settings_for_accuracy,
};
use crate::report::seconds;
use crate::simulate::{PartialRun, PathSink, PathVertex, Scene};
use crate::text::grouped;
use std::path::Path;

/// Room that the sums of a shard need at least, bytes.
const LEAST_TALLY_BYTES: u64 = 100_000;

/// Commands that continue a saved run, and one whose paths were to be written.
const RESUME: &str = "the same command with --resume";
const RESUME_WITHOUT_PATHS: &str =
    "the same command with --resume in place of --paths, which are those of a whole run,";

/// What `trace` was asked for.
pub(crate) struct TraceCommand<'a> {
    pub(crate) scene: &'a Path,
    pub(crate) folder: &'a Path,
    pub(crate) meshing: MeshingSettings,
    pub(crate) tracing: TracingSettings,
    pub(crate) extra: &'a TraceOptions,
}

/// Reads and prepares the scene, then does the one of its jobs that the options ask for.
pub(crate) fn run(command: &TraceCommand, console: &Console) -> Result<Completion, Failure> {
    let TraceCommand { folder, extra, .. } = *command;
    // What is wrong with the options themselves is said before any file is read.
    let shard =
        extra.shard.as_deref().map(|text| shards::requested_shard(text, extra.shards, console)).transpose()?;
    let replay = replay::parse_request(&extra.replay)?;
    check_options(command)?;
    let tracing = tracing_settings(command, shard)?;
    // A range of rays is part of a run that grows: its tally joins those of the other rays.
    let is_range = tracing.ray_range.is_some_and(|range| range.first.is_some());
    if is_range {
        ray_range::refuse_options(extra)?;
    }
    // Reading is done by these threads too.
    set_threads(tracing.threads)?;
    let monitor = TerminalMonitor::new(console);
    let cache = cache_folder::cache(&extra.cache)?;
    let (mut scene, loaded) = read_cached_scene(command.scene, cache.as_ref(), &monitor)?;
    refuse_facet_normals(&tracing, Some(&scene))?;
    // What the scene cannot give is said before time is spent on facets and a pilot.
    let target = extra.until_error.as_deref().map(|text| ErrorTarget::new(text, &scene)).transpose()?;
    if extra.until_settled {
        verdicts::check_settling(&scene)?;
    }
    extra.ends.as_deref().map_or(Ok(()), |file| end_file::check_scene(&scene, file))?;
    let has_results = shard.is_none() && !is_range && replay.is_empty();
    refuse_inputs(command, &scene, has_results)?;
    scene.run.sequences = extra.sequences.unwrap_or(scene.run.sequences);
    scene.run.faces = extra.faces.unwrap_or(scene.run.faces);
    let accuracy = extra.precision.accuracy;
    // What is traced in parts is chosen once: by the part that came first.
    let is_part = shard.is_some() || extra.resume || is_range;
    if accuracy.is_some() && is_part {
        let message = "--accuracy would search for its facets again in every part";
        return Err(Failure::arguments(message)
            .with_help("give --tolerance and --normals with --shard, --resume and --rays A..B"));
    }
    // Before the search for an accuracy and the pilot, which take their time; and again once the folder is this process's own.
    if !extra.dry_run && replay.is_empty() {
        try_places(command, shard.or(is_range.then_some([0, 1])), &tracing)?;
    }
    let requested = (command.meshing.clone(), tracing);
    let AccurateSettings { meshing, tracing, plan } =
        settings_for_accuracy(accuracy, requested, Some(&scene), &loaded.model, &monitor)?;
    // A part with settings of how to trace need not read what the others chose.
    let chooses_as_part = is_part && !is_accuracy_asked(&meshing, &tracing, &scene);
    let job = SceneJob {
        meshing,
        tracing,
        accuracy: plan,
        chosen: if chooses_as_part { tally_file::choice_of_parts(folder) } else { None },
        cache,
        ..SceneJob::new(scene, loaded)
    };
    let mut prepared = PreparedScene::new(job, &monitor)?;
    extra.ends.as_deref().map_or(Ok(()), |file| end_file::check_rays(&prepared, file))?;
    closing::say_notes(prepared.bound.notes(), &[], console);
    let refused = input_files::report_refusals(&prepared.job.loaded, extra.limits.max_refused, console)
        .and(input_files::report_bare_faces(&prepared, extra.limits.max_refused, console));
    if extra.dry_run {
        return Ok(dry_run::run(&prepared, folder, console)?.and(refused));
    }
    // A replay traces single rays and writes no results.
    if !replay.is_empty() {
        replay::run(&prepared, &replay, folder, console)?;
        return Ok(refused);
    }
    ray_range::check_growing(&prepared, console)?;
    // A range without a shard is the only shard.
    let done = match shard.or(is_range.then_some([0, 1])) {
        Some(shard) => trace_shard(&prepared, command, shard, console)?,
        None => trace_whole(&mut prepared, command, target.as_ref(), console)?,
    };
    Ok(done.and(refused))
}

/// Tries all places that something is to be written to, those of the part (index from 0, count) if one is traced. Fails where one cannot be
/// written, or holds an interrupted run that would be written over.
fn try_places(command: &TraceCommand, part: Option<[u32; 2]>, tracing: &TracingSettings) -> Result<(), Failure> {
    let TraceCommand { folder, extra, .. } = *command;
    [&extra.paths, &extra.ends].into_iter().flatten().try_for_each(|file| try_new_file(file))?;
    if let Some(part) = part {
        return try_claim(&shards::shard_file(folder, part, tracing.ray_range));
    }
    if !extra.resume {
        refuse_overwriting(&folder.join(CHECKPOINT))?;
    }
    try_folder(folder)
}

/// Checks what can be checked of the options without the scene.
///
/// # Errors
/// For the first that has no meaning, names a file of a kind that is not written, or is not looked at.
fn check_options(command: &TraceCommand) -> Result<(), Failure> {
    let extra = command.extra;
    refuse_facet_normals(&command.tracing, None)?;
    extra.until_error.as_deref().map(ErrorTarget::parse).transpose()?;
    extra.paths.as_deref().map_or(Ok(()), PathFile::check_name)?;
    extra.ends.as_deref().map_or(Ok(()), end_file::check_name)
}

/// Returns the settings of the rays, with `--resume` those of the saved run; `shard` is its part, as index from 0 and count.
///
/// # Errors
/// When other rays are asked for than the saved run has.
fn tracing_settings(command: &TraceCommand, shard: Option<[u32; 2]>) -> Result<TracingSettings, Failure> {
    let TraceCommand { folder, ref tracing, extra, .. } = *command;
    // A search goes through runs of several lengths, and --rays is the most of them.
    let is_search = extra.until_error.is_some() || extra.until_settled;
    if !extra.resume || is_search {
        return Ok(tracing.clone());
    }
    let range = tracing.ray_range.filter(|range| range.first.is_some());
    let file = match shard.or(range.map(|_| [0, 1])) {
        Some(shard) => shards::shard_file(folder, shard, range),
        None if shards::is_tally(folder) => folder.to_path_buf(),
        None => folder.join(CHECKPOINT),
    };
    continued_settings(&file, tracing)
}

/// Refuses outputs that would replace the scene or a file that it names; `has_results` says whether results are among them.
fn refuse_inputs(command: &TraceCommand, scene: &Scene, has_results: bool) -> Result<(), Failure> {
    let guard = InputGuard::new([command.scene]).with_scene(scene);
    for (option, file) in [("--paths", &command.extra.paths), ("--ends", &command.extra.ends)] {
        file.as_deref().map_or(Ok(()), |file| guard.refuse(option, file))?;
    }
    if has_results { results_folder::refuse_inputs(scene, command.scene, command.folder) } else { Ok(()) }
}

/// Traces the whole run, or what is left of it, and writes its results. Interrupted, it fails with what was done saved. Incomplete where an
/// error or verdict asked for was missed, or too much light lost.
fn trace_whole(
    prepared: &mut PreparedScene,
    command: &TraceCommand,
    target: Option<&ErrorTarget>,
    console: &Console,
) -> Result<Completion, Failure> {
    let TraceCommand { folder, extra, .. } = *command;
    let file = folder.join(CHECKPOINT);
    // All that can go wrong with the place of the results is tried before anything is traced.
    let _owned = OutputPlace::folder(folder)?;
    let with_report = extra.report.is_wanted();
    let paths = try_outputs(prepared, command, &file)?;
    let until = target.map(Until::Error).or(extra.until_settled.then_some(Until::Settled));
    let search = until.map(|until| until.search_text(prepared.job.tracing.rays()));
    let place = SavePlace::new(command.scene, file, extra.checkpoint, console).with_search(search);
    let found = until.map(|until| trace_until(prepared, until, &place, extra.resume)).transpose()?;
    let prepared = &*prepared;
    let checkpoint = Checkpoint::new(prepared, &place)?;
    let (traced, saved, result) = match found {
        Some(SearchedRun { partial, .. }) if !partial.is_whole() => {
            return Err(checkpoint.save_stopped(&partial, None, RESUME));
        }
        Some(SearchedRun { partial, result }) => (Some(partial), None, result),
        None if extra.resume => (None, checkpoint.read_and_say()?, None),
        None => (None, None, None),
    };
    // Called by any thread: it saves when it is time to.
    let save = |p: &PartialRun| checkpoint.save_when_due(p);
    let take = paths.as_ref().map(|paths| |vertices: &[PathVertex]| paths.append(vertices));
    let request = TraceRequest {
        verify_pruning: extra.verify_pruning,
        // What was traced to find the number of rays is saved.
        finished: traced.is_none().then_some(&save),
        from: traced.or(saved),
        every: checkpoint.interval(),
        paths: take.as_ref().map(|take| take as PathSink<'_>),
        ..TraceRequest::default()
    };
    let monitor = TerminalMonitor::of_saveable(console, paths.as_ref());
    let mut run = match prepared.trace(request, &monitor) {
        Ok(run) => run,
        Err(partial) => {
            let failed = paths.and_then(PathFile::failure).map(|e| e.to_string());
            // Rays that are traced already have no recorded paths.
            let again = if extra.paths.is_some() { RESUME_WITHOUT_PATHS } else { RESUME };
            return Err(checkpoint.save_stopped(&partial, failed.as_deref(), again));
        }
    };
    // The run counts whether its paths could be written or not.
    let paths_written = match (paths, &extra.paths) {
        (Some(paths), Some(file)) => say_paths(paths, file, console),
        _ => Ok(()),
    };
    say_verification(&run, console)?;
    let remarks = RunRemarks::say_target(result, checkpoint.commands(), console);
    let written = results_folder::write(prepared, folder, &mut run, &remarks, with_report, console);
    let (document, answer) =
        written.map_err(|failure| rescue_results(&mut run, &remarks, &checkpoint, with_report, failure))?;
    // What was missed comes before what was found.
    let unsettled = if extra.until_settled { verdicts::unsettled_sentence(&document) } else { None };
    let missed = remarks.target.as_ref().is_some_and(|result| !result.reached) || unsettled.is_some();
    if let Some(sentence) = unsettled.as_ref().filter(|_| !console.has_closing_lines()) {
        console.insist(plain_sentence(sentence));
    }
    let answer = unsettled.map_or(String::new(), |sentence| sentence + " ") + &answer;
    verdicts::say_verdicts(&run, prepared, console)?;
    closing::say_notes(&run.results.notes, prepared.bound.notes(), console);
    closing::print_listings(&run, prepared, console)?;
    closing::print_results(&document, &answer, folder, &run.results, with_report, console)?;
    // Last of all, because it may fail where the results did not.
    let ends_written = end_file::write(prepared, extra.ends.as_deref(), console);
    // Only after everything was written: until then it is all that would be left.
    checkpoint.remove();
    // Rays that cannot be traced again for their paths alone are not lost with these.
    paths_written?;
    ends_written?;
    let lost = lost_rays::report_lost_light(&run.results, prepared, extra.max_lost, folder, console);
    Ok(lost.and(Completion::incomplete_if(missed)))
}

/// Tries all that is to be written, and begins the file of paths if one is wanted, else `None`. Fails, before anything is traced, where a
/// place cannot be written or holds an interrupted run.
fn try_outputs(
    prepared: &PreparedScene,
    command: &TraceCommand,
    checkpoint: &Path,
) -> Result<Option<PathFile>, Failure> {
    let TraceCommand { folder, extra, .. } = *command;
    if !extra.resume {
        refuse_overwriting(checkpoint)?;
    }
    results_folder::try_folder(prepared, folder, extra.report.is_wanted())?;
    extra.ends.as_deref().map_or(Ok(()), try_file)?;
    let Some(file) = &extra.paths else { return Ok(None) };
    try_file(file)?;
    PathFile::create(file).map(Some)
}

/// Completes the file of paths and says how many vertices it has.
fn say_paths(paths: PathFile, file: &Path, console: &Console) -> Result<(), Failure> {
    let vertices = paths.finish()?;
    console.say(format_args!("wrote {} ({} vertices)", file.display(), grouped(vertices)));
    Ok(())
}

/// Saves results that could not be written where they should: they go where they can, or their sums do. Returns `failure` with where they
/// are.
fn rescue_results(
    run: &mut SceneResults,
    remarks: &RunRemarks,
    checkpoint: &Checkpoint,
    with_report: bool,
    failure: Failure,
) -> Failure {
    let (prepared, console) = (checkpoint.prepared, checkpoint.place.console);
    if let Some(folder) = results_folder::write_anywhere(prepared, run, remarks, with_report, console) {
        return failure.with_further_help(format!("nothing is lost: the results are in {}", folder.display()));
    }
    let Some(sums) = run.sums() else { return failure };
    match checkpoint.save_anywhere(&sums) {
        Ok(file) => failure.with_further_help(format!(
            "nothing is lost: `lampyris merge {} -o DIR` writes the results into another folder",
            file.display()
        )),
        Err(_) => failure.with_further_help("nor could the sums be saved anywhere else"),
    }
}

/// Says that both kernels agree, where both were run.
///
/// # Errors
/// When they do not.
fn say_verification(run: &SceneResults, console: &Console) -> Result<(), Failure> {
    let Some(v) = &run.verification else { return Ok(()) };
    if !v.identical {
        let message =
            format!("the {} kernel gives other tallies than the {} one: a defect of lampyris", v.full, v.pruned);
        let help = format!("nothing was written; what differs: {}", v.differing.join(", "));
        return Err(Failure::running(message).with_help(help));
    }
    console.say(format_args!(
        "the {} kernel ({}) gives the same tallies as the {} one ({}), bit by bit",
        v.full,
        seconds(v.seconds_full),
        v.pruned,
        seconds(v.seconds_pruned)
    ));
    Ok(())
}

/// Traces a shard (index from 0, count), or continues it, into its file; one that is done already is not traced again. Incomplete where
/// light was lost beyond the limit. Fails when interrupted, with what was done saved.
fn trace_shard(
    prepared: &PreparedScene,
    command: &TraceCommand,
    shard: [u32; 2],
    console: &Console,
) -> Result<Completion, Failure> {
    let replicates = prepared.replicate_range();
    let file = shards::shard_file(command.folder, shard, prepared.job.tracing.ray_range);
    let _owned = OutputPlace::file(&file)?;
    require_space(&folder_of(&file), LEAST_TALLY_BYTES)?;
    let place = SavePlace::new(command.scene, file, command.extra.checkpoint, console).with_shard(shard);
    let checkpoint = Checkpoint::new(prepared, &place)?;
    let from = checkpoint.read()?;
    // Asked again, a shard that is done is not traced once more: arrays of jobs are restarted as a whole.
    if let Some(partial) = from.as_ref().filter(|p| shards::is_shard_done(p, replicates.clone(), shard)) {
        console.say("traced already: nothing is left to do");
        shards::say_shard(&place.file, partial, shard, console)?;
        return Ok(lost_rays::report_light_lost_in_part(partial, prepared, command.extra.max_lost, console));
    }
    from.as_ref().map_or(Ok(()), |saved| checkpoint.refuse_other_part(saved, &replicates, shard))?;
    if !command.extra.resume {
        refuse_overwriting(&place.file)?;
    }
    let save = |p: &PartialRun| checkpoint.save_when_due(p);
    let request = TraceRequest {
        from,
        shard: Some(shard),
        finished: Some(&save),
        every: checkpoint.interval(),
        ..TraceRequest::default()
    };
    let partial = prepared.trace_part(request, &TerminalMonitor::of_saveable(console, None));
    // Fewer replicates than the shard has: it was stopped.
    if !shards::is_shard_done(&partial, replicates, shard) {
        return Err(checkpoint.save_stopped(&partial, None, RESUME));
    }
    let file = checkpoint.save_anywhere(&partial)?;
    // It was rescued to another place.
    if file != place.file {
        let message = format!("{}: cannot be written", place.file.display());
        return Err(
            Failure::running(message).with_help(format!("nothing is lost: the shard is in {}", file.display()))
        );
    }
    shards::say_shard(&place.file, &partial, shard, console)?;
    Ok(lost_rays::report_light_lost_in_part(&partial, prepared, command.extra.max_lost, console))
}
