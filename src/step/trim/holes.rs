//! Where the holes of a face lie on a surface with periods: moved by whole ones until they are inside its border.

use super::lobes::cancelling_lobes;
use super::loops::{Chain, contains};
use super::obstacles::bounds;
use crate::math::Uv;
use crate::math::polygon::{nearest_on_side, polygon_sides, signed_area};
use crate::step::chart::Chart;
use std::cell::OnceCell;

/// Places of a hole that are looked for inside the border.
const PLACES: usize = 5;
/// Most periods by which a hole is moved: no thread of a real part has as many turns in one face.
const MOST_PERIODS: f64 = 64.0;
/// How much finer the border's polygon is where the first one has a hole outside: a hexagon in a circle 1.5 % wider stood out of the
/// 16-sided polygon of that circle.
const FINE_DENSITY: usize = 16;
/// A hole stands out of its border where it does so by more than this share of the border's size in u or v: the fine polygon of a circle
/// misses it by 1e-4 of its size, and holes may touch their border.
const OUTSIDE_SHARE: f64 = 1e-3;

/// A polygon in the box around it.
struct Outline {
    polygon: Vec<Uv>,
    /// Lowest and highest corner of the box.
    bounds: [Uv; 2],
}

impl Outline {
    fn new(polygon: Vec<Uv>) -> Self {
        let bounds = bounds(&polygon);
        Self { polygon, bounds }
    }

    /// Returns [`PLACES`] corners, evenly over all.
    fn places(&self) -> impl Iterator<Item = Uv> {
        (0..PLACES).map(move |k| self.polygon[k * self.polygon.len() / PLACES])
    }

    /// Whether the box of a hole, moved by `shift`, stands out of this one by more than [`OUTSIDE_SHARE`].
    fn is_left_by(&self, hole: &Self, shift: Uv) -> bool {
        let ([hole_lo, hole_hi], [lo, hi]) = (hole.bounds, self.bounds);
        let room = OUTSIDE_SHARE * (hi - lo);
        ((hole_lo + shift).cmplt(lo - room) | (hole_hi + shift).cmpgt(hi + room)).any()
    }

    /// Whether a place lies outside by more than [`OUTSIDE_SHARE`].
    fn is_far_from(&self, place: Uv) -> bool {
        let size = self.bounds[1] - self.bounds[0];
        let distance = |side: [Uv; 2]| {
            let [a, b, p] = [side[0], side[1], place].map(|q| q / size);
            (nearest_on_side([a, b], p) - p).length()
        };
        let distances = polygon_sides(&self.polygon).map(distance);
        !contains(&self.polygon, place) && distances.fold(f64::INFINITY, f64::min) > OUTSIDE_SHARE
    }
}

/// The border into which holes are moved, as polygons that are made once, when they are first asked for.
pub(super) struct Border<'c> {
    outer: &'c Chain,
    coarse: OnceCell<Outline>,
    fine: OnceCell<Outline>,
}

impl<'c> Border<'c> {
    pub(super) fn new(outer: &'c Chain) -> Self {
        Self { outer, coarse: OnceCell::new(), fine: OnceCell::new() }
    }

    /// Returns the polygon in which nearly all holes are whole.
    fn coarse(&self) -> &Outline {
        self.coarse.get_or_init(|| Outline::new(self.outer.polygon()))
    }

    /// Returns the polygon of [`FINE_DENSITY`].
    fn fine(&self) -> &Outline {
        self.fine.get_or_init(|| Outline::new(self.outer.polygon_of_density(FINE_DENSITY)))
    }

    /// Whether the box of a hole, moved by `shift`, stands out.
    fn is_left_by(&self, hole: &Outline, shift: Uv) -> bool {
        self.coarse().is_left_by(hole, shift) && self.fine().is_left_by(hole, shift)
    }

    /// Whether one of a few places of a hole, moved by `shift`, lies outside.
    fn leaves_out(&self, hole: &Outline, shift: Uv) -> bool {
        let mut places = hole.places().map(|place| place + shift);
        places.any(|p| !contains(&self.coarse().polygon, p) && self.fine().is_far_from(p))
    }
}

/// By how many periods a hole may be moved along `axis` so that it reaches into a border, each given by its box, the fewest first: a border
/// that is cut along a helix leans over several.
fn period_counts([hole_lo, hole_hi]: [Uv; 2], [lo, hi]: [Uv; 2], axis: usize, period: f64) -> Vec<i32> {
    let least = ((lo[axis] - hole_hi[axis]) / period).floor().max(-MOST_PERIODS) as i32;
    let most = ((hi[axis] - hole_lo[axis]) / period).ceil().min(MOST_PERIODS) as i32;
    let mut counts: Vec<i32> = (least.min(0)..=most.max(0)).collect();
    counts.sort_by_key(|count| count.abs());
    counts
}

