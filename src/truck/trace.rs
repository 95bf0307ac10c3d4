//! The uv curve of an edge on a surface: a closest point to start from, Newton steps along the edge, a cubic Hermite spline
//! through the answers, refined until it is right.

use crate::math::{Point, Uv, Vector, largest_distance};
use crate::nurbs::{Curve, Surface, UvCurve};

/// Wanted distance between the edge and its uv curve on the surface, mm, and the largest that is accepted.
const WANTED: f64 = 1e-9;
pub(super) const ACCEPTED: f64 = 1e-5;

/// Length of a derivative, as a share of the surface's size, below which its parameter moves nothing: a pole.
const POLE: f64 = 1e-9;

/// The shortest share of a Newton step that is tried; what does not come nearer by then does not come nearer.
const LEAST_STEP: f64 = 1e-3;

/// A step of this share of the parameters' range is below their rounding.
const STANDSTILL: f64 = 1e-15;

/// Squared sine between two derivatives below which they count as parallel: the determinant is then rounding.
const PARALLEL_SQUARED: f64 = 1e-20;
/// Most Hermite pieces of a uv curve.
const MAX_PIECES: usize = 512;

/// A surface and what is needed to find points on it.
pub(super) struct EdgeTracer<'a> {
    surface: &'a Surface,
    /// Points over a grid of parameters, to start from.
    seeds: Vec<(Uv, Point)>,
    extent: Uv,
    /// Size of the surface, mm.
    size: f64,
}

/// A uv curve and the largest distance found between its image and the edge, mm, by samples.
pub(super) struct TracedEdge {
    pub(super) uv: UvCurve,
    pub(super) gap: f64,
}

impl<'a> EdgeTracer<'a> {
    /// Samples the surface over its domain, for searches to start from.
    pub(super) fn new(surface: &'a Surface) -> Self {
        let [[u0, u1], [v0, v1]] = surface.domain();
        // Some samples a span, within what is quick to search.
        let steps = |k: usize| (4 * surface.knots[k].len()).clamp(12, 64);
        let (nu, nv) = (steps(0), steps(1));
        let seeds = (0..=nu)
            .flat_map(|i| (0..=nv).map(move |j| (i, j)))
            .map(|(i, j)| {
                let uv = Uv::new(u0 + (u1 - u0) * i as f64 / nu as f64, v0 + (v1 - v0) * j as f64 / nv as f64);
                (uv, surface.evaluate(uv))
            })
            .collect();
        let size = surface.bounds().diagonal();
        Self { surface, seeds, extent: Uv::new(u1 - u0, v1 - v0), size }
    }

    /// Returns the uv curve of an edge, over the edge's own parameters; `near_u` selects one of two sides of a seam, `None` where there is
    /// none. Fails for edges more than [`ACCEPTED`] off the surface.
    pub(super) fn trace(&self, edge: &Curve, near_u: Option<f64>) -> Result<TracedEdge, String> {
        let [t0, t1] = edge.domain();
        // The kinks of the edge's parametrisation are always nodes.
        let mut pieces_each = 2;
        let breaks = edge.breakpoints();
        loop {
            let mut ts = vec![t0];
            for pair in breaks.windows(2) {
                ts.extend((1..=pieces_each).map(|i| pair[0] + (pair[1] - pair[0]) * i as f64 / pieces_each as f64));
            }
            let last = ts.len() - 1;
            ts[last] = t1;
            let uv = self.fit_hermite(edge, &ts, near_u)?;
            let gap = self.largest_gap(edge, &uv, &ts);
            // When halving no longer helps, the file's own gap is what is left.
            if gap <= WANTED || 2 * ts.len() > MAX_PIECES {
                return if gap <= ACCEPTED {
                    Ok(TracedEdge { uv, gap })
                } else {
                    Err(format!("an edge lies {gap:.3e} mm off the surface; at most {ACCEPTED:e} mm is accepted"))
                };
            }
            pieces_each *= 2;
        }
    }

    /// Returns the largest distance of a trim from its edge, mm, sampled between the points at `ts`; NaN where one is no number.
    fn largest_gap(&self, edge: &Curve, uv: &UvCurve, ts: &[f64]) -> f64 {
        let off = |t: f64| (self.surface.evaluate(uv.evaluate(t)) - edge.evaluate(t)).length();
        // At the middles, where Hermite pieces are worst, and on both sides of them.
        let places = ts.windows(2).flat_map(|p| [0.25, 0.5, 0.75, 1.0].map(|s| p[0] + s * (p[1] - p[0])));
        largest_distance(std::iter::once(ts[0]).chain(places).map(off))
    }

    /// Returns the uv curve through the feet of an edge's points at `ts`, with slopes that follow the edge; fails where its middle is not
    /// on the surface.
    fn fit_hermite(&self, edge: &Curve, ts: &[f64], near_u: Option<f64>) -> Result<UvCurve, String> {
        // Start in the middle, where no pole is, and walk to both ends.
        let middle = ts.len() / 2;
        let start = self.closest(edge.evaluate(ts[middle]), near_u)?;
        let mut nodes = vec![start; ts.len()];
        for i in middle + 1..ts.len() {
            nodes[i] = self.refine(edge.evaluate(ts[i]), nodes[i - 1]);
        }
        for i in (0..middle).rev() {
            nodes[i] = self.refine(edge.evaluate(ts[i]), nodes[i + 1]);
        }
        let mut slopes: Vec<Uv> =
            nodes.iter().zip(ts).map(|(&uv, &t)| self.slope(uv, edge.derivatives(t).first)).collect();
        for (end, inner) in [(0, 1), (ts.len() - 1, ts.len() - 2)] {
            if let Some(k) = self.pole_parameter(nodes[end]) {
                let (at, slope) = self.extrapolate_to_pole(edge, [ts[end], ts[inner]], nodes[inner], k);
                nodes[end][k] = at.clamp(self.surface.domain()[k][0], self.surface.domain()[k][1]);
                slopes[end][k] = slope;
            }
        }
        Ok(UvCurve::hermite(ts, &nodes, &slopes))
    }

