//! What a seam must not cross: the holes and borders of a face with their copies, and which of them a straight piece meets.
//!
//! Boxes around runs of sides stand in a tree, so that a piece is compared with what is beside it alone.

use super::segment::{Contact, Segment};
use super::tolerances::CROSSING_NOISE;
use crate::math::polygon::{is_inside_sides, polygon_sides};
use crate::math::{Aabb, BoxTree, Uv};
use std::cell::Cell;
use std::ops::{Range, RangeInclusive};

/// Most turns of a hole that are looked at.
const MOST_TURNS: i32 = 64;
/// Sides of a chain that one box is around.
const SIDES_OF_RUN: usize = 16;
/// Boxes that a walk through the tree looks at, the runs that it meets apart: four levels of four, as of a few hundred runs.
const STEPS_OF_WALK: u64 = 16;

/// A hole by its number, moved by so many displacements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct HoleCopy {
    pub(super) hole: usize,
    pub(super) copy: i32,
}

/// What a seam must not cross, with its copies by multiples of the displacement: closed holes and open borders, in parameters.
pub(super) struct Obstacles<'o> {
    pub(super) holes: &'o [Vec<Uv>],
    pub(super) borders: &'o [Vec<Uv>],
    pub(super) displacement: Uv,
    /// Of the holes, then of the borders.
    chains: Vec<Chain<'o>>,
    /// The least and the most of all their places along the displacement, in displacements.
    along: [f64; 2],
    runs: Vec<Run>,
    /// Around the runs, by their index.
    tree: BoxTree,
    /// Around the holes, by their number.
    hole_tree: BoxTree,
    /// Boxes and sides that were looked at since [`Self::take_steps`].
    steps: Cell<u64>,
}

/// Places one after the other, in parameters.
struct Chain<'o> {
    places: &'o [Uv],
    closed: bool,
    /// Those of all its sides.
    runs: Range<usize>,
}

/// Up to [`SIDES_OF_RUN`] sides of a chain.
struct Run {
    chain: usize,
    first_side: usize,
    /// Lowest and highest corner of the box around them.
    bounds: [Uv; 2],
}

impl<'o> Obstacles<'o> {
    pub(super) fn new(holes: &'o [Vec<Uv>], borders: &'o [Vec<Uv>], displacement: Uv) -> Self {
        let closed = holes.iter().map(|places| Chain { places, closed: true, runs: 0..0 });
        let open = borders.iter().map(|places| Chain { places, closed: false, runs: 0..0 });
        let mut chains: Vec<Chain<'o>> = closed.chain(open).collect();
        let mut along = [f64::INFINITY, f64::NEG_INFINITY];
        let mut runs: Vec<Run> = Vec::new();
        for (chain, c) in chains.iter_mut().enumerate() {
            let [lo, hi] = range_along(c.places, displacement);
            along = [along[0].min(lo), along[1].max(hi)];
            let first_run = runs.len();
            for first_side in (0..c.sides()).step_by(SIDES_OF_RUN) {
                runs.push(Run { chain, first_side, bounds: c.bounds_of_run(first_side) });
            }
            c.runs = first_run..runs.len();
        }
        let boxes: Vec<Aabb> = runs.iter().map(|run| flat_box(run.bounds)).collect();
        let tree = BoxTree::new(&boxes);
        let hole_boxes: Vec<Aabb> = holes.iter().map(|hole| flat_box(bounds(hole))).collect();
        let hole_tree = BoxTree::new(&hole_boxes);
        Self { holes, borders, displacement, chains, along, runs, tree, hole_tree, steps: Cell::new(0) }
    }

    /// Returns how many boxes and sides were tested since the last call: the measure of a search's work.
    pub(super) fn take_steps(&self) -> u64 {
        self.steps.take()
    }

    /// Adds looks at boxes and sides to those that [`Self::take_steps`] returns.
    pub(super) fn count_steps(&self, steps: u64) {
        self.steps.set(self.steps.get() + steps);
    }

    /// Whether the straight line between two places crosses no hole, no border and no copy of these.
    pub(super) fn leave_free(&self, from: Uv, to: Uv) -> bool {
        !self.any_beside(from, to, |_, is_crossed| is_crossed())
    }

    /// Returns the holes, and copies of them, that a way through these places crosses; some may be returned more than once.
    pub(super) fn crossed_by(&self, places: &[Uv]) -> Vec<HoleCopy> {
        let mut crossed = Vec::new();
        for side in places.windows(2) {
            self.any_beside(side[0], side[1], |hole, is_crossed| {
                crossed.extend(hole.filter(|_| is_crossed()));
                false
            });
        }
        crossed
    }

