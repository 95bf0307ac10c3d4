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

/// Returns a report's table for the terminal, at most `width` columns wide, its title above it; columns of numbers to the right.
pub(crate) fn table_text(table: &Table, width: usize) -> String {
    let mut grid = blank_table(width);
    let heading = |c: &crate::report::Column| {
        if c.unit.is_empty() { c.title.clone() } else { format!("{} [{}]", c.title, c.unit) }
    };
    let headings: Vec<String> = table.columns.iter().map(heading).collect();
    grid.set_header(&headings);
    for row in &table.rows {
        grid.add_row(row.iter().map(Cell::shown));
    }
    let least = least_widths(table, &headings, width);
    for ((k, column), least) in grid.column_iter_mut().enumerate().zip(least) {
        // A column with words is read from the left.
        let words = table.rows.iter().any(|r| matches!(r.get(k), Some(Cell::Text(_))));
        column.set_cell_alignment(if words { CellAlignment::Left } else { CellAlignment::Right });
        column.set_constraint(ColumnConstraint::LowerBoundary(Width::Fixed(least + PADDING)));
    }
    format!("  {}\n{grid}\n", table.title)
}

/// Columns of a terminal that a table's column has beside its text.
const PADDING: u16 = 2;

/// The least width of each column: no number is broken, whatever that takes, and where there is room no word of a heading.
fn least_widths(table: &Table, headings: &[String], width: usize) -> Vec<u16> {
    let of_numbers = |k: usize| {
        let cells = table.rows.iter().filter_map(|row| row.get(k));
        cells
            .filter(|cell| !matches!(cell, Cell::Text(_)))
            .map(|cell| cell.shown().chars().count())
            .max()
            .unwrap_or(0)
    };
    let numbers: Vec<usize> = (0..table.columns.len()).map(of_numbers).collect();
    let word = |heading: &String| heading.split_whitespace().map(|word| word.chars().count()).max().unwrap_or(0);
    let with_words: Vec<usize> = headings.iter().zip(&numbers).map(|(h, numbers)| word(h).max(*numbers)).collect();
    let room = width.saturating_sub(headings.len() * usize::from(PADDING + 1));
    let least = if with_words.iter().sum::<usize>() <= room { with_words } else { numbers };
    least.into_iter().map(|least| u16::try_from(least).unwrap_or(u16::MAX)).collect()
}

/// Returns the tables of a study's page as text, empty ones and its list of every measurement left out.
pub(crate) fn study_tables(report: &Report, width: usize) -> String {
    let blocks = report.sections.iter().flat_map(|s| &s.blocks);
    let tables = blocks.filter_map(|b| if let Block::Table(t) = b { Some(t) } else { None });
    let wanted = tables.filter(|t| !t.name.ends_with("-rows") && !t.rows.is_empty());
    wanted.map(|t| table_text(t, width) + "\n").collect()
}

/// Breaks a text into lines of at most `width` characters; a longer word has a line to itself. An empty text is one empty line.
pub(crate) fn wrapped_lines(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec![String::new()];
    // At spaces and line breaks alone: the narrow one within a number does not break it.
    for word in text.split([' ', '\n']).filter(|word| !word.is_empty()) {
        let line = lines.last_mut().map(|l| (l.chars().count(), l));
        match line {
            Some((0, line)) => line.push_str(word),
            Some((n, line)) if n + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
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

    #[test]
    fn a_sentence_does_not_break_within_a_number() {
        let text = format!("of  {} rays\nand more", crate::text::grouped(16_384));
        assert_eq!(wrapped_lines(&text, 7), ["of", crate::text::grouped(16_384).as_str(), "rays", "and", "more"]);
    }

    /// On whatever few columns a number stands in one line, and where there is room a word of a heading too.
    #[test]
    fn numbers_are_not_broken() {
        let columns = [("face", ""), ("absorbed share", "W"), ("from the facets", "W")];
        let mut table = Table::new("t", "Faces", &columns);
        let words = "a face of the cover that has a long name";
        table.row([words.into(), Cell::Number(200_000.0, 4), Cell::Number(-3.08e-5, 3)]);
        for (width, has_words) in [(100, true), (40, true), (24, false), (5, false)] {
            let text = table_text(&table, width);
            for number in [Cell::Number(200_000.0, 4).shown(), Cell::Number(-3.08e-5, 3).shown()] {
                assert!(text.contains(&number), "{width}: {text}");
            }
            assert_eq!(text.contains("absorbed") && text.contains("facets"), has_words, "{width}: {text}");
        }
    }

    #[test]
    fn the_list_of_every_measurement_is_left_out() {
        let document = serde_json::json!({"study": "complexity", "rows": [{"model": "simple", "method": "octree", "rays": 7}]});
        let text = study_tables(&crate::report::study_report(&document, Default::default()), 100);
        assert!(text.contains("Before and after") && !text.contains("Every measurement"), "{text}");
    }
}
