//! The way of a seam from one loop to another past the holes between them: the shortest one by corners of boxes around the holes, else by
//! corners of the holes.
//!
//! Among too many holes for that, as in a tube with thousands of staggered windows, a straight line is divided between holes that it
//! crosses, and each stage gets its own shortest way: the work then grows with the holes on the line. Guarantee: all work is taken from the
//! face's budget. Known weakness: where the loops themselves bar every straight line, only the holes nearest to it are passed.

use super::clearance::{CORNERS_OF_BOX, NEAR_SHARE};
use super::fit::{Budget, Overrun};
use super::obstacles::{Obstacles, bounds, crosses_itself, turns_of};
use super::way_search::{COPIES, Goals, MARGINS, MOST_HOLES, SeamPath, Search};
use crate::math::Uv;
use crate::nurbs::Derivatives;

/// Most places by which a way is sought past everything at once.
const MOST_PLACES: usize = 4000;
/// Holes that the line of a stage may cross: past so many staggered windows a way takes in some thirty.
const HOLES_OF_STAGE: usize = 4;
/// Most holes that a stage takes in.
const MOST_HOLES_OF_STAGE: usize = 64;

/// Places along each side of the strip between two loops that are in each other's way.
const LATTICE: f64 = 24.0;
/// Places between two turns of a hole: so many along each of its turns, of a hole of many turns fewer, about so many in all.
const PLACES_PER_TURN: usize = 16;
const PLACES_BETWEEN: usize = 1000;
/// Least such places along a whole hole; the strip beside a helix is straight.
const LEAST_PLACES: usize = 8;
/// Where they lie between a side of the hole and its next copy: no slot is likely to be just so wide that they lie on its other side.
const BETWEEN: [f64; 4] = [0.23, 0.41, 0.59, 0.77];

impl Obstacles<'_> {
    /// Returns the shortest way found from one of the starts to a goal, by lengths on the surface near the first start; `None` where holes
    /// and borders leave none. Fails when the budget is used up.
    pub(super) fn way_around(
        &self,
        starts: &[Uv],
        goals: &Goals<'_>,
        metric: &Derivatives,
        budget: &Budget,
    ) -> Result<Option<SeamPath>, Overrun> {
        let way = self.way_by_any_search(starts, goals, metric, budget)?;
        // A seam through a hole would make a wrong face of one that can be refused.
        Ok(way.filter(|way| way.points.windows(2).all(|leg| self.leave_free(leg[0], leg[1]))))
    }

    /// Returns the way of the first search that finds one.
    fn way_by_any_search(
        &self,
        starts: &[Uv],
        goals: &Goals<'_>,
        metric: &Derivatives,
        budget: &Budget,
    ) -> Result<Option<SeamPath>, Overrun> {
        let borders = Obstacles::new(&[], self.borders, self.displacement);
        let most_holes = MOST_HOLES;
        let search = Search { obstacles: self, borders: &borders, starts, goals, metric, budget, most_holes };
        // Beside a hole of several turns no corner of a box helps.
        let between = self.between_turns();
        if !between.is_empty()
            && let Some(way) = search.way_by_all(&between)?
        {
            return Ok(Some(way));
        }
        if let Some(way) = search.way_by_boxes()? {
            return Ok(Some(way));
        }
        let has_few = COPIES.len() * self.holes.len() <= MOST_HOLES;
        if !has_few && let Some(way) = search.way_in_stages()? {
            return Ok(Some(way));
        }
        if let Some(way) = search.way_by_outlines()? {
            return Ok(Some(way));
        }
        // Where the loops themselves are in the way, by places between them.
        let near = search.copies_by_distance().into_iter().take(MOST_PLACES / CORNERS_OF_BOX);
        let corners = near.flat_map(|copy| self.corners(copy, MARGINS[MARGINS.len() - 1]));
        let places: Vec<Uv> = corners.chain(self.lattice()).collect();
        search.way_by_all(&places)
    }

    /// Returns the places, in parameters, that are clear of a square lattice over the box of the borders, [`LATTICE`] steps each way.
    fn lattice(&self) -> Vec<Uv> {
        let [lo, hi] = bounds(self.borders.iter().flatten());
        let cell = (hi - lo) / LATTICE;
        let mut places = Vec::new();
        for i in 0..=LATTICE as usize {
            for j in 0..=LATTICE as usize {
                places.push(lo + cell * Uv::new(i as f64, j as f64));
            }
        }
        places.retain(|&place| self.is_clear(place, NEAR_SHARE * cell));
        places
    }

    /// Returns places between each hole of more than one turn, such as a slot along a helix, and its next copy, in all turns that the hole
    /// has, as far as they are clear.
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
        places.truncate(MOST_PLACES);
        places.retain(|&place| self.is_clear(place, Uv::ZERO));
        places
    }

    /// Returns a way without those of its places whose neighbours see each other.
    fn pulled_taut(&self, places: &[Uv]) -> Vec<Uv> {
        let mut taut: Vec<Uv> = Vec::with_capacity(places.len());
        for &place in places {
            while taut.len() > 1 && self.leave_free(taut[taut.len() - 2], place) {
                taut.pop();
            }
            taut.push(place);
        }
        taut
    }
}

