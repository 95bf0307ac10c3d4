//! Places beside holes at which a seam may turn: clear of all holes and borders.

use super::obstacles::{HoleCopy, Obstacles};
use super::segment::Segment;
use crate::math::Uv;

/// Corners of one hole's box.
pub(super) const CORNERS_OF_BOX: usize = 4;
/// A place nearer to a side than this share of the size of what it stands beside counts as on it: far above the noise of fits, 1e-6 mm, and
/// far below the least share by which places are off.
pub(super) const NEAR_SHARE: f64 = 1e-4;

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
}
