//! `lampyris merge`: the results of all parts of a run.

use crate::cli::arguments::command::RefusalLimit;
use crate::cli::arguments::options::CacheOption;
use crate::cli::completion::Completion;
use crate::cli::console::{Console, print};
use crate::cli::failure::Failure;
use crate::cli::output::closing;
use crate::cli::output::json::json_text;
use crate::cli::work::cache_folder;
use crate::cli::work::checkpoint::{CHECKPOINT, Checkpoint, SavePlace, saved_header};
use crate::cli::work::input_guard::InputGuard;
use crate::cli::work::output_place::{OutputPlace, try_claim, try_folder};
use crate::cli::work::part_sum::{AskedRun, PartFailure, PartOrigins, PartSum, input_failure, read_header};
use crate::cli::work::results_folder::RunRemarks;
use crate::cli::work::run_commands::RunCommands;
use crate::cli::work::shards::is_tally;
use crate::cli::work::tally_file::TallyHeader;
use crate::cli::work::terminal_monitor::TerminalMonitor;
use crate::cli::work::threads::set_threads;
use crate::cli::work::{input_files, lost_rays, results_folder};
use crate::pipeline::{ErrorTarget, PreparedScene, SceneJob, TraceRequest, read_cached_scene};
use crate::simulate::{GROWING_REPLICATE, PartialRun, shard_replicates};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What `merge` was asked for; `None` for what was not given.
pub(crate) struct MergeCommand<'a> {
    pub(crate) parts: &'a [PathBuf],
    pub(crate) folder: &'a Path,
    pub(crate) scene: Option<&'a Path>,
    pub(crate) wait: Option<f64>,
    pub(crate) rays: Option<u64>,
    pub(crate) until_error: Option<&'a str>,
    pub(crate) cache: &'a CacheOption,
    pub(crate) max_lost: f64,
    pub(crate) with_report: bool,
    pub(crate) limits: RefusalLimit,
}

/// How long to wait before looking for parts again.
const LOOK_AGAIN: Duration = Duration::from_millis(500);

/// Puts the parts together, waiting for missing ones if asked to, and writes the results of the whole run, or the sum where the place is a
/// `.tally`. Incomplete where light was lost or faces refused beyond the limits, or the error asked for was not reached.
pub(crate) fn run(command: &MergeCommand, console: &Console) -> Result<Completion, Failure> {
    let patience = Patience::new(command.wait);
    // Before any part is waited for.
    command.until_error.map(ErrorTarget::parse).transpose()?;
    // A sum in the place of a part: merged once more, their rays would count twice or be lost.
    let parts = part_files(command.parts)?;
    InputGuard::new(parts.iter().map(PathBuf::as_path)).refuse("-o", command.folder)?;
    let monitor = TerminalMonitor::of_traced(console);
    let header = first_header(command, &patience, console)?;
    // The part knows where its scene was.
    let scene_path = command.scene.map_or_else(|| header.scene(), Path::to_path_buf);
    let cache = cache_folder::cache(command.cache)?;
    set_threads(None)?;
    let read = read_cached_scene(&scene_path, cache.as_ref(), &monitor);
    let (mut scene, loaded) = read.map_err(|error| match command.scene {
        Some(_) => Failure::from(error),
        None => {
            Failure::from(error).with_further_help("where the scene has moved since, --scene FILE says where it is")
        }
    })?;
    scene.run.sequences = header.sequences;
    scene.run.faces = header.faces;
    if is_tally(command.folder) {
        try_claim(command.folder)?;
    } else {
        results_folder::refuse_inputs(&scene, &scene_path, command.folder)?;
        try_folder(command.folder)?;
    }
    let (meshing, tracing) = (header.meshing(), header.tracing());
    let target = command.until_error.map(|text| ErrorTarget::new(text, &scene)).transpose()?;
    let job = SceneJob { meshing, tracing, cache, chosen: header.choice(), ..SceneJob::new(scene, loaded) };
    let mut prepared = PreparedScene::new(job, &monitor)?;
    // A part that is named is waited for as those of a folder are.
    while let Some(absent) = part_files(command.parts)?.into_iter().find(|file| !file.exists())
        && patience.wait_again(console, &format!("{} is not there yet", absent.display()))
    {}
    let (whole, origins) = sum_parts(command, &header, &prepared, &patience, console)?;
    if is_tally(command.folder) {
        // A merge into a tally sums up what is there, whole or not.
        return write_sum(command, &prepared, &scene_path, (&whole, origins), console);
    }
    if !whole.is_whole() {
        let failure = Failure::input(missing_parts(&whole, &header));
        return Err(
            failure.with_help("merge all parts at once; --wait SECONDS waits for those that are still traced")
        );
    }
    if whole.grows {
        // As large as it has grown, whichever part came first.
        prepared.rays = Some(u64::from(whole.replicates) * GROWING_REPLICATE);
    }
    let _owned = OutputPlace::folder(command.folder)?;
    results_folder::try_folder(&prepared, command.folder, command.with_report)?;
    let request = TraceRequest { from: Some(whole), ..TraceRequest::default() };
    let mut run = prepared.trace(request, &monitor).map_err(|_| Failure::running("merge: the run is not whole"))?;
    origins.usage.note_in(&mut run.results);
    let commands = RunCommands::new(None, console).with_parts(origins.traced_by);
    let remarks = RunRemarks::say_target(target.map(|target| target.result(&run.results)), commands, console);
    let written =
        results_folder::write(&prepared, command.folder, &mut run, &remarks, command.with_report, console);
    let (document, answer) = match written {
        Ok(written) => written,
        Err(failure) => {
            let place = results_folder::write_anywhere(&prepared, &mut run, &remarks, command.with_report, console);
            let saved = place.map(|folder| format!("nothing is lost: the results are in {}", folder.display()));
            return Err(
                failure.with_further_help(saved.unwrap_or("nothing is lost: the parts are as they were".into()))
            );
        }
    };
    closing::say_notes(&run.results.notes, &[], console);
    closing::print_listings(&run, &prepared, console)?;
    closing::print_results(&document, &answer, command.folder, &run.results, command.with_report, console)?;
    let refused = input_files::report_refusals(&prepared.job.loaded, command.limits.max_refused, console)
        .and(input_files::report_bare_faces(&prepared, command.limits.max_refused, console));
    Ok(lost_rays::report_lost_light(&run.results, &prepared, command.max_lost, command.folder, console)
        .and(refused)
        .and(Completion::incomplete_if(remarks.target.is_some_and(|result| !result.reached))))
}

