//! An assessment on the terminal.

use super::terminal_tables::blank_table;
use crate::cli::console::Console;
use crate::regulation::{Assessment, RowVerdict};
use crate::report::{direction_text, figures, requirement_text, settling_text, traffic_sentence, verdict_counts};
use comfy_table::CellAlignment;

/// Significant digits of intensities: more than any photometer has.
const DIGITS: usize = 5;

/// Describes an assessment in lines and a table: aim, photometer, every row and the whole.
pub(crate) fn summary(a: &Assessment, console: &Console) -> String {
    let mut text = format!("{}  {}\n", console.bold(&a.regulation.id), a.regulation.function.name);
    text += &format!("  aim     {}\n", a.aim.how);
    if !traffic_sentence(a).is_empty() {
        text += &format!("  traffic {}\n", traffic_sentence(a).trim_end());
    }
    text += &format!("  sensor  {:.3}° from side to side\n", a.sensor_deg);
    text += &format!("  tables  {}\n", a.regulation.checked());
    let mut table = blank_table(console.width());
    table.set_header(["", "direction", "asked [cd]", "read [cd]", "± stat.", "± geom.", "verdict", "settled by"]);
    for row in &a.rows {
        table.add_row(row_cells(row));
    }
    for column in 2..=5 {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let counts = verdict_counts(a);
    let unjudged = a.rows.len() - counts.iter().sum::<usize>();
    text += &format!("{table}\n  {} pass, {} fail, {} unsure", counts[0], counts[1], counts[2]);
    text += &if unjudged > 0 { format!(", {unjudged} not judged (notes and conditions)") } else { String::new() };
    text + &format!("; the whole: {}\n", console.bold(&a.verdict.to_string()))
}

/// Returns the eight cells of a row of the table; a dash where nothing was read.
fn row_cells(row: &RowVerdict) -> [String; 8] {
    let read = |value: fn(crate::regulation::Reading) -> f64| {
        row.reading.map_or("–".to_owned(), |r| figures(value(r), DIGITS))
    };
    [
        row.row.id.clone(),
        row.direction.map_or(String::new(), direction_text),
        requirement_text(row),
        read(|r| r.value),
        read(|r| r.statistical),
        read(|r| r.geometric),
        row.verdict.map_or("not judged".to_owned(), |v| v.to_string()),
        settling_text(row),
    ]
}
