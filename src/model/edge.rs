//! Edges: curves in space between vertices.

use crate::nurbs::Curve;
use serde::{Deserialize, Serialize};

/// Index into [`Part::edges`](super::Part::edges).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct EdgeId(pub u32);

/// Index into [`Part::vertices`](super::Part::vertices).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct VertexId(pub u32);

/// An edge in space, cut to its ends.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Edge {
    /// The curve; its domain is the edge's parameter interval.
    pub curve: Curve,
    /// Vertices at the start and end of the domain; equal for a closed edge.
    pub vertices: [VertexId; 2],
    /// The `#id` of the edge in its file, when it came from one.
    pub entity: Option<u64>,
}
