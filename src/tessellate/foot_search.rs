//! Points of a surface near to others, found without what the proofs rely on.

use super::triangle_frame::TriangleFrame;
use crate::math::{Point, Uv};
use crate::nurbs::{Derivatives, Surface};
use std::cell::Cell;

/// A spline that counts how often it is evaluated.
pub(super) struct CountedSurface<'s> {
    pub(super) spline: &'s Surface,
    evaluations: Cell<u64>,
}

impl<'s> CountedSurface<'s> {
    pub(super) fn new(spline: &'s Surface) -> Self {
        Self { spline, evaluations: Cell::new(0) }
    }

    pub(super) fn point(&self, at: Uv) -> Point {
        self.evaluations.set(self.evaluations.get() + 1);
        self.spline.evaluate(at)
    }

    /// Whether a place lies off the border of the domain.
    pub(super) fn is_inside(&self, at: Uv) -> bool {
        self.spline.domain().iter().zip([at.x, at.y]).all(|([low, high], x)| *low < x && x < *high)
    }

    fn derivatives(&self, at: Uv) -> Derivatives {
        self.evaluations.set(self.evaluations.get() + 1);
        self.spline.derivatives(at)
    }

    /// Returns how often it was evaluated.
    pub(super) fn evaluations(&self) -> u64 {
        self.evaluations.get()
    }
}

/// Share of the distance found so far below which a piece of the surface is small enough: a start for [`project`], no more.
const SMALL_PIECE: f64 = 0.05;
/// Steps of one projection, and the share of a distance below which nothing is gained.
const MAX_STEPS: usize = 12;
pub(super) const STILL: f64 = 1e-9;
/// Determinant of the first fundamental form, in shares of the product of its diagonal, at which it cannot be solved for a step.
const SINGULAR: f64 = 1e-14;

/// How far the middle of a side may lie beside that between its ends, as a share of its length, where parameters are even: steps along
/// the side differ by a quarter, and [`nearest_from`] finds the foot from any place nearby.
const EVEN: f64 = 1.0 / 16.0;

/// How far the middles of a triangle's sides on the surface lie beside those of the flat triangle, added up, and the parameters and points
/// of these middles; `None` where parameters are not even.
fn even_middles(surface: &CountedSurface<'_>, t: [(Uv, Point); 3]) -> Option<(f64, [(Uv, Point); 3])> {
    let middles = [0, 1, 2].map(|k| {
        let uv = 0.5 * (t[k].0 + t[(k + 1) % 3].0);
        (uv, surface.point(uv))
    });
    let side = |k: usize| [t[k].1, t[(k + 1) % 3].1];
    let beside = [0, 1, 2].map(|k| (middles[k].1 - 0.5 * (side(k)[0] + side(k)[1])).length());
    let is_even = (0..3).all(|k| beside[k] <= EVEN * (side(k)[1] - side(k)[0]).length());
    is_even.then(|| (beside.iter().sum(), middles))
}

/// Returns a near point on the part of the surface over the triangles `over` of parameters, or `known` where none is nearer; `None` where
/// their parameters, or those of a quarter of them that `x` is near to, are not even: once is not enough, for the middle of a side with
/// weights may lie where it should and its quarters may not.
pub(super) fn search_even_pieces(
    surface: &CountedSurface<'_>,
    x: Point,
    over: &[[Uv; 3]],
    known: (Uv, f64),
) -> Option<(Uv, f64)> {
    let mut nearest = known;
    for uv in over {
        let t @ [a, b, c] = uv.map(|u| (u, surface.point(u)));
        let (beside, [d, e, f]) = even_middles(surface, t)?;
        for quarter in [[a, d, f], [d, b, e], [f, e, c], [d, e, f]] {
            // The surface lies beside a flat quarter by no more than beside the whole.
            if TriangleFrame::new(quarter.map(|q| q.1)).distance(x) - beside < known.1 {
                even_middles(surface, quarter)?;
                let found = nearest_from(surface, x, (quarter[0].0 + quarter[1].0 + quarter[2].0) / 3.0);
                if found.1 < nearest.1 {
                    nearest = found;
                }
            }
        }
    }
    Some(nearest)
}

/// Pieces that are followed at a time, and how often they are cut into four.
const FOLLOWED: usize = 8;
const LEVELS: usize = 40;

