//! What the corners of a search see of each other past the borders of a face and those of its holes that the search has taken in.
//!
//! Holes are only ever added, so that what is barred remains so, and what was free is compared with the new ones alone.

use super::obstacles::{HoleCopy, Obstacles};
use super::segment::Segment;
use crate::math::Uv;
use rustc_hash::FxHashSet;

/// A straight piece of a way.
pub(super) struct Leg {
    /// The node that it starts from.
    pub(super) from: usize,
    /// The corner to which it leads; `None` for a goal, of which nothing is remembered.
    pub(super) to: Option<usize>,
    pub(super) ends: [Uv; 2],
}

/// What is known of a leg.
#[derive(Clone, Copy, Default)]
enum Sight {
    #[default]
    Unknown,
    Barred,
    /// Free of the borders and of so many holes, the first that were taken in: of no more than a few hundred.
    Free(u16),
}

/// A hole that was taken in.
struct MetHole {
    hole: HoleCopy,
    /// Lowest and highest corner of the box around it.
    bounds: [Uv; 2],
}

/// Which legs are free.
pub(super) struct Visibility<'s> {
    obstacles: &'s Obstacles<'s>,
    /// The borders alone.
    borders: &'s Obstacles<'s>,
    /// In the order in which they were taken in.
    met: Vec<MetHole>,
    numbers: FxHashSet<HoleCopy>,
    /// By node, then by corner, as far as they were asked for.
    sights: Vec<Vec<Sight>>,
}

impl<'s> Visibility<'s> {
    /// What is seen before any hole is taken in.
    pub(super) fn new(obstacles: &'s Obstacles<'s>, borders: &'s Obstacles<'s>) -> Self {
        Self { obstacles, borders, met: Vec::new(), numbers: FxHashSet::default(), sights: Vec::new() }
    }

    /// Returns how many holes were taken in.
    pub(super) fn met_count(&self) -> usize {
        self.met.len()
    }

    /// Whether a hole was taken in.
    pub(super) fn has_met(&self, hole: HoleCopy) -> bool {
        self.numbers.contains(&hole)
    }

    /// Takes in a hole; false where it was before.
    pub(super) fn meet(&mut self, hole: HoleCopy) -> bool {
        let is_new = self.numbers.insert(hole);
        if is_new {
            self.met.push(MetHole { hole, bounds: self.obstacles.bounds_of(hole) });
        }
        is_new
    }

    /// Whether a leg crosses no border and no hole that was taken in.
    pub(super) fn is_free(&mut self, leg: &Leg) -> bool {
        let Some(corner) = leg.to else { return self.is_free_past(leg.ends, None) };
        let row = self.sights.get(leg.from);
        let past = match row.and_then(|row| row.get(corner)).copied().unwrap_or_default() {
            Sight::Barred => return false,
            Sight::Unknown => None,
            Sight::Free(holes) => Some(usize::from(holes)),
        };
        let is_free = self.is_free_past(leg.ends, past);
        let sight = if is_free { Sight::Free(self.met.len() as u16) } else { Sight::Barred };
        if self.sights.len() <= leg.from {
            self.sights.resize_with(leg.from + 1, Vec::new);
        }
        let row = &mut self.sights[leg.from];
        if row.len() <= corner {
            row.resize(corner + 1, Sight::Unknown);
        }
        row[corner] = sight;
        is_free
    }

    /// Whether the straight line between two places is free, known to miss the borders and so many of the first holes, or nothing yet.
    fn is_free_past(&self, ends: [Uv; 2], past: Option<usize>) -> bool {
        let segment = Segment::new(ends);
        let others = &self.met[past.unwrap_or(0)..];
        let is_crossed =
            |met: &MetHole| segment.may_meet(met.bounds) && self.obstacles.hole_is_crossed(met.hole, ends);
        let crossed = others.iter().position(is_crossed);
        self.obstacles.count_steps(crossed.map_or(others.len(), |k| k + 1) as u64);
        // Borders are tested last: what is barred is nearly always barred by a hole.
        crossed.is_none() && (past.is_some() || self.borders.leave_free(ends[0], ends[1]))
    }
}
