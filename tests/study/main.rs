//! The studies: the cross-check of intersectors, stability, accuracy and what a run is asked for.

mod accuracy;
mod asks;
mod check;
#[path = "../support/files.rs"]
mod files;
mod models;
mod stability;
mod support;