    /// Whether the straight line between two places crosses a copy of a hole, or runs through it from side to side. Touching it from
    /// outside does not count, a corner between both sides does.
    pub(super) fn hole_is_crossed(&self, HoleCopy { hole, copy }: HoleCopy, ends: [Uv; 2]) -> bool {
        let by = self.displacement * f64::from(copy);
        let segment = Segment::new(ends.map(|p| p - by));
        let runs = self.chains[hole].runs.clone();
        self.count_steps(runs.len() as u64);
        let mut is_touched = false;
        for run in &self.runs[runs] {
            match self.run_contact(run, &segment) {
                Contact::Crossing => return true,
                Contact::Touching => is_touched = true,
                Contact::Apart => {}
            }
        }
        is_touched && self.runs_through(&segment, hole)
    }

    /// Returns what of the straight line from `a` to `b` lies between holes that it crosses one after the other, in order and as shares of
    /// it: what comes before the first one and after the last one is left out.
    pub(super) fn gaps_between_holes(&self, a: Uv, b: Uv) -> Vec<[f64; 2]> {
        let crossed = self.crossed_by(&[a, b]);
        let mut spans: Vec<[f64; 2]> = crossed.into_iter().map(|hole| self.span_across(hole, [a, b])).collect();
        spans.sort_by(|x, y| x[0].total_cmp(&y[0]));
        let Some(&[_, mut end]) = spans.first() else { return Vec::new() };
        let mut gaps = Vec::new();
        for [first, last] in spans {
            if first > end + CROSSING_NOISE {
                gaps.push([end, first]);
            }
            end = end.max(last);
        }
        gaps
    }

