//! What a seam must not cross: the holes and borders of a face with their copies, and which of them a straight piece meets.
//!
//! Boxes around runs of sides stand in a tree, so that a piece is compared with what is beside it alone.

use super::tolerances::CROSSING_NOISE;
use crate::math::{Aabb, BoxTree, Uv};
use std::ops::RangeInclusive;

/// Most turns of a hole that are looked at.
const MOST_TURNS: i32 = 64;
/// Sides of a chain that one box is around.
const SIDES_OF_RUN: usize = 16;

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
}

/// Places one after the other, in parameters.
struct Chain<'o> {
    places: &'o [Uv],
    closed: bool,
}

/// Up to [`SIDES_OF_RUN`] sides of a chain.
struct Run {
    chain: usize,
    first_side: usize,
}

impl<'o> Obstacles<'o> {
    pub(super) fn new(holes: &'o [Vec<Uv>], borders: &'o [Vec<Uv>], displacement: Uv) -> Self {
        let closed = holes.iter().map(|places| Chain { places, closed: true });
        let chains: Vec<Chain<'o>> =
            closed.chain(borders.iter().map(|places| Chain { places, closed: false })).collect();
        let mut along = [f64::INFINITY, f64::NEG_INFINITY];
        let (mut runs, mut boxes) = (Vec::new(), Vec::new());
        for (chain, c) in chains.iter().enumerate() {
            let [lo, hi] = range_along(c.places, displacement);
            along = [along[0].min(lo), along[1].max(hi)];
            for first_side in (0..c.sides()).step_by(SIDES_OF_RUN) {
                boxes.push(c.box_of_run(first_side));
                runs.push(Run { chain, first_side });
            }
        }
        Self { holes, borders, displacement, chains, along, runs, tree: BoxTree::new(&boxes) }
    }

    /// Whether the straight line between two places crosses no hole, no border and no copy of these.
    pub(super) fn leave_free(&self, from: Uv, to: Uv) -> bool {
        !self.crosses_any(from, to, |_| true)
    }

    /// Returns the holes, and copies of them, that a way through these places crosses; some may be told more than once.
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

    /// Whether the straight line between two places crosses something that is wanted; `is_wanted` is asked of each hole beside it, and
    /// with `None` of a border. Touching does not count, a corner between both sides does.
    pub(super) fn crosses_any(&self, a: Uv, b: Uv, is_wanted: impl Fn(Option<HoleCopy>) -> bool) -> bool {
        // Nine holes in ten are not wanted, and to ask that is cheaper.
        self.any_beside(a, b, |hole, is_crossed| is_wanted(hole) && is_crossed())
    }

    /// Whether `is_found` says so of something beside the straight line between two places: it is given the hole, `None` for a border, and
    /// what works out whether the line crosses it.
    fn any_beside(
        &self,
        a: Uv,
        b: Uv,
        mut is_found: impl FnMut(Option<HoleCopy>, &dyn Fn() -> bool) -> bool,
    ) -> bool {
        let slack = CROSSING_NOISE * (b - a).length();
        self.copies_beside([a, b]).any(|copy| {
            let by = self.displacement * f64::from(copy);
            let moved = [a - by, b - by];
            let around = Aabb::from_points(moved.map(|p| p.extend(0.0))).grown(slack);
            self.tree.any_meeting(&around, |k| {
                let Run { chain, first_side } = self.runs[k as usize];
                let hole = (chain < self.holes.len()).then_some(HoleCopy { hole: chain, copy });
                is_found(hole, &|| self.chains[chain].run_is_crossed(first_side, moved))
            })
        })
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

    /// Returns the box, of height 0, around the run of sides that begins with side `first`.
    fn box_of_run(&self, first: usize) -> Aabb {
        let last = (first + SIDES_OF_RUN).min(self.sides());
        Aabb::from_points((first..=last).map(|k| self.places[k % self.places.len()].extend(0.0)))
    }

    /// Whether a segment crosses one of the run of sides that begins with side `first`.
    fn run_is_crossed(&self, first: usize, segment: [Uv; 2]) -> bool {
        (first..self.sides()).take(SIDES_OF_RUN).any(|side| self.side_is_crossed(side, segment))
    }

    /// Whether a segment crosses the side that begins at so many places.
    fn side_is_crossed(&self, i: usize, [a, b]: [Uv; 2]) -> bool {
        let n = self.places.len();
        let (p, q) = (self.places[i], self.places[(i + 1) % n]);
        // Segments cross where each has the ends of the other on opposite sides.
        let side = |o: Uv, d: Uv, x: Uv| (d - o).perp_dot(x - o);
        let (s1, s2, s3, s4) = (side(a, b, p), side(a, b, q), side(p, q, a), side(p, q, b));
        let noise = CROSSING_NOISE * (b - a).length() * (q - p).length();
        let ends_apart = s3 > noise && s4 < -noise || s3 < -noise && s4 > noise;
        if s2.abs() <= noise && ends_apart {
            // Through a corner: between what comes before it and what comes after it.
            let rest = if self.closed { n } else { n - 2 - i };
            let next = (2..=rest).map(|k| self.places[(i + k) % n]).find(|x| side(a, b, *x).abs() > noise);
            return next.is_some_and(|x| s1.abs() > noise && side(a, b, x) * s1 < 0.0);
        }
        (s1 > noise && s2 < -noise || s1 < -noise && s2 > noise) && ends_apart
    }
}
