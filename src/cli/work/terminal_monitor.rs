//! A job as a terminal shows it: a sign of life or a bar for each stage, and a line for what was decided.

use super::path_file::PathFile;
use crate::cli::console::{Console, show_progress};
use crate::cli::interruption::{self, SaveableRun};
use crate::cli::output::sentences::plain_sentence_lines;
use crate::intersect::NormalMode;
use crate::pipeline::{Monitor, Stage};
use crate::report::tolerance_text;
use crate::study;
use crate::study::default_accuracy::TracingChoice;
use crate::text::{figures, grouped};
use indicatif::ProgressBar;
use std::sync::{Mutex, MutexGuard};

/// Shows the stages of a job on the terminal; stops tracing when a signal stops a run that can be saved, and when its paths can
/// no longer be written.
pub(crate) struct TerminalMonitor<'a> {
    console: &'a Console,
    is_saveable: bool,
    /// Whether rays are traced: what was traced already is not said to be.
    is_tracing: bool,
    paths: Option<&'a PathFile>,
    shown: Mutex<Shown>,
}

/// The stage that is on the terminal.
#[derive(Default)]
struct Shown {
    bar: Option<ProgressBar>,
    saveable: Option<SaveableRun>,
}

impl<'a> TerminalMonitor<'a> {
    /// Shows a job that cannot be saved.
    pub(crate) fn new(console: &'a Console) -> Self {
        Self { console, is_saveable: false, is_tracing: true, paths: None, shown: Mutex::default() }
    }

    /// Shows a job whose rays were traced before.
    pub(crate) fn of_traced(console: &'a Console) -> Self {
        Self { is_tracing: false, ..Self::new(console) }
    }

    /// Shows a run that is saved when a signal asks it to stop, and stops it when its `paths` can no longer be written.
    pub(crate) fn of_saveable(console: &'a Console, paths: Option<&'a PathFile>) -> Self {
        Self { is_saveable: true, paths, ..Self::new(console) }
    }

    /// Locks what is on the terminal at present.
    fn shown(&self) -> MutexGuard<'_, Shown> {
        self.shown.lock().unwrap_or_else(|e| e.into_inner())
    }
}

impl Monitor for TerminalMonitor<'_> {
    fn begin(&self, stage: Stage<'_>) {
        let console = self.console;
        let mut shown = self.shown();
        shown.bar = Some(match stage {
            Stage::Reading(path) => console.spinner(&format!("reading {}", path.display())),
            Stage::Tessellating => console.spinner("making facets"),
            Stage::Choosing => console.spinner("choosing facets or spline by a pilot"),
            Stage::Aiming => console.stage_bar("aiming"),
            Stage::Building(kind) => console.spinner(&format!("building the {}", kind.in_words())),
            Stage::BuildingCheck(what) => console.spinner(&format!("building {what} for the cross-check")),
            Stage::Tracing(rays) => {
                // From here on a signal stops the run and saves it; before it there is nothing to save.
                shown.saveable = self.is_saveable.then(SaveableRun::begin);
                console.progress_bar("tracing", "rays", rays)
            }
            Stage::Checking(rays) => console.progress_bar("checking", "rays", rays),
        });
    }

    fn advance(&self, done: u64, total: u64) -> bool {
        let shown = self.shown();
        if let Some(bar) = &shown.bar {
            // A resumed run learns its total late.
            bar.set_length(total);
            bar.set_position(done);
        }
        let is_stopped = shown.saveable.is_some() && interruption::is_requested();
        !is_stopped && self.paths.is_none_or(|paths| !paths.has_failed())
    }

    fn study_progress(&self, progress: &study::Progress) {
        if let Some(bar) = &self.shown().bar {
            show_progress(bar, progress);
        }
    }

    fn end(&self) {
        let mut shown = self.shown();
        if let Some(bar) = shown.bar.take() {
            bar.finish_and_clear();
        }
        shown.saveable = None;
    }

    fn warns(&self, message: &str) {
        self.console.say_once(message);
    }

    fn chosen(&self, chosen: &TracingChoice) {
        if !self.is_tracing {
            return;
        }
        if chosen.has_no_surface {
            return self.console.say(format_args!("{}, and nothing is met", chosen.because));
        }
        let tolerance = tolerance_text(chosen.tolerance_mm);
        let how = match (chosen.intersector, chosen.normals) {
            ("exact", _) => "on the spline".to_owned(),
            (_, NormalMode::Exact) => format!("on facets of {tolerance} with hits moved to the spline"),
            _ => format!("on facets of {tolerance} with {} normals", chosen.normals),
        };
        // The results say why.
        self.console.say(format_args!("tracing {how}"));
    }

    fn aimed(&self, answer: &str) {
        self.console.say(plain_sentence_lines(answer, self.console.width()).trim_end());
    }

    fn unsettled(&self, rows: usize, rays: u64) {
        let rows = if rows == 1 { "1 row is".to_owned() } else { format!("{rows} rows are") };
        self.console.say(format_args!("{rows} unsure: going on with {} rays", grouped(rays)));
    }

    fn grows(&self, found_percent: Option<f64>, rays: u64) {
        let found = found_percent.map_or("nothing arrives".into(), |e| format!("{} %", figures(e, 2)));
        self.console.say(format_args!("{found}: going on with {} rays", grouped(rays)));
    }
}
