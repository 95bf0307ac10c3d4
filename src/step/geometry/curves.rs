//! Curves of the file: closed forms where there is one, rational splines for the rest.

use super::joints::{JoinedCurve, Joint, crossed_joints, segment_over_seam};
use super::tolerances::{CLOSED_MM, CLOSED_SHARE, CONVERGED_ANGLE, MERGED_POINTS_MM};
use super::{GeometryReader, Outcome, Refusal};
use crate::math::{Frame, Homogeneous, Point, Vector};
use crate::nurbs::{ControlPoint, Curve, conic, project, sanitise};
use crate::step::part21::{Args, Entity};
use std::f64::consts::PI;

/// Deepest chain of curves that refer to curves.
pub(crate) const MAX_DEPTH: usize = 16;

/// Names of curves on surfaces, which stand for the curve in space that they hold.
pub(super) const SURFACE_CURVES: [&str; 4] =
    ["SURFACE_CURVE", "SEAM_CURVE", "INTERSECTION_CURVE", "BOUNDED_SURFACE_CURVE"];
/// Names of curves of several segments.
pub(super) const COMPOSITES: [&str; 4] =
    ["COMPOSITE_CURVE", "COMPOSITE_CURVE_ON_SURFACE", "BOUNDARY_CURVE", "OUTER_BOUNDARY_CURVE"];
/// Names of splines, whose parameters are the file's.
pub(super) const SPLINES: [&str; 5] =
    ["B_SPLINE_CURVE", "B_SPLINE_CURVE_WITH_KNOTS", "BEZIER_CURVE", "UNIFORM_CURVE", "QUASI_UNIFORM_CURVE"];

/// A curve in space, mm, not yet cut; parameters of conics are radians or pure numbers, as in ISO 10303-42.
#[derive(Clone, Debug)]
pub(crate) enum CurveShape {
    /// `origin + t·direction`.
    Line { origin: Point, direction: Vector },
    /// `(a cos t, b sin t)`; a circle when equal.
    Ellipse { frame: Frame, a: f64, b: f64 },
    /// `(a cosh t, b sinh t)`.
    Hyperbola { frame: Frame, a: f64, b: f64 },
    /// `(f t², 2 f t)`.
    Parabola { frame: Frame, f: f64 },
    /// A spline over its domain; `joints` are those of a composite curve.
    Spline { curve: Curve, closed: bool, joints: Vec<Joint> },
}

/// A curve with the direction in which it is run.
#[derive(Clone, Debug)]
pub(crate) struct DirectedCurve {
    pub(crate) shape: CurveShape,
    /// Whether it is run against its parameter.
    pub(crate) reversed: bool,
}

impl CurveShape {
    /// Wraps a spline, and finds out whether its ends meet.
    pub(crate) fn spline(curve: Curve) -> Self {
        Self::joined(JoinedCurve { curve, joints: Vec::new() })
    }

    /// Wraps a spline, as [`Self::spline`] does, with the joints of its segments.
    pub(super) fn joined(JoinedCurve { curve, joints }: JoinedCurve) -> Self {
        let [a, b] = curve.domain();
        let size = curve.bounds().diagonal();
        let closed = (curve.evaluate(a) - curve.evaluate(b)).length() <= CLOSED_SHARE * size + CLOSED_MM;
        Self::Spline { curve, closed, joints }
    }

    /// Returns the joints that the piece over a range runs over, by the parameter of the piece.
    pub(super) fn joints_along(&self, range: [f64; 2]) -> Vec<Joint> {
        match self {
            Self::Spline { curve, joints, .. } => crossed_joints(joints, curve.domain()[0], self.period(), range),
            _ => Vec::new(),
        }
    }

