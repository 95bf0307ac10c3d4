//! STEP files to [`Model`](crate::model::Model)s: Part 21 text, units, assemblies, trimmed surfaces, and an account of every face.
//!
//! Sources: ISO 10303-21:2016 (text), ISO 10303-42 (geometry and topology), ISO 10303-43/44 (representations and
//! assemblies). The way of a file: text becomes records (`part21`); records become curves and surfaces (`geometry`), a surface with the
//! parameters of ISO 10303-42 (`chart`); loops are located in these, by closed forms or by Newton steps with a search behind them,
//! and the rectangle that they bound becomes one rational B-spline (`trim`); faces make parts, and parts stand in an assembly
//! (`product`). Of `part21`, `chart`, `geometry`, `trim` and `product` each sees only those before it.
//!
//! Guarantee: what [`crate::model`] promises, with uv curves within [`Settings::uv_tolerance`] of the foot points of
//! their edges wherever they were checked; each face is converted, repaired (with how) or refused (with why). Known
//! weakness: curves that the file gives in a parameter plane are used only where the one in space is missing, other
//! edges are always located anew; mirrored placements are kept as they are.
//!
//! ```no_run
//! use lampyris::step::{Settings, read};
//! let import = read(std::path::Path::new("lens.stp"), &Settings::default())?;
//! println!("{} faces, {} refused", import.report.faces.converted, import.report.faces.refused);
//! # Ok::<(), lampyris::step::Error>(())
//! ```

// Negated comparisons refuse NaN together with what is out of range.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

mod chart;
mod error;
mod geometry;
mod import;
mod part21;
mod product;
mod report;
mod settings;
mod stored;
mod trim;

pub use error::{Error, ErrorKind};
#[cfg(feature = "cli")]
pub(crate) use import::peak_bytes;
pub(crate) use import::read_file;
pub use import::{Import, read, read_bytes};
pub use report::{FaceCounts, ImportReport, Note, PlacedCounts, Seconds, SurfaceCounts, UnitNames};
pub use settings::Settings;
pub(crate) use stored::StepText;
