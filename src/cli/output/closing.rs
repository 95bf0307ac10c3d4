//! The last lines of a traced scene, or its document on stdout.

use super::face_tables::print_faces;
use super::json::json_text;
use super::sentences::plain_sentence_lines;
use super::sequence_tables::print_sequences;
use crate::cli::console::{Console, print};
use crate::cli::failure::Failure;
use crate::formats::printable_line;
use crate::pipeline::{PreparedScene, SceneResults, TargetResult};
use crate::report::file_stem;
use crate::simulate::Results;
use crate::text::{figures, grouped};
use serde_json::Value;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Longest line of the closing paragraph, characters.
const LINE_LENGTH: usize = 96;

/// Most columns that paths are padded to.
const PATH_COLUMNS: usize = LINE_LENGTH / 2;

/// Name of the list of lost rays in a folder of results.
pub(crate) const LOST_RAYS_FILE: &str = "lost_rays.csv";

/// Prints what was asked for beside the figures: power by face and light by sequence. Nothing where neither was.
pub(crate) fn print_listings(
    run: &SceneResults,
    prepared: &PreparedScene,
    console: &Console,
) -> Result<(), Failure> {
    if console.quiet {
        return Ok(());
    }
    let (model, unit) = (&prepared.job.loaded.model, prepared.power_unit());
    print_faces(run, prepared, console)?;
    Ok(print_sequences(&run.results, model, unit, console)?)
}

/// Prints the document of the results on stdout with `--json`, else says the closing lines.
pub(crate) fn print_results(
    document: &Value,
    answer: &str,
    folder: &Path,
    results: &Results,
    with_report: bool,
    console: &Console,
) -> Result<(), Failure> {
    if console.json {
        return Ok(print(&json_text(document)?)?);
    }
    say_closing_lines(answer, folder, results, with_report, console);
    Ok(())
}

/// Prints the notes that a reader of the results must know, a line each, without those `said` before.
pub(crate) fn say_notes(notes: &[String], said: &[String], console: &Console) {
    let said: HashSet<&String> = said.iter().collect();
    notes.iter().filter(|note| !said.contains(note)).for_each(|note| console.say(note));
}

/// Says the last lines of a traced scene: what was found, and which files to open.
fn say_closing_lines(answer: &str, folder: &Path, results: &Results, with_report: bool, console: &Console) {
    console.say("");
    console.say(plain_sentence_lines(answer, console.width().min(LINE_LENGTH)));
    let mut files = notable_files(folder, results);
    // Without a report its line, the first one, is left out.
    if !with_report {
        files.remove(0);
    }
    let lengths = files.iter().map(|(p, _)| p.display().to_string().chars().count());
    // A long path reaches beyond the column instead of pushing all descriptions out of the window.
    let widest = lengths.filter(|&length| length <= PATH_COLUMNS).fold(0, usize::max);
    for (k, (path, what)) in files.iter().enumerate() {
        let name = format!("{:<widest$}", path.display().to_string());
        let name = if k == 0 { console.bold(&name) } else { name };
        console.say(format_args!("  {name}  {}", console.dim(what)));
    }
}

/// Returns the files of a result folder that a person wants to know of, with what they are; the report is always the first.
fn notable_files(folder: &Path, results: &Results) -> Vec<(PathBuf, String)> {
    let mut files = vec![
        (folder.join("report.html"), "open this in a browser: pictures, tables, cross-check".to_owned()),
        (folder.join("results.json"), "every number of the run".into()),
    ];
    for r in results.receivers.iter().filter(|r| r.files.iter().any(|file| file.ends_with(".csv"))) {
        files.push((
            folder.join(format!("{}.csv", file_stem(&r.name))),
            format!("{} cell by cell (also .npz .png .vti and more)", printable_line(&r.name)),
        ));
    }
    if !results.ledger.is_empty() {
        files.push((
            folder.join(LOST_RAYS_FILE),
            "the lost rays; `lampyris trace` shows their paths with --replay".into(),
        ));
    }
    files.push((folder.join("facets.glb"), "facets and ray paths in 3-D, for any glTF viewer".into()));
    files
}

/// Says in one Markdown sentence whether the requested statistical error was reached, and about how many more rays it takes if not.
pub(crate) fn target_sentence(result: &TargetResult) -> String {
    let found = result.found_percent.map_or("nothing arrived".into(), |e| format!("{} %", figures(e, 2)));
    let verdict = if result.reached { "reached" } else { "**not reached**" };
    let missing = match (result.missing_rays, result.found_percent) {
        (0, _) if result.reached => String::new(),
        (_, None) => ", so the number needed is not known".into(),
        (0, Some(_)) => "; it is the rounding of the rays' power, which more rays do not lessen".into(),
        (more, Some(_)) => format!("; about {} more are needed", grouped(more)),
    };
    format!(
        "Asked for a statistical error of {} % of the {} on {}: {verdict} with {} rays ({found}){missing}.",
        result.asked_percent,
        result.quantity,
        result.receiver,
        grouped(result.rays)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is missing follows from the error; where nothing arrived there is none.
    #[test]
    fn how_many_rays_are_missing_is_told_where_it_is_known() {
        let told = |found_percent: Option<f64>, missing_rays: u64| {
            target_sentence(&TargetResult {
                receiver: "wall".into(),
                quantity: "power",
                asked_percent: 1.0,
                found_percent,
                rays: 900,
                reached: missing_rays == 0,
                missing_rays,
            })
        };
        assert!(told(Some(0.9), 0).ends_with("reached with 900 rays (0.9 %)."));
        assert!(told(Some(2.0), 2700).ends_with("(2 %); about 2700 more are needed."));
        assert!(told(None, 2700).ends_with("(nothing arrived), so the number needed is not known."));
    }
}
