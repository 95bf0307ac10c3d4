//! What faces absorb and let through, as a table and in the document of the results.

use super::sequence_tables::face_names;
use crate::cli::console::{Console, print};
use crate::cli::output::terminal_tables::table_text;
use crate::model::Model;
use crate::pipeline::{PreparedScene, SceneResults};
use crate::report::{Cell, Section, Table};
use crate::simulate::{FaceResult, Results};
use crate::text::{count_of, figures};
use serde_json::Value;
use std::io;

/// Digits of powers in the table.
const DIGITS: usize = 6;

/// Digits of sums that stand in a sentence.
const SAID_DIGITS: usize = 4;

/// Returns the name of a face; its number where the model has too many to be named.
fn name(names: &[String], face: &FaceResult) -> String {
    names.get(face.face as usize).cloned().unwrap_or_else(|| format!("face {}", face.face))
}

/// Returns the table of the faces that took or let through most light, with both errors; `None` where the run did not count them.
fn face_table(run: &SceneResults, prepared: &PreparedScene) -> Option<Table> {
    let (model, unit) = (&prepared.job.loaded.model, prepared.power_unit());
    let found = run.results.faces.as_ref()?;
    let names = face_names(model);
    let columns = [
        ("face", ""),
        ("absorbed", unit),
        ("± rays", unit),
        ("± facets", unit),
        ("entered through it", unit),
        ("± rays", unit),
        ("± facets", unit),
        ("left through it", unit),
        ("± rays", unit),
        ("± facets", unit),
    ];
    let caption = format!(
        "Light met {}; those that are not listed absorbed {} {unit} and let {} {unit} out. Light that passes a face several \
         times counts each time. Errors (1σ) are those of the rays and, where facets were compared with the spline on the face, of the facets; \
         lost light is part of the latter.",
        count_of(found.count as u64, "face"),
        figures(found.rest_absorbed, SAID_DIGITS),
        figures(found.rest_left, SAID_DIGITS)
    );
    let mut table = Table::new("faces", "Power by face", &columns).caption(caption);
    for (face, geometric) in found.first.iter().zip(run.geometric_face_errors(prepared)) {
        let cells = |power: f64, of_rays: f64, k: usize| {
            let of_facets = geometric.map(|errors| errors[k]);
            let error = of_rays.hypot(of_facets.unwrap_or(0.0));
            [Cell::Known(power, error, DIGITS), Cell::Error(of_rays), of_facets.map_or(Cell::Empty, Cell::Error)]
        };
        let absorbed = cells(face.absorbed, face.absorbed_error, 0);
        let entered = cells(face.entered, face.entered_error, 1);
        let left = cells(face.left, face.left_error, 2);
        table.row([Cell::from(name(&names, face))].into_iter().chain(absorbed).chain(entered).chain(left));
    }
    Some(table)
}

/// Returns the report's section on light by face; `None` where the run did not count it.
pub(crate) fn face_section(run: &SceneResults, prepared: &PreparedScene) -> Option<Section> {
    Some(Section::new("Light by face").with_block(face_table(run, prepared)?))
}

/// Puts into the document of the results, beside each face that it lists, what selects that face; its number where the model has too many
/// to be named.
pub(crate) fn add_selectors(document: &mut Value, results: &Results, model: &Model) {
    let Some(found) = &results.faces else { return };
    let names = face_names(model);
    for (k, face) in found.first.iter().enumerate() {
        document["faces"]["first"][k]["selector"] = name(&names, face).into();
    }
}

/// Prints the table on the terminal.
pub(crate) fn print_faces(run: &SceneResults, prepared: &PreparedScene, console: &Console) -> io::Result<()> {
    match face_table(run, prepared) {
        Some(table) if !console.json => print(&table_text(&table, console.width())),
        _ => Ok(()),
    }
}