impl Search<'_> {
    /// Returns a way along a straight line, by stages; `None` where borders bar every line or a stage has no way, and where it would cross
    /// itself or its own copies.
    fn way_in_stages(&self) -> Result<Option<SeamPath>, Overrun> {
        let Some(SeamPath { start, goal, points: line }) = self.line_past_borders() else { return Ok(None) };
        let Some(places) = self.places_between(line[0], line[1])? else { return Ok(None) };
        // The ends of stages help no further.
        let points = self.obstacles.pulled_taut(&places);
        let is_sound = self.obstacles.is_simple(&points) && !crosses_itself(&points);
        Ok(is_sound.then_some(SeamPath { start, goal, points }))
    }

    /// Returns the straight line from a start to the goal nearest to it that no border bars and that crosses the fewest holes, the first of
    /// several.
    fn line_past_borders(&self) -> Option<SeamPath> {
        let lines = self.starts.iter().enumerate().filter_map(|(start, &from)| {
            let (goal, end) = match self.goals {
                Goals::Points(points) => *points
                    .iter()
                    .min_by(|(_, p), (_, q)| self.length(from, *p).total_cmp(&self.length(from, *q)))?,
                Goals::Line(foot) => (0, foot(from)),
            };
            self.borders.leave_free(from, end).then(|| SeamPath { start, goal, points: vec![from, end] })
        });
        lines.min_by_key(|line| self.obstacles.crossed_by(&line.points).len())
    }

    /// Returns the places of a way from `a` to `b`, both included: the shortest one where the line between them crosses few holes, else by
    /// way of a place on the line between two of these.
    fn places_between(&self, a: Uv, b: Uv) -> Result<Option<Vec<Uv>>, Overrun> {
        let gaps = self.obstacles.gaps_between_holes(a, b);
        if gaps.len() < HOLES_OF_STAGE {
            let (starts, ends) = ([a], [(0, b)]);
            let goals = Goals::Points(&ends);
            let Self { obstacles, borders, metric, budget, .. } = *self;
            let most_holes = MOST_HOLES_OF_STAGE;
            let stage = Search { obstacles, borders, starts: &starts, goals: &goals, metric, budget, most_holes };
            if let Some(way) = stage.way_by_boxes()? {
                return Ok(Some(way.points));
            }
            if let Some(way) = stage.way_by_outlines()? {
                return Ok(Some(way.points));
            }
        }
        // The widest gap whose middle is clear, of those that leave a quarter of the holes on either side.
        let middle_of = |gap: [f64; 2]| a + (b - a) * (0.5 * (gap[0] + gap[1]));
        let is_clear = |gap: &[f64; 2]| {
            let room = NEAR_SHARE * (gap[1] - gap[0]) * (b - a).abs();
            self.obstacles.is_clear(middle_of(*gap), room)
        };
        let middle = &gaps[gaps.len() / 4..(3 * gaps.len()).div_ceil(4)];
        let clear = middle.iter().copied().filter(is_clear);
        let widest = clear.max_by(|x, y| (x[1] - x[0]).total_cmp(&(y[1] - y[0])));
        let Some(place) = widest.map(middle_of) else { return Ok(None) };
        let Some(mut places) = self.places_between(a, place)? else { return Ok(None) };
        let Some(others) = self.places_between(place, b)? else { return Ok(None) };
        places.extend_from_slice(&others[1..]);
        Ok(Some(places))
    }
}

#[cfg(test)]
mod tests {
    use super::super::obstacles::unrolled_polygon;
    use super::*;
    use crate::math::{Point, Vector};

