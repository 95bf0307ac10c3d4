//! `trace --until-error` and `--until-settled`: the number of rays is looked for by runs of growing length, each saved while it goes on.

use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::cli::work::checkpoint::Checkpoint;
use crate::cli::work::tally_file::TallyHeader;
use crate::cli::work::terminal_monitor::TerminalMonitor;
use crate::formats::read_bytes;
use crate::pipeline::{
    ErrorTarget, GrowingSearch, PreparedScene, RunKeeper, TargetResult, TraceRequest, trace_until_settled,
};
use crate::simulate::PartialRun;
use std::path::Path;
use std::sync::Mutex;

/// What is to be reached.
#[derive(Clone, Copy)]
pub(super) enum Until<'a> {
    /// An error of a receiver.
    Error(&'a ErrorTarget),
    /// Verdicts without an unsure row.
    Settled,
}

/// What was traced to find a number of rays.
pub(super) struct SearchedRun {
    /// The last run.
    pub(super) portion: PartialRun,
    /// What came of an error that was to be reached.
    pub(super) result: Option<TargetResult>,
}

/// Where the runs of a search are saved.
pub(super) struct SearchPlace<'a> {
    pub(super) scene: &'a Path,
    /// The checkpoint.
    pub(super) file: &'a Path,
    /// Least seconds between two saves.
    pub(super) every_seconds: f64,
    pub(super) console: &'a Console,
}

/// Saves the runs of a search, and goes on with the one that an earlier process was at.
struct SavedRuns<'a> {
    place: &'a SearchPlace<'a>,
    /// What is done of the first run; taken by it.
    done: Mutex<Option<PartialRun>>,
}

impl RunKeeper for SavedRuns<'_> {
    fn keep(&self, prepared: &PreparedScene, trace: &mut dyn FnMut(TraceRequest<'_>)) {
        let from = self.done.lock().unwrap_or_else(|e| e.into_inner()).take();
        let checkpoint = match self.place.checkpoint(prepared) {
            Ok(checkpoint) => checkpoint,
            Err(failure) => {
                // A run that cannot be saved goes on all the same.
                self.place.console.say(format_args!("not saved: {failure}"));
                return trace(TraceRequest { from, ..TraceRequest::default() });
            }
        };
        let save = |portion: &PartialRun| checkpoint.save_when_due(portion);
        trace(TraceRequest {
            from,
            finished: Some(&save),
            every: checkpoint.interval(),
            ..TraceRequest::default()
        });
    }
}

impl SearchPlace<'_> {
    /// Makes the checkpoint of the run that `prepared` asks for.
    fn checkpoint<'p>(&'p self, prepared: &'p PreparedScene) -> Result<Checkpoint<'p>, Failure> {
        Checkpoint::new(prepared, self.scene, self.file.to_path_buf(), None, self.every_seconds, self.console)
    }

    /// Reads the run that an earlier search was at, and sets `prepared.rays` to its number; `None` where there is none.
    fn saved_run(&self, prepared: &mut PreparedScene) -> Result<Option<PartialRun>, Failure> {
        // What cannot be read is refused by the checkpoint, with its reason.
        let header = read_bytes(self.file).ok().and_then(|bytes| PartialRun::header::<TallyHeader>(&bytes).ok());
        if let Some(header) = header {
            let of_scene = prepared.run_settings().rays;
            prepared.rays = Some(header.rays().unwrap_or(of_scene));
        }
        self.checkpoint(prepared)?.read_and_say()
    }
}

/// Traces as many rays as `until` needs, or fewer where the terminal stops it; with `resume` from where an earlier search was. Sets
/// `prepared.rays`.
///
/// # Errors
/// When what is saved is of another run.
pub(super) fn trace_until(
    prepared: &mut PreparedScene,
    until: Until<'_>,
    place: &SearchPlace<'_>,
    resume: bool,
) -> Result<SearchedRun, Failure> {
    let done = if resume { place.saved_run(prepared)? } else { None };
    let resume_rays = done.as_ref().map(|_| prepared.run_settings().rays);
    let keeper = SavedRuns { place, done: Mutex::new(done) };
    let search = GrowingSearch { resume_rays, keeper: &keeper };
    let monitor = TerminalMonitor::of_saveable(place.console, None);
    Ok(match until {
        Until::Error(target) => {
            let (portion, result) = target.trace(prepared, search, &monitor);
            SearchedRun { portion, result: Some(result) }
        }
        Until::Settled => {
            let (portion, _) = trace_until_settled(prepared, search, &monitor);
            SearchedRun { portion, result: None }
        }
    })
}
