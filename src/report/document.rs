//! A result for people as plain data: title, answer, sections of text, pictures and tables.

use super::{Chart, Provenance, Table, View};
use std::collections::HashSet;

/// A result for people.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Title of the report.
    pub title: String,
    /// The answer in one paragraph; `**words**` are emphasised.
    pub answer: String,
    /// The parts, pictures first.
    pub sections: Vec<Section>,
    /// Where the numbers come from.
    pub provenance: Provenance,
}

impl Report {
    /// Gives pictures, and tables, that would share a name a name each: the second `facets` is `facets-2`. Receivers are called by their
    /// users, as the report's own pictures may be.
    pub(super) fn with_distinct_names(mut self) -> Self {
        let (mut pictures, mut tables) = (HashSet::new(), HashSet::new());
        // The report's own views first: what links and users know by name stays, and a receiver's map makes way.
        for block in self.sections.iter().flat_map(|section| &section.blocks) {
            if let Block::View(view) = block {
                pictures.insert(view.name.clone());
            }
        }
        for block in self.sections.iter_mut().flat_map(|section| &mut section.blocks) {
            match block {
                Block::Chart(chart) => make_distinct(&mut chart.name, &mut pictures),
                Block::Table(table) => make_distinct(&mut table.name, &mut tables),
                Block::View(_) | Block::Text(_) => {}
            }
        }
        self
    }
}

/// Numbers a name that is among the `taken` ones, from 2 on, and adds it to them.
fn make_distinct(name: &mut String, taken: &mut HashSet<String>) {
    let given = name.clone();
    let mut number = 2;
    while !taken.insert(name.clone()) {
        *name = format!("{given}-{number}");
        number += 1;
    }
}

/// A part of a report.
#[derive(Clone, Debug, Default)]
pub struct Section {
    /// Its heading.
    pub title: String,
    /// What it holds, in order; neighbouring pictures share a row where the window is wide.
    pub blocks: Vec<Block>,
}

/// One thing in a section.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Block {
    /// A paragraph; `**words**` are emphasised.
    Text(String),
    /// A chart.
    Chart(Box<Chart>),
    /// A 3-D view.
    View(Box<View>),
    /// A table.
    Table(Table),
}

impl Section {
    /// Makes a section without content.
    pub fn new(title: &str) -> Self {
        Self { title: title.into(), blocks: Vec::new() }
    }

    /// Returns the section with one more block at its end.
    pub fn with_block(mut self, block: impl Into<Block>) -> Self {
        self.blocks.push(block.into());
        self
    }
}

impl From<Chart> for Block {
    fn from(chart: Chart) -> Self {
        Self::Chart(Box::new(chart))
    }
}

impl From<View> for Block {
    fn from(view: View) -> Self {
        Self::View(Box::new(view))
    }
}

impl From<Table> for Block {
    fn from(table: Table) -> Self {
        Self::Table(table)
    }
}

impl From<&str> for Block {
    fn from(text: &str) -> Self {
        Self::Text(text.into())
    }
}

impl From<String> for Block {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::AxisStyle;

    #[test]
    fn pictures_of_one_name_get_names_of_their_own() {
        let axes = || [AxisStyle::linear("x", ""), AxisStyle::linear("y", "")];
        let chart = |name: &str| Chart::series(name, "", "", axes(), Vec::new());
        let words = String::new;
        let view = View { name: "facets".into(), title: words(), caption: words(), shapes: Vec::new() };
        let section = Section::new("").with_block(chart("facets")).with_block(view).with_block(chart("facets"));
        let section = section.with_block(Table::new("facets", "", &[]));
        let report = Report { sections: vec![section], ..Report::default() }.with_distinct_names();
        let names: Vec<&str> = (report.sections[0].blocks.iter())
            .map(|block| match block {
                Block::Chart(chart) => chart.name.as_str(),
                Block::View(view) => &view.name,
                Block::Table(table) => &table.name,
                Block::Text(text) => text,
            })
            .collect();
        assert_eq!(names, ["facets-2", "facets", "facets-3", "facets"]);
    }
}
