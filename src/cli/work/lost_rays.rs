//! The lost-ray ledger: one line per lost ray, of the first of them, with all that is needed to trace it again.

use crate::cli::completion::Completion;
use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::cli::output::closing::LOST_RAYS_FILE;
use crate::formats::{csv_quoted_text, printable_line, write_atomic};
use crate::pipeline::PreparedScene;
use crate::simulate::{LostRay, PartialRun, Results};
use crate::text::figures;
use std::path::Path;

/// The first line of a ledger.
pub(crate) const COLUMNS: &str =
    "ray,branch,bounce,cause,power,x_mm,y_mm,z_mm,dx,dy,dz,instance,medium,face,hit_instance,seed,rays,grows";

/// Writes the ledger of lost rays into the folder, lengths in mm; returns whether there was one to write.
pub(crate) fn write(folder: &Path, results: &Results, prepared: &PreparedScene) -> Result<bool, Failure> {
    if results.ledger.is_empty() {
        return Ok(false);
    }
    let settings = prepared.run_settings();
    write_atomic(&folder.join(LOST_RAYS_FILE), |w| {
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
    let recorded = results.ledger.len();
    let is_cut = results.lost_rays as usize > recorded;
    let listed = if is_cut { format!("the first {recorded} of them") } else { "them all".into() };
    say_beyond([share, max_lost], "the energy", console, || {
        let reasons = reasons(&results.ledger, results.lost_rays, prepared);
        format!("{reasons}; {} lists {listed}", folder.join(LOST_RAYS_FILE).display())
    })
}

/// Says so, and is incomplete, where a larger share of the light of a part of a run was lost than `max_lost`.
pub(crate) fn report_light_lost_in_part(
    part: &PartialRun,
    prepared: &PreparedScene,
    max_lost: f64,
    console: &Console,
) -> Completion {
    // Of no light, whose share is no number, none was lost.
    let share = part.tallies.lost_share().max(0.0);
    say_beyond([share, max_lost], "the energy of this part", console, || {
        let reasons = reasons(&part.tallies.ledger, part.tallies.counts.lost, prepared);
        format!("{reasons}; `lampyris merge` lists the lost rays")
    })
}

/// Says that a share of `what` was lost beyond the largest that is allowed, with its `reasons`, and is incomplete then.
fn say_beyond(
    [share, most]: [f64; 2],
    what: &str,
    console: &Console,
    reasons: impl FnOnce() -> String,
) -> Completion {
    if share <= most {
        return Completion::Complete;
    }
    let percent = figures(100.0 * share, 2);
    console.insist(format_args!("{percent} % of {what} was lost, more than --max-lost allows: {}", reasons()));
    Completion::Incomplete
}

/// Returns why rays were lost, by how many of those that are recorded of so many.
fn reasons(recorded: &[LostRay], lost_rays: u64, prepared: &PreparedScene) -> String {
    let of = if lost_rays as usize > recorded.len() {
        format!("of the first {} paths ", recorded.len())
    } else {
        String::new()
    };
    of + &prepared.bound.loss_reasons(recorded).join("; ")
}
