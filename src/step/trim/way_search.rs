//! The shortest way from one of some starts to a goal by corners that see each other.
//!
//! Source: shortest paths by visibility graphs, after Lozano-Pérez and Wesley 1979, expanded by Dijkstra only as far as needed. Holes are
//! taken in where a way crosses them: most faces of hundreds have a way past a few. Where corners of boxes leave no way, as in a honeycomb,
//! whose boxes overlap, the corners of the holes themselves are tried. Known weakness: arcs with less than a fortieth of their diameter
//! between them leave a way only where boxes do.

use super::clearance::CORNERS_OF_BOX;
use super::fit::{Budget, Overrun};
use super::obstacles::{HoleCopy, Obstacles, bounds};
use super::visibility::{Leg, Visibility};
use crate::math::{Point, Uv, distance_to_segment};
use crate::nurbs::Derivatives;

/// How far a box stands off its hole, as shares of the hole's size; the first with which there is a way.
pub(super) const MARGINS: [f64; 4] = [0.2, 0.06, 0.015, 0.004];
/// Copies of a hole that stand beside a seam: itself and those by one displacement to both sides.
pub(super) const COPIES: [i32; 3] = [0, -1, 1];
/// Most corners by which a way past holes is sought: the search is quadratic in them, and looks at 1.6e7 boxes to find that so many do not
/// lead past staggered windows.
const MOST_CORNERS: usize = 800;
/// Most holes that a search takes in.
pub(super) const MOST_HOLES: usize = MOST_CORNERS / CORNERS_OF_BOX;
/// Holes that are taken in at least where those that were met leave no way.
const FEWEST_MORE: usize = 8;

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

/// A start or a corner, on the way or not.
struct Node {
    place: Uv,
    /// Length of the way to it, mm; infinite while none is known.
    length: f64,
    /// The node before it; starts have none.
    before: Option<usize>,
    settled: bool,
}

/// A way that reaches a goal.
#[derive(Clone, Copy)]
struct WholeWay {
    /// mm.
    length: f64,
    /// Its last node before the goal.
    last: usize,
    goal: usize,
    end: Uv,
}

/// A search for a way from one of the starts to a goal.
pub(super) struct Search<'s> {
    pub(super) obstacles: &'s Obstacles<'s>,
    /// The borders alone.
    pub(super) borders: &'s Obstacles<'s>,
    pub(super) starts: &'s [Uv],
    pub(super) goals: &'s Goals<'s>,
    /// What lengths on the surface are measured by.
    pub(super) metric: &'s Derivatives,
    /// What its work is taken from.
    pub(super) budget: &'s Budget,
    /// Most holes that it takes in, [`MOST_HOLES`] or fewer.
    pub(super) most_holes: usize,
}