    /// Returns the curve as a placement moves, turns, mirrors and scales it, with the same parameter.
    pub(super) fn placed(self, placement: &Frame) -> Self {
        let scale = placement.scale;
        let carried = |frame: Frame| placed_frame(placement, frame);
        match self {
            Self::Line { origin, direction } => {
                Self::Line { origin: placement.point(origin), direction: placement.vector(direction) }
            }
            Self::Ellipse { frame, a, b } => Self::Ellipse { frame: carried(frame), a: scale * a, b: scale * b },
            Self::Hyperbola { frame, a, b } => {
                Self::Hyperbola { frame: carried(frame), a: scale * a, b: scale * b }
            }
            Self::Parabola { frame, f } => Self::Parabola { frame: carried(frame), f: scale * f },
            Self::Spline { curve, closed, joints } => {
                Self::Spline { curve: map_points(curve, |p| placement.point(p)), closed, joints }
            }
        }
    }

    /// Returns the parameter difference after which the curve repeats; `None` for an open one.
    pub(crate) fn period(&self) -> Option<f64> {
        match self {
            Self::Ellipse { .. } => Some(2.0 * PI),
            Self::Spline { curve, closed: true, .. } => {
                let [a, b] = curve.domain();
                Some(b - a)
            }
            _ => None,
        }
    }

    /// Returns the parameter of the nearest point, radians on an ellipse; on a hyperbola or parabola that of the point with the same local
    /// y, which is the same for points of the curve.
    pub(crate) fn parameter(&self, p: Point) -> f64 {
        match self {
            Self::Line { origin, direction } => (p - *origin).dot(*direction) / direction.length_squared(),
            Self::Ellipse { frame, a, b } => {
                let q = frame.local_point(p);
                // A circle's angle is exact; the nearest point of an ellipse takes iterations.
                if a == b { q.y.atan2(q.x) } else { ellipse_angle(q, *a, *b) }
            }
            Self::Hyperbola { frame, b, .. } => (frame.local_point(p).y / b).asinh(),
            Self::Parabola { frame, f } => frame.local_point(p).y / (2.0 * f),
            Self::Spline { curve, .. } => project::nearest(curve, p).0,
        }
    }

    /// Returns the piece over `[t0, t1]`, `t0 < t1`, as a spline; over a period at most, and inside the domain of an open spline.
    pub(crate) fn segment(&self, t0: f64, t1: f64) -> Curve {
        match self {
            Self::Line { origin, direction } => {
                Curve::line(*origin + t0 * *direction, *origin + t1 * *direction, [t0, t1])
            }
            Self::Ellipse { frame, a, b } => {
                // A rational spline goes along with an affine map: the ellipse is the image of a circle's arc.
                let unit = conic::arc(&Frame::IDENTITY, 1.0, [t0, t1]);
                map_points(unit, |q| frame.point(Point::new(a * q.x, b * q.y, 0.0)))
            }
            Self::Hyperbola { frame, a, b } => {
                // Middle control point on the crossing of the tangents, weight cosh of half the range.
                let (middle, half) = (0.5 * (t0 + t1), 0.5 * (t1 - t0));
                let w = half.cosh();
                let at = |t: f64, k: f64| frame.point(Point::new(a * t.cosh() / k, b * t.sinh() / k, 0.0));
                let points = vec![
                    Homogeneous::weighted(at(t0, 1.0), 1.0),
                    Homogeneous::weighted(at(middle, w), w),
                    Homogeneous::weighted(at(t1, 1.0), 1.0),
                ];
                Curve { degree: 2, knots: vec![t0, t0, t0, t1, t1, t1], points }
            }
            Self::Parabola { frame, f } => {
                // The blossom of (f t², 2 f t).
                let at = |s: f64, t: f64| frame.point(Point::new(f * s * t, f * (s + t), 0.0));
                let points = [at(t0, t0), at(t0, t1), at(t1, t1)].map(|p| Homogeneous::weighted(p, 1.0)).to_vec();
                Curve { degree: 2, knots: vec![t0, t0, t0, t1, t1, t1], points }
            }
            Self::Spline { curve, closed, .. } => {
                let [a, b] = curve.domain();
                let period = b - a;
                if *closed && (t1 > b || t0 < a) {
                    // Into the first period, where the spline is given; the range may run past its end once.
                    let shift = ((t0 - a) / period).floor() * period;
                    let (s0, s1) = ((t0 - shift).clamp(a, b), (t1 - shift).clamp(a, a + 2.0 * period));
                    return segment_over_seam(curve, s0, s1).reparametrised([t0, t1]);
                }
                curve.restricted(t0.clamp(a, b), t1.clamp(a, b))
            }
        }
    }
}

