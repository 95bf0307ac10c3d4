//! Edges in the parameter plane: cubic Hermite curves over the edge's own parameter, to a stated error in space.
//!
//! Guarantee: at four interior points of every piece, `surface(uv(t))` lies within the tolerance of the foot point of
//! `curve(t)`. Known weakness: what happens between those points is not bounded, only unlikely: the error of a cubic
//! piece is symmetric, and pieces are halved until it is met.

use super::tolerances::{
    DIFFERENCE_STEP, LARGEST_SWING, LAST_POLE_STEP, MAX_OVERSHOOT, ON_BORDER, PARALLEL_DERIVATIVES,
    POLE_DISTANCE_RATIO, POLE_STEPS, SAME_JOINT, SHARE_OF_GAP, SMOOTH_SLOPE, STRAIGHT_SHARE, STRAIGHT_SIZE,
};
use crate::math::{Point, Uv};
use crate::nurbs::{ControlPoint, Curve, Derivatives, UvCurve};
use crate::step::chart::Pole;
use std::cell::Cell;

/// Deepest halving of a Bézier span of the edge.
const MAX_DEPTH: u32 = 12;

/// Steps of a search, each a look at one box, side or place, that take as long as an evaluation: 2 ns to 1 µs.
const STEPS_OF_EVALUATION: u64 = 512;

/// Work that a face has left, in steps, so that none takes for ever.
#[derive(Debug)]
pub(crate) struct Budget(Cell<u64>);

impl Budget {
    pub(crate) fn new(evaluations: u64) -> Self {
        Self(Cell::new(evaluations.saturating_mul(STEPS_OF_EVALUATION)))
    }

    /// Takes one evaluation; fails when none is left.
    pub(super) fn spend(&self) -> Result<(), Overrun> {
        self.spend_steps(STEPS_OF_EVALUATION)
    }

    /// Takes so many steps of a search; fails when fewer are left.
    pub(super) fn spend_steps(&self, steps: u64) -> Result<(), Overrun> {
        let left = self.0.get();
        self.0.set(left.saturating_sub(steps));
        if left < steps { Err(Overrun) } else { Ok(()) }
    }

    #[cfg(test)]
    pub(super) fn steps_left(&self) -> u64 {
        self.0.get()
    }
}

/// The work budget of the face is used up.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Overrun;

/// The surface as the fit sees it, in the chart's or the spline's parameters.
pub(crate) struct Target<'t> {
    /// Parameters of the point nearest to a place, given the edge's parameter and, if known, what is expected.
    pub(crate) locate: &'t dyn Fn(f64, Point, Option<Uv>) -> Uv,
    /// Position and first derivatives.
    pub(crate) derivatives: &'t dyn Fn(Uv) -> Derivatives,
    pub(crate) poles: &'t [Pole],
    /// What the curve must not leave; infinite where the surface has no border.
    pub(crate) range: [[f64; 2]; 2],
    /// Periods of the surface; `locate` chooses among its repeats by the expected parameters.
    pub(crate) period: [Option<f64>; 2],
    /// Nearer than this is at the pole, mm.
    pub(crate) pole_tolerance: f64,
    /// Allowed error in space, mm.
    pub(crate) tolerance: f64,
    pub(crate) budget: &'t Budget,
}

/// An edge in the parameter plane.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub(crate) curve: UvCurve,
    /// Largest distance found between the edge and the surface at the fitted parameters, mm; on a plane a bound of it.
    pub(crate) gap: f64,
}

/// An end of a fitted cubic piece.
#[derive(Clone, Copy)]
struct Node {
    t: f64,
    uv: Uv,
    /// d(uv)/dt inside the piece.
    slope: Uv,
    /// Distance of the surface from the edge there, mm.
    miss: f64,
}

