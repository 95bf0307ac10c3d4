//! The lost-ray ledger: one line per lost ray, of the first of them, with all that is needed to trace it again.

use crate::cli::completion::Completion;
use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::cli::output::closing::LEDGER;
use crate::formats::{csv_quoted_text, printable_line, write_atomic};
use crate::pipeline::PreparedScene;
use crate::report::figures;
use crate::simulate::{LostCause, Results};
use std::collections::BTreeMap;
use std::path::Path;

/// Reasons that a message names.
const NAMED_REASONS: usize = 3;

/// The first line of a ledger.
pub(crate) const COLUMNS: &str =
    "ray,branch,bounce,cause,power,x_mm,y_mm,z_mm,dx,dy,dz,instance,medium,face,hit_instance,seed,rays,grows";

/// Writes the ledger of lost rays into the folder, lengths in mm; returns whether there was one to write.
pub(crate) fn write(folder: &Path, results: &Results, prepared: &PreparedScene) -> Result<bool, Failure> {
    if results.ledger.is_empty() {
        return Ok(false);
    }
    let settings = prepared.run_settings();
    write_atomic(&folder.join(LEDGER), |w| {
        writeln!(w, "{COLUMNS}")?;
        for l in &results.ledger {
            let power = l.quanta as f64 * results.quantum;
            let (o, d) = (l.origin, l.direction);
            // A name that holds line ends would take several lines.
            let cell = |name: &str| csv_quoted_text(&printable_line(name));
            let [instance, medium] = prepared.bound.body_names(l.body).unwrap_or(["", ""]).map(cell);
            // A ray that left the scene was lost at no face: an empty cell.
            let face = l.face.map_or(String::new(), |f| f.to_string());
            let hit = cell(l.face.and_then(|f| prepared.bound.instance(f)).unwrap_or(""));
            writeln!(
                w,
                "{},{},{},{},{power},{},{},{},{},{},{},{instance},{medium},{face},{hit},{},{},{}",
                l.ray,
                l.branch,
                l.bounce,
                l.cause.name(),
                o.x,
                o.y,
                o.z,
                d.x,
                d.y,
                d.z,
                settings.seed,
                settings.rays,
                results.grows
            )?;
        }
        Ok(())
    })?;
    Ok(true)
}

/// Says what is open in the scene, or beyond its tables, a line each.
pub(crate) fn warn(prepared: &PreparedScene, console: &Console) {
    prepared.bound.notes().iter().for_each(|note| console.say(note));
}

/// Says so, and is incomplete, where a larger share of the light was lost than `max_lost`, or the power is no finite number.
pub(crate) fn report_lost_light(
    results: &Results,
    prepared: &PreparedScene,
    max_lost: f64,
    folder: &Path,
    console: &Console,
) -> Completion {
    // Shares of it would be no numbers.
    if !results.power.emitted.is_finite() {
        console.insist("the powers of the sources sum to no finite number: the powers of this run mean nothing");
        return Completion::Incomplete;
    }
    let share = results.power.lost / results.power.emitted;
    if share <= max_lost {
        return Completion::Complete;
    }
    console.insist(format_args!(
        "{} % of the energy was lost, more than --max-lost allows: {}; {} lists {}{}",
        figures(100.0 * share, 2),
        loss_reasons(results, prepared),
        folder.join(LEDGER).display(),
        if is_cut(results) { format!("the first {} of them", results.ledger.len()) } else { "them all".into() },
        advice(results)
    ));
    Completion::Incomplete
}

/// Returns why rays of the ledger were lost and where, the [`NAMED_REASONS`] most frequent first, in words.
fn loss_reasons(results: &Results, prepared: &PreparedScene) -> String {
    // Sorted by the words, so that equal counts come in one order.
    let mut count: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for l in &results.ledger {
        let hit = l.face.and_then(|f| prepared.bound.instance(f));
        let inside = || prepared.bound.body_names(l.body).map(|[instance, _]| instance);
        // Where it was hit; a ray that left the scene is told by the body that it was in.
        *count.entry((cause_text(l.cause), hit.or_else(inside).unwrap_or(""))).or_default() += 1;
    }
    let mut all: Vec<_> = count.into_iter().collect();
    all.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    let reasons: Vec<String> =
        all.iter().take(NAMED_REASONS).map(|((why, place), n)| format!("{n} {why} at '{place}'")).collect();
    let counted = if is_cut(results) { format!("of the first {}: ", results.ledger.len()) } else { String::new() };
    format!("{counted}{}", reasons.join("; "))
}

/// Returns what to do about the loss, to follow a sentence; empty where a model's own gaps are to blame.
fn advice(results: &Results) -> &'static str {
    if results.ledger.iter().any(|l| l.cause == LostCause::InsideSolid) {
        "; move sources out of solids, or, where a solid is drawn around a hollow, give its part a `medium` of index 1"
    } else {
        ""
    }
}

/// Whether more rays were lost than the ledger keeps.
fn is_cut(results: &Results) -> bool {
    results.lost_rays as usize > results.ledger.len()
}

/// Returns what happened to rays that were lost so, to follow "rays".
fn cause_text(cause: LostCause) -> &'static str {
    match cause {
        LostCause::NoExit => "left the scene inside a medium, as by a gap or an open shell,",
        LostCause::ImpossibleMedium => "met a body from the wrong side, as through a gap or an open shell,",
        LostCause::InsideSolid => {
            "hit an opaque solid from inside, as from a source that lies in it or through a gap,"
        }
        LostCause::TooDeep => {
            "were in more bodies at once than a ray can carry, as after entering an open shell again and again,"
        }
        LostCause::Unreadable => "could not be read, as their ray file was changed or went during the run,",
        LostCause::NotANumber => "had a distance or direction that is no number",
    }
}
