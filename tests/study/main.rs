//! The studies: the cross-check of intersectors, stability, accuracy and what a run is asked for.

mod accuracy;
mod asks;
mod axial;
mod check;
mod default_figures;
#[path = "../support/files.rs"]
mod files;
mod known_scenes;
mod models;
mod stability;
mod support;
