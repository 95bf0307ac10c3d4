//! An assessment on the terminal.

use super::sentences::sentence_lines;
use super::terminal_tables::table_text;
use crate::regulation::Assessment;
use crate::report::{Table, judged_note, traffic_sentence, verdict_cells, verdict_counts};

/// Columns of the table, with their units.
const COLUMNS: [(&str, &str); 9] = [
    ("", ""),
    ("verdict", ""),
    ("limit", "cd"),
    ("reading", "cd"),
    ("± rays", ""),
    ("± facets", ""),
    ("± cells", ""),
    ("direction", ""),
    ("settled by", ""),
];

/// Describes an assessment in lines of at most `width` columns and a table: aim, photometer, every row, what is remarked on rows, and the
/// whole. `bold` emphasizes where the text is shown.
pub(crate) fn summary(a: &Assessment, width: usize, bold: impl Fn(&str) -> String) -> String {
    let mut text = format!("{}  {}\n", bold(&a.regulation.id), a.regulation.function.name);
    let sensor = format!("{:.3}° from side to side", a.sensor_deg);
    let tables = a.regulation.checked();
    let labels =
        [("aim", a.aim.how.as_str()), ("traffic", traffic_sentence(a)), ("sensor", &sensor), ("tables", &tables)];
    for (label, sentence) in labels.iter().filter(|(_, sentence)| !sentence.trim().is_empty()) {
        text += &sentence_lines(&format!("  {label:<8}"), LABEL_COLUMNS, sentence, width);
    }
    let mut table = Table::new("verdict", "", &COLUMNS);
    for row in &a.rows {
        table.row(verdict_cells(row));
    }
    let counts = verdict_counts(a);
    let unjudged = a.rows.len() - counts.iter().sum::<usize>();
    text += &table_text(&table, width);
    for (note, rows) in notes(a) {
        text += &sentence_lines("  ", 4, &format!("{}: {note}", rows.join(", ")), width);
    }
    text += &format!("  {} pass, {} fail, {} unsure", counts[0], counts[1], counts[2]);
    text += &if unjudged > 0 { format!(", {unjudged} not judged (notes and conditions)") } else { String::new() };
    text + &format!("; the whole: {}\n", bold(&a.verdict.to_string()))
}

/// Columns of the labels above the table, with the blanks around them.
const LABEL_COLUMNS: usize = 10;

/// Returns what is remarked on rows that were judged, in the order of the table, each with the rows that it is remarked on.
fn notes(a: &Assessment) -> Vec<(&str, Vec<&str>)> {
    let mut notes: Vec<(&str, Vec<&str>)> = Vec::new();
    for (row, note) in a.rows.iter().filter_map(|row| Some((row, judged_note(row)?))) {
        match notes.iter_mut().find(|(known, _)| *known == note) {
            Some((_, rows)) => rows.push(&row.row.id),
            None => notes.push((note, vec![&row.row.id])),
        }
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regulation::{Aim, Regulation, RowVerdict, Traffic, Verdict};
    use crate::report::Cell;

    /// The tables of a brake light remark one thing on two of its groups; neither is in need of being settled.
    #[test]
    fn what_tables_remark_stands_below_and_settles_nothing() {
        let mut regulation = Regulation::find("FMVSS 108 stop").unwrap();
        let rows: Vec<RowVerdict> = regulation.function.rows.drain(..).map(passed).collect();
        let aim = Aim::default();
        let (traffic, verdict) = (Traffic::Right, Verdict::Pass);
        let a = Assessment { regulation, traffic, aim, sensor_deg: 0.1, rows, verdict };
        let notes = notes(&a);
        assert!(
            notes.iter().any(|(note, rows)| note.starts_with("as printed") && rows[..] == ["Group 1", "Group 5"]),
            "{notes:?}"
        );
        assert!(a.rows.iter().all(|row| verdict_cells(row)[8] == Cell::Text(String::new())));
    }

    fn passed(row: crate::regulation::Row) -> RowVerdict {
        RowVerdict { row, reading: None, direction: None, verdict: Some(Verdict::Pass), settles: None, unseen: 0 }
    }
}
