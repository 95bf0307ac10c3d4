//! Receivers that lie in one plane and overlap: light that would meet both ends on one, and the other counts none of it.

use super::bound_scene::BoundScene;
use crate::math::{Aabb, BoxTree, Point};
use crate::simulate::receiver::{FlatShape, NAMED_RECEIVERS, Receiver};
use crate::text::{count_of, first_sentences, grouped};

/// A flat receiver that ends light.
struct Candidate<'r> {
    receiver: &'r Receiver,
    flat: FlatShape<'r>,
}

impl<'r> Candidate<'r> {
    /// `None` for a receiver that is not flat or lets light pass.
    fn new(receiver: &'r Receiver) -> Option<Self> {
        let flat = receiver.flat().filter(|_| receiver.absorbs)?;
        Some(Self { receiver, flat })
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

    /// Whether light that meets both ends on one of them before the other counts it: not where each looks away from the other.
    fn competes_with(&self, other: &Self) -> bool {
        !(self.flat.is_one_sided && other.flat.is_one_sided && self.flat.frame.z.dot(other.flat.frame.z) < 0.0)
    }
}

/// Pairs that are counted, and pairs of boxes that are asked for them, a tenth of a second of work: of a thousand receivers at one place
/// there are half a million.
const MOST_COUNTED: usize = 1000;
const MOST_ASKED: usize = 1 << 19;

/// Returns sentences about flat receivers that both absorb and overlap in one plane: one for each of the first pairs, and one that counts
/// the others, up to [`MOST_COUNTED`], or says that not all were compared.
pub(super) fn overlapping_receiver_notes(bound: &BoundScene) -> Vec<String> {
    let flat: Vec<Candidate<'_>> = bound.receivers.iter().filter_map(Candidate::new).collect();
    let boxes: Vec<Aabb> = flat.iter().map(|c| c.receiver.bounds().grown(c.flat.near())).collect();
    let mut asked = 0;
    let pairs = BoxTree::meeting_pairs(&boxes).take(MOST_ASKED).inspect(|_| asked += 1);
    // Rectangles overlap where neither lies beyond a side of the other.
    let overlapping: Vec<[&Candidate<'_>; 2]> = pairs
        .map(|meeting| meeting.map(|k| &flat[k]))
        .filter(|[first, second]| first.competes_with(second) && first.is_under(second) && second.is_under(first))
        .take(MOST_COUNTED)
        .collect();
    let sentences = overlapping.iter().map(|[first, second]| {
        format!(
            "the receivers '{}' and '{}' lie in one plane and overlap: light that would meet both ends on one of them, and the other \
             counts none of it; `absorbs = false` for one of them, or a hundredth of a millimetre between them, lets each count it",
            first.receiver.name, second.receiver.name
        )
    });
    let at_least = if overlapping.len() == MOST_COUNTED || asked == MOST_ASKED { "at least " } else { "" };
    let mut notes = first_sentences(sentences, NAMED_RECEIVERS, |further| {
        format!("the same holds for {at_least}{} of receivers", count_of(further as u64, "more pair"))
    });
    if asked == MOST_ASKED && overlapping.len() <= NAMED_RECEIVERS {
        notes.push(format!(
            "only the first {} of the pairs of receivers whose boxes meet were compared: others may lie in one plane and overlap",
            grouped(MOST_ASKED as u64)
        ));
    }
    notes
}
