//! Inversion of spline surfaces: Newton from a nearby start, a search over Bézier patches when there is none.

use super::Pole;
use super::tolerances::{
    CLOSED_CONTROLS_LARGEST_MM, CLOSED_CONTROLS_SHARE, CLOSED_MM, CONVERGED_SHARE, EXACT_FOOT_MM,
    FIRST_EXPECTATION_MM, LARGEST_MISS_SHARE, PERIOD_SLACK, SINGULAR_METRIC, STANDING_STILL,
};
use crate::math::{Aabb, Point, Uv};
use crate::nurbs::{BezierPatch, ControlPoint, Curve, Surface};
use std::cell::Cell;
use std::sync::OnceLock;

/// Samples per direction in a patch that seed the search, at degrees up to 3. Threads have degree 13 and a whole turn in
/// one patch: higher degrees take twice their number.
const SEEDS: usize = 4;

/// A step is bent by at most this share of its length: more says that it is too long for the second order (Transtrum and Sethna).
const LARGEST_BEND: f64 = 0.75;

/// Most copies of a closed curve behind its first one: the turns of a thread.
const MAX_COPIES: i64 = 256;
/// Patches from which a search starts; nearer boxes come first.
const MAX_PATCHES_SEARCHED: usize = 200;

/// A spline surface that knows where it closes and contracts.
#[derive(Debug)]
pub(in crate::step) struct SplineChart {
    pub(in crate::step) surface: Surface,
    /// Diagonal of its box, mm.
    pub(super) size: f64,
    /// Whether both ends of u, of v, are one row of control points.
    closed: [bool; 2],
    /// Collapsed sides: `[direction][low, high]`.
    collapsed: [[bool; 2]; 2],
    patches: OnceLock<Vec<(BezierPatch, Aabb)>>,
    /// Distance from the surface, mm, that edges of this face have shown; larger residuals start a search.
    expected: Cell<f64>,
}

impl Clone for SplineChart {
    fn clone(&self) -> Self {
        // The patches and what the edges showed belong to one use of the surface; a copy starts anew.
        Self::new(self.surface.clone())
    }
}

impl SplineChart {
    /// Makes a chart of a spline; finds out which sides coincide and which are one point, by control points.
    pub(in crate::step) fn new(surface: Surface) -> Self {
        let size = surface.bounds().diagonal();
        let near = CLOSED_CONTROLS_SHARE * size.min(CLOSED_CONTROLS_LARGEST_MM) + CLOSED_MM;
        let [nu, nv] = surface.counts();
        let at = |i: usize, j: usize| surface.points[i * nv + j].position();
        let equal = |a: Point, b: Point| (a - b).length() <= near;
        let collapsed = [
            [0, nu - 1].map(|i| (1..nv).all(|j| equal(at(i, 0), at(i, j)))),
            [0, nv - 1].map(|j| (1..nu).all(|i| equal(at(0, j), at(i, j)))),
        ];
        let meet =
            [(0..nv).all(|j| equal(at(0, j), at(nu - 1, j))), (0..nu).all(|i| equal(at(i, 0), at(i, nv - 1)))];
        // Sides that contract to one and the same point are poles, no seam: a step over one would leave the unwrapped plane.
        let closed = [0, 1].map(|d| meet[d] && collapsed[d] == [false; 2]);
        let expected = Cell::new(FIRST_EXPECTATION_MM);
        Self { surface, size, closed, collapsed, patches: OnceLock::new(), expected }
    }

    /// Returns the lengths of the domain in closed directions; `None` where it is open or both ends are poles.
    pub(super) fn period(&self) -> [Option<f64>; 2] {
        let domain = self.surface.domain();
        [0, 1].map(|d| self.closed[d].then(|| domain[d][1] - domain[d][0]))
    }

    /// Returns a pole for each side of the domain that is one point.
    pub(super) fn poles(&self) -> Vec<Pole> {
        let domain = self.surface.domain();
        let mut poles = Vec::new();
        for fixed in 0..2 {
            for side in 0..2 {
                if self.collapsed[fixed][side] {
                    let at = domain[fixed][side];
                    let corner = if fixed == 0 { Uv::new(at, domain[1][0]) } else { Uv::new(domain[0][0], at) };
                    poles.push(Pole { fixed, parameter: at, point: self.surface.evaluate(corner) });
                }
            }
        }
        poles
    }

    /// Returns the parameters of a nearest point of the surface, inside its domain: by Newton from `hint` where that ends as near as
    /// expected, else by a search. Remembers how far from the surface points are.
    pub(super) fn locate(&self, p: Point, hint: Option<Uv>) -> Uv {
        let mut best: Option<(Uv, f64)> = None;
        if let Some(hint) = hint {
            // Edges are walked along: the point before is almost always the start that Newton wants.
            let found = self.newton(p, self.wrap(hint));
            if found.1 <= self.expected.get() {
                return found.0;
            }
            best = Some(found);
        }
        let (uv, distance) = self.search(p, best);
        // Edges that stay off the surface by this much need no search at every point.
        let in_vain = best.is_some_and(|b| distance > 0.9 * b.1);
        if distance > self.expected.get() && (in_vain || distance < LARGEST_MISS_SHARE * self.size) {
            self.expected.set(1.5 * distance);
        }
        uv
    }

