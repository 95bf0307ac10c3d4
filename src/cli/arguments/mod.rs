//! What is asked on the command line.

pub(super) mod args;
pub(super) mod options;
pub(super) mod suggest;
mod words;
