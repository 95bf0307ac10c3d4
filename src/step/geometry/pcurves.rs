//! Curves given only in the parameter plane of a surface, offset curves, and cubic curves through what can be evaluated.

use super::curves::{CurveShape, DirectedCurve};
use super::extent::FaceExtent;
use super::joints::{JoinedCurve, direction};
use super::tolerances::{CURVE_ERROR_MM, DIFFERENCE_STEP, PARALLEL_AXIS, WORST_CURVE_ERROR_MM};
use super::units::Units;
use super::{GeometryReader, Outcome, Refusal};
use crate::math::{Aabb, Point, Uv, Vector};
use crate::nurbs::{Curve, fit_cubic};
use crate::step::chart::Chart;
use crate::step::part21::{Args, Entity};

impl<'f, 'a> GeometryReader<'f, 'a> {
    /// Reads an OFFSET_CURVE_3D with attributes `own`: the basis moved along the reference direction × its tangent. Lines, and circles in
    /// their plane, stay exact, all else is fitted as by [`fit_pieces`]; refuses hyperbolas and parabolas. Trimming of the basis is left to
    /// the caller, as by [`Self::curve`].
    pub(crate) fn offset_curve(
        &self,
        e: Entity<'f, 'a>,
        own: Args<'f, 'a>,
        depth: usize,
    ) -> Outcome<DirectedCurve> {
        let basis = self.resolve(e, own.id(0), "basis curve")?;
        let curve = self.curve(basis.id, depth + 1)?;
        self.offset_basis(e, own, curve, None)
    }

    /// Offsets the basis curve of the OFFSET_CURVE_3D `e` with attributes `own`; of one that has to be fitted only what lies over `range`,
    /// all of it where there is none. Lines and circles keep their parameter, and so does what is fitted, over its range.
    pub(super) fn offset_basis(
        &self,
        e: Entity<'f, 'a>,
        own: Args<'f, 'a>,
        DirectedCurve { shape, reversed }: DirectedCurve,
        range: Option<[f64; 2]>,
    ) -> Outcome<DirectedCurve> {
        let distance = own.real(1).map(|d| d * self.units.length).filter(|d| d.is_finite());
        let distance = distance.ok_or_else(|| Refusal::new(e, "its distance is missing"))?;
        let across = self.direction(own.id(3)).and_then(|d| d.try_normalize());
        let across = across.ok_or_else(|| Refusal::new(e, "its reference direction is missing"))?;
        // Run against its basis, the curve has its other side on the left.
        let sign = if reversed { -distance } else { distance };
        let shape = match shape {
            CurveShape::Line { origin, direction } => {
                let aside = across.cross(direction).try_normalize();
                let aside = aside.ok_or_else(|| Refusal::new(e, "its reference direction runs along its line"))?;
                CurveShape::Line { origin: origin + sign * aside, direction }
            }
            CurveShape::Ellipse { frame, a, b } if a == b && across.cross(frame.z).length() < PARALLEL_AXIS => {
                // The tangent turned by a right angle about the axis points to the center.
                let radius = a - sign * across.dot(frame.z).signum();
                if !(radius > 0.0) {
                    return Err(Refusal::new(e, "the offset leaves nothing of its circle"));
                }
                CurveShape::Ellipse { frame, a: radius, b: radius }
            }
            shape => {
                let whole = match &shape {
                    CurveShape::Spline { curve, .. } => Some(curve.domain()),
                    other => other.period().map(|period| [0.0, period]),
                };
                let Some([from, to]) = range.or(whole) else {
                    return Err(Refusal::new(e, "an offset of an unbounded conic is not supported"));
                };
                let curve = shape.segment(from, to);
                let moved = |piece: &Curve, t: f64| {
                    let aside = across.cross(direction(piece, t)).try_normalize();
                    // A curve that stands still throughout stays where it is.
                    piece.evaluate(t) + sign * aside.unwrap_or(Vector::ZERO)
                };
                // The offset's own derivative would need the curve's second one; a quotient is close enough for a
                // fit.
                let at = |piece: &Curve, t: f64| {
                    let [a, b] = piece.domain();
                    let h = DIFFERENCE_STEP * (b - a);
                    let (lo, hi) = ((t - h).max(a), (t + h).min(b));
                    (moved(piece, t), (moved(piece, hi) - moved(piece, lo)) / (hi - lo))
                };
                // Over its range it keeps its parameter, and with that its joints.
                let joints = shape.joints_along([from, to]);
                CurveShape::joined(JoinedCurve { curve: fit_pieces(e, &curve, at)?, joints })
            }
        };
        Ok(DirectedCurve { shape, reversed })
    }