    /// Moves parameters into the domain: by periods where it closes on itself, to the nearest border elsewhere.
    fn wrap(&self, uv: Uv) -> Uv {
        let domain = self.surface.domain();
        let one = |d: usize| {
            let [a, b] = domain[d];
            if uv[d] >= a && uv[d] <= b {
                uv[d]
            } else if self.closed[d] {
                a + (uv[d] - a).rem_euclid(b - a)
            } else {
                uv[d].clamp(a, b)
            }
        };
        Uv::new(one(0), one(1))
    }

    /// Descends from `start`, inside the domain, to a point that is locally nearest to `p`; returns its parameters and distance, mm.
    /// Gauss–Newton by the tangents alone; a step that does not descend is bent as the surface is, and halved until it does.
    ///
    /// Bent by the second-order correction of Transtrum and Sethna, 2012 ("geodesic acceleration"): where both tangents are nearly
    /// parallel, as on a surface 30 m long and 1.7 mm wide, the way to the foot is a curved valley along which straight steps stand still.
    fn newton(&self, p: Point, start: Uv) -> (Uv, f64) {
        let domain = self.surface.domain();
        let extent = [domain[0][1] - domain[0][0], domain[1][1] - domain[1][0]];
        let mut uv = start;
        let mut d = self.surface.derivatives(uv);
        let mut at = (d.point - p).length();
        for _ in 0..25 {
            let r = d.point - p;
            let (gu, gv) = (d.du.dot(r), d.dv.dot(r));
            let (mut e, f, mut g) = (d.du.length_squared(), d.du.dot(d.dv), d.dv.length_squared());
            // A direction along which the surface stands still moves nothing.
            let floor = STANDING_STILL * (e * extent[0] * extent[0]).max(g * extent[1] * extent[1]);
            e = e.max(floor / (extent[0] * extent[0]));
            g = g.max(floor / (extent[1] * extent[1]));
            // Where descent points out of the domain the foot lies on the border, and the other parameter goes on
            // alone.
            let held = |d: usize, gradient: f64| {
                !self.closed[d]
                    && (uv[d] <= domain[d][0] && gradient > 0.0 || uv[d] >= domain[d][1] && gradient < 0.0)
            };
            let (hold_u, hold_v) = (held(0, gu), held(1, gv));
            let det = e * g - f * f;
            if hold_u && hold_v || !(e > 0.0 && g > 0.0) {
                break;
            }
            // The step that takes back a miss with these products with the tangents.
            let step_against = |gu: f64, gv: f64| {
                if hold_u {
                    Uv::new(0.0, -gv / g)
                } else if hold_v {
                    Uv::new(-gu / e, 0.0)
                } else if det > SINGULAR_METRIC * e * g {
                    Uv::new((-gu * g + gv * f) / det, (-gv * e + gu * f) / det)
                } else {
                    // Where tangents are parallel in rounding each parameter steps by itself, half as far, since both
                    // reach for the same miss.
                    Uv::new(-gu / e, -gv / g) * 0.5
                }
            };
            let share = |step: Uv| (step.x.abs() / extent[0]).max(step.y.abs() / extent[1]);
            let step = step_against(gu, gv);
            // At most a quarter of the domain at once.
            let mut step = step / (share(step) / 0.25).max(1.0);
            let (mut bend, mut second) = (Uv::ZERO, None);
            let mut moved = false;
            // Straight, bent, and eight halvings: 1/256 of a step that still does not descend is at the floor of rounding.
            for attempt in 0..9 {
                let next = self.wrap_step(uv, step + bend, domain);
                let next_d = self.surface.derivatives(next);
                let distance = (next_d.point - p).length();
                if distance < at {
                    moved = true;
                    uv = next;
                    d = next_d;
                    at = distance;
                    break;
                }
                if attempt > 0 {
                    step *= 0.5;
                }
                let s = second.get_or_insert_with(|| self.surface.second_derivatives(uv));
                let leaves =
                    s.duu * (step.x * step.x) + s.duv * (2.0 * step.x * step.y) + s.dvv * (step.y * step.y);
                bend = 0.5 * step_against(d.du.dot(leaves), d.dv.dot(leaves));
                bend /= (share(bend) / (LARGEST_BEND * share(step))).max(1.0);
            }
            if !moved || step.x.abs() <= CONVERGED_SHARE * extent[0] && step.y.abs() <= CONVERGED_SHARE * extent[1]
            {
                break;
            }
        }
        (uv, at)
    }

    /// Adds a step to parameters: around where the surface closes, held at its border elsewhere.
    fn wrap_step(&self, uv: Uv, step: Uv, domain: [[f64; 2]; 2]) -> Uv {
        let one = |d: usize| {
            let [a, b] = domain[d];
            let x = uv[d] + step[d];
            if self.closed[d] && (x < a || x > b) { a + (x - a).rem_euclid(b - a) } else { x.clamp(a, b) }
        };
        Uv::new(one(0), one(1))
    }