impl Target<'_> {
    /// Returns the foot point and slope at `t` of a Bézier piece; `inward`, 1 or −1, leads from an end into the piece. At a pole both are
    /// extrapolated from inside.
    fn node(&self, piece: &Curve, t: f64, inward: f64, hint: Option<Uv>) -> Result<Node, Overrun> {
        self.budget.spend()?;
        let [a, b] = piece.domain();
        let d = piece.derivatives(t);
        let near = |p: &&Pole| (p.point - d.point).length() <= self.pole_tolerance;
        if let Some(pole) = self.poles.iter().find(near) {
            // So far in that what the file's edge misses the pole by no longer turns the azimuth.
            let miss = (pole.point - d.point).length();
            let far = |s: &&f64| {
                (piece.evaluate(t + **s * (b - a) * inward) - pole.point).length() > POLE_DISTANCE_RATIO * miss
            };
            let fraction = POLE_STEPS.iter().find(far).copied().unwrap_or(LAST_POLE_STEP);
            let step = fraction * (b - a) * inward;
            let (t1, t2) = (t + step, t + 2.0 * step);
            let second = (self.locate)(t2, piece.evaluate(t2), hint);
            let first = (self.locate)(t1, piece.evaluate(t1), Some(second));
            // At the pole itself one parameter means nothing: it goes on from two places inside.
            let slope = (second - first) / step;
            // A canal that touches itself has a pole at both ends, in one point: the one that the edge runs into is meant.
            let off = |p: &Pole| (second[p.fixed] - p.parameter).abs();
            let pole = self.poles.iter().filter(near).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(pole);
            let mut uv = first * 2.0 - second;
            for d in 0..2 {
                uv[d] = uv[d].max(self.range[d][0]).min(self.range[d][1]);
            }
            uv[pole.fixed] = pole.parameter;
            return Ok(Node { t, uv, slope, miss });
        }
        let uv = (self.locate)(t, d.point, hint);
        let s = (self.derivatives)(uv);
        let (e, f, g) = (s.du.length_squared(), s.du.dot(s.dv), s.dv.length_squared());
        let miss = (s.point - d.point).length();
        let det = e * g - f * f;
        if det > PARALLEL_DERIVATIVES * e * g && det.is_normal() {
            // The curve's tangent in terms of Su and Sv, by least squares: what it is across the surface is the file's own gap.
            let (x, y) = (s.du.dot(d.first), s.dv.dot(d.first));
            return Ok(Node { t, uv, slope: Uv::new((x * g - y * f) / det, (y * e - x * f) / det), miss });
        }
        // Parallel derivatives give no slope; neighbouring feet do.
        let step = DIFFERENCE_STEP * (b - a) * inward;
        let beside = (self.locate)(t + step, piece.evaluate(t + step), Some(uv));
        Ok(Node { t, uv, slope: (beside - uv) / step, miss })
    }

    /// Returns where the middle between two nodes is expected. Close to a pole azimuths change so fast that the cubic swings by whole
    /// periods; then the chord says which period is meant.
    fn middle_guess(&self, a: Node, b: Node) -> Uv {
        let mut guess = evaluate_hermite(a, b, 0.5);
        let chord = 0.5 * (a.uv + b.uv);
        for d in 0..2 {
            let far = |p: f64| (guess[d] - chord[d]).abs() > LARGEST_SWING * p;
            if self.period[d].is_some_and(far) {
                guess[d] = chord[d];
            }
        }
        guess
    }

    /// Returns how far `uv` lies beyond the range, as a share of it; negative inside, 0 where it has no end.
    fn overshoot(&self, uv: Uv) -> f64 {
        let over = |d: usize| {
            let [lo, hi] = self.range[d];
            if hi - lo < f64::INFINITY { (lo - uv[d]).max(uv[d] - hi) / (hi - lo) } else { 0.0 }
        };
        over(0).max(over(1))
    }

    /// Returns the node without the part of its slope that leads out of the border that it lies on: ahead (1), behind (−1) or to both sides
    /// (0).
    fn slope_inside(&self, mut node: Node, ahead: f64) -> Node {
        for d in 0..2 {
            let [lo, hi] = self.range[d];
            let near = ON_BORDER * (hi - lo);
            let out = ahead * node.slope[d];
            let low = node.uv[d] <= lo + near && (ahead == 0.0 || out < 0.0);
            let high = node.uv[d] >= hi - near && (ahead == 0.0 || out > 0.0);
            if near < f64::INFINITY && (low || high) {
                node.slope[d] = 0.0;
            }
        }
        node
    }

    /// Returns both nodes with slopes shortened so that the cubic's control points lie inside the border.
    fn controls_inside(&self, mut a: Node, mut b: Node) -> (Node, Node) {
        let third = (b.t - a.t) / 3.0;
        if !(third > 0.0) {
            return (a, b);
        }
        for d in 0..2 {
            let [lo, hi] = self.range[d];
            a.slope[d] = ((a.uv[d] + a.slope[d] * third).max(lo).min(hi) - a.uv[d]) / third;
            b.slope[d] = (b.uv[d] - (b.uv[d] - b.slope[d] * third).max(lo).min(hi)) / third;
        }
        (a, b)
    }

    /// Whether the cubic between two nodes keeps to the border and, at four places, to the tolerance or a share of the file's own gap.
    /// Raises `gap` to the largest miss seen, mm.
    fn accepts(&self, piece: &Curve, a: Node, b: Node, gap: &mut f64) -> Result<bool, Overrun> {
        // Where an edge runs along the border beside the surface, its foot points follow the border with corners.
        if (1..10).any(|k| self.overshoot(evaluate_hermite(a, b, 0.1 * f64::from(k))) > MAX_OVERSHOOT) {
            return Ok(false);
        }
        // Not in symmetric places alone: a cubic's error may vanish in the middle.
        for s in [0.5, 0.13, 0.87, 0.32] {
            self.budget.spend()?;
            let t = a.t + s * (b.t - a.t);
            let guess = evaluate_hermite(a, b, s);
            let p = piece.evaluate(t);
            let at = (self.derivatives)(guess);
            let miss = at.point - p;
            if miss.length() <= self.tolerance {
                *gap = gap.max(miss.length());
                continue;
            }
            // Off the surface by a gap of the file's own, or off the foot point by our fit?
            let foot = (self.locate)(t, p, Some(guess));
            let d = guess - foot;
            // The difference of parameters as a length on the surface: their own units mean nothing.
            let error = at.du * d.x + at.dv * d.y;
            // Where the file itself leaves a gap, a twentieth of it is accurate enough.
            let own = SHARE_OF_GAP * ((self.derivatives)(foot).point - p).length();
            if !(error.length() <= self.tolerance.max(own)) {
                return Ok(false);
            }
            *gap = gap.max(miss.length());
        }
        Ok(true)
    }

    /// Fits a uv curve to an edge, over the edge's own parameter; fails only when the budget is used up. Beyond [`MAX_DEPTH`] halvings
    /// pieces are taken as they are. `start` is where it is expected to begin, if known.
    pub(crate) fn fit(&self, curve: &Curve, start: Option<Uv>) -> Result<Fit, Overrun> {
        let breaks = curve.breakpoints();
        let spans = breaks.len() - 1;
        // One Bézier span of high degree may hold a whole turn of a thread.
        let pieces = if curve.degree == 1 { 1 } else { 4usize.div_ceil(spans).max(curve.degree.div_ceil(2)) };
        let mut nodes: Vec<(Node, Node)> = Vec::new();
        let mut hint = start;
        let mut gap = 0f64;
        for (points, pair) in curve.bezier_pieces().into_iter().zip(breaks.windows(2)) {
            let degree = curve.degree;
            let knots = [vec![pair[0]; degree + 1], vec![pair[1]; degree + 1]].concat();
            let piece = Curve { degree, knots, points };
            let mut a = self.node(&piece, pair[0], 1.0, hint)?;
            for k in 1..=pieces {
                let t =
                    if k == pieces { pair[1] } else { pair[0] + (pair[1] - pair[0]) * k as f64 / pieces as f64 };
                let b = self.node(&piece, t, -1.0, Some(a.uv))?;
                self.fit_by_halving(&piece, a, b, 0, &mut nodes, &mut gap)?;
                a = b;
            }
            // The end of one span is where the next one is expected to begin.
            hint = Some(a.uv);
        }
        Ok(Fit { curve: join_pieces(&nodes), gap })
    }

    /// Appends the cubic from `a` to `b` to `nodes` where it is accepted, else those of its halves; raises `gap` to the largest miss, mm.
    fn fit_by_halving(
        &self,
        piece: &Curve,
        a: Node,
        b: Node,
        depth: u32,
        nodes: &mut Vec<(Node, Node)>,
        gap: &mut f64,
    ) -> Result<(), Overrun> {
        let mut seen = *gap;
        let (a, b) = (self.slope_inside(a, 1.0), self.slope_inside(b, -1.0));
        // At the deepest halving it is taken as it is, with control points held inside the border.
        if depth >= MAX_DEPTH || self.accepts(piece, a, b, &mut seen)? {
            *gap = seen.max(a.miss).max(b.miss);
            nodes.push(if depth >= MAX_DEPTH { self.controls_inside(a, b) } else { (a, b) });
            return Ok(());
        }
        let t = 0.5 * (a.t + b.t);
        let middle = self.node(piece, t, 1.0, Some(self.middle_guess(a, b)))?;
        let middle = self.slope_inside(middle, 0.0);
        self.fit_by_halving(piece, a, middle, depth + 1, nodes, gap)?;
        self.fit_by_halving(piece, middle, b, depth + 1, nodes, gap)
    }
}

