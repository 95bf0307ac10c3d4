//! What came out, in the words of `facet --json`.

use super::angles::SteepFace;
use serde::Serialize;

/// The geometry part of `facet --json`.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// Facets of the mesh.
    pub facets: usize,
    /// Those with four corners.
    pub quads: usize,
    /// Those with three.
    pub triangles: usize,
    /// Distinct positions.
    pub vertices: usize,
    /// The requested tolerance.
    pub tolerance_mm: ToleranceRange,
    /// The sag that was reached.
    pub sag_mm: Sag,
    /// Facets whose sampled sag exceeds their local tolerance; `None` when not measured.
    pub over_tolerance: Option<usize>,
    /// Facets that were not sampled, of models with so many that it would take too long: facets without proof are sampled first.
    #[serde(skip_serializing_if = "is_zero")]
    pub unsampled: usize,
    /// Indices and sampled sags of those over their tolerance, mm; not part of the JSON.
    #[serde(skip)]
    pub over: Vec<(u32, f64)>,
    /// Bilinear normal against the spline's; `None` when not measured.
    pub normal_error_deg: Option<Percentiles>,
    /// Facets proved to be within their local tolerance.
    pub certified: usize,
    /// Faces with facets that are not, and how many of each: indices of placed faces.
    pub not_certified: Vec<NotCertified>,
    /// Faces of which something was given up, and what was reached there.
    pub repaired: Vec<RepairedFace>,
    /// Faces with facets that turn farther from the surface normals than requested; `None` when no angle was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over_angle: Option<Vec<SteepFace>>,
    /// Share of the area that is in facets with four corners.
    pub quad_area_share: f64,
    /// Area of the facets as traced.
    pub area_mm2: f64,
    /// Enclosed volume; `None` unless every shell is closed.
    pub volume_mm3: Option<f64>,
    /// How many of the placed shells that the file calls closed are, and how many it calls open.
    pub shells: ShellCounts,
    /// Edges with one facet, in shells that the file calls closed.
    pub open_edges: usize,
    /// Edges with more than two facets that do not pair off, or two that disagree which side is outside, in those shells.
    pub nonmanifold_edges: usize,
    /// Edges along which those shells touch themselves, with two facets or more each way, all of different faces: they are closed there.
    #[serde(skip_serializing_if = "is_zero")]
    pub touching_edges: usize,
    /// Placed faces.
    pub faces: FaceCounts,
    /// Faces that could not be meshed and have no facets.
    pub failed: Vec<FailedFace>,
    /// Times.
    pub seconds: Seconds,
    /// Peak memory of the process, bytes; filled in by the caller.
    pub peak_bytes: Option<u64>,
}

impl Report {
    /// Returns how many faces have no facets though they have an area: light passes where they are.
    pub fn missing_faces(&self) -> usize {
        self.failed.iter().filter(|f| f.cause != FailureCause::NoArea).count()
    }
}

/// Whether there is nothing to report.
fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// Least and largest tolerance asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ToleranceRange {
    /// mm.
    pub min: f64,
    /// mm.
    pub max: f64,
}

/// Distances between facets and spline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Sag {
    /// Largest proved bound of the certified facets, mm.
    pub bound_max: f64,
    /// Largest sampled distance, mm; `None` when not measured.
    pub sampled_max: Option<f64>,
    /// Mean sampled distance weighted by area, mm; `None` when not measured.
    pub sampled_mean: Option<f64>,
}

/// A distribution in three numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Percentiles {
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Largest.
    pub max: f64,
}

/// A face that has facets without proof.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct NotCertified {
    /// Index of the placed face.
    pub face: u32,
    /// The `#id` in the file.
    pub entity: Option<u64>,
    /// How many of its facets.
    pub facets: usize,
    /// How far the file itself has the face's edges from it, mm: beside a gap wider than the tolerance no facet can be proved.
    pub gap_mm: f64,
}

/// Placed shells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ShellCounts {
    /// Closed and consistently oriented.
    pub closed: usize,
    /// Not so, though the file calls them closed.
    pub open: usize,
    /// Those that the file calls open: they bound no volume, and are not examined.
    pub sheets: usize,
}

/// Placed faces by outcome.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FaceCounts {
    /// With facets.
    pub meshed: usize,
    /// Without.
    pub failed: usize,
    /// Of those meshed: with something given up; see [`Report::repaired`].
    pub repaired: usize,
}

/// A face without facets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FailedFace {
    /// Index of the placed face.
    pub face: u32,
    /// The `#id` in the file.
    pub entity: Option<u64>,
    /// Why.
    pub cause: FailureCause,
}

/// Why a face has no facets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum FailureCause {
    /// Nothing can be made of its border and its surface.
    #[default]
    NothingToMesh,
    /// At its tolerance it needs at least so many facets, with which the model would have more than
    /// [`super::Settings::most_cells`].
    TooManyFacets(f64),
    /// Its surface is so wild that the proofs of its facets took more steps than any face may take.
    TooManySteps,
    /// All of its surface is one point or one line, to the rounding of its coordinates: nothing is missing.
    NoArea,
}

impl std::fmt::Display for FailureCause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NothingToMesh => f.write_str("nothing can be made of its border and its surface"),
            Self::TooManyFacets(count) => write!(
                f,
                "it needs more than {count:.0e} facets, with which the model would have more than it may: ask for a larger tolerance, or check the file's unit"
            ),
            Self::TooManySteps => f.write_str("its surface is too wild to be proved: ask for a larger tolerance"),
            Self::NoArea => f.write_str("it has no area: all of it is one point or one line"),
        }
    }
}

/// Times in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Seconds {
    /// Reading the file; filled in by its reader.
    pub read: f64,
    /// Tessellating.
    pub tessellate: f64,
}

/// Requirement that was given up on a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Repair {
    /// Its budget of facets ended: what was left has coarser cells or triangles.
    CoarserCells,
    /// Its border crosses itself in the parameter plane: it has corners there, or parts of it are not kept, and facets may cover the wrong
    /// side. Its facets are certified only if they cover as much as the border bounds, and nothing is left out farther than its tolerance.
    CrossingBorder,
    /// Its facets cover more or less of its parameter plane than its border bounds: none of them is certified.
    AreaOff,
    /// Its parameter plane gave nothing, or its border crosses itself there: only the border was triangulated.
    BorderOnly,
    /// The triangulation library gave up on it: only its border was triangulated.
    TriangulationFailed,
}

/// A face of which something was given up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RepairedFace {
    /// Index of the placed face.
    pub face: u32,
    /// The `#id` in the file.
    pub entity: Option<u64>,
    /// The requirement given up.
    pub how: Repair,
    /// The largest distance to its spline: proved for certified facets, sampled for the others or, where that would take too long, for a
    /// share of them, mm. At least the distance to what is left out of a border that crosses itself.
    pub reached_mm: f64,
}
