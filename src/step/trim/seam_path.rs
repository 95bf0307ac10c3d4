//! The way of a seam from one loop to another past the holes between them: straight where something straight is free, otherwise the
//! shortest way by corners of boxes around the holes.
//!
//! Source: shortest paths by visibility graphs, after Lozano-Pérez and Wesley 1979, expanded by Dijkstra only as far as needed. Holes are
//! taken in where a way crosses them: most faces of hundreds have a way past a few. Known weakness: a hole so near to a border or another
//! hole that the smallest box around it touches them leaves no way between.

use super::obstacles::{HoleCopy, Obstacles, turns_of};
use crate::math::{Point, Uv, distance_to_segment};
use crate::nurbs::Derivatives;
use rustc_hash::FxHashSet;

/// How far a box stands off its hole, as shares of the hole's size; the first with which there is a way.
const MARGINS: [f64; 4] = [0.2, 0.06, 0.015, 0.004];
/// Corners of one hole's box.
const CORNERS_OF_BOX: usize = 4;
/// Copies of a hole that stand beside a seam: itself and those by one displacement to both sides.
const COPIES: [i32; 3] = [0, -1, 1];
/// Corners that are tried with each margin at first: the search is quadratic in them, and takes less than a second with so many.
const FEW_CORNERS: usize = 800;
/// Most corners that are tried, those of the holes nearest to the seam.
const MAX_CORNERS: usize = 4000;
/// Holes that are taken in at least where those that were met leave no way.
const FEWEST_MORE: usize = 8;

/// Places along each side of the strip between two loops that are in each other's way.
const LATTICE: f64 = 24.0;
/// Places between two turns of a hole: so many along each of its turns, of a hole of many turns fewer, about so many in all.
const PLACES_PER_TURN: usize = 16;
const PLACES_BETWEEN: usize = 1000;
/// Least such places along a whole hole; the strip beside a helix is straight.
const LEAST_PLACES: usize = 8;
/// Where they lie between a side of the hole and its next copy: no slot is likely to be just so wide that they lie on its other side.
const BETWEEN: [f64; 4] = [0.23, 0.41, 0.59, 0.77];

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

/// A corner on the way.
struct Node {
    place: Uv,
    /// Length of the way to it, mm; infinite while none is known.
    length: f64,
    /// The node before it; starts have none.
    before: Option<usize>,
    settled: bool,
}

/// A search for a way from one of the starts to a goal.
struct Search<'s> {
    obstacles: &'s Obstacles<'s>,
    starts: &'s [Uv],
    goals: &'s Goals<'s>,
    /// What lengths on the surface are measured by.
    metric: &'s Derivatives,
}

impl Obstacles<'_> {
    /// Returns the shortest way found from one of the starts to a goal, by lengths on the surface near the first start; `None` where holes
    /// and borders leave none.
    pub(super) fn way_around(&self, starts: &[Uv], goals: &Goals<'_>, metric: &Derivatives) -> Option<SeamPath> {
        let search = Search { obstacles: self, starts, goals, metric };
        let by_places = |places: Vec<Uv>| {
            let way = search.way_by(&places, &|_| true)?;
            self.is_simple(&way.points).then_some(way)
        };
        // Beside a hole of several turns no corner of a box helps.
        let between = Some(self.between_turns()).filter(|places| !places.is_empty());
        if let Some(way) = between.and_then(by_places) {
            return Some(way);
        }
        let nearest = search.copies_by_distance();
        let has_few = nearest.len() * CORNERS_OF_BOX <= FEW_CORNERS;
        let mosts: &[usize] = if has_few { &[FEW_CORNERS] } else { &[FEW_CORNERS, MAX_CORNERS] };
        let mut tries = mosts.iter().flat_map(|most| MARGINS.iter().map(move |margin| (*most, *margin)));
        tries.find_map(|(most, margin)| search.way_past(&nearest, margin, most)).or_else(|| {
            // Where the loops themselves are in the way, by places between them.
            let near = nearest.iter().take(MAX_CORNERS / CORNERS_OF_BOX);
            let corners = near.flat_map(|copy| self.corners(*copy, MARGINS[MARGINS.len() - 1]));
            by_places(corners.chain(self.lattice()).collect())
        })
    }

    /// Returns the corners of the box around a copy of a hole, larger by a share of its size.
    fn corners(&self, HoleCopy { hole, copy }: HoleCopy, margin: f64) -> [Uv; CORNERS_OF_BOX] {
        let [lo, hi] = bounds(&self.holes[hole]);
        let off = margin * (hi - lo);
        let by = self.displacement * f64::from(copy);
        let [a, b] = [lo - off + by, hi + off + by];
        [a, Uv::new(b.x, a.y), b, Uv::new(a.x, b.y)]
    }

    /// Returns the places, in parameters, of a square lattice over the box of the borders, [`LATTICE`] steps each way.
    fn lattice(&self) -> Vec<Uv> {
        let [lo, hi] = bounds(self.borders.iter().flatten());
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
}