/// Returns the parameters of a near point on the part of the surface over the triangles `over`: quarters are followed whose flat triangles
/// lie nearest to `x`. So none is lost where weights crowd most of the parameters into one place and a step of any length leaps over the
/// surface.
pub(super) fn search_pieces(surface: &CountedSurface<'_>, x: Point, over: &[[Uv; 3]]) -> Uv {
    let at = |u: Uv| (u, surface.point(u));
    let off = |p: &[(Uv, Point); 3]| TriangleFrame::new(p.map(|q| q.1)).distance(x);
    let mut best = (f64::INFINITY, over[0][0]);
    let mut pieces: Vec<[(Uv, Point); 3]> = over.iter().map(|uv| uv.map(at)).collect();
    // As many levels as halve the domain down to the spacing of numbers, unless the pieces are small before.
    for _ in 0..LEVELS {
        let mut parts = Vec::with_capacity(4 * pieces.len());
        for [a, b, c] in pieces {
            let [d, e, f] = [(a, b), (b, c), (c, a)].map(|(p, q)| at(0.5 * (p.0 + q.0)));
            for (u, p) in [a, b, c, d, e, f] {
                let away = (p - x).length();
                if away < best.0 {
                    best = (away, u);
                }
            }
            let four = [[a, d, f], [d, b, e], [f, e, c], [d, e, f]];
            parts.extend(four.into_iter().map(|p| (off(&p), p)));
        }
        if parts.len() > FOLLOWED {
            parts.select_nth_unstable_by(FOLLOWED - 1, |p, q| p.0.total_cmp(&q.0));
            parts.truncate(FOLLOWED);
        }
        let small = |[a, b, c]: &[(Uv, Point); 3]| {
            (a.1 - b.1).length().max((b.1 - c.1).length()).max((c.1 - a.1).length()) <= SMALL_PIECE * best.0
        };
        pieces = parts.into_iter().map(|p| p.1).filter(|p| !small(p)).collect();
        if pieces.is_empty() {
            break;
        }
    }
    best.1
}

/// Returns the parameters of a near, mostly the nearest, point of the whole surface.
pub(super) fn nearest_parameters(surface: &Surface, x: Point) -> Uv {
    let [[u0, u1], [v0, v1]] = surface.domain();
    let [a, b, c, d] = [(u0, v0), (u1, v0), (u1, v1), (u0, v1)].map(|(u, v)| Uv::new(u, v));
    // Both halves of the domain, since a path of nearest triangles may run into a dead end in one.
    let surface = CountedSurface::new(surface);
    let search = |half| nearest_from(&surface, x, search_pieces(&surface, x, &[half]));
    let [first, second] = [[a, b, c], [a, c, d]].map(search);
    if second.1 < first.1 { second.0 } else { first.0 }
}

/// Returns the parameters of a near point of the surface by damped Gauss–Newton from `start`, which is clamped to the domain first; never
/// farther away than it.
pub(super) fn project(surface: &Surface, x: Point, start: Uv) -> Uv {
    nearest_from(&CountedSurface::new(surface), x, start).0
}

/// Returns what [`project`] does, and the distance there.
pub(super) fn nearest_from(surface: &CountedSurface<'_>, x: Point, start: Uv) -> (Uv, f64) {
    let clamp = |u: Uv| surface.spline.clamp(u);
    let mut best = clamp(start);
    let mut d = surface.derivatives(best);
    let mut away = (d.point - x).length();
    for _ in 0..MAX_STEPS {
        let e = x - d.point;
        let (a, b, c) = (d.du.dot(d.du), d.du.dot(d.dv), d.dv.dot(d.dv));
        let det = a * c - b * b;
        // At a pole or cusp one derivative is nothing, and steps along it would be anywhere.
        if det <= SINGULAR * a * c {
            break;
        }
        let (r, s) = (e.dot(d.du), e.dot(d.dv));
        let step = Uv::new(c * r - b * s, a * s - b * r) / det;
        // What the step would take off the square of the distance were the surface flat; to try it for less costs more than it gains.
        if r * step.x + s * step.y <= 2.0 * STILL * away * away {
            break;
        }
        let full = clamp(best + step);
        let there = surface.derivatives(full);
        let mut gain = away - (there.point - x).length();
        if gain > 0.0 {
            (best, d) = (full, there);
        } else {
            // A full step may overshoot where the surface bends; one that comes nearer is enough.
            let tries = [0.5, 0.25, 0.1].map(|f| clamp(best + step * f));
            let Some(next) = tries.into_iter().find(|&u| (surface.point(u) - x).length() < away) else {
                break;
            };
            (best, d) = (next, surface.derivatives(next));
            gain = away - (d.point - x).length();
        }
        away -= gain;
        if gain <= STILL * away {
            break;
        }
    }
    (best, away)
}
