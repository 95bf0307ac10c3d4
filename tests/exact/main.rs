//! The exact spline intersector: closed forms, pure clipping and closed shells judge it.

mod audit;
mod borders;
mod certificates;
mod closed_forms;
mod drift;
mod edges;
#[path = "../support/files.rs"]
mod files;
mod gaps;
mod grazing;
mod hostile;
mod models;
mod own_points;
mod paths;
mod polish;
mod polished_starts;
#[path = "../support/random.rs"]
mod random;
mod referee;
mod scaled;
mod support;
mod thin_rings;