/// Sums up the parts that are there, waiting for missing ones if asked to, and what made these.
fn sum_parts(
    command: &MergeCommand,
    header: &TallyHeader,
    prepared: &PreparedScene,
    patience: &Patience,
    console: &Console,
) -> Result<(PartialRun, PartOrigins), Failure> {
    let mut sum = PartSum::new(AskedRun {
        first: header.clone(),
        fingerprint: prepared.fingerprint()?.0,
        scene: command.scene.map(Path::to_path_buf),
        rays: command.rays,
    });
    // Listed anew each time: parts may come, and grow, while they are waited for.
    loop {
        let there = match sum.add_new(&part_files(command.parts)?, &prepared.bound) {
            Ok(there) => there,
            Err(failure) => {
                patience.wait_for_end(failure, console)?;
                continue;
            }
        };
        if there.is_whole() || !patience.wait_again(console, &missing_parts(there, header)) {
            return Ok(sum.into_total());
        }
    }
}

/// Writes the sum of the parts, whole or not, as a tally for a merge of merges, and says so, or with `--json` prints what it holds.
fn write_sum(
    command: &MergeCommand,
    prepared: &PreparedScene,
    scene: &Path,
    (sum, origins): (&PartialRun, PartOrigins),
    console: &Console,
) -> Result<Completion, Failure> {
    let file = command.folder.to_path_buf();
    let _owned = OutputPlace::file(&file)?;
    let place = SavePlace::new(scene, file, 0.0, console);
    Checkpoint::new(prepared, &place)?.save_sum(sum, origins)?;
    if console.json {
        let counts = &sum.tallies.counts;
        let document = json!({"replicates": sum.done.len(), "of": sum.replicates, "rays": counts.rays,
            "segments": counts.segments, "lost_rays": counts.lost, "file": command.folder.display().to_string()});
        print(&json_text(&document)?)?;
        return Ok(Completion::Complete);
    }
    console.say(format_args!(
        "{} of {} replicates in {}",
        sum.done.len(),
        sum.replicates,
        command.folder.display()
    ));
    Ok(Completion::Complete)
}

/// How long to wait for parts.
struct Patience {
    start: Instant,
    limit: Duration,
}

impl Patience {
    /// Starts the clock; `None` does not wait, and what no clock counts to waits for ever.
    fn new(seconds: Option<f64>) -> Self {
        let limit = |s| Duration::try_from_secs_f64(s).unwrap_or(Duration::MAX);
        Self { start: Instant::now(), limit: seconds.map_or(Duration::ZERO, limit) }
    }

    /// Waits [`LOOK_AGAIN`] and returns true; false, at once, when the time is over. With -v says what is missing.
    fn wait_again(&self, console: &Console, missing: &str) -> bool {
        if self.start.elapsed() >= self.limit {
            return false;
        }
        if console.verbose > 0 {
            console.say(missing);
        }
        std::thread::sleep(LOOK_AGAIN);
        true
    }

