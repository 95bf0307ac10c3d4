//! The ways that light took, as tables, in the document of the results and as a view.

use super::rule_table::face_labels;
use crate::cli::console::{Console, print};
use crate::cli::output::terminal_tables::table_text;
use crate::formats::{Facets, Polylines};
use crate::model::{Model, PlacedFace};
use crate::pipeline::PreparedScene;
use crate::report::{Cell, Section, Table, View, file_stem};
use crate::simulate::{Event, RecordedWay, Results, Sequence, SequenceResult, recorded_ways};
use crate::text::{count_of, figures};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io;

/// Sequences whose paths are drawn, and their colours.
const DRAWN: [[f64; 3]; 6] = [
    [1.0, 0.72, 0.12],
    [0.23, 0.51, 0.96],
    [0.85, 0.30, 0.30],
    [0.16, 0.65, 0.38],
    [0.66, 0.33, 0.85],
    [0.05, 0.6, 0.65],
];

/// Most paths of a sequence that are drawn.
const MOST_DRAWN: usize = 60;

/// Share of a receiver's power, per cent, is shown with so many digits.
const SHARE_DIGITS: usize = 4;

/// Names of faces as ways have them: what selects each, without the braces around it, behind its instance where there are several.
pub(super) fn face_names(model: &Model) -> Vec<String> {
    let labels = model.labels();
    let name = |(face, label): (PlacedFace<'_>, String)| {
        let bare = label.strip_prefix("on = { ").and_then(|l| l.strip_suffix(" }")).unwrap_or(&label);
        if model.instances.len() < 2 || bare.starts_with("instance") {
            return bare.to_owned();
        }
        format!("{} ({bare})", labels[face.instance])
    };
    model.placed_faces().zip(face_labels(model)).map(name).collect()
}

/// Returns the way of a sequence in words, from its source on; `names` are those of the faces, by number.
fn way_text(sequence: &SequenceResult, names: &[String]) -> String {
    let step = |face: Option<u32>, event: Event| {
        let verb = match event {
            Event::Reflected => "reflected by",
            Event::Transmitted => "through",
            Event::Absorbed => "absorbed by",
            _ => "scattered by",
        };
        match face {
            None => "scattered inside".to_owned(),
            Some(f) => {
                let name = names.get(f as usize).cloned().unwrap_or_else(|| format!("face {f}"));
                format!("{verb} {name}")
            }
        }
    };
    let mut words = vec![sequence.source_name.clone()];
    words.extend(sequence.steps.iter().map(|s| step(s.face, s.event)));
    if sequence.steps.is_empty() {
        words.push("straight".into());
    }
    if sequence.more {
        words.push("and on".into());
    }
    words.join(" → ")
}

/// Returns a table for each receiver that light was grouped for, its ways by power; none where it was not. `unit` is that of power.
fn sequence_tables(results: &Results, model: &Model, unit: &str) -> Vec<Table> {
    let names = face_names(model);
    let columns = [("", ""), ("power", unit), ("± (1σ)", unit), ("share", "%"), ("way", "")];
    let table = |(k, found): (usize, &crate::simulate::ReceiverSequences)| {
        let receiver = &results.receivers[k];
        let share = |power: f64| Cell::Number(100.0 * power / receiver.power, SHARE_DIGITS);
        let name = format!("{}-sequences", file_stem(&receiver.name));
        let title = format!("{}: ways of its light", receiver.name);
        let mut table = Table::new(&name, &title, &columns);
        // Nothing is left where the table has all.
        if found.count > found.first.len() {
            table = table.caption(format!(
                "Of {} all others together brought {} {unit}.",
                count_of(found.count as u64, "way"),
                figures(found.rest, SHARE_DIGITS)
            ));
        }
        for (rank, s) in found.first.iter().enumerate() {
            let [power, error] = [Cell::Known(s.power, s.power_error, 6), Cell::Error(s.power_error)];
            table.row([(rank + 1).into(), power, error, share(s.power), way_text(s, &names).into()]);
        }
        table
    };
    results.sequences.iter().enumerate().filter(|(_, found)| found.count > 0).map(table).collect()
}

/// Returns the section of a report with view and tables; `None` where light was not grouped.
pub(crate) fn sequence_section(prepared: &PreparedScene, results: &Results, facets: &Facets) -> Option<Section> {
    let tables = sequence_tables(results, &prepared.job.loaded.model, prepared.power_unit());
    if tables.is_empty() {
        return None;
    }
    let section = Section::new("Ways of light").with_block(sequence_view(prepared, results, facets));
    Some(tables.into_iter().fold(section, Section::with_block))
}

/// Draws recorded paths of the first sequences of each receiver, a colour for each; cut a little outside of the model, mm.
fn sequence_view(prepared: &PreparedScene, results: &Results, facets: &Facets) -> View {
    let mut view = View::of_facets("sequences", "Paths of the first ways", facets).faded(0.35);
    // Rank by rank, so that every receiver has its first way drawn before any has its second.
    let first = (0..DRAWN.len()).flat_map(|rank| {
        let of_rank = results.sequences.iter().enumerate();
        of_rank.filter_map(move |(r, found)| Some((r, rank, found.first.get(rank)?)))
    });
    let settings = prepared.run_settings();
    let mut of_receiver: BTreeMap<usize, Vec<RecordedWay>> = BTreeMap::new();
    for ((receiver, rank, sequence), colour) in first.zip(DRAWN) {
        let ways = of_receiver
            .entry(receiver)
            .or_insert_with(|| recorded_ways(&prepared.bound, &settings, receiver, results));
        let is_same = |way: &Sequence| {
            (way.source, way.more) == (sequence.source, sequence.more) && way.steps == sequence.steps
        };
        let mut lines = Polylines::default();
        ways.iter()
            .filter(|w| is_same(&w.sequence))
            .take(MOST_DRAWN)
            .for_each(|w| lines.push(w.points.iter().copied()));
        let near = lines.near(&facets.mesh.bounds());
        let name = format!("{} {}", results.receivers[receiver].name, rank + 1);
        view = view.lines(&name, &near, colour);
    }
    view.caption(
        "Numbers are those of the tables. Lines are recorded paths up to where the receiver counted them; a way too rare to be among them has none.",
    )
}

/// Adds each sequence in words to the document of the results, as `way`; nothing where light was not grouped.
pub(crate) fn add_ways(document: &mut Value, results: &Results, model: &Model) {
    if results.sequences.is_empty() {
        return;
    }
    let names = face_names(model);
    for (r, found) in results.sequences.iter().enumerate() {
        for (k, s) in found.first.iter().enumerate() {
            document["sequences"][r]["first"][k]["way"] = way_text(s, &names).into();
        }
    }
}

/// Prints the tables of sequences on stdout, but not with `--json`.
pub(crate) fn print_sequences(results: &Results, model: &Model, unit: &str, console: &Console) -> io::Result<()> {
    if console.json {
        return Ok(());
    }
    sequence_tables(results, model, unit).iter().try_for_each(|t| print(&table_text(t, console.width())))
}
