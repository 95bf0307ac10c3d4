//! `lampyris info`: what a STEP file holds and what could not be read.

use super::faces::print_faces;
use crate::cli::arguments::command::{PlacedLimit, RefusalLimit};
use crate::cli::console::{Console, print};
use crate::cli::output::json::json_text;
use crate::cli::output::terminal_tables::blank_table;
use crate::cli::work::input_files;
use crate::cli::work::threads::set_threads;
use crate::cli::{completion::Completion, failure::Failure};
use crate::report::{bytes, seconds};
use crate::step::ImportReport;
use crate::text::{count_of, figures, grouped};
use std::path::Path;

/// Names and notes shown without -v: what fits a screen.
const SHOWN_NAMES: usize = 12;
const SHOWN_NOTES: usize = 20;
/// Largest distance between edges and faces that is not worth a word, mm: what curves in parameters are allowed.
const NO_GAP_MM: f64 = 1e-6;

/// Reads a STEP file and prints what it holds and what was refused, or with `faces` all of its faces. Incomplete where more faces were
/// refused than the limit allows, and where there are none.
pub(crate) fn run(
    path: &Path,
    faces: bool,
    limits: RefusalLimit,
    placed: PlacedLimit,
    console: &Console,
) -> Result<Completion, Failure> {
    set_threads(None)?;
    let import = input_files::step_file(path, &placed.settings(), console)?;
    let report = import.report;
    // Zero of zero faces are no excess.
    let is_incomplete = report.faces.found == 0
        || input_files::is_too_much_missing(
            [report.faces.refused, report.faces.found],
            report.cut_off,
            limits.max_refused,
        );
    if faces {
        print_faces(&import.model, &report, console)?;
        // The document has them itself.
        if !console.json {
            say_losses(&report, is_incomplete, console);
        }
    } else if console.json {
        print(&json_text(&report)?)?;
    } else {
        print(&import_summary(&report, console))?;
    }
    Ok(Completion::incomplete_if(is_incomplete))
}

/// Says how many faces were refused, which and why, and what else could not be read, quiet or not where that is why the exit code
/// is not 0; lists are cut off without -v.
fn say_losses(r: &ImportReport, is_incomplete: bool, console: &Console) {
    let say = |message: String| console.say_or_insist(is_incomplete, message);
    input_files::say_refused_faces([r.faces.refused, r.faces.found], is_incomplete, "", console);
    let most = if console.verbose > 0 { usize::MAX } else { SHOWN_NOTES };
    for note in r.refusals.iter().take(most) {
        say(format!("refused: #{} {}: {}", note.id, note.entity, note.reason));
    }
    for problem in r.problems.iter().take(most) {
        say(format!("problem: {problem}"));
    }
    let rest = r.refusals.len().saturating_sub(most) + r.problems.len().saturating_sub(most);
    if rest > 0 {
        say(format!("and {rest} more; -v shows all, --json too"));
    }
}

/// Returns the report of an import as lines for people; lists are cut off without -v.
fn import_summary(r: &ImportReport, console: &Console) -> String {
    let list = |words: &[String]| if words.is_empty() { "none named".to_owned() } else { words.join(", ") };
    let mut text = format!("{}  {}, {}\n", r.file, bytes(r.bytes), list(&r.schema));
    let mut line = |name: &str, what: String| text += &format!("  {name:<10} {what}\n");
    line("units", format!("length {}; angle {}", list(&r.units.length), list(&r.units.angle)));
    let shapes = [(r.parts, "part"), (r.instances, "instance"), (r.shells, "shell")];
    let shapes = shapes.map(|(number, noun)| count_of(number as u64, noun));
    line("shapes", shapes.join(", "));
    let f = &r.faces;
    line(
        "faces",
        format!(
            "{} found, {} converted (of these {} repaired), {} refused; {} as placed",
            grouped(f.found as u64),
            grouped(f.converted as u64),
            f.repaired,
            f.refused,
            grouped(r.faces_placed.found as u64)
        ),
    );
    line("surfaces", surface_counts(r));
    match r.bbox_mm {
        Some([low, high]) => {
            let side = |k: usize| format!("{} … {}", figures(low[k], 5), figures(high[k], 5));
            line("box", format!("x {}, y {}, z {} mm", side(0), side(1), side(2)));
        }
        None => line("box", "nothing to bound".into()),
    }
    if r.gap_max_mm > NO_GAP_MM {
        line("edges", format!("up to {} mm off the faces that they bound", figures(r.gap_max_mm, 2)));
    }
    let shown: Vec<String> = r.names.iter().take(SHOWN_NAMES).cloned().collect();
    let more = if r.names.len() > SHOWN_NAMES {
        format!(" and {} more", r.names.len() - SHOWN_NAMES)
    } else {
        String::new()
    };
    line("names", list(&shown) + &more);
    line("read in", format!("{} (parse) + {} (convert)", seconds(r.seconds.parse), seconds(r.seconds.convert)));
    let refused = r.refusals.iter().map(|n| ("refused", n));
    let repaired = r.repairs.iter().map(|n| ("repaired", n));
    let left_out = r.left_out.iter().map(|n| ("left out", n));
    let hidden = r.hidden.iter().map(|n| ("hidden", n));
    let notes: Vec<_> = refused.chain(repaired).chain(left_out).chain(hidden).collect();
    let most = if console.verbose > 0 { usize::MAX } else { SHOWN_NOTES };
    if !notes.is_empty() {
        let mut table = blank_table(console.width());
        table.set_header(["", "entity", "why"]);
        for (what, note) in notes.iter().take(most) {
            table.add_row([(*what).to_owned(), format!("#{} {}", note.id, note.entity), note.reason.clone()]);
        }
        text += &format!("{table}\n");
        if notes.len() > most {
            text += &format!("  and {} more; -v shows all, --json all with every detail\n", notes.len() - most);
        }
    }
    for problem in r.problems.iter().take(most) {
        text += &format!("  problem: {problem}\n");
    }
    let rest = r.problems.len().saturating_sub(most);
    if rest > 0 {
        text += &format!("  and {}; -v shows all\n", count_of(rest as u64, "more problem"));
    }
    text
}

/// Lists in words how many faces there are of each kind of surface, "none" for none.
fn surface_counts(r: &ImportReport) -> String {
    let s = &r.by_surface;
    let kinds = [
        ("plane", s.plane),
        ("cylinder", s.cylinder),
        ("cone", s.cone),
        ("sphere", s.sphere),
        ("torus", s.torus),
        ("revolution", s.revolution),
        ("extrusion", s.extrusion),
        ("offset", s.offset),
        ("B-spline", s.bspline),
        ("rational B-spline", s.rational),
        ("ready mesh", s.tessellated),
        ("other", s.other),
    ];
    let present: Vec<String> = kinds.iter().filter(|k| k.1 > 0).map(|(name, n)| format!("{n} {name}")).collect();
    if present.is_empty() { "none".into() } else { present.join(", ") }
}