impl Search<'_> {
    /// Returns the shortest way past the holes by corners of boxes that stand off them by `margin`: the straight one first, then by the
    /// corners of the holes that this one crosses, and so on until it crosses none. Where those leave no way, more are taken in, in the
    /// order of `nearest`. `None` without a way by `most` corners, and where it would cross its own copies.
    fn way_past(&self, nearest: &[HoleCopy], margin: f64, most: usize) -> Option<SeamPath> {
        let mut met: FxHashSet<HoleCopy> = FxHashSet::default();
        let mut corners: Vec<Uv> = Vec::new();
        loop {
            let way = self.way_by(&corners, &|hole| met.contains(&hole));
            let crossed = match &way {
                Some(way) => self.obstacles.crossed_by(&way.points),
                None => {
                    let others = nearest.iter().filter(|copy| !met.contains(*copy));
                    others.take(met.len().max(FEWEST_MORE)).copied().collect()
                }
            };
            if crossed.is_empty() {
                return way.filter(|way| self.obstacles.is_simple(&way.points));
            }
            let before = corners.len();
            for copy in crossed {
                if corners.len() + CORNERS_OF_BOX <= most && met.insert(copy) {
                    corners.extend(self.obstacles.corners(copy, margin));
                }
            }
            if corners.len() == before {
                return None;
            }
        }
    }

    /// Returns the holes, and their copies beside them, those first that are nearest to the straight line from the first start to a goal.
    fn copies_by_distance(&self) -> Vec<HoleCopy> {
        let Some(start) = self.starts.first() else { return Vec::new() };
        let goal = match self.goals {
            Goals::Points(points) => points.first().map_or(*start, |(_, goal)| *goal),
            Goals::Line(foot) => foot(*start),
        };
        let place = |p: Uv| -> Point { self.metric.du * p.x + self.metric.dv * p.y };
        let mut copies = Vec::with_capacity(COPIES.len() * self.obstacles.holes.len());
        for (hole, polygon) in self.obstacles.holes.iter().enumerate() {
            let [lo, hi] = bounds(polygon);
            for copy in COPIES {
                let middle = 0.5 * (lo + hi) + self.obstacles.displacement * f64::from(copy);
                let distance = distance_to_segment(place(middle), place(*start), place(goal));
                copies.push((distance, HoleCopy { hole, copy }));
            }
        }
        copies.sort_by(|a, b| a.0.total_cmp(&b.0));
        copies.into_iter().map(|(_, copy)| copy).collect()
    }

    /// Returns the shortest way from a start to a goal by way of these corners that no border bars, and no hole that `is_met`; `None`
    /// without one.
    fn way_by(&self, corners: &[Uv], is_met: &dyn Fn(HoleCopy) -> bool) -> Option<SeamPath> {
        let is_free = |from: Uv, to: Uv| !self.obstacles.crosses_any(from, to, |hole| hole.is_none_or(is_met));
        let length = |a: Uv, b: Uv| (self.metric.du * (b.x - a.x) + self.metric.dv * (b.y - a.y)).length();
        let node = |place: Uv, length: f64| Node { place, length, before: None, settled: false };
        // Dijkstra's algorithm over the corners that see each other; the last leg is tried from each that is settled.
        let mut nodes: Vec<Node> = self.starts.iter().map(|p| node(*p, 0.0)).collect();
        nodes.extend(corners.iter().map(|p| node(*p, f64::INFINITY)));
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
                if best.is_none_or(|b| whole < b.0) && is_free(place, end) {
                    best = Some((whole, i, goal, end));
                }
            };
            match self.goals {
                Goals::Points(points) => points.iter().for_each(|(goal, end)| reach(*goal, *end)),
                Goals::Line(foot) => reach(0, foot(place)),
            }
            for k in 0..nodes.len() {
                let whole = so_far + length(place, nodes[k].place);
                if !nodes[k].settled && whole < nodes[k].length && is_free(place, nodes[k].place) {
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
        Some(SeamPath { start: at, goal, points })
    }
}

