//! Numbered points looked up by place.

use super::Point;
use rustc_hash::FxHashMap;

/// Numbers of points by the cube in which they lie, for finding those within a small distance of a place.
pub(crate) struct NearPoints {
    /// The distance, and the side of the cubes.
    distance: f64,
    cubes: FxHashMap<[i64; 3], Vec<u32>>,
}

impl NearPoints {
    /// Makes an empty set to be asked for points within `distance`, above 0.
    pub(crate) fn within(distance: f64) -> Self {
        Self { distance, cubes: FxHashMap::default() }
    }

    /// The cube that holds a place, in whole sides from the origin.
    fn cube(&self, p: Point) -> [i64; 3] {
        p.to_array().map(|x| (x / self.distance).floor() as i64)
    }

    /// Adds a point by its number.
    pub(crate) fn insert(&mut self, p: Point, number: u32) {
        self.cubes.entry(self.cube(p)).or_default().push(number);
    }

    /// Returns the least number of a point within the distance of `p` that `is_meant`; `place` gives each point's place.
    pub(crate) fn first(
        &self,
        p: Point,
        place: impl Fn(u32) -> Point,
        is_meant: impl Fn(u32) -> bool,
    ) -> Option<u32> {
        let cube = self.cube(p);
        let steps = (0..27).map(|k: i64| [k % 3, k / 3 % 3, k / 9]);
        let around = steps.map(|step| [0, 1, 2].map(|d| cube[d].saturating_add(step[d] - 1)));
        let candidates = around.filter_map(|cube| self.cubes.get(&cube)).flatten().copied();
        candidates.filter(|&k| (place(k) - p).length() <= self.distance && is_meant(k)).min()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_found_within_the_distance_whichever_cube_they_lie_in() {
        let points = [Point::new(0.99, -0.01, 3.0), Point::new(1.01, 0.01, 3.0), Point::new(1.6, 0.01, 3.0)];
        let mut near = NearPoints::within(0.5);
        points.iter().zip(0..).for_each(|(p, k)| near.insert(*p, k));
        let first = |p: Point, is_meant: fn(u32) -> bool| near.first(p, |k| points[k as usize], is_meant);
        assert_eq!(first(points[1], |_| true), Some(0));
        assert_eq!(first(points[1], |k| k > 0), Some(1));
        assert_eq!(first(points[2], |_| true), Some(2));
        assert_eq!(first(Point::new(2.2, 0.0, 3.0), |_| true), None);
    }
}
