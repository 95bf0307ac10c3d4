//! The way of a seam from one loop to another past the holes between them: straight where something straight is free, otherwise the
//! shortest way by corners of boxes around the holes.
//!
//! Source: shortest paths by visibility graphs, after Lozano-Pérez and Wesley 1979, expanded by Dijkstra only as far as needed. Known
//! weakness: a hole so near to a border or another hole that the smallest box around it touches them leaves no way between.

use super::tolerances::CROSSING_NOISE;
use crate::math::Uv;
use crate::nurbs::Derivatives;
use std::ops::RangeInclusive;

/// How far a box stands off its hole, as shares of the hole's size; the first with which there is a way.
const MARGINS: [f64; 4] = [0.2, 0.06, 0.015, 0.004];
/// Most corners that are tried: beyond them a face has too many holes for a search that is quadratic in them.
const MAX_CORNERS: usize = 4000;

/// Places along each side of the strip between two loops that are in each other's way.
const LATTICE: f64 = 24.0;
/// Places between two turns of a hole: so many along each of its turns, of a hole of many turns fewer, about so many in all.
const PLACES_PER_TURN: usize = 16;
const PLACES_BETWEEN: usize = 1000;
/// Least such places along a whole hole; the strip beside a helix is straight.
const LEAST_PLACES: usize = 8;
/// Where they lie between a side of the hole and its next copy: no slot is likely to be just so wide that they lie on its other side.
const BETWEEN: [f64; 4] = [0.23, 0.41, 0.59, 0.77];
/// Most turns of a hole that are looked at.
const MOST_TURNS: i32 = 64;
/// Sides of a chain that one box is around.
const SIDES_OF_RUN: usize = 16;

/// A seam's way: the numbers of its start and goal, and its places in parameters, both ends included.
pub(super) struct SeamPath {
    pub(super) start: usize,
    pub(super) goal: usize,
    pub(super) points: Vec<Uv>,
}

/// Where a seam may end.
pub(super) enum Goals<'g> {
    /// At one of these, each with its number.
    Points(&'g [(usize, Uv)]),
    /// On a line, at the foot that a place has there; its number is 0.
    Line(&'g dyn Fn(Uv) -> Uv),
}

/// What a seam must not cross, with its copies by multiples of the displacement: closed holes and open borders, in parameters.
pub(super) struct Obstacles<'o> {
    holes: &'o [Vec<Uv>],
    borders: &'o [Vec<Uv>],
    displacement: Uv,
    chains: Vec<Chain<'o>>,
}

/// Places one after the other, in parameters, with boxes around runs of the sides between them.
struct Chain<'o> {
    places: &'o [Uv],
    closed: bool,
    /// What it is copied by; without one it stands once.
    period: Uv,
    /// The least and the most of its places along the period, in periods.
    along: [f64; 2],
    /// Lowest and highest corner around each [`SIDES_OF_RUN`] sides.
    boxes: Vec<[Uv; 2]>,
}

/// A corner on the way.
struct Node {
    place: Uv,
    /// Length of the way to it, mm; infinite while none is known.
    length: f64,
    /// The node before it; starts have none.
    before: Option<usize>,
    settled: bool,
}

impl<'o> Obstacles<'o> {
    pub(super) fn new(holes: &'o [Vec<Uv>], borders: &'o [Vec<Uv>], displacement: Uv) -> Self {
        let closed = holes.iter().map(|places| Chain::new(places, true, displacement));
        let chains = closed.chain(borders.iter().map(|places| Chain::new(places, false, displacement))).collect();
        Self { holes, borders, displacement, chains }
    }

    /// Whether the straight line between two places crosses no hole, no border and no copy of these.
    pub(super) fn leave_free(&self, from: Uv, to: Uv) -> bool {
        !self.chains.iter().any(|chain| chain.is_crossed(from, to))
    }

