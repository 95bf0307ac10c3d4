//! [`crate::model::Model`] to [`crate::mesh::FacetMesh`] inside a proved tolerance.
//!
//! Each edge is sampled once in space and its points are shared by its faces, so closed shells stay closed. Inside a
//! face a tree of rectangles is cut across the direction that bends more, until each facet is proved to lie within
//! the local tolerance; between these cells and the border a constrained Delaunay triangulation is refined until it is
//! proved too, and pairs of triangles become quads. The tolerance follows curvature: tight where the surface
//! is sharply curved, loose where it is nearly flat.
//!
//! Guarantee: a facet with [`FacetQuality::certified`] and its piece of the spline lie within its tolerance of each other,
//! measured both ways; the argument stands in `bound.rs`. Facets that cannot be proved are counted, never hidden. The
//! result is the same bits for any number of threads.
//!
//! Known weakness: the angle condition ([`Settings::angle_deg`]) is checked at corners, not proved, and broken in acute corners between
//! trims (counted and named in [`Report::over_angle`]); a face whose edges lie farther from
//! its surface than the tolerance keeps that gap.

mod angles;
mod assemble;
mod border;
mod cells;
mod face;
mod fallback;
mod proof;
mod repairs;
mod report;
mod sample;
mod settings;
mod sheet;
mod strip;

use crate::mesh::FacetMesh;
use crate::model::Model;
pub use angles::SteepFace;
pub use repairs::{Repair, RepairedFace};
pub use report::{FaceCounts, Percentiles, Report, Sag, ShellCounts, ToleranceRange, sampled_sag};
pub use settings::{Judge, Law, Override, Place, Settings};

/// What [`tessellate`] makes.
#[derive(Clone, Debug, Default)]
pub struct Tessellation {
    /// The facets of all placed faces; the id of a facet's face is its index in [`Model::placed_faces`].
    pub mesh: FacetMesh,
    /// What came out, counted.
    pub report: Report,
    /// For each facet of the mesh: what it had to hold to, and whether it does.
    pub quality: Vec<FacetQuality>,
}

/// How a facet stands to its tolerance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FacetQuality {
    /// Tolerance at the facet's place, mm; 0 for faces that are meshes in the file.
    pub tolerance: f64,
    /// Upper bound of the distance to its piece of the spline where certified; otherwise a value above the tolerance.
    pub bound: f64,
    /// Whether the bound is proved to be within the tolerance.
    pub certified: bool,
}

/// Tessellates every placed face of a model. Faces of which nothing can be made are counted in the report.
///
/// ```
/// use lampyris::math::Frame;
/// use lampyris::model::{Analytic, Face, Model, Part, Shell};
/// use lampyris::{nurbs::sweep, tessellate};
/// use std::f64::consts::PI;
///
/// let frame = Frame::IDENTITY;
/// let face = Face {
///     name: "ball".into(),
///     entity: None,
///     colour: None,
///     surface: sweep::sphere(&frame, 10.0, [0.0, 2.0 * PI], [-PI / 2.0, PI / 2.0]),
///     analytic: Analytic::Sphere { frame, radius: 10.0 },
///     reversed: false,
///     loops: Vec::new(),
///     gap: 0.0,
/// };
/// let shell = Shell { faces: vec![face], closed: true, ..Shell::default() };
/// let model = Model::from_part(Part { shells: vec![shell], ..Part::default() });
/// let made = tessellate::tessellate(&model, &tessellate::Settings::uniform(0.1));
/// assert!(made.quality.iter().all(|q| q.certified));
/// assert_eq!(made.report.open_edges, 0);
/// ```
pub fn tessellate(model: &Model, settings: &Settings) -> Tessellation {
    let start = std::time::Instant::now();
    let parts = assemble::parts(model, settings);
    let (mut made, failed, repairs) = assemble::place(model, &parts);
    made.report.seconds.tessellate = start.elapsed().as_secs_f64();
    report::fill(&mut made, model, settings, failed, &repairs);
    made
}