    /// Returns where the straight line from `a` to `b` first and last crosses a side of a hole, as shares of it: an end where it does so
    /// beyond that.
    fn span_across(&self, HoleCopy { hole, copy }: HoleCopy, [a, b]: [Uv; 2]) -> [f64; 2] {
        let (from, along) = (a - self.displacement * f64::from(copy), b - a);
        let mut span = [f64::INFINITY, f64::NEG_INFINITY];
        for [p, q] in polygon_sides(&self.holes[hole]) {
            // Distances of the side's ends from the line, of opposite signs where it crosses.
            let (off_p, off_q) = (along.perp_dot(p - from), along.perp_dot(q - from));
            if off_p * off_q <= 0.0 && off_p != off_q {
                let crossing = p + (q - p) * (off_p / (off_p - off_q));
                let share = ((crossing - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
                span = [span[0].min(share), span[1].max(share)];
            }
        }
        span
    }

    /// Whether `is_found` says so of something beside the straight line between two places: it is given the hole, `None` for a border, and
    /// what works out whether the line crosses it.
    fn any_beside(
        &self,
        a: Uv,
        b: Uv,
        mut is_found: impl FnMut(Option<HoleCopy>, &dyn Fn() -> bool) -> bool,
    ) -> bool {
        self.copies_beside([a, b]).any(|copy| {
            let by = self.displacement * f64::from(copy);
            let segment = Segment::new([a - by, b - by]);
            self.count_steps(STEPS_OF_WALK);
            self.tree.any_meeting(&flat_box(segment.bounds), |k| {
                self.count_steps(1);
                let run = &self.runs[k as usize];
                let hole = (run.chain < self.holes.len()).then_some(HoleCopy { hole: run.chain, copy });
                is_found(hole, &|| self.run_bars(run, &segment))
            })
        })
    }

    /// Whether a segment crosses a side of a run, or touches one and runs through its hole.
    fn run_bars(&self, run: &Run, segment: &Segment) -> bool {
        match self.run_contact(run, segment) {
            Contact::Crossing => true,
            Contact::Touching => run.chain < self.holes.len() && self.runs_through(segment, run.chain),
            Contact::Apart => false,
        }
    }

    /// Returns how a segment meets the sides of a run.
    fn run_contact(&self, run: &Run, segment: &Segment) -> Contact {
        if !segment.may_meet(run.bounds) {
            return Contact::Apart;
        }
        let chain = &self.chains[run.chain];
        let mut contact = Contact::Apart;
        let mut compared = 0;
        for side in chain.sides_of_run(run.first_side) {
            compared += 1;
            contact = contact.max(chain.side_contact(side, segment.ends));
            if contact == Contact::Crossing {
                break;
            }
        }
        self.count_steps(compared);
        contact
    }

    /// Whether a segment runs through a hole that it touches.
    fn runs_through(&self, segment: &Segment, hole: usize) -> bool {
        self.count_steps(self.holes[hole].len() as u64);
        segment.runs_through(&self.holes[hole])
    }

    /// Whether a place is in a hole or a copy of one; on a side either answer may come.
    pub(super) fn lies_in_hole(&self, place: Uv) -> bool {
        self.copies_beside([place, place]).any(|copy| {
            let p = place - self.displacement * f64::from(copy);
            self.count_steps(STEPS_OF_WALK);
            self.hole_tree.any_meeting(&flat_box([p, p]), |k| {
                let hole = &self.holes[k as usize];
                self.count_steps(hole.len() as u64);
                is_inside_sides(polygon_sides(hole), p)
            })
        })
    }

    /// Whether `is_wanted` says so of a side near a box, given by its lowest and highest corner: it is given the side and its hole, `None`
    /// of a border. All that meet the box are asked for, in no order, up to the first.
    pub(super) fn any_side_near(
        &self,
        [lo, hi]: [Uv; 2],
        mut is_wanted: impl FnMut(Option<HoleCopy>, [Uv; 2]) -> bool,
    ) -> bool {
        self.copies_beside([lo, hi]).any(|copy| {
            let by = self.displacement * f64::from(copy);
            self.count_steps(STEPS_OF_WALK);
            self.tree.any_meeting(&flat_box([lo - by, hi - by]), |k| {
                let run = &self.runs[k as usize];
                let hole = (run.chain < self.holes.len()).then_some(HoleCopy { hole: run.chain, copy });
                let chain = &self.chains[run.chain];
                let mut sides = chain.sides_of_run(run.first_side);
                self.count_steps(sides.len() as u64);
                sides.any(|side| is_wanted(hole, chain.side(side).map(|p| p + by)))
            })
        })
    }

    /// Returns the lowest and highest corner of the box around a copy of a hole.
    pub(super) fn bounds_of(&self, HoleCopy { hole, copy }: HoleCopy) -> [Uv; 2] {
        let by = self.displacement * f64::from(copy);
        bounds(&self.holes[hole]).map(|corner| corner + by)
    }

    /// Returns how many displacements the longest hole reaches over, beyond the one in which a seam has room beside a short one: as many
    /// turns a seam may have to make with it.
    pub(super) fn turns(&self) -> i32 {
        self.holes.iter().map(|hole| turns_of(hole, self.displacement)).max().unwrap_or(0)
    }

    /// Whether a way misses its copies on both sides: the cut surface then lies in one sheet.
    pub(super) fn is_simple(&self, places: &[Uv]) -> bool {
        let way = [places.to_vec()];
        let itself = Obstacles::new(&[], &way, Uv::ZERO);
        let misses_copies = |side: &[Uv]| {
            [-1.0, 1.0].iter().all(|&copy| {
                let by = self.displacement * copy;
                itself.leave_free(side[0] + by, side[1] + by)
            })
        };
        places.windows(2).all(misses_copies)
    }

    /// Returns by how many displacements copies are moved that may meet a segment.
    fn copies_beside(&self, segment: [Uv; 2]) -> RangeInclusive<i32> {
        if self.displacement == Uv::ZERO {
            return 0..=0;
        }
        let [lo, hi] = self.along;
        let [from, to] = range_along(&segment, self.displacement);
        let first = (from - hi - CROSSING_NOISE).ceil().max(f64::from(-MOST_TURNS));
        let last = (to - lo + CROSSING_NOISE).floor().min(f64::from(MOST_TURNS));
        first as i32..=last as i32
    }
}

/// Whether a way crosses itself.
pub(super) fn crosses_itself(places: &[Uv]) -> bool {
    let way = [places.to_vec()];
    let itself = Obstacles::new(&[], &way, Uv::ZERO);
    places.windows(2).any(|side| !itself.leave_free(side[0], side[1]))
}

/// Returns the lowest and highest corner of the box around places.
pub(super) fn bounds<'p>(places: impl IntoIterator<Item = &'p Uv>) -> [Uv; 2] {
    let places = places.into_iter();
    places.fold([Uv::INFINITY, Uv::NEG_INFINITY], |[lo, hi], p| [lo.min(*p), hi.max(*p)])
}

/// Returns a box, given by its lowest and highest corner, as one of height 0.
fn flat_box(bounds: [Uv; 2]) -> Aabb {
    let [min, max] = bounds.map(|p| p.extend(0.0));
    Aabb { min, max }
}

/// Returns the polygon of a chain that winds, with its end point, which is one displacement from its start.
pub(super) fn unrolled_polygon(polygon: &[Uv], displacement: Uv) -> Vec<Uv> {
    let mut open = polygon.to_vec();
    open.push(polygon[0] + displacement);
    open
}

/// Returns the least and the most of some places along `period`, in periods.
fn range_along(places: &[Uv], period: Uv) -> [f64; 2] {
    let along = places.iter().map(|p| p.dot(period) / period.length_squared());
    along.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], x| [lo.min(x), hi.max(x)])
}

