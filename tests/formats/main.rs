//! Files and pages that are written, opened by readers that others wrote.

mod damaged;
mod facets;
#[path = "../support/files.rs"]
mod files;
mod grids;
#[path = "../support/random.rs"]
mod random;
mod ray_sets;
#[cfg(feature = "report")]
mod report_page;
mod unreached;
