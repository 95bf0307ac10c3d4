//! Receivers that lie in one plane and overlap: light that would meet both ends on one, and the other counts none of it.

use super::bound_scene::BoundScene;
use crate::math::Point;
use crate::simulate::receiver::{FlatShape, Receiver};

/// A flat receiver with its reach along x, mm.
struct Candidate<'r> {
    receiver: &'r Receiver,
    flat: FlatShape<'r>,
    along_x: [f64; 2],
}

impl<'r> Candidate<'r> {
    /// `None` for a receiver that is not flat.
    fn new(receiver: &'r Receiver) -> Option<Self> {
        let bounds = receiver.bounds();
        Some(Self { receiver, flat: receiver.flat()?, along_x: [bounds.min.x, bounds.max.x] })
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
    let mut flat: Vec<Candidate<'_>> = bound.receivers.iter().filter_map(Candidate::new).collect();
    flat.sort_by(|a, b| a.along_x[0].total_cmp(&b.along_x[0]));
    let mut notes = Vec::new();
    for (i, first) in flat.iter().enumerate() {
        for second in flat[i + 1..].iter().take_while(|second| second.along_x[0] <= first.along_x[1]) {
            // Rectangles overlap where neither lies beyond a side of the other.
            if first.competes_with(second) && first.is_under(second) && second.is_under(first) {
                notes.push(format!(
                    "the receivers '{}' and '{}' lie in one plane and overlap: light that would meet both ends on one of them, and the \
                     other counts none of it; `absorbs = false` for both, or a hundredth of a millimetre between them, lets each count it",
                    first.receiver.name, second.receiver.name
                ));
            }
        }
    }
    notes
}
