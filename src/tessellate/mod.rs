//! [`crate::model::Model`] to [`crate::mesh::FacetMesh`] inside a proved tolerance.
//!
//! Each edge is sampled once in space and its points are shared by its faces, so closed shells stay closed. Inside a
//! face a tree of rectangles is cut across the direction that bends more, until each facet is proved to lie within
//! the local tolerance; between these cells and the border a constrained Delaunay triangulation is refined until it is
//! proved too, and pairs of triangles become quads. The tolerance follows curvature: tight where the surface
//! is sharply curved, loose where it is nearly flat.
//!
//! Guarantee: a facet with [`FacetQuality::certified`] and its piece of the spline lie within its tolerance of each other,
//! measured both ways; the argument stands in `prover.rs`. Facets that cannot be proved are counted, never hidden. The
//! result is the same bits for any number of threads.
//!
//! Known weakness: the angle condition ([`Settings::angle_deg`]) is checked at corners, not proved, and broken in acute corners between
//! trims (counted and named in [`Report::over_angle`]); a face whose edges lie farther from
//! its surface than the tolerance keeps that gap.

mod angles;
mod assemble;
mod border;
mod border_nodes;
mod cells;
mod closing;
mod contact;
mod crossing_chords;
mod detours;
mod emission;
mod evaluation;
mod expected_cells;
mod extent;
mod face;
mod face_mesh;
mod face_surface;
mod fallback;
mod flooding;
mod foot_search;
mod grouped;
mod imprint;
mod limits;
mod lobes;
mod meetings;
mod nodes;
mod placed_part;
mod placement;
mod previous_round;
mod proof;
mod proof_steps;
mod remesh_budget;
mod repairs;
mod report;
mod sample;
mod sample_budget;
mod second_derivatives;
mod settings;
mod taken_chords;
mod tessellation;
mod transition;
mod triangle_frame;
mod triangulator;
mod turned_facets;

use crate::model::Model;
pub use angles::SteepFace;
pub use evaluation::sampled_sag;
pub use grouped::GroupedFacets;
use placed_part::PlacedPart;
pub use report::{
    FaceCounts, FailedFace, FailureCause, NotCertified, Percentiles, Repair, RepairedFace, Report, Sag,
    ShellCounts, ToleranceRange,
};
pub use settings::{Acceptance, LEAST_TOLERANCE_MM, Settings, ToleranceLaw, ToleranceOverride, ToleranceScope};
pub use tessellation::{FacetQuality, Tessellation};
pub use triangulator::is_panic_guarded;

/// Tessellates every placed face of a model, in the scene's coordinates. Never fails: faces of which nothing can be made, or that exceed a
/// limit, are left out and named in the report.
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
///     analytic: Analytic::Sphere { frame, radius: 10.0 },
///     ..Face::whole(sweep::sphere(&frame, 10.0, [0.0, 2.0 * PI], [-PI / 2.0, PI / 2.0]))
/// };
/// let shell = Shell { faces: vec![face], closed: true, ..Shell::default() };
/// let model = Model::from_part(Part { shells: vec![shell], ..Part::default() });
/// let made = tessellate::tessellate(&model, &tessellate::Settings::uniform(0.1));
/// assert!(made.quality.iter().all(|q| q.certified));
/// assert_eq!(made.report.open_edges, 0);
/// ```
pub fn tessellate(model: &Model, settings: &Settings) -> Tessellation {
    let start = std::time::Instant::now();
    let settings = &limits::within_size(model, settings);
    // Parts first, each once; then faces that touch, which need the placed model; then copies for all instances.
    let places = PlacedPart::all(model);
    let parts = assemble::mesh_parts(&places, settings);
    let joined = contact::mesh_contacts(model, &places, settings, &parts);
    let mut placed = placement::place_instances(model, &parts, &joined);
    placed.made.report.seconds.tessellate = start.elapsed().as_secs_f64();
    let mut made = evaluation::evaluate(placed, model, settings);
    limits::name_causes(&mut made.report, model, |part, k| parts[part].as_ref()?.causes.get(&k).copied());
    made
}
