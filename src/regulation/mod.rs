//! Verdicts of lamp regulations. Each row of a table is measured on a far field, with the regulation's sensor and, where it scans for a
//! cut-off, its aim, and is judged with both errors of the simulation.
//!
//! A verdict is *pass* or *fail* only where the value is farther from its limit than three combined standard errors (statistical and
//! geometric, added in quadrature), or as far as few rays or few replicates leave open at the same confidence; else it is *unsure*, and
//! [`Settles`] says what would settle it. Rows that ask for every direction of a line or zone, or for the brightest of many, are many
//! comparisons: what a single lucky one of them could decide is asked for at a confidence that is divided by their number, so that a wrong
//! pass or fail stays below 0.3 % a row.
//!
//! The tables (`tables/*.json`) hold one row per requirement with its source and whether a second source was compared. A verdict repeats
//! that: it is an engineer's answer about a simulated lamp, not a statement of conformity.
//!
//! The order of the modules, each of which uses only those before it, is in `tests/architecture/layers.rs`.

mod aim;
mod assessment;
mod cell_axis;
mod document;
mod edge;
mod error;
mod few_rays;
mod judgement;
mod map;
mod names;
mod open_aims;
mod opening;
mod photometer;
mod read;
mod requirement;
mod row;
mod row_verdict;
mod spots;
mod table;
#[cfg(test)]
mod test_lamps;
mod verdict;
mod zone;

pub use aim::Aim;
pub use assessment::{Assessment, Assumptions, RowVerdict};
pub use error::{Error, ErrorKind};
pub use few_rays::RaySample;
pub use judgement::{Settles, Verdict};
pub use map::{IntensityMap, Reading};
pub(crate) use names::plain;
pub(crate) use read::even_edges;
pub use row::{Bound, Row, RowKind};
pub use table::{Function, Regulation, Traffic};
pub use verdict::assess;
