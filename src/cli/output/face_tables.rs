//! What faces absorb and let through, as a table and in the document of the results.

use super::sequence_tables::face_names;
use crate::cli::console::{Console, print};
use crate::cli::output::terminal_tables::table_text;
use crate::model::Model;
use crate::report::{Cell, Section, Table, figures, grouped};
use crate::simulate::{FaceResult, Results};
use serde_json::Value;
use std::io;

/// Digits of powers in the table.
const DIGITS: usize = 6;

/// Digits of sums that stand in a sentence.
const SAID_DIGITS: usize = 4;

/// The name of a face; its number where the model has too many to be named.
fn name(names: &[String], face: &FaceResult) -> String {
    names.get(face.face as usize).cloned().unwrap_or_else(|| format!("face {}", face.face))
}

/// The table; `None` where it was not asked for.
fn face_table(results: &Results, model: &Model, unit: &str) -> Option<Table> {
    let found = results.faces.as_ref()?;
    let names = face_names(model);
    let columns = [
        ("face", ""),
        ("absorbed", unit),
        ("± (1σ)", unit),
        ("entered through it", unit),
        ("± (1σ)", unit),
        ("left through it", unit),
        ("± (1σ)", unit),
    ];
    let caption = format!(
        "{} faces were met by light; those that are not listed absorbed {} {unit} and let {} {unit} out. Light that passes a face several \
         times counts each time. Errors are those of the rays.",
        grouped(found.count as u64),
        figures(found.rest_absorbed, SAID_DIGITS),
        figures(found.rest_left, SAID_DIGITS)
    );
    let mut table = Table::new("faces", "Power by face", &columns).caption(caption);
    for face in &found.first {
        let power = |value: f64| Cell::Number(value, DIGITS);
        table.row([
            name(&names, face).into(),
            power(face.absorbed),
            face.absorbed_error.into(),
            power(face.entered),
            face.entered_error.into(),
            power(face.left),
            face.left_error.into(),
        ]);
    }
    Some(table)
}

/// The section of a page; `None` where the table was not asked for.
pub(crate) fn face_section(results: &Results, model: &Model, unit: &str) -> Option<Section> {
    Some(Section::new("Light by face").with_block(face_table(results, model, unit)?))
}

/// Puts what selects each face into the document of the results.
pub(crate) fn add_selectors(document: &mut Value, results: &Results, model: &Model) {
    let Some(found) = &results.faces else { return };
    let names = face_names(model);
    for (k, face) in found.first.iter().enumerate() {
        document["faces"]["first"][k]["selector"] = name(&names, face).into();
    }
}

/// Prints the table on the terminal.
pub(crate) fn print_faces(results: &Results, model: &Model, unit: &str, console: &Console) -> io::Result<()> {
    match face_table(results, model, unit) {
        Some(table) if !console.json => print(&table_text(&table, console.width())),
        _ => Ok(()),
    }
}