/// Returns the place, in parameters, of the cubic between two nodes at the share `s` of its interval.
fn evaluate_hermite(a: Node, b: Node, s: f64) -> Uv {
    let h = b.t - a.t;
    let r = 1.0 - s;
    a.uv * (r * r * (1.0 + 2.0 * s)) + b.uv * (s * s * (3.0 - 2.0 * s)) + a.slope * (h * s * r * r)
        - b.slope * (h * s * s * r)
}

/// Makes one spline of all pieces, of which there is at least one: C¹ where slopes agree, a corner where they do not, a single line where
/// all is straight.
fn join_pieces(pieces: &[(Node, Node)]) -> UvCurve {
    let (first, last) = (pieces[0].0, pieces[pieces.len() - 1].1);
    let line = UvCurve::line(first.uv, last.uv, [first.t, last.t]);
    let size = (last.uv - first.uv).abs().max_element();
    let straight = pieces.iter().all(|(a, b)| {
        [0.0, 0.3, 0.7, 1.0].iter().all(|&s| {
            let t = a.t + s * (b.t - a.t);
            (evaluate_hermite(*a, *b, s) - line.evaluate(t)).abs().max_element()
                <= STRAIGHT_SHARE * size.max(STRAIGHT_SIZE)
        })
    });
    if straight {
        return line;
    }
    let mut knots = vec![first.t; 4];
    let mut points = vec![UvCurve::line(first.uv, last.uv, [0.0, 1.0]).points[0]];
    for (i, (a, b)) in pieces.iter().enumerate() {
        // From Hermite to Bézier: inner control points lie a third of the step along the slopes.
        let third = (b.t - a.t) / 3.0;
        points.push((a.uv + a.slope * third).extend(1.0));
        points.push((b.uv - b.slope * third).extend(1.0));
        match pieces.get(i + 1) {
            None => {
                points.push(b.uv.extend(1.0));
                knots.extend([b.t; 4]);
            }
            Some((next, _)) => {
                let smooth = (b.slope - next.slope).length()
                    <= SMOOTH_SLOPE * (b.slope.length() + next.slope.length())
                    && (b.uv - next.uv).abs().max_element() <= SAME_JOINT * size;
                if !smooth {
                    points.push(b.uv.extend(1.0));
                }
                // A double knot keeps a cubic C¹, and its joint is no control point; a triple one allows a corner.
                knots.extend(std::iter::repeat_n(b.t, if smooth { 2 } else { 3 }));
            }
        }
    }
    UvCurve { degree: 3, knots, points }
}

/// Returns an edge on a plane, exactly: its control points by `flat`, an affine map to parameters and height over the plane, mm. The gap is
/// the largest height of a control point, a bound of the edge's.
pub(crate) fn project_to_plane(curve: &Curve, flat: impl Fn(Point) -> (Uv, f64)) -> Fit {
    let mut gap = 0f64;
    let points = curve
        .points
        .iter()
        .map(|p| {
            let (uv, height) = flat(p.position());
            gap = gap.max(height.abs());
            <glam::DVec3 as ControlPoint>::weighted(uv, p.w)
        })
        .collect();
    Fit { curve: UvCurve { degree: curve.degree, knots: curve.knots.clone(), points }, gap }
}