    /// Finds a nearest point without a start: by Newton from the best samples of patches, in the order of the distance to their boxes, of
    /// at most about [`MAX_PATCHES_SEARCHED`]. Returns parameters and distance, mm; `known` where nothing nearer is found.
    fn search(&self, p: Point, known: Option<(Uv, f64)>) -> (Uv, f64) {
        let patches = self.patches.get_or_init(|| {
            self.surface
                .bezier_patches()
                .into_iter()
                .map(|b| {
                    let bounds = b.bounds();
                    (b, bounds)
                })
                .collect()
        });
        let mut order: Vec<(f64, usize)> =
            patches.iter().enumerate().map(|(i, (_, b))| ((p.clamp(b.min, b.max) - p).length(), i)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let domain = self.surface.domain();
        let middle = Uv::new(0.5 * (domain[0][0] + domain[0][1]), 0.5 * (domain[1][0] + domain[1][1]));
        let mut best = known.unwrap_or((middle, f64::INFINITY));
        for (tried, (bound, i)) in order.into_iter().enumerate() {
            // What lies in a farther box is farther.
            if bound >= best.1 || best.1 < EXACT_FOOT_MM || tried > MAX_PATCHES_SEARCHED {
                break;
            }
            let patch = &patches[i].0;
            let counts = patch.degree.map(|p| if p <= 3 { SEEDS } else { 2 * p });
            let mut seeds: Vec<(f64, Uv)> = Vec::with_capacity(counts[0] * counts[1]);
            for a in 0..counts[0] {
                for b in 0..counts[1] {
                    let local = Uv::new((a as f64 + 0.5) / counts[0] as f64, (b as f64 + 0.5) / counts[1] as f64);
                    let q = patch.local_jet(local)[0].position();
                    seeds.push(((q - p).length(), patch.surface_uv(local)));
                }
            }
            seeds.sort_by(|a, b| a.0.total_cmp(&b.0));
            // The two best seeds: the nearest sample may lie on the wrong side of a fold.
            for &(_, seed) in &seeds[..2] {
                let found = self.newton(p, seed);
                if found.1 < best.1 {
                    best = found;
                }
            }
        }
        best
    }

    /// Returns the surface over a rectangle that may run over the seams of closed directions; in others, its own domain stays.
    pub(super) fn extend_periodically(&self, domain: [[f64; 2]; 2]) -> Surface {
        let base = self.surface.domain();
        let mut surface = self.surface.clone();
        for d in 0..2 {
            let [a, b] = domain[d];
            let near = PERIOD_SLACK * (base[d][1] - base[d][0]);
            if a < base[d][0] - near || b > base[d][1] + near {
                let period = self.period()[d];
                surface = surface.map_direction(d, |c| extend_periodically(&c, [a, b], period));
            }
        }
        surface
    }
}

/// Returns a curve over `[a, b]`, repeated by its period as far as needed, at most [`MAX_COPIES`] times; without a period, or within its
/// domain, the whole curve as it is.
pub(super) fn extend_periodically(curve: &Curve, [a, b]: [f64; 2], period: Option<f64>) -> Curve {
    let [t0, t1] = curve.domain();
    let Some(period) = period else { return curve.clone() };
    let near = PERIOD_SLACK * period;
    if a >= t0 - near && b <= t1 + near {
        return curve.clone();
    }
    let first = ((a - t0) / period + PERIOD_SLACK).floor() as i64;
    let last = (((b - t0) / period - PERIOD_SLACK).ceil() as i64 - 1).clamp(first, first + MAX_COPIES);
    let start = t0 + first as f64 * period;
    // From the period in which the range begins; further copies are joined to its end.
    let copy = curve.reparametrised([start, start + period]);
    let mut whole = copy.clone();
    for _ in first..last {
        whole = whole.joined_with(curve);
    }
    let [w0, w1] = whole.domain();
    whole.restricted(a.clamp(w0, w1), b.clamp(w0, w1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `(u, v, 300 (v − 4 (u − ½)²))` mm: a strip 300 mm long and 1 mm wide, on which places of one height lie on a parabola.
    fn strip() -> SplineChart {
        let height = [-1.0, 1.0, -1.0];
        let point = |k: usize| {
            let (i, v) = (k / 2, (k % 2) as f64);
            Point::new(0.5 * i as f64, v, 300.0 * (v + height[i])).extend(1.0)
        };
        let knots = [vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]];
        SplineChart::new(Surface { degree: [2, 1], knots, points: (0..6).map(point).collect() })
    }

    #[test]
    fn a_foot_is_found_along_a_curved_valley() {
        let strip = strip();
        for start in [[0.55, 0.01], [0.5, 0.0], [0.4, 0.04]] {
            let (uv, distance) = strip.newton(Point::new(0.9, 0.64, 0.0), Uv::from(start));
            assert!(distance < 1e-9 && uv.distance(Uv::new(0.9, 0.64)) < 1e-9, "{start:?} {uv} {distance}");
        }
    }
}