    /// Waits [`LOOK_AGAIN`] for the end of a part that is cut short; fails where waiting changes nothing, and when the time is over.
    fn wait_for_end(&self, failure: PartFailure, console: &Console) -> Result<(), Failure> {
        match failure {
            PartFailure::CutShort(failure) if self.wait_again(console, &failure.to_string()) => Ok(()),
            PartFailure::CutShort(failure) | PartFailure::Lasting(failure) => Err(failure),
        }
    }
}

/// Returns the header of the first part that is there, waited for if requested; fails when none came in time.
fn first_header(command: &MergeCommand, patience: &Patience, console: &Console) -> Result<TallyHeader, Failure> {
    loop {
        // Listed anew each time: parts appear in the folder.
        let files = part_files(command.parts)?;
        match files.iter().find(|file| file.exists()).map(|file| read_header(file)) {
            Some(Ok(header)) => return Ok(header),
            Some(Err(failure)) => patience.wait_for_end(failure, console)?,
            None if patience.wait_again(console, "no part is there yet") => {}
            None => return Err(no_part(command.parts)),
        }
    }
}

/// Returns the failure of a merge whose arguments mean no part, which points out an interrupted run in one of them.
fn no_part(arguments: &[PathBuf]) -> Failure {
    let Some(folder) = arguments.iter().find(|folder| folder.join(CHECKPOINT).is_file()) else {
        let missing = arguments.first().map_or_else(String::new, |p| p.display().to_string());
        return Failure::input(format!("{missing}: no .tally file is there"))
            .with_help("`lampyris trace SCENE --shard I/N -o DIR` writes one, and so does --rays A..B");
    };
    let header = saved_header(&folder.join(CHECKPOINT));
    let scene = header.map_or_else(|| "SCENE".into(), |header| header.scene().display().to_string());
    let place = folder.display();
    Failure::input(format!("{place}: no part is there, but an interrupted run, {CHECKPOINT}"))
        .with_help(format!("finish it with `lampyris trace {scene} -o {place} --resume`"))
}

/// Returns the tally files that the arguments mean: files as they are given, there or not, and those in folders, sorted by name,
/// checkpoints left out.
fn part_files(arguments: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut files = Vec::new();
    for argument in arguments {
        if !argument.is_dir() {
            files.push(argument.clone());
            continue;
        }
        let entries = std::fs::read_dir(argument).map_err(|e| input_failure(argument, e))?;
        let mut inside: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        // A checkpoint is of a run that is still traced.
        inside.retain(|path| is_tally(path) && !path.ends_with(CHECKPOINT));
        inside.sort();
        files.extend(inside);
    }
    Ok(files)
}

/// Returns a text of how many replicates are missing, and which shards or, of a run that grows, which rays they are.
fn missing_parts(whole: &PartialRun, header: &TallyHeader) -> String {
    let absent = |r: &u32| whole.done.binary_search(r).is_err();
    let count = whole.replicates as usize - whole.done.len();
    let mut text = format!("{count} of the {} replicates of the run are missing", whole.replicates);
    if whole.grows && (header.first_ray.is_some() || header.shard.is_none()) {
        text += &format!(": rays {}", missing_rays(whole).join(", "));
    } else if let Some([_, n]) = header.shard {
        let shards: Vec<String> = (0..n)
            // A shard without any of its replicates, or with some of them only.
            .filter(|&k| shard_replicates(0..whole.replicates, [k, n]).any(|r| absent(&r)))
            .map(|k| format!("{}/{n}", k + 1))
            .collect();
        text += &format!(": those of shard {}", shards.join(", "));
    }
    text
}

/// Returns the ranges of rays that are not there, of a run that grows, as `A..B`.
fn missing_rays(whole: &PartialRun) -> Vec<String> {
    let mut ranges = Vec::new();
    let mut next = 0;
    // The number of all replicates closes the last gap.
    for &replicate in whole.done.iter().chain([&whole.replicates]) {
        if replicate > next {
            let [first, end] = [next, replicate].map(|r| u64::from(r) * GROWING_REPLICATE);
            ranges.push(format!("{first}..{end}"));
        }
        next = replicate + 1;
    }
    ranges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patience_is_as_long_as_the_seconds_and_without_end_for_inf() {
        let limit = |seconds| Patience::new(seconds).limit;
        assert_eq!([None, Some(2.5)].map(limit), [Duration::ZERO, Duration::from_millis(2500)]);
        assert_eq!(limit(Some(f64::INFINITY)), Duration::MAX);
    }
}