    /// Returns the shortest way found from one of the starts to a goal, by lengths on the surface near the first start; `None` where holes
    /// and borders leave none.
    pub(super) fn way_around(&self, starts: &[Uv], goals: &Goals<'_>, metric: &Derivatives) -> Option<SeamPath> {
        // Beside a hole of several turns no corner of a box helps.
        let between = Some(self.between_turns()).filter(|places| !places.is_empty());
        let mut around_holes = between.into_iter().chain(MARGINS.iter().map(|margin| self.corners(*margin)));
        let found = around_holes.find_map(|corners| self.way_by(starts, goals, metric, corners));
        // Where the loops themselves are in the way, by places between them.
        found.or_else(|| {
            let everywhere = [self.corners(MARGINS[MARGINS.len() - 1]), self.lattice()].concat();
            self.way_by(starts, goals, metric, everywhere)
        })
    }

    /// Returns how many displacements the longest hole reaches over, beyond the one in which a seam has room beside a short one: as many
    /// turns a seam may have to make with it.
    pub(super) fn turns(&self) -> i32 {
        self.holes.iter().map(|hole| turns_of(hole, self.displacement)).max().unwrap_or(0)
    }

    /// Returns the shortest way from a start to a goal by way of these corners that nothing bars; `None` without one, and where it would
    /// cross its own copies.
    fn way_by(&self, starts: &[Uv], goals: &Goals<'_>, metric: &Derivatives, corners: Vec<Uv>) -> Option<SeamPath> {
        let length = |a: Uv, b: Uv| (metric.du * (b.x - a.x) + metric.dv * (b.y - a.y)).length();
        let node = |place: Uv, length: f64| Node { place, length, before: None, settled: false };
        // Dijkstra's algorithm over the corners that see each other; the last leg is tried from each that is settled.
        let mut nodes: Vec<Node> = starts.iter().map(|p| node(*p, 0.0)).collect();
        nodes.extend(corners.into_iter().map(|p| node(p, f64::INFINITY)));
        // Shortest complete way so far: its length, last node, goal and end.
        let mut best: Option<(f64, usize, usize, Uv)> = None;
        loop {
            let open = (0..nodes.len()).filter(|&i| !nodes[i].settled && nodes[i].length.is_finite());
            let Some(i) = open.min_by(|&a, &b| nodes[a].length.total_cmp(&nodes[b].length)) else { break };
            let (place, so_far) = (nodes[i].place, nodes[i].length);
            // Nodes are settled in order of length: what is left is longer than the best whole way.
            if best.is_some_and(|b| b.0 <= so_far) {
                break;
            }
            nodes[i].settled = true;
            let mut reach = |goal: usize, end: Uv| {
                let whole = so_far + length(place, end);
                if best.is_none_or(|b| whole < b.0) && self.leave_free(place, end) {
                    best = Some((whole, i, goal, end));
                }
            };
            match goals {
                Goals::Points(points) => points.iter().for_each(|(goal, end)| reach(*goal, *end)),
                Goals::Line(foot) => reach(0, foot(place)),
            }
            for k in 0..nodes.len() {
                let whole = so_far + length(place, nodes[k].place);
                if !nodes[k].settled && whole < nodes[k].length && self.leave_free(place, nodes[k].place) {
                    nodes[k].length = whole;
                    nodes[k].before = Some(i);
                }
            }
        }
        let (_, last, goal, end) = best?;
        let mut points = vec![end];
        let mut at = last;
        loop {
            points.push(nodes[at].place);
            match nodes[at].before {
                Some(before) => at = before,
                None => break,
            }
        }
        points.reverse();
        // A way that crosses itself is no seam.
        self.is_simple(&points).then_some(SeamPath { start: at, goal, points })
    }

    /// Returns the corners of boxes around the holes, larger by a share of their size, and around their next copies; [`MAX_CORNERS`] at
    /// most.
    fn corners(&self, margin: f64) -> Vec<Uv> {
        let mut corners = Vec::new();
        for hole in self.holes {
            let lo = hole.iter().fold(Uv::INFINITY, |m, p| m.min(*p));
            let hi = hole.iter().fold(Uv::NEG_INFINITY, |m, p| m.max(*p));
            let off = margin * (hi - lo);
            for copy in [0.0, -1.0, 1.0] {
                let by = self.displacement * copy;
                let [a, b] = [lo - off + by, hi + off + by];
                corners.extend([a, Uv::new(b.x, a.y), b, Uv::new(a.x, b.y)]);
            }
        }
        corners.truncate(MAX_CORNERS);
        corners
    }

