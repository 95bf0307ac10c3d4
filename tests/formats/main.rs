//! Files and pages that are written, opened by readers that others wrote.

mod facets;
mod grids;
mod ray_sets;
#[cfg(feature = "report")]
mod report_page;