/// Returns the frame of a conic that a placement carries along, which scales its sizes. It is right-handed also where the placement
/// mirrors: a conic lies in x and y alone.
fn placed_frame(placement: &Frame, conic: Frame) -> Frame {
    let Frame { origin, x, y, .. } = placement.compose(&conic);
    Frame { origin, x, y, z: x.cross(y), scale: 1.0 }
}

/// Returns a spline with its control points moved by `map`, which must be affine.
pub(crate) fn map_points(curve: Curve, map: impl Fn(Point) -> Point) -> Curve {
    let points = curve.points.iter().map(|p| Homogeneous::weighted(map(p.position()), p.w)).collect();
    Curve { points, ..curve }
}

/// Returns the angle, radians, of the point of an ellipse nearest to `q`, by Newton from the angle of the scaled point; may be a local
/// minimum for far points.
fn ellipse_angle(q: Point, a: f64, b: f64) -> f64 {
    let mut t = (q.y / b).atan2(q.x / a);
    for _ in 0..20 {
        let (s, c) = t.sin_cos();
        // Half the derivative of the squared distance, and its derivative in turn.
        let slope = (a * c - q.x) * (-a * s) + (b * s - q.y) * (b * c);
        let bend = a * a * s * s + b * b * c * c + (a * c - q.x) * (-a * c) + (b * s - q.y) * (-b * s);
        if !(bend > 0.0) {
            break;
        }
        let step = slope / bend;
        t -= step;
        if step.abs() < CONVERGED_ANGLE {
            break;
        }
    }
    t
}

/// Returns the id of the curve in space of a surface curve, of its first PCURVE where it has none; `None` if it has neither.
pub(super) fn space_curve(e: Entity<'_, '_>) -> Option<u64> {
    // In a complex instance the curve is the first of its own attributes; in a simple one it stands behind the name.
    let own = e.attributes("SURFACE_CURVE", 1);
    let first_pcurve = || {
        let list = own.map_or_else(|| e.args().list(2), |a| a.list(1));
        let mut curves = (0..list.len()).filter_map(|i| list.entity(i));
        curves.find(|c| c.is_one_of(&["PCURVE", "BOUNDED_PCURVE"])).map(|c| c.id)
    };
    own.and_then(|a| a.id(0)).or_else(|| e.args().id(1)).or_else(first_pcurve)
}

impl<'f, 'a> GeometryReader<'f, 'a> {
    /// Reads a curve in space with its direction. Trimming is left to the caller's vertices, except of the segments of composite curves.
    /// Refuses kinds that are not supported, and chains of more than [`MAX_DEPTH`] references.
    pub(crate) fn curve(&self, id: u64, depth: usize) -> Outcome<DirectedCurve> {
        let e = self.entity(id)?;
        if depth > MAX_DEPTH {
            return Err(Refusal::new(e, "curves refer to each other too deeply"));
        }
        let ahead = |shape| Ok(DirectedCurve { shape, reversed: false });
        if e.is_one_of(&SURFACE_CURVES) {
            let basis = self.resolve(e, space_curve(e), "curve_3d of the surface curve")?;
            return self.curve(basis.id, depth + 1);
        }
        if e.is_one_of(&["PCURVE", "BOUNDED_PCURVE"]) {
            return ahead(CurveShape::joined(self.pcurve(e, depth + 1)?));
        }
        if let Some(own) = e.attributes("OFFSET_CURVE_3D", 1) {
            return self.offset_curve(e, own, depth);
        }
        if let Some(trimmed) = e.attributes("TRIMMED_CURVE", 1) {
            let basis = self.resolve(e, trimmed.id(0), "basis curve")?;
            let mut curve = self.curve(basis.id, depth + 1)?;
            curve.reversed ^= trimmed.flag(3) == Some(false);
            return Ok(curve);
        }
        if e.is_one_of(&COMPOSITES) {
            return ahead(CurveShape::joined(self.composite_curve(e, depth + 1)?));
        }
        if let Some(own) = e.attributes("CURVE_REPLICA", 1) {
            let (parent, placement) = self.replica(e, own)?;
            let DirectedCurve { shape, reversed } = self.curve(parent.id, depth + 1)?;
            return Ok(DirectedCurve { shape: shape.placed(&placement), reversed });
        }
        ahead(self.elementary_curve(e)?)
    }