/// Returns the lowest and highest corner of the box around places.
fn bounds<'p>(places: impl IntoIterator<Item = &'p Uv>) -> [Uv; 2] {
    let places = places.into_iter();
    places.fold([Uv::INFINITY, Uv::NEG_INFINITY], |[lo, hi], p| [lo.min(*p), hi.max(*p)])
}

#[cfg(test)]
mod tests {
    use super::super::obstacles::unrolled_polygon;
    use super::*;
    use crate::math::Vector;

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
        let turned: Vec<Uv> = holes[0].iter().map(|p| *p + Uv::new(1.0, 0.0)).collect();
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

    /// Rows of staggered windows, each over 0.3 of the pitch to both sides of its middle: a seam from row to row winds between them, past
    /// windows that stand in no order.
    #[test]
    fn a_seam_winds_through_rows_of_staggered_windows() {
        let (across, rows) = (16i32, 14i32);
        let turn = Uv::new(f64::from(across), 0.0);
        let line = |v: f64| unrolled_polygon(&[Uv::new(0.0, v), Uv::new(8.0, v)], turn);
        let window = |i: i32, j: i32| {
            let middle = Uv::new(f64::from(i) + 0.5 * f64::from(j % 2), f64::from(j) + 0.5);
            [[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]].map(|p| middle + Uv::from_array(p)).to_vec()
        };
        let all = |k: i32| window(k * 5 % across, k / across);
        let holes: Vec<Vec<Uv>> = (0..across * rows).map(all).collect();
        let borders = [line(0.0), line(f64::from(rows))];
        let obstacles = Obstacles::new(&holes, &borders, turn);
        let (start, goal) = (Uv::ZERO, Uv::new(0.0, f64::from(rows)));
        let metric = Derivatives { point: Point::ZERO, du: Vector::X, dv: Vector::Y };
        assert_eq!(obstacles.crossed_by(&[start, goal]).len(), 7);
        let path = obstacles.way_around(&[start], &Goals::Points(&[(0, goal)]), &metric).expect("a way");
        let ends = [path.points[0], path.points[path.points.len() - 1]];
        assert_eq!((ends, obstacles.crossed_by(&path.points)), ([start, goal], Vec::new()));
        // No longer than a way beside boxes of half side 0.42: at ±0.42 through even rows and at ±0.08 through odd ones, 0.84 along each
        // but the last, which leaves the straight way to the goal free, and from row to row across by 0.34 within 0.16.
        let length: f64 = path.points.windows(2).map(|side| (side[1] - side[0]).length()).sum();
        let winding = 0.42f64.hypot(0.08) + 13.0 * (0.84 + 0.34f64.hypot(0.16)) + 0.08f64.hypot(0.92);
        assert!((f64::from(rows)..winding).contains(&length), "{length} for {winding}");
    }
}