    /// Reads a PCURVE as a curve in space, mm, fitted as by [`fit_pieces`], with the joints of what is composite in the parameter plane;
    /// refuses surfaces whose parameters the chart does not keep.
    pub(super) fn pcurve(&self, e: Entity<'f, 'a>, depth: usize) -> Outcome<JoinedCurve> {
        let own = e.attributes("PCURVE", 1).unwrap_or_else(|| e.args());
        let basis = self.resolve(e, own.id(0), "basis surface")?;
        let definition = self.resolve(e, own.id(1), "curve in the parameter plane")?;
        let representation = definition.attributes("REPRESENTATION", 0).unwrap_or_else(|| definition.args());
        let item = self.resolve(definition, representation.list(1).id(0), "curve in the parameter plane")?;
        // Parameters are pure numbers; only angles of conics keep their unit.
        let plane = GeometryReader { file: self.file, units: Units { length: 1.0, ..self.units } };
        let JoinedCurve { curve, joints } = plane.joined_part(item.id, depth + 1)?;
        let Aabb { min, max } = curve.bounds();
        let ranges =
            [[min.x, max.x], [min.y, max.y]].map(|[a, b]| [Some(a), Some(if a < b { b } else { a + 1.0 })]);
        let chart = self.chart(basis.id, FaceExtent::UNKNOWN.over_parameters(ranges), depth + 1)?;
        let Some(scale) = chart.parameter_scale(self.units.length, self.units.angle) else {
            return Err(Refusal::new(e, "its parameters cannot be taken over to the surface's closed form"));
        };
        Ok(JoinedCurve { curve: lift_to_surface(e, &chart, &curve, scale)?, joints })
    }
}

/// Returns a curve of a chart's parameter plane as a curve in space, fitted; `scale` turns the curve's u and v into the chart's.
fn lift_to_surface(e: Entity<'_, '_>, chart: &Chart, curve: &Curve, scale: [f64; 2]) -> Outcome<Curve> {
    fit_pieces(e, curve, |piece, t| {
        let c = piece.derivatives(t);
        let d = chart.derivatives(Uv::new(c.point.x * scale[0], c.point.y * scale[1]));
        (d.point, d.du * (c.first.x * scale[0]) + d.dv * (c.first.y * scale[1]))
    })
}

/// Fits cubics to what becomes of `curve`: `at` gives position, mm, and derivative on a piece of it, which ends where a corner may be, at
/// knots of full multiplicity. They are refined to [`CURVE_ERROR_MM`] where that can be reached; refuses what is not met within
/// [`WORST_CURVE_ERROR_MM`], and pieces that part at a corner.
fn fit_pieces(e: Entity<'_, '_>, curve: &Curve, at: impl Fn(&Curve, f64) -> (Point, Vector)) -> Outcome<Curve> {
    let breaks = curve.breakpoints();
    let multiplicity = |t: f64| curve.knots.partition_point(|&k| k <= t) - curve.knots.partition_point(|&k| k < t);
    let is_corner = |t: f64| multiplicity(t) >= curve.degree;
    let [start, end] = curve.domain();
    let corners: Vec<f64> = breaks.into_iter().filter(|&t| t == start || t == end || is_corner(t)).collect();
    let mut pieces: Vec<Curve> = Vec::with_capacity(corners.len());
    for span in corners.windows(2) {
        let piece = curve.restricted(span[0], span[1]);
        let (fitted, error) = fit_cubic([span[0], span[1]], |t| at(&piece, t), CURVE_ERROR_MM);
        // Of an offset both sides of a corner part, and no one curve joins them.
        let end_before = pieces.last().and_then(|piece| piece.points.last());
        let parted = end_before.map_or(0.0, |end| (*end - fitted.points[0]).length());
        // An error that is no number stays one.
        let off = if parted > error { parted } else { error };
        if !(off <= WORST_CURVE_ERROR_MM) {
            return Err(Refusal::new(e, format!("no curve follows it to more than {off:.1e} mm")));
        }
        pieces.push(fitted);
    }
    Curve::join(pieces).ok_or_else(|| Refusal::new(e, "it has no length"))
}