/// Returns where a period of direction `d` may start so that no hole spans it: in the middle of the widest gap between them, `base` without
/// holes. `None` where there is no gap.
pub(super) fn free_start(d: usize, base: f64, period: f64, holes: &[Vec<Uv>]) -> Option<f64> {
    if holes.is_empty() {
        return Some(base);
    }
    let mut spans: Vec<(f64, f64)> = Vec::new();
    for hole in holes {
        let lo = hole.iter().map(|p| p[d]).fold(f64::INFINITY, f64::min);
        let hi = hole.iter().map(|p| p[d]).fold(f64::NEG_INFINITY, f64::max);
        let start = (lo - base).rem_euclid(period);
        spans.push((start, start + (hi - lo)));
    }
    spans.sort_by(|a, b| a.0.total_cmp(&b.0));
    // What reaches over the end of the period lies at its start too.
    let mut end = spans.iter().map(|s| s.1 - period).fold(f64::NEG_INFINITY, f64::max);
    let mut best = (0.0, 0.0);
    for &(a, b) in &spans {
        if a - end > best.1 {
            best = (0.5 * (a + end), a - end);
        }
        end = end.max(b);
    }
    (best.1 > 0.0).then_some(base + best.0)
}

/// Moves a hole by periods into the border, and turns it clockwise; one that lies in no place inside is a loop of its own and turned the
/// other way. Notes what was turned, and a hole that stands out of the border.
pub(super) fn place_hole(
    mut hole: Chain,
    border: &Border<'_>,
    chart: &Chart,
    repairs: &mut Vec<&'static str>,
) -> Chain {
    let outline = Outline::new(hole.polygon());
    // Most of a few places decide, because one may lie on the border; a shift with all of them inside is the better one.
    let shift_into = |border: &Outline, least: usize| {
        let counts =
            [0, 1].map(|d| chart.period[d].map_or(vec![0], |p| period_counts(outline.bounds, border.bounds, d, p)));
        let [along_u, along_v] = &counts;
        let shifts = along_u.iter().flat_map(|&i| along_v.iter().map(move |&j| [i, j]));
        let inside = |shift: &Uv| {
            outline.places().filter(|&place| contains(&border.polygon, place + *shift)).count() >= least
        };
        shifts.map(|count| chart.whole_periods(count)).find(inside)
    };
    let whole = shift_into(border.coarse(), PLACES);
    let shift = whole.or_else(|| {
        let (coarse, fine) = (border.coarse(), border.fine());
        let tries = [(fine, PLACES), (coarse, PLACES / 2 + 1), (fine, PLACES / 2 + 1)];
        tries.into_iter().find_map(|(border, least)| shift_into(border, least))
    });
    // The sign of an area that cancels is rounding.
    let is_told = |hole: &Chain| cancelling_lobes(hole, &outline.polygon).is_none();
    match shift {
        Some(shift) => {
            hole.shift(shift);
            if border.is_left_by(&outline, shift) || whole.is_none() && border.leaves_out(&outline, shift) {
                repairs.push("a hole reaches beyond the outer loop of its face");
            }
            if signed_area(&outline.polygon) > 0.0 && is_told(&hole) {
                hole.reverse();
                repairs.push("a hole was turned around");
            }
        }
        None => {
            if signed_area(&outline.polygon) < 0.0 && is_told(&hole) {
                hole.reverse();
                repairs.push("a loop outside the others was turned around");
            }
        }
    }
    hole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::step::trim::loops::Piece;

    fn square(low: Uv, size: f64) -> Vec<Uv> {
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|p| low + size * Uv::from_array(p)).to_vec()
    }

    /// A square of 10 by 10 and another of 2 by 2: inside, on a side, beyond it by half, and inside once moved.
    #[test]
    fn a_hole_stands_out_of_its_border_where_it_leaves_it() {
        let sides = polygon_sides(&square(Uv::ZERO, 10.0)).map(|[a, b]| Piece::straight(a, b)).collect();
        let outer = Chain::closed(sides);
        let border = Border::new(&outer);
        for (low, shift, expected) in
            [(1.0, 0.0, false), (8.0, 0.0, false), (8.005, 0.0, false), (9.0, 0.0, true), (29.0, -22.0, false)]
        {
            let hole = Outline::new(square(Uv::new(low, 4.0), 2.0));
            let shift = Uv::new(shift, 0.0);
            assert_eq!(border.is_left_by(&hole, shift) || border.leaves_out(&hole, shift), expected, "{low}");
        }
    }

    /// A hole of 1 by 1 and a border from 30 to 33 along u, of a period of 2π: four of them lead before it, five into it, none across.
    #[test]
    fn a_hole_is_moved_as_far_as_its_border_leans() {
        let square = |low: f64, size: f64| [Uv::new(low, 0.0), Uv::new(low + size, size)];
        let period = std::f64::consts::TAU;
        let counts = period_counts(square(0.0, 1.0), square(30.0, 3.0), 0, period);
        assert!(
            counts.contains(&5) && counts.contains(&0) && counts.iter().all(|c| (0..=6).contains(c)),
            "{counts:?}"
        );
        let counts = period_counts(square(0.0, 1.0), square(-20.0, 40.0), 0, period);
        assert_eq!(counts[0], 0);
        assert!(counts.iter().all(|c| c.abs() <= 4) && counts.contains(&-3) && counts.contains(&3), "{counts:?}");
    }
}
