//! Tables on the terminal: one style for all commands, numbers to the right.

use crate::report::{Block, Cell, Report, Table};
use comfy_table::{CellAlignment, ColumnConstraint, ContentArrangement, LineStyle, TableStyle, Width};

/// A line under the heading and nothing else, so that rows stay close together.
const STYLE: TableStyle = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));

/// Returns an empty table in the common style that wraps its cells at `width` columns.
pub(crate) fn blank_table(width: usize) -> comfy_table::Table {
    let mut table = comfy_table::Table::new();
    // Terminals count columns in 16 bits.
    let width = u16::try_from(width).unwrap_or(u16::MAX);
    table.load_style(STYLE).set_content_arrangement(ContentArrangement::Dynamic).set_width(width);
    table
}

/// Returns a report's table for the terminal, its title, if it has one, above it; columns of numbers to the right. A table of more columns
/// than `width` has room for becomes several, each behind the columns of words that name the rows. No number is broken.
pub(crate) fn table_text(table: &Table, width: usize) -> String {
    let columns: Vec<Column<'_>> = (0..table.columns.len()).map(|k| Column::new(table, k)).collect();
    let grids = divided(&columns, width).into_iter().map(|shown| grid_text(table, &shown, width));
    let title = if table.title.is_empty() { String::new() } else { format!("  {}\n", table.title) };
    title + &grids.collect::<Vec<_>>().join("\n")
}

/// Columns of a terminal that a table's column has beside its text.
const PADDING: usize = 3;
/// Longest word that is kept whole, as the name of a row: longer ones are paths.
const LONGEST_WORD: usize = 24;
/// Longest selector that is kept in one line, so that it can be copied.
const LONGEST_SELECTOR: usize = 60;

/// How a selector of faces begins.
const SELECTOR: &str = "on = {";

/// Returns what a cell shows, of several selectors each in a line of its own.
fn shown_text(cell: &Cell) -> String {
    let text = cell.shown();
    if text.contains(SELECTOR) { text.replace("} | on", "} |\non").replace("} and ", "}\nand ") } else { text }
}

/// Returns the width at which no word of a text is broken, and no selector, but for long ones.
fn unbroken_width(text: &str) -> usize {
    let longest = |line: &str| {
        if line.starts_with(SELECTOR) {
            return line.chars().count().min(LONGEST_SELECTOR);
        }
        line.split(' ').map(|word| word.chars().count()).max().unwrap_or(0).min(LONGEST_WORD)
    };
    text.lines().map(longest).max().unwrap_or(0)
}

/// A column of a table, and what it takes on a terminal.
struct Column<'t> {
    heading: String,
    cells: Vec<&'t Cell>,
    /// Whether it has words, and is read from the left.
    is_words: bool,
    /// Width at which no number is broken, and at which no word is either, but for long ones.
    least: usize,
    easy: usize,
}

impl<'t> Column<'t> {
    fn new(table: &'t Table, index: usize) -> Self {
        let crate::report::Column { title, unit } = &table.columns[index];
        let heading = if unit.is_empty() { title.clone() } else { format!("{title} [{unit}]") };
        let cells: Vec<&Cell> = table.rows.iter().filter_map(|row| row.get(index)).collect();
        let is_text = |cell: &&Cell| matches!(cell, Cell::Text(_));
        let numbers = cells.iter().filter(|cell| !is_text(cell)).map(|cell| cell.shown().chars().count());
        let least = numbers.max().unwrap_or(1);
        let of_texts = cells.iter().filter(|cell| is_text(cell)).map(|cell| unbroken_width(&shown_text(cell)));
        let longest = of_texts.fold(unbroken_width(&heading), usize::max);
        Self { is_words: cells.iter().any(is_text), heading, cells, least, easy: longest.max(least) }
    }
}