    /// Reads an elementary curve, polyline or B-spline; refuses any other kind, and sizes that are not positive.
    fn elementary_curve(&self, e: Entity<'f, 'a>) -> Outcome<CurveShape> {
        let mm = self.units.length;
        let positive = |x: Option<f64>, what: &str| {
            x.map(|x| x * mm)
                .filter(|x| *x > 0.0 && x.is_finite())
                .ok_or_else(|| Refusal::new(e, format!("{what} is not positive")))
        };
        if let Some(a) = e.attributes("LINE", 1) {
            let origin = self.point(self.resolve(e, a.id(0), "point")?.id)?;
            let direction = self.vector(self.resolve(e, a.id(1), "direction")?.id)?;
            return Ok(CurveShape::Line { origin, direction });
        }
        let conic = |name: &str| {
            e.attributes(name, 1).map(|a| (a, e.attributes("CONIC", 1).and_then(|c| c.id(0)).or_else(|| a.id(0))))
        };
        // In a complex instance the position belongs to CONIC, so the sizes come first.
        let offset = usize::from(!e.keyword().is_empty());
        if let Some((a, at)) = conic("CIRCLE") {
            let frame = self.placement(self.resolve(e, at, "position")?.id)?;
            let r = positive(a.real(offset), "radius")?;
            return Ok(CurveShape::Ellipse { frame, a: r, b: r });
        }
        if let Some((a, at)) = conic("ELLIPSE") {
            let frame = self.placement(self.resolve(e, at, "position")?.id)?;
            let [x, y] = [positive(a.real(offset), "semi-axis 1")?, positive(a.real(offset + 1), "semi-axis 2")?];
            return Ok(CurveShape::Ellipse { frame, a: x, b: y });
        }
        if let Some((a, at)) = conic("HYPERBOLA") {
            let frame = self.placement(self.resolve(e, at, "position")?.id)?;
            let [x, y] =
                [positive(a.real(offset), "semi-axis")?, positive(a.real(offset + 1), "imaginary semi-axis")?];
            return Ok(CurveShape::Hyperbola { frame, a: x, b: y });
        }
        if let Some((a, at)) = conic("PARABOLA") {
            let frame = self.placement(self.resolve(e, at, "position")?.id)?;
            return Ok(CurveShape::Parabola { frame, f: positive(a.real(offset), "focal distance")? });
        }
        if let Some(a) = e.attributes("POLYLINE", 1) {
            return polyline(&self.points(e, a.list(0))?)
                .map(CurveShape::spline)
                .ok_or_else(|| Refusal::new(e, "polyline without length"));
        }
        if e.is_one_of(&SPLINES) {
            return self.spline_curve(e).map(CurveShape::spline);
        }
        Err(Refusal::new(e, "this kind of curve is not supported"))
    }

    /// Reads a B-spline curve in any of its forms, in mm; small faults of knots and weights are mended, others refused.
    fn spline_curve(&self, e: Entity<'f, 'a>) -> Outcome<Curve> {
        let base = e.attributes("B_SPLINE_CURVE", 1).unwrap_or_else(|| e.args());
        let shift = usize::from(!e.keyword().is_empty() && e.keyword() != "B_SPLINE_CURVE");
        let degree = base.count(shift).ok_or_else(|| Refusal::new(e, "its degree is missing"))?;
        let points = self.points(e, base.list(shift + 1))?;
        let weights = match e.attributes("RATIONAL_B_SPLINE_CURVE", 6).map(|a| a.list(0).reals()) {
            Some(None) => return Err(Refusal::new(e, "weights are no numbers")),
            Some(weights) => weights,
            None => None,
        };
        let form = knot_form(e, "CURVE");
        let knots = match e.attributes("B_SPLINE_CURVE_WITH_KNOTS", 6) {
            Some(a) => explicit_knots(a.list(0), a.list(1)),
            None => form.knots(degree, points.len()),
        };
        let knots = knots.ok_or_else(|| Refusal::new(e, "knots and multiplicities do not fit"))?;
        sanitise::curve(degree, knots, &points, weights.as_deref())
            .map(|(c, _)| c)
            .map_err(|d| Refusal::new(e, d.to_string()))
    }
}

