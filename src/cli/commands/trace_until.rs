//! `trace --until-error` and `--until-settled`: the number of rays is looked for by runs of growing length, each saved while it goes on.

use crate::cli::failure::Failure;
use crate::cli::work::checkpoint::{Checkpoint, SavePlace, saved_header};
use crate::cli::work::terminal_monitor::TerminalMonitor;
use crate::pipeline::{
    ErrorTarget, GrowingSearch, PreparedScene, RunKeeper, TargetResult, TraceRequest, trace_until_settled,
};
use crate::simulate::PartialRun;
use std::sync::Mutex;

/// The target to reach.
#[derive(Clone, Copy)]
pub(super) enum Until<'a> {
    /// An error of a receiver.
    Error(&'a ErrorTarget),
    /// Verdicts without an unsure row.
    Settled,
}

impl Until<'_> {
    /// Returns a text of what is searched for, among the runs of at most so many rays. Searches of one scene with one text come to the same
    /// run.
    pub(super) fn search_text(self, most_rays: Option<u64>) -> String {
        let sought = match self {
            Self::Error(ErrorTarget { percent, receiver, cells }) => {
                format!("{percent}%@{receiver}{}", if *cells { ":cells" } else { "" })
            }
            Self::Settled => "settled".into(),
        };
        match most_rays {
            Some(rays) => format!("{sought} of at most {rays} rays"),
            None => sought,
        }
    }
}

/// The run that was traced to find a number of rays.
pub(super) struct SearchedRun {
    /// The last run.
    pub(super) partial: PartialRun,
    /// Outcome of an error target.
    pub(super) result: Option<TargetResult>,
}

/// Saves the runs of a search, and continues the one that an earlier process was at.
struct SavedRuns<'a> {
    place: &'a SavePlace<'a>,
    /// What is done of the first run; taken by it.
    done: Mutex<Option<PartialRun>>,
}

impl RunKeeper for SavedRuns<'_> {
    fn keep(&self, prepared: &PreparedScene, trace: &mut dyn FnMut(TraceRequest<'_>)) {
        let from = self.done.lock().unwrap_or_else(|e| e.into_inner()).take();
        let checkpoint = match Checkpoint::new(prepared, self.place) {
            Ok(checkpoint) => checkpoint,
            Err(failure) => {
                // A run that cannot be saved goes on all the same.
                self.place.console.say(format_args!("not saved: {failure}"));
                return trace(TraceRequest { from, ..TraceRequest::default() });
            }
        };
        let save = |partial: &PartialRun| checkpoint.save_when_due(partial);
        trace(TraceRequest {
            from,
            finished: Some(&save),
            every: checkpoint.interval(),
            ..TraceRequest::default()
        });
    }
}

/// Reads the run that an earlier search was at, and sets `prepared.rays` to its number; `None` where there is none.
fn saved_run(prepared: &mut PreparedScene, place: &SavePlace<'_>) -> Result<Option<PartialRun>, Failure> {
    // What cannot be read is refused by the checkpoint, with its reason.
    if let Some(header) = saved_header(&place.file) {
        let of_scene = prepared.run_settings().rays;
        prepared.rays = Some(header.rays().unwrap_or(of_scene));
    }
    Checkpoint::new(prepared, place)?.read_and_say()
}

/// Traces as many rays as `until` needs, or fewer where the terminal stops it; with `resume` from where an earlier search was. Sets
/// `prepared.rays`.
///
/// # Errors
/// When what is saved is of another run.
pub(super) fn trace_until(
    prepared: &mut PreparedScene,
    until: Until<'_>,
    place: &SavePlace<'_>,
    resume: bool,
) -> Result<SearchedRun, Failure> {
    let done = if resume { saved_run(prepared, place)? } else { None };
    let resume_rays = done.as_ref().map(|_| prepared.run_settings().rays);
    let keeper = SavedRuns { place, done: Mutex::new(done) };
    let search = GrowingSearch { resume_rays, keeper: &keeper };
    let monitor = TerminalMonitor::of_saveable(place.console, None);
    Ok(match until {
        Until::Error(target) => {
            let (partial, result) = target.trace(prepared, search, &monitor);
            SearchedRun { partial, result: Some(result) }
        }
        Until::Settled => {
            let (partial, _) = trace_until_settled(prepared, search, &monitor);
            SearchedRun { partial, result: None }
        }
    })
}
