//! Which faces of a triangulation lie inside its border, told by steps from face to face: the middle of a sliver beside a straight side is
//! rounded to either side of it.

use spade::handles::{DirectedEdgeHandle, FixedFaceHandle, PossiblyOuterTag};
use spade::{CdtEdge, ConstrainedDelaunayTriangulation, HasPosition, Triangulation};
use std::collections::VecDeque;

/// A side of a face of a triangulation.
pub(super) type Side<'c, V> = DirectedEdgeHandle<'c, V, (), CdtEdge<()>, ()>;

/// What a walk took.
pub(super) struct Steps {
    /// Faces that were told.
    pub(super) asked: usize,
    /// Sides that were looked at.
    pub(super) looked: usize,
}

/// Tells all faces that can be reached from `known` ones, breadth first, and sets them in `inside`, by the index of the face; the answer
/// turns at every side that `is_border` names.
pub(super) fn flood<V: HasPosition>(
    cdt: &ConstrainedDelaunayTriangulation<V>,
    inside: &mut [Option<bool>],
    known: impl IntoIterator<Item = FixedFaceHandle<PossiblyOuterTag>>,
    is_border: impl Fn(&Side<'_, V>) -> bool,
) -> Steps {
    let mut steps = Steps { asked: 0, looked: 0 };
    let mut queue: VecDeque<_> = known.into_iter().collect();
    while let Some(face) = queue.pop_front() {
        let is_inside = inside[face.index()] == Some(true);
        let mut ask_beyond = |e: Side<'_, V>| {
            steps.looked += 1;
            // Hull edges run along the outer face or against it, by version; take the unknown side.
            for side in [e, e.rev()] {
                let next = side.face();
                if inside[next.index()].is_none() {
                    inside[next.index()] = Some(is_inside != is_border(&e));
                    steps.asked += 1;
                    queue.push_back(next.fix());
                }
            }
        };
        match cdt.face(face).as_inner() {
            Some(inner) => inner.adjacent_edges().into_iter().for_each(&mut ask_beyond),
            None => cdt.convex_hull().for_each(&mut ask_beyond),
        }
    }
    steps
}