impl Search<'_> {
    /// Returns the shortest way past the holes by corners of boxes around those in its way; `None` without one by [`MOST_CORNERS`].
    pub(super) fn way_by_boxes(&self) -> Result<Option<SeamPath>, Overrun> {
        for margin in MARGINS {
            if let Some(way) = self.way_past(&|hole| self.obstacles.corners(hole, margin))? {
                return Ok(Some(way));
            }
        }
        Ok(None)
    }

    /// Returns the shortest way past the holes by places off the corners of those in its way; `None` without one by [`MOST_CORNERS`].
    pub(super) fn way_by_outlines(&self) -> Result<Option<SeamPath>, Overrun> {
        self.way_past(&|hole| self.obstacles.outline(hole))
    }

    /// Returns the shortest way past the holes by the corners that `corners_of` gives them: the straight one first, then by the corners of
    /// the holes that this one crosses, and so on until it crosses none. Where those leave no way, more are taken in, the nearest first.
    /// `None` without a way by [`MOST_CORNERS`], and where it would cross its own copies.
    fn way_past(&self, corners_of: &dyn Fn(HoleCopy) -> Vec<Uv>) -> Result<Option<SeamPath>, Overrun> {
        let mut visibility = Visibility::new(self.obstacles, self.borders);
        let mut corners: Vec<Uv> = Vec::new();
        let mut nearest: Option<Vec<HoleCopy>> = None;
        loop {
            let way = self.way_by(&corners, &mut |leg: &Leg| visibility.is_free(leg))?;
            let crossed: Vec<HoleCopy> = match &way {
                Some(way) => self.obstacles.crossed_by(&way.points),
                None => {
                    let nearest = nearest.get_or_insert_with(|| self.copies_by_distance());
                    let others = nearest.iter().copied().filter(|copy| !visibility.has_met(*copy));
                    others.take(visibility.met_count().max(FEWEST_MORE)).collect()
                }
            };
            if crossed.is_empty() {
                return Ok(way.filter(|way| self.obstacles.is_simple(&way.points)));
            }
            // A hole bars legs though it may have no corner that is clear.
            let before = visibility.met_count();
            for copy in crossed {
                let has_room = visibility.met_count() < self.most_holes && corners.len() < MOST_CORNERS;
                if has_room && visibility.meet(copy) {
                    corners.extend(corners_of(copy));
                }
            }
            if visibility.met_count() == before {
                return Ok(None);
            }
        }
    }

    /// Returns the shortest way by these places past all borders and holes; `None` without one, and where it would cross its own copies.
    pub(super) fn way_by_all(&self, places: &[Uv]) -> Result<Option<SeamPath>, Overrun> {
        let way = self.way_by(places, &mut |leg: &Leg| self.obstacles.leave_free(leg.ends[0], leg.ends[1]))?;
        Ok(way.filter(|way| self.obstacles.is_simple(&way.points)))
    }

    /// Returns the holes, and their copies beside them, those first that are nearest to the straight line from the first start to a goal.
    pub(super) fn copies_by_distance(&self) -> Vec<HoleCopy> {
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

    /// Returns the length of a straight line on the surface, mm.
    pub(super) fn length(&self, a: Uv, b: Uv) -> f64 {
        (self.metric.du * (b.x - a.x) + self.metric.dv * (b.y - a.y)).length()
    }

    /// Returns the shortest way from a start to a goal by way of these corners in legs that are free; `None` without one. Nodes are the
    /// starts, then the corners.
    fn way_by(&self, corners: &[Uv], is_free: &mut dyn FnMut(&Leg) -> bool) -> Result<Option<SeamPath>, Overrun> {
        let node = |place: Uv, length: f64| Node { place, length, before: None, settled: false };
        // Dijkstra's algorithm over the corners that see each other; the last leg is tried from each that is settled.
        let mut nodes: Vec<Node> = self.starts.iter().map(|p| node(*p, 0.0)).collect();
        nodes.extend(corners.iter().map(|p| node(*p, f64::INFINITY)));
        let mut best: Option<WholeWay> = None;
        loop {
            let open = (0..nodes.len()).filter(|&i| !nodes[i].settled && nodes[i].length.is_finite());
            let Some(i) = open.min_by(|&a, &b| nodes[a].length.total_cmp(&nodes[b].length)) else { break };
            let (place, so_far) = (nodes[i].place, nodes[i].length);
            // Nodes are settled in order of length: what is left is longer than the best whole way.
            if best.is_some_and(|b| b.length <= so_far) {
                break;
            }
            nodes[i].settled = true;
            let mut reach = |goal: usize, end: Uv| {
                let length = so_far + self.length(place, end);
                let leg = Leg { from: i, to: None, ends: [place, end] };
                if best.is_none_or(|b| length < b.length) && is_free(&leg) {
                    best = Some(WholeWay { length, last: i, goal, end });
                }
            };
            match self.goals {
                Goals::Points(points) => points.iter().for_each(|(goal, end)| reach(*goal, *end)),
                Goals::Line(foot) => reach(0, foot(place)),
            }
            let longest = best.map_or(f64::INFINITY, |b| b.length);
            for (corner, next) in nodes[self.starts.len()..].iter_mut().enumerate() {
                let length = so_far + self.length(place, next.place);
                let leg = Leg { from: i, to: Some(corner), ends: [place, next.place] };
                // Cheap tests come first.
                if !next.settled && length < next.length.min(longest) && is_free(&leg) {
                    next.length = length;
                    next.before = Some(i);
                }
            }
            let looks = self.obstacles.take_steps() + self.borders.take_steps();
            self.budget.spend_steps(nodes.len() as u64 + looks)?;
        }
        let Some(WholeWay { last, goal, end, .. }) = best else { return Ok(None) };
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
        Ok(Some(SeamPath { start: at, goal, points }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::obstacles::unrolled_polygon;
    use super::*;
    use crate::math::Vector;

    const ACROSS: i32 = 6;
    const ROWS: i32 = 5;

    /// Returns the way by outlines up a tube of height `height` past `ACROSS` by `ROWS` holes of unit pitch, and checks that there is none
    /// by boxes.
    fn way_by_outlines(height: f64, hole: impl Fn(i32, i32) -> Vec<Uv>) -> SeamPath {
        let turn = Uv::new(f64::from(ACROSS), 0.0);
        let rim = |v: f64| unrolled_polygon(&[Uv::new(0.0, v), Uv::new(0.5 * turn.x, v)], turn);
        let holes: Vec<Vec<Uv>> = (0..ACROSS * ROWS).map(|k| hole(k % ACROSS, k / ACROSS)).collect();
        let rims = [rim(0.0), rim(height)];
        let (obstacles, borders) = (Obstacles::new(&holes, &rims, turn), Obstacles::new(&[], &rims, turn));
        let ends = [(0, Uv::new(0.0, height))];
        let search = Search {
            obstacles: &obstacles,
            borders: &borders,
            starts: &[Uv::ZERO],
            goals: &Goals::Points(&ends),
            metric: &Derivatives { point: Point::ZERO, du: Vector::X, dv: Vector::Y },
            budget: &Budget::new(u64::MAX),
            most_holes: MOST_HOLES,
        };
        assert!(search.way_by_boxes().expect("no budget is used up").is_none(), "a way by boxes");
        search.way_by_outlines().expect("no budget is used up").expect("a way by outlines")
    }

    /// Whether a place of a way, of a hundred on each leg, is within a hole: nearer to the middle of one than `radius` by some norm.
    fn enters(way: &SeamPath, middle: impl Fn(i32, i32) -> Uv, norm: impl Fn(Uv) -> f64, radius: f64) -> bool {
        let mut middles = Vec::new();
        for i in -3..ACROSS + 3 {
            middles.extend((0..ROWS).map(|j| middle(i, j)));
        }
        let is_in_hole = |place: Uv| middles.iter().any(|m| norm(place - *m) < radius - 1e-9);
        way.points.windows(2).any(|leg| {
            let mut places = (0..=100).map(|k| leg[0].lerp(leg[1], f64::from(k) / 100.0));
            places.any(is_in_hole)
        })
    }

    fn length(way: &SeamPath) -> f64 {
        way.points.windows(2).map(|leg| (leg[1] - leg[0]).length()).sum()
    }

    /// A honeycomb with webs of a tenth of the pitch. From row to row along the webs it is as far as two sides of a cell of the pitch.
    #[test]
    fn a_seam_goes_along_the_webs_of_a_honeycomb() {
        let (row, apothem) = (0.75f64.sqrt(), 0.45);
        let middle =
            |i: i32, j: i32| Uv::new(f64::from(i) + 0.5 * f64::from(j % 2), row * (f64::from(j) + 0.5) + 0.3);
        let corner = |k: i32| Uv::from_angle((f64::from(k) + 0.5) * std::f64::consts::FRAC_PI_3) * (apothem / row);
        let way =
            way_by_outlines(row * f64::from(ROWS) + 0.6, |i, j| (0..6).map(|k| middle(i, j) + corner(k)).collect());
        // The largest distance along the normals of a cell's sides.
        let across = |p: Uv| p.x.abs().max((0.5 * p.x + row * p.y).abs()).max((0.5 * p.x - row * p.y).abs());
        assert!(!enters(&way, middle, across, apothem), "{:?}", way.points);
        let along_webs = f64::from(ROWS) / row;
        assert!(length(&way) < along_webs + 2.0, "{} for {along_webs}", length(&way));
    }

    /// Diamonds in a square lattice that stands on its corner, a tenth of the pitch from tip to tip. From row to row it is half a diagonal.
    #[test]
    fn a_seam_goes_along_the_webs_between_diamonds() {
        let half = 0.45;
        let middle = |i: i32, j: i32| Uv::new(f64::from(i) + 0.5 * f64::from(j % 2), 0.5 * f64::from(j) + 0.7);
        let way = way_by_outlines(0.5 * f64::from(ROWS - 1) + 1.4, |i, j| {
            [Uv::X, Uv::Y, Uv::NEG_X, Uv::NEG_Y].map(|tip| middle(i, j) + half * tip).to_vec()
        });
        assert!(!enters(&way, middle, |p| p.x.abs() + p.y.abs(), half), "{:?}", way.points);
        let along_webs = f64::from(ROWS) * 0.5f64.sqrt();
        assert!(length(&way) < along_webs + 2.0, "{} for {along_webs}", length(&way));
    }
}