/// Returns over how many whole periods a hole reaches; [`MOST_TURNS`] at most.
pub(super) fn turns_of(hole: &[Uv], period: Uv) -> i32 {
    let [lo, hi] = range_along(hole, period);
    (hi - lo).clamp(0.0, f64::from(MOST_TURNS)) as i32
}

impl Chain<'_> {
    /// Returns how many sides it has.
    fn sides(&self) -> usize {
        if self.closed { self.places.len() } else { self.places.len().saturating_sub(1) }
    }

    /// Returns the lowest and highest corner of the box around the run of sides that begins with side `first`.
    fn bounds_of_run(&self, first: usize) -> [Uv; 2] {
        let last = (first + SIDES_OF_RUN).min(self.sides());
        bounds((first..=last).map(|k| &self.places[k % self.places.len()]))
    }

    /// Returns the sides of the run that begins with side `first`.
    fn sides_of_run(&self, first: usize) -> Range<usize> {
        first..(first + SIDES_OF_RUN).min(self.sides())
    }

    /// Returns the ends of side `i`.
    fn side(&self, i: usize) -> [Uv; 2] {
        [self.places[i], self.places[(i + 1) % self.places.len()]]
    }

    /// Returns how a segment meets side `i`.
    fn side_contact(&self, i: usize, [a, b]: [Uv; 2]) -> Contact {
        let [p, q] = self.side(i);
        // Segments cross where each has the ends of the other on opposite sides.
        let side = |o: Uv, d: Uv, x: Uv| (d - o).perp_dot(x - o);
        let (s1, s2, s3, s4) = (side(a, b, p), side(a, b, q), side(p, q, a), side(p, q, b));
        let noise = CROSSING_NOISE * (b - a).length() * (q - p).length();
        let are_together = |x: f64, y: f64| x > noise && y > noise || x < -noise && y < -noise;
        if are_together(s1, s2) || are_together(s3, s4) {
            return Contact::Apart;
        }
        let are_opposite = |x: f64, y: f64| x > noise && y < -noise || x < -noise && y > noise;
        let is_crossed = if s2.abs() <= noise && are_opposite(s3, s4) {
            // Through a corner: between what comes before it and what comes after it.
            let n = self.places.len();
            let rest = if self.closed { n } else { n - 2 - i };
            let next = (2..=rest).map(|k| self.places[(i + k) % n]).find(|x| side(a, b, *x).abs() > noise);
            next.is_some_and(|x| s1.abs() > noise && side(a, b, x) * s1 < 0.0)
        } else {
            are_opposite(s1, s2) && are_opposite(s3, s4)
        };
        if is_crossed { Contact::Crossing } else { Contact::Touching }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A circle of 16 sides: past its box no side is compared, over a corner of the box all are, and from the middle on the first one that
    /// is crossed is the last.
    #[test]
    fn every_side_that_is_compared_is_a_step() {
        let circle: Vec<Uv> = (0..16).map(|k| Uv::from_angle(f64::from(k) * std::f64::consts::FRAC_PI_8)).collect();
        let holes = [circle];
        let obstacles = Obstacles::new(&holes, &[], Uv::ZERO);
        let steps = |a: [f64; 2], b: [f64; 2]| {
            obstacles.hole_is_crossed(HoleCopy { hole: 0, copy: 0 }, [a, b].map(Uv::from));
            obstacles.take_steps()
        };
        assert_eq!(steps([1.5, 0.9], [0.9, 1.5]), 1);
        assert_eq!(steps([1.2, 0.7], [0.7, 1.2]), 1 + 16);
        // Sides 0 to 4: the fifth one goes from the top to the left.
        assert_eq!(steps([-0.1, 0.0], [-0.1, 2.0]), 1 + 5);
    }
}
