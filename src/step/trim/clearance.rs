//! Places beside holes at which a seam may turn: clear of all holes and borders.
//!
//! Corners of a box around a hole serve among squares and circles. In a honeycomb they lie in the neighbours; there the places stand off
//! the corners of the hole itself, each by a share of the way to what is nearest to it.

use super::obstacles::{HoleCopy, Obstacles};
use super::segment::Segment;
use crate::math::Uv;
use crate::math::polygon::{nearest_on_side, polygon_sides, signed_area};

/// Corners of one hole's box.
pub(super) const CORNERS_OF_BOX: usize = 4;
/// A place nearer to a side than this share of the size of what it stands beside counts as on it: far above the noise of fits, 1e-6 mm, and
/// far below the least share by which places are off.
pub(super) const NEAR_SHARE: f64 = 1e-4;
/// A hole has a corner wherever its outline has turned by so much since the last one, rad: a circle has at most 18.
const TURN_OF_CORNER: f64 = 0.34;
/// Most corners of one outline; of more every second or third is taken.
const MOST_OF_OUTLINE: usize = 24;
/// How far from a corner other holes and borders are looked for, as a share of the hole's size.
const FARTHEST: f64 = 0.5;
/// Share of the way to the nearest of them by which a place stands off a corner. At the half, places of neighbours would be the same.
const SHARE_OF_CLEARANCE: f64 = 0.4;

impl Obstacles<'_> {
    /// Whether a place is in no hole, and no side of a hole or border meets the box around it that reaches over `room` to each side.
    pub(super) fn is_clear(&self, place: Uv, room: Uv) -> bool {
        let around = [place - room, place + room];
        !self.any_side_near(around, |_, side| Segment::new(side).may_meet(around)) && !self.lies_in_hole(place)
    }

    /// Returns the corners of the box around a copy of a hole, larger by a share of its size, that are clear.
    pub(super) fn corners(&self, copy: HoleCopy, margin: f64) -> Vec<Uv> {
        let [lo, hi] = self.bounds_of(copy);
        let size = hi - lo;
        let [a, b] = [lo - margin * size, hi + margin * size];
        let corners: [Uv; CORNERS_OF_BOX] = [a, Uv::new(b.x, a.y), b, Uv::new(a.x, b.y)];
        corners.into_iter().filter(|&corner| self.is_clear(corner, NEAR_SHARE * size)).collect()
    }

    /// Returns places off the corners of a copy of a hole, those that are clear.
    pub(super) fn outline(&self, HoleCopy { hole, copy }: HoleCopy) -> Vec<Uv> {
        let own = HoleCopy { hole, copy: 0 };
        let [lo, hi] = self.bounds_of(own);
        let size = hi - lo;
        if !(size.min_element() > 0.0) {
            return Vec::new();
        }
        // Angles and distances are those in a box of sides 1: directions in parameters have units of their own.
        let polygon: Vec<Uv> = self.holes[hole].iter().map(|p| (*p - lo) / size).collect();
        let corners = outline_corners(&polygon);
        let by = self.displacement * f64::from(copy);
        let mut places = Vec::new();
        for corner in corners.iter().step_by(corners.len().div_ceil(MOST_OF_OUTLINE).max(1)) {
            let off = SHARE_OF_CLEARANCE * self.clearance(own, lo + corner.place * size, size);
            let place = lo + (corner.place + corner.outward * off) * size;
            if self.is_clear(place, NEAR_SHARE * size) {
                places.push(place + by);
            }
        }
        places
    }

    /// Returns the distance from a place to the nearest side of another hole or of a border, as a share of `size`; [`FARTHEST`] at most.
    fn clearance(&self, own: HoleCopy, place: Uv, size: Uv) -> f64 {
        let reach = FARTHEST * size;
        let mut nearest = FARTHEST;
        self.any_side_near([place - reach, place + reach], |hole, side| {
            let side = side.map(|p| (p - place) / size);
            if hole != Some(own) && side[0] != side[1] {
                nearest = nearest.min(nearest_on_side(side, Uv::ZERO).length());
            }
            false
        });
        nearest
    }
}

/// A corner of a hole's outline.
struct OutlineCorner {
    place: Uv,
    /// Of length 1.
    outward: Uv,
}