/// Divides columns into tables that fit `width`, each with the first columns of words, which name the rows. All in one where not even one
/// column has room beside these.
fn divided<'c>(columns: &'c [Column<'_>], width: usize) -> Vec<Vec<&'c Column<'c>>> {
    let takes = |columns: &[&Column<'_>]| columns.iter().map(|c| c.easy + PADDING).sum::<usize>();
    // A number between words, as a tolerance before the kind of normals, is part of a row's name.
    let is_words = |k: usize| columns.get(k).is_some_and(|column| column.is_words);
    let named = (0..columns.len()).take_while(|&k| is_words(k) || is_words(k + 1)).count();
    let names: Vec<&Column<'_>> = columns[..named].iter().collect();
    let all: Vec<&Column<'_>> = columns.iter().collect();
    let widest = columns[names.len()..].iter().map(|c| c.easy + PADDING).max().unwrap_or(0);
    if takes(&all) <= width || takes(&names) + widest > width {
        return vec![all];
    }
    let mut tables = vec![names.clone()];
    for column in &columns[names.len()..] {
        if let Some(last) = tables.last_mut().filter(|last| takes(last) + column.easy + PADDING <= width) {
            last.push(column);
        } else {
            tables.push([&names[..], &[column]].concat());
        }
    }
    tables
}

/// Returns some columns of a table as a table of their own.
fn grid_text(table: &Table, columns: &[&Column<'_>], width: usize) -> String {
    let mut grid = blank_table(width);
    grid.set_header(columns.iter().map(|c| &c.heading));
    for row in 0..table.rows.len() {
        grid.add_row(columns.iter().map(|c| c.cells.get(row).map_or_else(String::new, |cell| shown_text(cell))));
    }
    let is_easy = columns.iter().map(|c| c.easy + PADDING).sum::<usize>() <= width;
    for (shown, column) in grid.column_iter_mut().zip(columns) {
        shown.set_cell_alignment(if column.is_words { CellAlignment::Left } else { CellAlignment::Right });
        // Of the padding two columns are the table's own, around the text.
        let least = (if is_easy { column.easy } else { column.least }) + PADDING - 1;
        shown.set_constraint(ColumnConstraint::LowerBoundary(Width::Fixed(
            u16::try_from(least).unwrap_or(u16::MAX),
        )));
    }
    format!("{grid}\n")
}

/// Returns the tables of a study's report as text, empty ones and its list of every measurement left out.
pub(crate) fn study_tables(report: &Report, width: usize) -> String {
    let blocks = report.sections.iter().flat_map(|s| &s.blocks);
    let tables = blocks.filter_map(|b| if let Block::Table(t) = b { Some(t) } else { None });
    let wanted = tables.filter(|t| !t.name.ends_with("-rows") && !t.rows.is_empty());
    wanted.map(|t| table_text(t, width) + "\n").collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_right_and_words_left() {
        let mut table = Table::new("t", "Sags", &[("face", ""), ("sag", "mm")]);
        table.row(["a".into(), Cell::from(0.5)]);
        table.row(["long".into(), Cell::from(12.25)]);
        let lines: Vec<String> = table_text(&table, 80).lines().map(|l| l.trim_end().to_owned()).collect();
        assert_eq!(
            lines,
            ["  Sags", " face   sag [mm]", "─────────────────", " a           0.5", " long      12.25"]
        );
    }

    /// On whatever few columns a number stands in one line, and where there is room a word of a heading too.
    #[test]
    fn numbers_are_not_broken() {
        let columns = [("face", ""), ("absorbed share", "W"), ("from the facets", "W")];
        let mut table = Table::new("t", "Faces", &columns);
        let words = "a face of the cover that has a long name";
        table.row([words.into(), Cell::Number(200_000.0, 4), Cell::Number(-3.08e-5, 3)]);
        for (width, has_words) in [(100, true), (40, true), (24, true), (5, false)] {
            let text = table_text(&table, width);
            for number in [Cell::Number(200_000.0, 4).shown(), Cell::Number(-3.08e-5, 3).shown()] {
                assert!(text.contains(&number), "{width}: {text}");
            }
            assert_eq!(text.contains("absorbed") && text.contains("facets"), has_words, "{width}: {text}");
        }
    }

    /// A selector can be copied as it stands: in one line.
    #[test]
    fn selectors_are_not_broken() {
        let mut table = Table::new("t", "Rules", &[("selects", ""), ("gives", ""), ("which", "")]);
        let [one, two] = [7590, 7710].map(|id| format!("on = {{ instance = \"led_0\", entity = {id} }}"));
        table.row([
            "part = \"led\" and much that follows".into(),
            "surface absorber".into(),
            format!("{one} | {two} and 30 more").into(),
        ]);
        let text = table_text(&table, 80);
        assert!(text.contains(&one) && text.contains(&two), "{text}");
    }

    /// What has no room beside the others stands in a table below, behind the names of the rows.
    #[test]
    fn a_wide_table_is_divided() {
        let columns =
            [("receiver", ""), ("at", "mm"), ("normals", ""), ("power", "W"), ("error", "W"), ("share", "%")];
        let mut table = Table::new("t", "Faces", &columns);
        let [power, error, share] = [0.5, 0.25, 12.5].map(Cell::from);
        table.row(["screen".into(), Cell::from(0.2), "flat".into(), power, error, share]);
        let lines: Vec<String> = table_text(&table, 46).lines().map(|l| l.trim_end().to_owned()).collect();
        let headings: Vec<&String> = lines.iter().filter(|line| line.contains("receiver")).collect();
        assert!(headings[0].contains("power") && headings[1].contains("share"), "{lines:?}");
        assert!(headings.iter().all(|heading| heading.contains("at") && heading.contains("normals")), "{lines:?}");
        assert!(
            lines.last().unwrap().starts_with(" screen") && lines.last().unwrap().ends_with("12.5"),
            "{lines:?}"
        );
        assert!(lines.iter().all(|line| line.chars().count() <= 46), "{lines:?}");
    }

    #[test]
    fn the_list_of_every_measurement_is_left_out() {
        let document = serde_json::json!({"study": "complexity", "rows": [{"model": "simple", "method": "octree", "rays": 7}]});
        let text = study_tables(&crate::report::study_report(&document, Default::default()), 100);
        assert!(text.contains("Before and after") && !text.contains("Every measurement"), "{text}");
    }
}
