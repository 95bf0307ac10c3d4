//! Receivers that lie in one plane and overlap: light that would meet both ends on one, and the other counts none of it.

use super::bound_scene::BoundScene;
use crate::math::{Aabb, BoxTree, Point};
use crate::simulate::receiver::{FlatShape, Receiver};

/// A flat receiver.
struct Candidate<'r> {
    receiver: &'r Receiver,
    flat: FlatShape<'r>,
}

impl<'r> Candidate<'r> {
    /// `None` for a receiver that is not flat.
    fn new(receiver: &'r Receiver) -> Option<Self> {
        Some(Self { receiver, flat: receiver.flat()? })
    }

    /// Whether another one lies in its plane and beyond none of its sides.
    fn is_under(&self, other: &Self) -> bool {
        let FlatShape { frame, half, .. } = self.flat;
        let near = self.flat.near();
        let seen = other.flat.corners().map(|p| frame.local_point(p));
        let reaches = |at: fn(&Point) -> f64, half: f64| {
            seen.iter().any(|p| at(p) < half - near) && seen.iter().any(|p| at(p) > near - half)
        };
        seen.iter().all(|p| p.z.abs() <= near) && reaches(|p| p.x, half[0]) && reaches(|p| p.y, half[1])
    }

    /// Whether light that meets both may end on one of them: not where each looks away from the other.
    fn competes_with(&self, other: &Self) -> bool {
        let are_back_to_back =
            self.flat.is_one_sided && other.flat.is_one_sided && self.flat.frame.z.dot(other.flat.frame.z) < 0.0;
        (self.receiver.absorbs || other.receiver.absorbs) && !are_back_to_back
    }
}

/// Returns a sentence for each two flat receivers, of which at least one absorbs, that overlap in one plane.
pub(super) fn overlapping_receiver_notes(bound: &BoundScene) -> Vec<String> {
    let flat: Vec<Candidate<'_>> = bound.receivers.iter().filter_map(Candidate::new).collect();
    let boxes: Vec<Aabb> = flat.iter().map(|c| c.receiver.bounds().grown(c.flat.near())).collect();
    let mut notes = Vec::new();
    for meeting in BoxTree::meeting_pairs(&boxes) {
        let [first, second] = meeting.map(|k| &flat[k]);
        // Rectangles overlap where neither lies beyond a side of the other.
        if first.competes_with(second) && first.is_under(second) && second.is_under(first) {
            notes.push(format!(
                "the receivers '{}' and '{}' lie in one plane and overlap: light that would meet both ends on one of them, and the \
                 other counts none of it; `absorbs = false` for both, or a hundredth of a millimetre between them, lets each count it",
                first.receiver.name, second.receiver.name
            ));
        }
    }
    notes
}
