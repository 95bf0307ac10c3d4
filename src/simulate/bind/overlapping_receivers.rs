//! Receivers that lie in one plane and overlap: light that would meet both ends on one, and the other counts none of it.

use super::bound_scene::BoundScene;
use crate::math::{Frame, Point};
use crate::simulate::receiver::{Receiver, Shape};

/// Distance, as a share of a receiver's half side, below which two are in one plane or touch along a border alone.
const FLUSH: f64 = 1e-9;

/// A flat receiver, as the rectangle that holds it.
struct Flat<'r> {
    receiver: &'r Receiver,
    frame: &'r Frame,
    half: [f64; 2],
    is_one_sided: bool,
    /// Its reach along x, mm.
    along_x: [f64; 2],
}

impl<'r> Flat<'r> {
    /// `None` for a receiver that is not flat.
    fn new(receiver: &'r Receiver) -> Option<Self> {
        let (frame, half, is_one_sided) = match &receiver.shape {
            Shape::Plane { frame, half, one_sided, .. } => (frame, *half, *one_sided),
            Shape::Disc { frame, radius, one_sided, .. } => (frame, [*radius; 2], *one_sided),
            _ => return None,
        };
        let reach = frame.x.x.abs() * half[0] + frame.y.x.abs() * half[1];
        let along_x = [frame.origin.x - reach, frame.origin.x + reach];
        Some(Self { receiver, frame, half, is_one_sided, along_x })
    }

    fn corners(&self) -> [Point; 4] {
        let Self { frame, half: [a, b], .. } = *self;
        [[-a, -b], [-a, b], [a, -b], [a, b]].map(|[x, y]| frame.origin + frame.x * x + frame.y * y)
    }

    /// Whether another one lies in its plane and beyond none of its sides.
    fn is_under(&self, other: &Self) -> bool {
        let near = FLUSH * self.half[0].max(self.half[1]);
        let seen = other.corners().map(|p| self.frame.local_point(p));
        let reaches = |at: fn(&Point) -> f64, half: f64| {
            seen.iter().any(|p| at(p) < half - near) && seen.iter().any(|p| at(p) > near - half)
        };
        seen.iter().all(|p| p.z.abs() <= near) && reaches(|p| p.x, self.half[0]) && reaches(|p| p.y, self.half[1])
    }

    /// Whether light that meets both may end on one of them: not where each looks away from the other.
    fn competes_with(&self, other: &Self) -> bool {
        let are_back_to_back = self.is_one_sided && other.is_one_sided && self.frame.z.dot(other.frame.z) < 0.0;
        (self.receiver.absorbs || other.receiver.absorbs) && !are_back_to_back
    }
}

/// Returns a sentence for each two flat receivers, of which at least one absorbs, that overlap in one plane.
pub(super) fn overlapping_receiver_notes(bound: &BoundScene) -> Vec<String> {
    let mut flat: Vec<Flat<'_>> = bound.receivers.iter().filter_map(Flat::new).collect();
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