    /// Returns the places, in parameters, of a square lattice over the box of the borders, [`LATTICE`] steps each way.
    fn lattice(&self) -> Vec<Uv> {
        let points = || self.borders.iter().flatten();
        let lo = points().fold(Uv::INFINITY, |m, p| m.min(*p));
        let hi = points().fold(Uv::NEG_INFINITY, |m, p| m.max(*p));
        let cell = (hi - lo) / LATTICE;
        let mut places = Vec::new();
        for i in 0..=LATTICE as usize {
            for j in 0..=LATTICE as usize {
                places.push(lo + cell * Uv::new(i as f64, j as f64));
            }
        }
        places
    }

    /// Returns places between each hole of more than one turn, such as a slot along a helix, and its next copy, in all turns that the hole
    /// has.
    fn between_turns(&self) -> Vec<Uv> {
        let mut places = Vec::new();
        for hole in self.holes {
            let turns = turns_of(hole, self.displacement);
            let Some(most) = PLACES_BETWEEN.checked_div(2 * BETWEEN.len() * turns as usize) else { continue };
            let count = (PLACES_PER_TURN * turns as usize).min(most).max(LEAST_PLACES);
            for (copy, share) in (-turns..turns).flat_map(|copy| BETWEEN.map(|share| (copy, share))) {
                let by = self.displacement * (f64::from(copy) + share);
                places.extend((0..count).map(|k| hole[k * hole.len() / count] + by));
            }
        }
        places.truncate(MAX_CORNERS);
        places
    }