    /// Returns the way in a plane, and how many steps it took to find it.
    fn way_and_steps(obstacles: &Obstacles<'_>, starts: &[Uv], goals: &Goals<'_>) -> (SeamPath, u64) {
        let metric = Derivatives { point: Point::ZERO, du: Vector::X, dv: Vector::Y };
        let budget = Budget::new(u64::MAX);
        let before = budget.steps_left();
        let way = obstacles.way_around(starts, goals, &metric, &budget).expect("no budget is used up");
        (way.expect("a way"), before - budget.steps_left())
    }

    fn way(obstacles: &Obstacles<'_>, starts: &[Uv], goals: &Goals<'_>) -> SeamPath {
        way_and_steps(obstacles, starts, goals).0
    }

    /// A unit strip with a hole in the way of its only straight seam.
    #[test]
    fn a_seam_runs_around_the_hole_in_its_way() {
        let turn = Uv::new(6.0, 0.0);
        let line = |v: f64| unrolled_polygon(&[Uv::new(0.0, v), Uv::new(3.0, v)], turn);
        let hole: Vec<Uv> = (0..16)
            .map(|k| Uv::from_angle(f64::from(k) * std::f64::consts::FRAC_PI_8) * 0.3 + Uv::new(0.0, 0.5))
            .collect();
        let holes = [hole];
        let borders = [line(0.0), line(1.0)];
        let obstacles = Obstacles::new(&holes, &borders, turn);
        let (start, goal) = (Uv::ZERO, Uv::new(0.0, 1.0));
        assert!(!obstacles.leave_free(start, goal));
        let path = way(&obstacles, &[start], &Goals::Points(&[(7, goal)]));
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
        let border = way(&obstacles, &[start], &Goals::Line(&foot));
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
        let path = way(&obstacles, &[start], &Goals::Points(&goals));
        assert!(path.points.windows(2).all(|s| obstacles.leave_free(s[0], s[1])));
        // The slot's middle leans by 24 from its lower end to its upper one: three whole turns at least.
        let end = path.points[path.points.len() - 1];
        assert!((end - start).x >= 18.0, "{end}");
    }

    /// Rows of staggered windows in a unit pitch, each over 0.3 to both sides of its middle, in no order.
    fn staggered_windows(across: i32, rows: i32) -> Vec<Vec<Uv>> {
        let window = |i: i32, j: i32| {
            let middle = Uv::new(f64::from(i) + 0.5 * f64::from(j % 2), f64::from(j) + 0.5);
            [[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]].map(|p| middle + Uv::from_array(p)).to_vec()
        };
        (0..across * rows).map(|k| window(k * 5 % across, k / across)).collect()
    }

    /// The unrolled borders of a tube that is so far around and high.
    fn rims(across: i32, rows: i32) -> [Vec<Uv>; 2] {
        let turn = Uv::new(f64::from(across), 0.0);
        [0.0, f64::from(rows)].map(|v| unrolled_polygon(&[Uv::new(0.0, v), Uv::new(0.5 * turn.x, v)], turn))
    }

    fn length(path: &SeamPath) -> f64 {
        path.points.windows(2).map(|side| (side[1] - side[0]).length()).sum()
    }

    /// A seam from row to row winds between the windows.
    #[test]
    fn a_seam_winds_through_rows_of_staggered_windows() {
        let (across, rows) = (16, 14);
        let (holes, borders) = (staggered_windows(across, rows), rims(across, rows));
        let obstacles = Obstacles::new(&holes, &borders, Uv::new(f64::from(across), 0.0));
        let (start, goal) = (Uv::ZERO, Uv::new(0.0, f64::from(rows)));
        assert_eq!(obstacles.crossed_by(&[start, goal]).len(), 7);
        let path = way(&obstacles, &[start], &Goals::Points(&[(0, goal)]));
        let ends = [path.points[0], path.points[path.points.len() - 1]];
        assert_eq!((ends, obstacles.crossed_by(&path.points)), ([start, goal], Vec::new()));
        // No longer than a way beside boxes of half side 0.42: at ±0.42 through even rows and at ±0.08 through odd ones, 0.84 along each
        // but the last, which leaves the straight way to the goal free, and from row to row across by 0.34 within 0.16.
        let winding = 0.42f64.hypot(0.08) + 13.0 * (0.84 + 0.34f64.hypot(0.16)) + 0.08f64.hypot(0.92);
        let length = length(&path);
        assert!((f64::from(rows)..winding).contains(&length), "{length} for {winding}");
    }

