//! How answers are shown on the terminal and written to files.

pub(super) mod cells;
pub(super) mod files;
pub(super) mod look;
pub(super) mod tables;
