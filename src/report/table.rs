//! Tables for the report and as CSV.

use super::number::{error_figures, known_figures};
use crate::formats::csv_text;
use crate::text::{figures, grouped};

/// A table that can be sorted and copied; also written as CSV.
///
/// ```
/// use lampyris::report::Table;
///
/// let mut table = Table::new("sags", "Sags", &[("face", ""), ("sag", "mm")]);
/// table.row(["cap".into(), 0.25.into()]);
/// assert_eq!(table.to_csv(), "face,sag (mm)\ncap,0.25\n");
/// ```
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Stem of its CSV file.
    pub name: String,
    /// What it shows.
    pub title: String,
    /// How to read it; may be empty.
    pub caption: String,
    /// Its columns.
    pub columns: Vec<Column>,
    /// Its rows, as long as there are columns.
    pub rows: Vec<Vec<Cell>>,
}

/// A column of a table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Column {
    /// What it holds.
    pub title: String,
    /// Its unit, empty for pure numbers and text.
    pub unit: String,
}

/// One cell of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Cell {
    /// Nothing was measured, or it does not apply.
    #[default]
    Empty,
    /// Words.
    Text(String),
    /// A whole number.
    Count(u64),
    /// A measured number, shown with so many significant digits, copied and written in full.
    Number(f64, usize),
    /// A measured number and its standard error: shown to the error's second digit, with so many digits at most; copied and written in full
    /// as [`Self::Number`].
    Known(f64, f64, usize),
    /// A standard error, shown with two digits, copied and written in full.
    Error(f64),
}

impl Table {
    /// Makes a table without rows; columns are given as title and unit, `name` is the stem of its file.
    pub fn new(name: &str, title: &str, columns: &[(&str, &str)]) -> Self {
        let column = |&(title, unit): &(&str, &str)| Column { title: title.into(), unit: unit.into() };
        Self {
            name: name.into(),
            title: title.into(),
            columns: columns.iter().map(column).collect(),
            ..Self::default()
        }
    }

    /// Adds a row, cut or filled to the number of columns.
    pub fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        // Rows that do not fit would shift the cells of the report.
        let mut row: Vec<Cell> = cells.into_iter().take(self.columns.len()).collect();
        row.resize(self.columns.len(), Cell::Empty);
        self.rows.push(row);
    }

    /// Returns the table with this caption, in place of any it had.
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = caption.into();
        self
    }

    /// Writes the table as CSV (RFC 4180), units in the header, numbers in full, text such that no spreadsheet takes it for a formula.
    pub fn to_csv(&self) -> String {
        let header: Vec<String> = self.columns.iter().map(|c| csv_text(&c.heading())).collect();
        let mut text = header.join(",") + "\n";
        for row in &self.rows {
            let cells: Vec<String> = row.iter().map(|c| csv_text(&c.plain())).collect();
            text += &(cells.join(",") + "\n");
        }
        text
    }
}

impl Column {
    /// Returns title and unit on one line.
    pub(super) fn heading(&self) -> String {
        if self.unit.is_empty() { self.title.clone() } else { format!("{} ({})", self.title, self.unit) }
    }
}

impl Cell {
    /// Writes the cell for people; a dash for an empty one.
    pub fn shown(&self) -> String {
        match self {
            Self::Empty => "–".into(),
            Self::Text(t) => t.clone(),
            Self::Count(n) => grouped(*n),
            Self::Number(x, digits) => figures(*x, *digits),
            Self::Known(x, error, digits) => known_figures(*x, *error, *digits),
            Self::Error(error) => error_figures(*error),
        }
    }

    /// Writes the cell for programs: every digit, nothing between them; nothing for an empty one.
    pub fn plain(&self) -> String {
        match self {
            Self::Empty => String::new(),
            Self::Text(t) => t.clone(),
            Self::Count(n) => n.to_string(),
            // As Rust writes them: every digit, and none too many.
            Self::Number(x, _) | Self::Known(x, ..) | Self::Error(x) => x.to_string(),
        }
    }

    /// Returns a number and its error as cells, each with the digits that the error knows; without one, all `digits` and an empty cell.
    pub(super) fn with_error(value: f64, error: Option<f64>, digits: usize) -> [Self; 2] {
        match error {
            Some(error) => [Self::Known(value, error, digits), Self::Error(error)],
            None => [Self::Number(value, digits), Self::Empty],
        }
    }

    pub(super) fn is_numeric(&self) -> bool {
        matches!(self, Self::Count(_) | Self::Number(..) | Self::Known(..) | Self::Error(_))
    }

    /// Whether it has words enough for several lines, which a narrow window would press to one of a word each.
    pub(super) fn is_sentence(&self) -> bool {
        /// Characters of a name or a direction at most.
        const LONGEST_NAME: usize = 40;
        matches!(self, Self::Text(text) if text.chars().count() > LONGEST_NAME)
    }

    /// Whether it has so few words that they stand on one line, as a direction does.
    pub(super) fn is_brief(&self) -> bool {
        /// Characters of a direction at most.
        const LONGEST_DIRECTION: usize = 14;
        matches!(self, Self::Text(text) if text.chars().count() <= LONGEST_DIRECTION)
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.into())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<u64> for Cell {
    fn from(n: u64) -> Self {
        Self::Count(n)
    }
}

impl From<usize> for Cell {
    fn from(n: usize) -> Self {
        Self::Count(n as u64)
    }
}

/// A measured number, four digits shown.
impl From<f64> for Cell {
    fn from(x: f64) -> Self {
        Self::Number(x, 4)
    }
}

impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Empty, Into::into)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_quotes_and_keeps_every_digit() {
        let mut table = Table::new("t", "T", &[("name", ""), ("sag", "mm")]);
        table.row(["a, \"b\"".into(), Cell::from(1.0 / 3.0)]);
        table.row([Cell::Empty]);
        assert_eq!(table.to_csv(), "name,sag (mm)\n\"a, \"\"b\"\"\",0.3333333333333333\n,\n");
        assert_eq!(table.rows[0][1].shown(), "0.3333");
        let known = [Cell::Known(20_465.8, 1309.4, 6), Cell::Error(1309.4)];
        assert_eq!(known.each_ref().map(Cell::shown), ["20\u{202f}500", "1300"]);
        assert_eq!(known.each_ref().map(Cell::plain), ["20465.8", "1309.4"]);
    }
}