    /// Returns which parameter moves nothing at a point, 0 for u or 1 for v: the one that runs along the pole; `None` off the poles.
    fn pole_parameter(&self, uv: Uv) -> Option<usize> {
        let d = self.surface.derivatives(uv);
        let lengths = [d.du.length() * self.extent.x, d.dv.length() * self.extent.y];
        (0..2).find(|&k| lengths[k] < POLE * self.size.max(lengths[1 - k]))
    }

    /// Returns the parameter `k` and its slope at a pole, where it means nothing: continued from two points further in, `at` and `inwards`
    /// being the edge's parameters at the pole and at `inner`, so that the curve stays smooth.
    fn extrapolate_to_pole(&self, edge: &Curve, [at, inwards]: [f64; 2], inner: Uv, k: usize) -> (f64, f64) {
        let h = 0.1 * (inwards - at);
        let near = |s: f64| self.refine(edge.evaluate(at + s * h), inner)[k];
        let (one, two) = (near(1.0), near(2.0));
        (2.0 * one - two, (two - one) / h)
    }

    /// Returns the parameters of the point of the surface that is closest to `p`, within 0.3 of the domain of `near_u` if that is given;
    /// fails where it is more than [`ACCEPTED`] away.
    fn closest(&self, p: Point, near_u: Option<f64>) -> Result<Uv, String> {
        // A seam's two sides lie a whole domain apart: a third of it separates them.
        let allowed = |uv: Uv| near_u.is_none_or(|u| (uv.x - u).abs() <= 0.3 * self.extent.x);
        let seeds = self.seeds.iter().filter(|(uv, _)| allowed(*uv));
        let mut order: Vec<(f64, Uv)> = seeds.map(|(uv, q)| ((*q - p).length_squared(), *uv)).collect();
        if order.is_empty() {
            return Err("an edge outside the parameters of its surface".into());
        }
        // The six nearest samples: a fold may hide the true foot from the nearest one.
        let tried = order.len().min(6);
        order.select_nth_unstable_by(tried - 1, |a, b| a.0.total_cmp(&b.0));
        let distance = |uv: Uv| (self.surface.evaluate(uv) - p).length();
        let found = order[..tried].iter().map(|(_, uv)| self.refine(p, *uv));
        found
            .map(|uv| (distance(uv), uv))
            .filter(|(_, uv)| allowed(*uv))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(d, _)| *d <= ACCEPTED)
            .map(|(_, uv)| uv)
            .ok_or_else(|| "an edge that does not lie on its surface".into())
    }

    /// Returns the parameters of a point at least as near to `p` as the start, which is clamped to the domain first, by Gauss–Newton steps.
    fn refine(&self, p: Point, start: Uv) -> Uv {
        let mut uv = self.surface.clamp(start);
        let mut off = (self.surface.evaluate(uv) - p).length();
        for _ in 0..50 {
            let d = self.surface.derivatives(uv);
            let step = solve_least_squares(d.du, d.dv, p - d.point);
            let mut scale = 1.0;
            let (next, next_off) = loop {
                let next = self.surface.clamp(uv + step * scale);
                let next_off = (self.surface.evaluate(next) - p).length();
                if next_off <= off || scale < LEAST_STEP {
                    break (next, next_off);
                }
                scale *= 0.5;
            };
            let moved = ((next - uv) / self.extent).abs().max_element();
            // What no step brings nearer is the foot, to rounding.
            if next_off > off {
                break;
            }
            (uv, off) = (next, next_off);
            if moved < STANDSTILL {
                break;
            }
        }
        uv
    }

    /// Returns the change of parameters along a curve with that tangent, per unit of the curve's parameter.
    fn slope(&self, uv: Uv, tangent: Vector) -> Uv {
        let d = self.surface.derivatives(uv);
        solve_least_squares(d.du, d.dv, tangent)
    }
}

/// Returns x and y, the least-squares solution of `du·x + dv·y = v`; with parallel `du` and `dv` the shorter one's is 0.
fn solve_least_squares(du: Vector, dv: Vector, v: Vector) -> Uv {
    let (a, b, c) = (du.length_squared(), du.dot(dv), dv.length_squared());
    let determinant = a * c - b * b;
    if determinant > PARALLEL_SQUARED * a * c {
        let (p, q) = (du.dot(v), dv.dot(v));
        return Uv::new(c * p - b * q, a * q - b * p) / determinant;
    }
    // Parallel derivatives: along the longer one, because the other has no say.
    let one = |along: Vector, length2: f64| if length2 > 0.0 { along.dot(v) / length2 } else { 0.0 };
    if a > c { Uv::new(one(du, a), 0.0) } else { Uv::new(0.0, one(dv, c)) }
}