    /// The corners of 200 holes lead past 32 rows of 32 windows and not past 64: there the seam goes by stages. For each window and each
    /// doubling of their number it took 500 to 3000 steps.
    #[test]
    fn the_work_grows_little_faster_than_the_number_of_windows() {
        const STEPS: f64 = 1e4;
        for n in [8, 16, 32, 64] {
            let (holes, borders) = (staggered_windows(n, n), rims(n, n));
            let obstacles = Obstacles::new(&holes, &borders, Uv::new(f64::from(n), 0.0));
            let (start, goal) = (Uv::ZERO, Uv::new(0.0, f64::from(n)));
            let (path, steps) = way_and_steps(&obstacles, &[start], &Goals::Points(&[(0, goal)]));
            assert!(path.points.windows(2).all(|side| obstacles.leave_free(side[0], side[1])), "{n} rows");
            assert_eq!([path.points[0], path.points[path.points.len() - 1]], [start, goal]);
            // A row is no longer than beside boxes of half side 0.42.
            let length = length(&path);
            assert!(length < f64::from(n) * (0.84 + 0.34f64.hypot(0.16)) + 1.0, "{length} past {n} rows");
            let windows = f64::from(n * n);
            let most = STEPS * windows * windows.log2();
            assert!((steps as f64) < most, "{steps} steps for {most} past {n} rows");
        }
    }

    /// Unit windows whose webs are as wide as a box stands off, between them and before the rims: its corners lie on other windows.
    #[test]
    fn a_seam_misses_windows_whose_webs_are_as_wide_as_a_box_stands_off() {
        let (across, rows) = (6, 4);
        for &web in &MARGINS[..3] {
            for stagger in [0.0, 0.5, 1.0 / 3.0] {
                let pitch = 1.0 + web;
                let middle = |i: i32, j: i32| {
                    Uv::new(f64::from(i) + stagger * f64::from(j), f64::from(j)) * pitch + Uv::new(0.0, web + 0.5)
                };
                let window = |i: i32, j: i32| {
                    let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
                    corners.map(|p| middle(i, j) + Uv::from_array(p)).to_vec()
                };
                let holes: Vec<Vec<Uv>> = (0..across * rows).map(|k| window(k % across, k / across)).collect();
                let turn = Uv::new(f64::from(across) * pitch, 0.0);
                let height = f64::from(rows) * pitch + web;
                let rim = |v: f64| unrolled_polygon(&[Uv::new(0.0, v), Uv::new(0.5 * turn.x, v)], turn);
                let borders = [rim(0.0), rim(height)];
                let obstacles = Obstacles::new(&holes, &borders, turn);
                let path = way(&obstacles, &[Uv::ZERO], &Goals::Points(&[(0, Uv::new(0.0, height))]));
                let is_in_window = |place: Uv| {
                    (0..rows).any(|j| {
                        let off = place - middle(0, j);
                        let around = off.x - pitch * (off.x / pitch).round();
                        around.abs().max(off.y.abs()) < 0.5 - 1e-9
                    })
                };
                for leg in path.points.windows(2) {
                    let mut places = (0..=100).map(|k| leg[0].lerp(leg[1], f64::from(k) / 100.0));
                    assert!(!places.any(is_in_window), "{leg:?} with webs of {web}, staggered by {stagger}");
                    assert!(leg[0].y > 0.0 || leg[1].y > 0.0, "along the rim with webs of {web}");
                }
            }
        }
    }

    /// Holes in no order, of which one is crossed in two arms and another one is only touched.
    #[test]
    fn a_line_is_free_between_the_holes_that_it_crosses() {
        let square = |u: f64, v: f64| {
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|p| Uv::new(u, v) + Uv::from_array(p)).to_vec()
        };
        let fork =
            [[4.0, -1.0], [7.0, -1.0], [7.0, 0.5], [6.0, 0.5], [6.0, -0.5], [5.0, -0.5], [5.0, 0.5], [4.0, 0.5]];
        let holes = [fork.map(Uv::from_array).to_vec(), square(1.0, -0.5), square(2.5, 0.0), square(8.0, -0.25)];
        let obstacles = Obstacles::new(&holes, &[], Uv::ZERO);
        let gaps = obstacles.gaps_between_holes(Uv::ZERO, Uv::new(10.0, 0.0));
        let expected = [[0.2, 0.4], [0.7, 0.8]];
        assert_eq!(gaps.len(), expected.len(), "{gaps:?}");
        for (share, wanted) in gaps.iter().flatten().zip(expected.iter().flatten()) {
            assert!((share - wanted).abs() < 1e-12, "{gaps:?}");
        }
        assert!(obstacles.gaps_between_holes(Uv::new(0.0, 2.0), Uv::new(10.0, 2.0)).is_empty());
    }
}
