//! One self-contained HTML file for any result: an answer on top, pictures first, tables that sort and copy, 3-D views that turn.
//!
//! A [`Report`] is plain data: sections of text, charts, 3-D views and tables. [`Report::write`] turns it into `report.html`
//! (plotly.js embedded once, nothing loaded from elsewhere), a static PNG of every picture under `figures/`, for charts with an SVG beside
//! it, and a CSV of every table under `tables/`. In `report.html` every chart carries its static twin, so that it shows without
//! scripts or WebGL.
//!
//! Guarantee: `report.html` stays under 15 MB; the caption of a simplified picture says so. Known weakness: the 3-D views need
//! WebGL to turn; without it their static picture remains.

mod canvas;
mod chart;
mod chart_png;
mod colour_picture;
mod contour;
mod cross_check;
mod document;
mod drawing;
mod error_tables;
mod errors;
mod even_poles;
mod framing;
mod geometric_cause;
mod half_width;
mod html;
mod lamp_figures;
mod legend;
mod map_labels;
mod maps;
mod number;
mod peak_lines;
mod plotly;
mod plotly_axis;
mod plotly_data;
mod plotly_polar;
mod polar;
mod provenance;
mod raster;
mod receiver_blocks;
mod road;
mod simulation;
mod static_axes;
mod static_chart;
mod static_map;
mod studies;
mod table;
mod verdicts;
mod view;
mod view_triangles;
mod write;

pub use crate::formats::file_stem;
pub use chart::{AxisStyle, Chart, Content, MapPoint, Marks, Series, SeriesStyle};
pub use colour_picture::colour_picture;
pub use contour::Isoline;
pub use cross_check::{CheckReport, unexplained, verdict};
pub use document::{Block, Report, Section};
#[cfg(feature = "cli")]
pub(crate) use even_poles::with_even_poles;
#[cfg(feature = "cli")]
pub(crate) use maps::on_receiver;
pub use maps::{photometric_grid, receiver_grid};
pub use number::{bytes, seconds, tolerance_text};
pub use provenance::Provenance;
pub use simulation::{SimulationReport, path_lines};
pub use studies::study_report;
pub use table::{Cell, Column, Table};
pub use verdicts::{judged_note, traffic_sentence, verdict_cells, verdict_counts, verdict_sentence};
pub use view::{Shape, View};
