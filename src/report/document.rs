//! A result for people as plain data: title, answer, sections of text, pictures and tables.

use super::{Chart, Provenance, Table, View};

/// A result for people.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Title of the page.
    pub title: String,
    /// The answer in one paragraph; `**words**` are emphasised.
    pub answer: String,
    /// The parts, pictures first.
    pub sections: Vec<Section>,
    /// Where the numbers come from.
    pub provenance: Provenance,
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
