//! The exact spline intersector: closed forms, pure clipping and closed shells judge it.

mod audit;
mod closed_forms;
mod edges;
#[path = "../support/files.rs"]
mod files;
mod grazing;
mod models;
mod polish;
mod support;