/// Returns a polyline parametrised by arc length, mm; points nearer than [`MERGED_POINTS_MM`] are dropped. `None` when fewer than two are
/// left.
pub(crate) fn polyline(points: &[Point]) -> Option<Curve> {
    let mut kept: Vec<(f64, Point)> = polyline_lengths(points).into_iter().zip(points.iter().copied()).collect();
    // Parameters must ascend: a piece without length would repeat its knot.
    kept.dedup_by_key(|(length, _)| *length);
    let (lengths, kept): (Vec<f64>, Vec<Point>) = kept.into_iter().unzip();
    (kept.len() > 1).then(|| Curve::polyline(&lengths, &kept))
}

/// Returns the arc length, mm, from the first point of a polyline to each; a point that is dropped has that of the one before it.
pub(super) fn polyline_lengths(points: &[Point]) -> Vec<f64> {
    let mut lengths = Vec::with_capacity(points.len());
    let mut last: Option<(f64, Point)> = None;
    for &p in points {
        last = match last {
            None => Some((0.0, p)),
            Some((sum, q)) if (p - q).length() > MERGED_POINTS_MM => Some((sum + (p - q).length(), p)),
            same => same,
        };
        lengths.extend(last.map(|(sum, _)| sum));
    }
    lengths
}

/// How knots follow from the subtype when they are not given.
#[derive(Clone, Copy)]
pub(crate) enum KnotForm {
    Uniform,
    QuasiUniform,
    Bezier,
}

/// Returns the form of a spline of this kind (`CURVE` or `SURFACE`) without knots, by the names of its records; quasi-uniform if none
/// tells.
pub(crate) fn knot_form(e: Entity<'_, '_>, kind: &str) -> KnotForm {
    let is = |prefix: &str| e.keywords().any(|k| k.strip_prefix(prefix).is_some_and(|rest| rest == kind));
    if is("UNIFORM_") {
        KnotForm::Uniform
    } else if is("BEZIER_") {
        KnotForm::Bezier
    } else {
        KnotForm::QuasiUniform
    }
}

impl KnotForm {
    /// Returns the knot vector for a degree and a number of control points; `None` where they do not fit the form.
    pub(crate) fn knots(self, degree: usize, points: usize) -> Option<Vec<f64>> {
        if degree == 0 || degree > crate::nurbs::MAX_DEGREE || points <= degree {
            return None;
        }
        let inner = points - degree;
        Some(match self {
            // From −degree on, so that the domain begins at zero (ISO 10303-42, uniform_curve).
            Self::Uniform => (0..points + degree + 1).map(|i| i as f64 - degree as f64).collect(),
            Self::QuasiUniform => {
                let ends = |x: f64| std::iter::repeat_n(x, degree);
                ends(0.0).chain((0..=inner).map(|i| i as f64)).chain(ends(inner as f64)).collect()
            }
            Self::Bezier => {
                if !(points - 1).is_multiple_of(degree) {
                    return None;
                }
                let spans = (points - 1) / degree;
                let mut knots = vec![0.0];
                knots.extend((0..=spans).flat_map(|i| std::iter::repeat_n(i as f64, degree)));
                knots.push(spans as f64);
                knots
            }
        })
    }
}

/// Returns the knot vector of multiplicities and distinct knots; `None` where they are no numbers or do not fit each other.
pub(crate) fn explicit_knots(multiplicities: Args<'_, '_>, knots: Args<'_, '_>) -> Option<Vec<f64>> {
    let m: Vec<usize> = (0..multiplicities.len()).map(|i| multiplicities.count(i)).collect::<Option<_>>()?;
    sanitise::expand_knots(&knots.reals()?, &m)
}