    /// Whether a way misses its copies on both sides: the cut surface then lies in one sheet.
    fn is_simple(&self, points: &[Uv]) -> bool {
        let chain = Chain::new(points, false, Uv::ZERO);
        let crosses_copy = |side: &[Uv]| {
            [-1.0, 1.0].iter().any(|&copy| {
                let by = self.displacement * copy;
                chain.is_crossed(side[0] + by, side[1] + by)
            })
        };
        !points.windows(2).any(crosses_copy)
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
fn turns_of(hole: &[Uv], period: Uv) -> i32 {
    let [lo, hi] = range_along(hole, period);
    (hi - lo).clamp(0.0, f64::from(MOST_TURNS)) as i32
}

impl<'o> Chain<'o> {
    fn new(places: &'o [Uv], closed: bool, period: Uv) -> Self {
        let n = places.len();
        let sides = if closed { n } else { n.saturating_sub(1) };
        let around = |first: usize| {
            let run = || (first..=(first + SIDES_OF_RUN).min(sides)).map(|k| places[k % n]);
            [run().fold(Uv::INFINITY, Uv::min), run().fold(Uv::NEG_INFINITY, Uv::max)]
        };
        let boxes = (0..sides).step_by(SIDES_OF_RUN).map(around).collect();
        Self { places, closed, period, along: range_along(places, period), boxes }
    }

    /// Whether the segment between two places crosses the chain or a copy of it; touching does not count, a corner between both sides does.
    fn is_crossed(&self, a: Uv, b: Uv) -> bool {
        let slack = CROSSING_NOISE * (b - a).length();
        self.copies_beside([a, b]).any(|copy| {
            let by = self.period * f64::from(copy);
            let (lo, hi) = (a.min(b) - by - slack, a.max(b) - by + slack);
            let meets = |[low, high]: [Uv; 2]| high.cmpge(lo).all() && low.cmple(hi).all();
            let near = self.boxes.iter().enumerate().filter(|(_, around)| meets(**around));
            let mut sides = near.flat_map(|(run, _)| (run * SIDES_OF_RUN..self.sides()).take(SIDES_OF_RUN));
            sides.any(|side| self.side_is_crossed(side, [a - by, b - by]))
        })
    }

    /// Returns how many sides it has.
    fn sides(&self) -> usize {
        if self.closed { self.places.len() } else { self.places.len() - 1 }
    }

    /// Returns by how many periods copies of it are moved that may meet a segment.
    fn copies_beside(&self, segment: [Uv; 2]) -> RangeInclusive<i32> {
        if self.period == Uv::ZERO {
            return 0..=0;
        }
        let [lo, hi] = self.along;
        let [from, to] = range_along(&segment, self.period);
        let first = (from - hi - CROSSING_NOISE).ceil().max(f64::from(-MOST_TURNS));
        let last = (to - lo + CROSSING_NOISE).floor().min(f64::from(MOST_TURNS));
        first as i32..=last as i32
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Point, Vector};

    /// A unit strip with a hole in the way of its only straight seam.
    #[test]
    fn a_seam_runs_around_the_hole_in_its_way() {
        let turn = Uv::new(6.0, 0.0);
        let line = |v: f64| unrolled_polygon(&[Uv::new(0.0, v), Uv::new(3.0, v)], turn);
        let hole: Vec<Uv> = (0..16)
            .map(|k| Uv::from_angle(f64::from(k) * std::f64::consts::FRAC_PI_8) * 0.3 + Uv::new(0.0, 0.5))
            .collect();
        let metric = Derivatives { point: Point::ZERO, du: Vector::X, dv: Vector::Y };
        let holes = [hole];
        let borders = [line(0.0), line(1.0)];
        let obstacles = Obstacles::new(&holes, &borders, turn);
        let (start, goal) = (Uv::ZERO, Uv::new(0.0, 1.0));
        assert!(!obstacles.leave_free(start, goal));
        let path = obstacles.way_around(&[start], &Goals::Points(&[(7, goal)]), &metric).expect("a way");
        assert_eq!(
            (path.start, path.goal, path.points[0], path.points[path.points.len() - 1]),
            (0, 7, start, goal)
        );
        assert!(path.points.len() > 2 && path.points.windows(2).all(|s| obstacles.leave_free(s[0], s[1])));
        // A hole whose corners lie on the straight seam is in its way as well.
        let turned: Vec<Uv> = obstacles.holes[0].iter().map(|p| *p + Uv::new(1.0, 0.0)).collect();
        let through = [turned];
        let obstacles = Obstacles::new(&through, &borders, turn);
        assert!(!obstacles.leave_free(Uv::new(1.0, 0.0), Uv::new(1.0, 1.0)));
        assert!(obstacles.leave_free(Uv::new(1.3, 0.0), Uv::new(1.3, 1.0)), "a hole that is touched");
        let obstacles = Obstacles::new(&holes, &borders, turn);
        let foot = |p: Uv| Uv::new(p.x, 1.0);
        let border = obstacles.way_around(&[start], &Goals::Line(&foot), &metric).expect("a way to the border");
        assert_eq!(border.points[border.points.len() - 1].y, 1.0);
    }

    /// A strip with a slot that leans over four of its periods: a straight way crosses copies of it that lie far off.
    #[test]
    fn a_seam_turns_as_often_as_the_slot_beside_it() {
        let turn = Uv::new(6.0, 0.0);
        let line = |v: f64| unrolled_polygon(&[Uv::new(0.0, v), Uv::new(3.0, v)], turn);
        let along = |x: f64| Uv::new(x, 1.0 + x / 6.0);
        let lower = (0..=48).map(|k| along(0.5 * f64::from(k)));
        let slot: Vec<Uv> = lower.clone().chain(lower.rev().map(|p| p + Uv::new(0.0, 0.3))).collect();
        let holes = [slot];
        let borders = [line(0.0), line(6.5)];
        let obstacles = Obstacles::new(&holes, &borders, turn);
        assert_eq!(obstacles.turns(), 4);
        for copy in -4..=4 {
            let across = Uv::new(6.0 * f64::from(copy) + 12.0, 0.0);
            assert!(!obstacles.leave_free(across, across + Uv::new(0.0, 6.5)), "copy {copy}");
        }
        let start = Uv::new(1.0, 0.0);
        let goals: Vec<(usize, Uv)> = (-4..=4).map(|turn| (0, Uv::new(6.0 * f64::from(turn) + 1.0, 6.5))).collect();
        let metric = Derivatives { point: Point::ZERO, du: Vector::X, dv: Vector::Y };
        let path = obstacles.way_around(&[start], &Goals::Points(&goals), &metric).expect("a way");
        assert!(path.points.windows(2).all(|s| obstacles.leave_free(s[0], s[1])));
        // The slot's middle leans by 24 from its lower end to its upper one: three whole turns at least.
        let end = path.points[path.points.len() - 1];
        assert!((end - start).x >= 18.0, "{end}");
    }
}
