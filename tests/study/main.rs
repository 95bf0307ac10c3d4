//! The studies: the cross-check of intersectors, stability, accuracy and what a run is asked for.

mod accuracy;
#[cfg(feature = "truck")]
mod accuracy_claims;
mod asks;
#[cfg(feature = "truck")]
mod axial;
mod check;
#[cfg(feature = "truck")]
mod default_figures;
#[path = "../support/files.rs"]
mod files;
#[cfg(feature = "truck")]
mod known_scenes;
mod media_beside;
mod models;
mod stability;
mod support;
