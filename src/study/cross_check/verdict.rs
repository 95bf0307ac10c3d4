//! What a cross-check reports: causes, defects, counts and the rays that were answered differently.

use crate::intersect::Hit;
use crate::math::Ray;
use crate::study::Summary;
use serde::Serialize;

/// Why facets and spline answered a ray differently.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Cause {
    /// Both hits are the same crossing: between them the ray stays within the facets' sag of the spline.
    WithinSag,
    /// The ray enters the sag band of the spline and leaves it on the side it came from.
    Silhouette,
    /// Inside the band the ray passes the border of the face, where facets and trim curve differ by up to the sag.
    TrimEdge,
    /// Two faces, or two sheets of one, lie closer together than their sags, and the order of the hits is swapped.
    Coincident,
    /// The spline's hit is a touch within 1e-9 mm.
    Tangent,
    /// The facet has no proved sag, and the cross-check's own measure of it is more than the tolerance and explains the difference.
    Unproved,
    /// The face was not meshed, so the facets cannot answer.
    Unmeshed,
    /// The face is a ready mesh without a surface, so the spline cannot answer.
    NoSurface,
    /// None of these: a defect.
    Unexplained(Defect),
}

/// The defect where no cause explains a difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Defect {
    /// The hit lies farther from the spline than the facet's sag allows.
    OffTheSurface,
    /// The ray crosses the whole band, yet one of the two did not see the crossing.
    MissedCrossing,
    /// Same crossing, opposite normals.
    Orientation,
    /// The cross-check's own walk along the ray did not end.
    Inconclusive,
}

impl Defect {
    /// Returns the word used in sentences and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::OffTheSurface => "off the surface",
            Self::MissedCrossing => "missed crossing",
            Self::Orientation => "orientation",
            Self::Inconclusive => "inconclusive",
        }
    }
}

impl Cause {
    /// Returns the word used in tables, one for all defects.
    pub fn name(self) -> &'static str {
        match self {
            Self::WithinSag => "within sag",
            Self::Silhouette => "silhouette",
            Self::TrimEdge => "trim edge",
            Self::Coincident => "coincident",
            Self::Tangent => "tangent",
            Self::Unproved => "unproved facet",
            Self::Unmeshed => "unmeshed",
            Self::NoSurface => "no surface",
            Self::Unexplained(_) => "unexplained",
        }
    }
}

/// A ray that was answered differently, with all answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disagreement {
    /// Index in the ray source.
    pub index: u64,
    /// The ray.
    pub ray: Ray,
    /// The octree's answer.
    pub octree: Option<Hit>,
    /// The BVH's answer.
    pub bvh: Option<Hit>,
    /// The spline's answer.
    pub exact: Option<Hit>,
    /// Why facets and spline differ; `None` when only octree and BVH do.
    pub cause: Option<Cause>,
    /// Whether octree and BVH differ.
    pub facets_differ: bool,
}

/// What the cross-check found, as `check --json` gives it.
#[derive(Clone, Debug, Default, Serialize)]
pub struct CrossCheck {
    /// Rays checked.
    pub rays: u64,
    /// Rays with a hit on the facets.
    pub hits: u64,
    /// Size of the scene that was checked.
    pub scene: SceneSize,
    /// Octree against BVH.
    pub octree_vs_bvh: FacetsDiffer,
    /// Facets (the octree's answer) against the spline.
    pub facets_vs_exact: FacetsAgainstExact,
    /// Certainty of the spline's hits.
    pub exact: Certainties,
    /// Million rays a second on one thread; filled by [`super::measure`].
    pub mrays_per_s: PerIntersector,
    /// Seconds to build each structure.
    pub build_seconds: PerIntersector,
    /// Bytes of each structure per facet (per patch for the spline).
    pub bytes_per_facet: PerIntersector,
    /// The rays that were answered differently, the largest cause `within_sag` left out; at most
    /// [`super::Settings::keep`] of them.
    #[serde(skip)]
    pub disagreements: Vec<Disagreement>,
}

/// Size of the scene that was checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SceneSize {
    /// Facets.
    pub facets: usize,
    /// Spline patches.
    pub patches: usize,
}

/// Octree against BVH.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FacetsDiffer {
    /// Rays with different answers: each is a defect.
    pub disagree: u64,
    /// Rays that meet two facets at the same distance, of which either may be named.
    pub ties: u64,
}

/// Facets against spline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FacetsAgainstExact {
    /// One hits, the other misses.
    pub hit_miss: u64,
    /// Both hit, on different faces.
    pub other_face: u64,
    /// Difference of the distances of hits that are the same crossing, mm.
    pub t_error_mm: Summary,
    /// Angle between the facets' normal and the spline's at hits that are the same crossing, degrees.
    pub normal_error_deg: Summary,
    /// Differences with a named cause.
    pub explained: Explained,
    /// Differences without: each is a defect.
    pub unexplained: u64,
}

/// Counts of the named causes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Explained {
    /// [`Cause::WithinSag`].
    pub within_sag: u64,
    /// [`Cause::Silhouette`].
    pub silhouette: u64,
    /// [`Cause::TrimEdge`].
    pub trim_edge: u64,
    /// [`Cause::Coincident`].
    pub coincident: u64,
    /// [`Cause::Tangent`].
    pub tangent: u64,
    /// [`Cause::Unproved`].
    pub unproved: u64,
    /// [`Cause::Unmeshed`].
    pub unmeshed: u64,
    /// [`Cause::NoSurface`].
    pub no_surface: u64,
}

/// Certainty of the spline's hits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Certainties {
    /// Proved first hits.
    pub certified: u64,
    /// Touches.
    pub tangent: u64,
    /// Hits not proved to be the first.
    pub uncertified: u64,
}

/// One figure for each intersector; `None` where it was not run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PerIntersector {
    /// The octree, all rays in one batch.
    pub octree: Option<f64>,
    /// The octree, ray by ray.
    pub octree_single: Option<f64>,
    /// obvhs' binary BVH.
    pub bvh2: Option<f64>,
    /// obvhs' 8-wide compressed BVH with the cures for correctness.
    pub cwbvh: Option<f64>,
    /// The same as its library ships it.
    pub cwbvh_as_shipped: Option<f64>,
    /// The octree with hits moved to the spline.
    pub polish: Option<f64>,
    /// The certified spline.
    pub exact: Option<f64>,
}
