//! The arguments of the command line.

pub(super) mod command;
mod help_text;
pub(super) mod options;
