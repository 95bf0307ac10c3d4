//! The border of a face of one solid on a face of another: lines that the facets of both keep to.

use super::nodes::Node;
use crate::math::{Point, Uv};

/// A corner of such a border on the face that carries it.
#[derive(Clone, Copy, Debug)]
pub(super) struct ImprintEnd {
    /// Parameters on the carrier, on the segment's side of a seam.
    pub(super) uv: Uv,
    /// In the carrier's part's coordinates.
    pub(super) place: Point,
    /// Number of the corner among those of all guests' borders.
    pub(super) vertex: usize,
}

/// A chord of the border.
#[derive(Clone, Copy, Debug)]
pub(super) struct ImprintSegment {
    pub(super) ends: [ImprintEnd; 2],
}

/// All borders that lie on a carrier.
#[derive(Clone, Debug, Default)]
pub(super) struct Imprint {
    pub(super) segments: Vec<ImprintSegment>,
    /// Distance within which places are one, mm of the scene.
    pub(super) near: f64,
}

impl Imprint {
    /// Returns the places of the ends of all segments, with repetitions, in the carrier's part's coordinates.
    pub(super) fn points(&self) -> Vec<Point> {
        self.segments.iter().flat_map(|s| s.ends).map(|end| end.place).collect()
    }
}

/// The facets of a carrier by their nodes, for the faces that lie on it.
#[derive(Clone, Debug, Default)]
pub(super) struct CarrierFacets {
    pub(super) nodes: Vec<Node>,
    /// A triangle repeats its third corner.
    pub(super) facets: Vec<[u32; 4]>,
    /// Nodes that stand for corners of the imprint: pairs of index in `nodes` and number of the corner, with repetitions.
    pub(super) vertex_nodes: Vec<(u32, usize)>,
    /// Whether no facet crosses the imprint.
    pub(super) holds_imprint: bool,
}