/// Returns where a polygon has turned by [`TURN_OF_CORNER`] since the last such place.
fn outline_corners(polygon: &[Uv]) -> Vec<OutlineCorner> {
    let sides: Vec<[Uv; 2]> = polygon_sides(polygon).filter(|[a, b]| a != b).collect();
    let directions: Vec<Uv> = sides.iter().map(|[a, b]| (*b - *a).normalize()).collect();
    let sense = signed_area(polygon).signum();
    let mut corners = Vec::new();
    let mut turned = 0.0f64;
    for (k, [place, _]) in sides.iter().enumerate() {
        let (before, after) = (directions[(k + sides.len() - 1) % sides.len()], directions[k]);
        turned += before.perp_dot(after).atan2(before.dot(after));
        if turned.abs() < TURN_OF_CORNER {
            continue;
        }
        turned = 0.0;
        // Between what is outward on both sides; the tip of a spike points outward.
        let outward = (-sense * (before + after).perp()).try_normalize().unwrap_or(before);
        corners.push(OutlineCorner { place: *place, outward });
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::super::obstacles::unrolled_polygon;
    use super::*;

    /// A strip of height 4 and period 6 with a unit square in it.
    #[test]
    fn a_place_is_clear_beside_holes_and_borders_alone() {
        let turn = Uv::new(6.0, 0.0);
        let line = |v: f64| unrolled_polygon(&[Uv::new(0.0, v), Uv::new(3.0, v)], turn);
        let holes = [[[1., 1.], [2., 1.], [2., 2.], [1., 2.]].map(Uv::from).to_vec()];
        let borders = [line(0.0), line(4.0)];
        let obstacles = Obstacles::new(&holes, &borders, turn);
        let is_clear = |u: f64, v: f64| obstacles.is_clear(Uv::new(u, v), Uv::splat(1e-3));
        for turns in [-2.0, 0.0, 1.0] {
            let u = 6.0 * turns;
            // Inside, on a side, at a corner, just beside it, and on a border.
            for (x, v) in [(1.5, 1.5), (2.0, 1.5), (1.0, 2.0), (2.0005, 1.5), (0.9995, 0.9995), (4.5, 4.0)] {
                assert!(!is_clear(u + x, v), "({}, {v})", u + x);
            }
            for (x, v) in [(2.002, 1.5), (0.998, 0.998), (4.5, 3.99), (1.5, 0.01)] {
                assert!(is_clear(u + x, v), "({}, {v})", u + x);
            }
        }
    }

    /// Unit squares side by side: corners of a box that lie in the other one or on it are none.
    #[test]
    fn corners_of_a_box_that_lie_on_another_hole_are_left_out() {
        let square =
            |u: f64| [[0., 0.], [1., 0.], [1., 1.], [0., 1.]].map(|p| Uv::new(u, 0.0) + Uv::from_array(p)).to_vec();
        let tall = [[1.25, -1.], [2., -1.], [2., 3.], [1.25, 3.]].map(Uv::from).to_vec();
        let holes = [square(0.0), tall];
        let obstacles = Obstacles::new(&holes, &[], Uv::ZERO);
        let corners = |margin: f64| obstacles.corners(HoleCopy { hole: 0, copy: 0 }, margin);
        assert_eq!(corners(0.5), [[-0.5, -0.5], [-0.5, 1.5]].map(Uv::from));
        assert_eq!(corners(0.25), [[-0.25, -0.25], [-0.25, 1.25]].map(Uv::from));
        assert_eq!(corners(0.125).len(), CORNERS_OF_BOX);
    }

    /// A diamond of half diagonals 1 and, 0.5 to its right, a wall; one corner is in the middle of a side.
    #[test]
    fn places_of_an_outline_stand_off_its_corners() {
        let diamond = [[1., 0.], [0.5, 0.5], [0., 1.], [-1., 0.], [0., -1.]].map(Uv::from);
        let wall = [[1.5, -9.], [2., -9.], [2., 9.], [1.5, 9.]].map(Uv::from).to_vec();
        for turned in [false, true] {
            let mut hole = diamond.to_vec();
            if turned {
                hole.reverse();
            }
            let holes = [hole, wall.clone()];
            let obstacles = Obstacles::new(&holes, &[], Uv::ZERO);
            let places = obstacles.outline(HoleCopy { hole: 0, copy: 0 });
            // Nothing but the wall at the right corner is nearer than half of the size, which is 2.
            for (u, v) in [(1.2, 0.0), (0.0, 1.4), (-1.4, 0.0), (0.0, -1.4)] {
                let nearest = places.iter().map(|p| (*p - Uv::new(u, v)).length()).fold(f64::INFINITY, f64::min);
                assert!(nearest < 1e-12, "({u}, {v}): {places:?}");
            }
            assert_eq!(places.len(), 4, "{places:?}");
        }
    }

    /// Of a polygon of a hundred corners on a circle of radius 1 every sixth is taken, and stands off by a fifth of the diameter.
    #[test]
    fn the_outline_of_a_circle_has_places_all_around() {
        let circle = |k: i32| Uv::from_angle(f64::from(k) * std::f64::consts::TAU / 100.0);
        let holes = [(0..100).map(circle).collect::<Vec<Uv>>()];
        let obstacles = Obstacles::new(&holes, &[], Uv::ZERO);
        let places = obstacles.outline(HoleCopy { hole: 0, copy: 0 });
        assert_eq!(places.len(), 16, "{places:?}");
        for pair in places.windows(2) {
            assert!((pair[0].length() - 1.4).abs() < 1e-12 && pair[0].angle_to(pair[1]) < 0.4, "{places:?}");
        }
    }
}
