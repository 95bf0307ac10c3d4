//! The facets of one face in its part's coordinates.

use super::meetings::MeetingSamples;
use super::nodes::Position;
use super::report::Repair;
use crate::math::{Point, Uv, Vector};
use crate::model::EdgeId;

/// A corner of facets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) position: Position,
    /// Outward, in the part's coordinates; zero where the surface has none, until a facet gives its own.
    pub(super) normal: Vector,
    pub(super) uv: Uv,
}

/// A facet of corners, counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshedFacet {
    /// A triangle repeats its last corner.
    pub(super) corners: [u32; 4],
    /// As of [`super::nodes::ProvedFacet`], mm of the part; infinite where nothing is proved.
    pub(super) bound: f64,
    pub(super) tolerance: f64,
}

/// The facets of a face in its part's coordinates.
#[derive(Clone, Default)]
pub(super) struct FaceMesh {
    pub(super) corners: Vec<Corner>,
    /// Places of the face's own positions, in the part's coordinates.
    pub(super) own: Vec<Point>,
    pub(super) facets: Vec<MeshedFacet>,
    /// Edges that should have shorter chords: theirs cross others in the parameter plane for their sag, or a facet beside them is not
    /// proved.
    pub(super) coarse: Vec<EdgeId>,
    /// Edges that should have shorter chords for facets beside them that look the other way than the surface.
    pub(super) turned: Vec<EdgeId>,
    /// Further samples that edges should have, so that chords of two of them do not cross.
    pub(super) facing: Vec<(EdgeId, f64)>,
    /// Further samples that edges should have where they cross each other, to be one corner.
    pub(super) meetings: Vec<MeetingSamples>,
    /// Shared positions that are one: vertices of the file in one place, where loops touch, and samples where edges cross.
    pub(super) coincident: Vec<[u32; 2]>,
    /// What was given up; `None` where nothing was.
    pub(super) repaired: Option<Repair>,
    /// How far facets are at least from what of the border crosses itself and was left out, mm of the part; 0 where nothing was.
    pub(super) left_out_mm: f64,
    /// Whether the border crosses itself in corners alone, so that all of it was kept.
    pub(super) meets_itself: bool,
}
