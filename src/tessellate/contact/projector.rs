//! Nearest points on one surface, many times.

use crate::math::{Aabb, Point, Uv};
use crate::nurbs::Surface;
use crate::tessellate::foot_search;

/// Seeds a knot interval along each parameter, and fewest and most along the whole.
const SEEDS: usize = 6;
const SEED_RANGE: [usize; 2] = [12, 60];
/// Nearest seeds from which the nearest point is looked for: two for both sides of a seam, and one more.
const TRIED: usize = 3;
/// Area of the parameters' unit square, in shares of that of the surface's own size, below which a place is a pole.
const SINGULAR: f64 = 1e-9;

/// A surface with a grid of places from which the nearest point is looked for.
pub(super) struct Projector<'s> {
    spline: &'s Surface,
    /// Places to start from, in parameters and in space; none at poles, where no step leads anywhere.
    seeds: Vec<(Uv, Point)>,
    /// Places at poles.
    poles: Vec<(Uv, Point)>,
    /// Largest distance between neighbouring places: none of the surface is farther from all of them.
    spacing: f64,
    /// Around the surface.
    bounds: Aabb,
}

impl<'s> Projector<'s> {
    /// Evaluates the surface on a grid over its domain, [`SEEDS`] to a knot interval, and sorts the places into seeds and poles.
    pub(super) fn new(spline: &'s Surface) -> Self {
        let [[u0, u1], [v0, v1]] = spline.domain();
        let steps = |d: usize| {
            let spans = spline.counts()[d] - spline.degree[d];
            (SEEDS * spans).clamp(SEED_RANGE[0], SEED_RANGE[1])
        };
        let (nu, nv) = (steps(0), steps(1));
        let place = |k: usize| {
            let (i, j) = (k / (nv + 1), k % (nv + 1));
            let uv = Uv::new(u0 + (u1 - u0) * i as f64 / nu as f64, v0 + (v1 - v0) * j as f64 / nv as f64);
            (uv, spline.evaluate(uv))
        };
        // What area a unit square of parameters would have if the surface ran evenly over its domain.
        let bounds = spline.bounds();
        let size = bounds.diagonal() / Uv::new(u1 - u0, v1 - v0).max_element();
        let is_regular = |&(uv, _): &(Uv, Point)| {
            let d = spline.derivatives(uv);
            d.du.cross(d.dv).length() > SINGULAR * size * size
        };
        let places: Vec<(Uv, Point)> = (0..(nu + 1) * (nv + 1)).map(place).collect();
        let apart = |a: usize, b: usize| (places[a].1 - places[b].1).length();
        let cells = (0..nu * nv).map(|cell| cell / nv * (nv + 1) + cell % nv);
        // Both diagonals of every cell.
        let spacing = cells.map(|k| apart(k, k + nv + 2).max(apart(k + 1, k + nv + 1))).fold(0.0, f64::max);
        let (seeds, poles) = places.into_iter().partition(is_regular);
        Self { spline, seeds, poles, spacing, bounds }
    }

    /// Whether no place of the surface is within `distance` of `p`, judged by its box and the seeds.
    pub(super) fn is_beyond(&self, p: Point, distance: f64) -> bool {
        // Twice the distance off the box, so that no rounding decides.
        if !self.bounds.grown(2.0 * distance).contains(p) {
            return true;
        }
        let reach = distance + self.spacing;
        self.seeds.iter().chain(&self.poles).all(|(_, q)| (*q - p).length_squared() > reach * reach)
    }

    /// Returns the parameters of the point nearest to `p`, and its distance in the surface's own lengths: from the [`TRIED`] nearest seeds,
    /// so that a far minimum may be missed.
    pub(super) fn project(&self, p: Point) -> (Uv, f64) {
        let mut best: [(f64, Uv); TRIED] = [(f64::INFINITY, Uv::ZERO); TRIED];
        for &(uv, q) in &self.seeds {
            let away = (q - p).length_squared();
            if away < best[TRIED - 1].0 {
                best[TRIED - 1] = (away, uv);
                best.sort_by(|a, b| a.0.total_cmp(&b.0));
            }
        }
        // The nearest seed may lie on a local minimum of its own, as beside a seam.
        let feet = best.map(|(_, start)| {
            let uv = foot_search::project(self.spline, p, start);
            (uv, (self.spline.evaluate(uv) - p).length())
        });
        let poles = self.poles.iter().map(|&(uv, q)| (uv, (q - p).length()));
        feet.into_iter().chain(poles).fold(feet[0], |a, b| if b.1 < a.1 { b } else { a })
    }
}
