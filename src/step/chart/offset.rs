//! Offset surfaces: exact where the basis is analytic, otherwise a spline fitted to 1e-6 mm; of an extrusion or a revolution only its
//! profile is fitted, since the offset is one too.
//!
//! The fit has the basis' own parameters and weights, and may have a corner at each of its knots. Known weakness: an offset beyond a radius
//! of curvature folds; it is fitted as it is.

use super::tolerances::{AXIS_RADIUS_SHARE, CLOSED_SHARE, SIDE_SHARE, WORST_FIT_MM};
use super::{Chart, Kind, SplineChart};
use crate::math::{Frame, Homogeneous, Uv, Vector};
use crate::model::Analytic;
use crate::nurbs::{Curve, Surface, fit_curve, fit_surface};

/// Stated error of fitted offsets, mm.
pub(crate) const TOLERANCE: f64 = 1e-6;

/// Returns the chart of the surface at `distance`, mm, along Su × Sv of `basis`. `None` where nothing is left of a radius, the basis
/// has no ends, or no fit within [`WORST_FIT_MM`] is found; the error of a fit is in the chart.
pub(crate) fn offset(basis: &Chart, distance: f64) -> Option<Chart> {
    let mut chart = match &basis.kind {
        // Elementary surfaces stay what they are, exact and with their parameters.
        Kind::Plane { frame } => {
            let mut frame = *frame;
            frame.origin += distance * frame.z;
            Chart::new(Kind::Plane { frame }, Analytic::Plane { frame })
        }
        Kind::Cone { frame, radius, half_angle } => {
            let (mut frame, half_angle) = (*frame, *half_angle);
            // Each point keeps its parameters (ISO 10303-42) and moves along the tilted normal: by the cosine outwards, by the sine down.
            let (sin, cos) = half_angle.sin_cos();
            frame.origin -= distance * sin * frame.z;
            let radius = radius + distance * cos;
            if !radius.is_finite() || half_angle == 0.0 && radius <= 0.0 {
                return None;
            }
            let analytic = if half_angle == 0.0 {
                Analytic::Cylinder { frame, radius }
            } else if radius >= 0.0 {
                Analytic::Cone { frame, radius, half_angle }
            } else {
                // Height 0 lies beyond the apex: the analytic cone starts at the apex.
                let origin = frame.origin - radius / half_angle.tan() * frame.z;
                Analytic::Cone { frame: Frame { origin, ..frame }, radius: 0.0, half_angle }
            };
            Chart::new(Kind::Cone { frame, radius, half_angle }, analytic)
        }
        Kind::Torus { frame, major, minor } => {
            let (frame, major, minor) = (*frame, *major, minor + distance);
            if !(minor > 0.0) {
                return None;
            }
            let analytic = match major {
                0.0 => Analytic::Sphere { frame, radius: minor },
                _ => Analytic::Torus { frame, major, minor },
            };
            Chart::new(Kind::Torus { frame, major, minor }, analytic)
        }
        Kind::Extrusion { base, direction } => {
            let normal = |t: f64| base.derivatives(t).first.cross(*direction).try_normalize();
            let (base, error) = offset_profile(base, normal, distance)?;
            let kind = Kind::Extrusion { base, direction: *direction };
            Chart { error, sweeps_spline: basis.sweeps_spline, ..Chart::new(kind, Analytic::Offset) }
        }
        Kind::Revolution { frame, meridian, .. } => {
            let normal = |t: f64| revolved_normal(frame, meridian, t);
            let (meridian, error) = offset_profile(meridian, normal, distance)?;
            let revolved = Chart::revolution(*frame, meridian);
            Chart { error, sweeps_spline: basis.sweeps_spline, analytic: Analytic::Offset, ..revolved }
        }
        // The offset of a spline is no spline in general: it is fitted.
        Kind::Spline(spline) => {
            let (surface, error) = offset_spline(&spline.surface, distance)?;
            Chart { error, ..Chart::new(Kind::Spline(SplineChart::new(surface)), Analytic::Offset) }
        }
    };
    chart.flipped = basis.flipped;
    chart.has_other_angles = basis.has_other_angles;
    Some(chart)
}

/// Returns a profile moved by `distance`, mm, along the `normal` of the surface that it sweeps, and the error of the fit, mm. `None` where
/// it is torn at a corner, has no normal, or the fit is worse than [`WORST_FIT_MM`].
fn offset_profile(base: &Curve, normal: impl Fn(f64) -> Option<Vector>, distance: f64) -> Option<(Curve, f64)> {
    let breaks = base.breakpoints();
    let weights = Weights::new(&base.points);
    let moved = |t: f64| {
        let weight = weights.unless_equal(|| base.homogeneous_at(t).w);
        Some(((base.evaluate(t) + distance * normal(t)?) * weight).extend(weight))
    };
    let near = CLOSED_SHARE * base.bounds().diagonal() + TOLERANCE;
    // At a corner of the profile the offsets of both sides part: no one curve joins them.
    for span in breaks.windows(3) {
        let step = SIDE_SHARE * (span[1] - span[0]).min(span[2] - span[1]);
        let [before, behind] = [-step, step].map(|by| Some(distance * normal(span[1] + by)?));
        if !((before? - behind?).length() <= near) {
            return None;
        }
    }
    let (mut curve, error) = fit_curve(&breaks, base.degree, moved, TOLERANCE)?;
    weights.equalise(&mut curve.points);
    (error <= WORST_FIT_MM).then_some((curve, error))
}

/// Returns the unit normal along Su × Sv, at azimuth 0, of the surface that a meridian makes, turned about the frame's z axis; `None`
/// where there is none. On the axis, where Su vanishes, it is the limit.
fn revolved_normal(frame: &Frame, meridian: &Curve, t: f64) -> Option<Vector> {
    let d = meridian.derivatives(t);
    // The part of a vector from the axis that is seen along it, turned a quarter around it.
    let turned = |from_axis: Vector| frame.z.cross(from_axis);
    let du = turned(d.point - frame.origin);
    let [start, end] = meridian.domain();
    let du = if du.length() > AXIS_RADIUS_SHARE * meridian.bounds().diagonal() {
        du
    } else {
        // Just inside the meridian, which leaves the axis along its tangent.
        turned(d.first) * if t > 0.5 * (start + end) { -1.0 } else { 1.0 }
    };
    du.cross(d.first).try_normalize()
}

/// Returns a spline moved by `distance`, mm, along its normals, and the error of the fit, mm. `None` where it has no normal or the fit is
/// worse than [`WORST_FIT_MM`].
fn offset_spline(basis: &Surface, distance: f64) -> Option<(Surface, f64)> {
    let breaks = [0, 1].map(|d| basis.breakpoints(d));
    let weights = Weights::new(&basis.points);
    let moved = |uv: Uv| {
        let weight = weights.unless_equal(|| basis.homogeneous_at(uv).w);
        Some(((basis.evaluate(uv) + distance * basis.normal(uv)?) * weight).extend(weight))
    };
    let (mut surface, error) = fit_surface([&breaks[0], &breaks[1]], basis.degree, moved, TOLERANCE)?;
    weights.equalise(&mut surface.points);
    (error <= WORST_FIT_MM).then_some((surface, error))
}

/// Whether control points have one weight, as a polynomial spline has: its fit has it too, without rounding.
#[derive(Clone, Copy)]
struct Weights {
    are_equal: bool,
}

impl Weights {
    fn new(points: &[Homogeneous]) -> Self {
        Self { are_equal: points.iter().all(|p| p.w == points[0].w) }
    }

    /// Returns 1 for equal weights, else what `weight` gives.
    fn unless_equal(self, weight: impl Fn() -> f64) -> f64 {
        if self.are_equal { 1.0 } else { weight() }
    }

    /// Sets the weights of fitted `points` to 1 for equal weights, which takes the rounding off; others stay.
    fn equalise(self, points: &mut [Homogeneous]) {
        if self.are_equal {
            points.iter_mut().for_each(|p| p.w = 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Point;
    use crate::nurbs::{conic, sweep};
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    /// Half axes of an ellipsoid, mm, as a reflector has them, and how far it is moved.
    const AXES: Vector = Vector::new(125.0, 157.5, 110.0);
    const DISTANCE: f64 = -2.5;

    /// Where a point of the ellipsoid comes to, by the gradient of its equation.
    fn moved(p: Point) -> Point {
        p + DISTANCE * (p / (AXES * AXES)).normalize()
    }

    /// Compares a fitted surface with the moved points of its basis at the same parameters, and counts its patches.
    fn judge(chart: &Chart, basis: &Surface, domain: [[f64; 2]; 2]) -> usize {
        let surface = chart.surface(domain);
        let [[u0, u1], [v0, v1]] = surface.domain();
        assert_eq!(surface.domain(), basis.domain());
        let mut worst = 0f64;
        // Steps that no knot follows.
        for (i, j) in (0..=173).flat_map(|i| (0..=181).map(move |j| (i, j))) {
            let uv = Uv::new(u0 + (u1 - u0) * f64::from(i) / 173.0, v0 + (v1 - v0) * f64::from(j) / 181.0);
            worst = worst.max((surface.evaluate(uv) - moved(basis.evaluate(uv))).length());
        }
        assert!(chart.error <= TOLERANCE && worst <= 2.0 * TOLERANCE, "{worst} of {}", chart.error);
        surface.bezier_patches().len()
    }

    #[test]
    fn an_offset_of_an_ellipsoid_takes_few_patches() {
        let ball = sweep::sphere(&Frame::IDENTITY, 1.0, [0.0, TAU], [-FRAC_PI_2, FRAC_PI_2]);
        let basis = ball.transformed(|p| p * AXES);
        let spline = Chart::new(Kind::Spline(SplineChart::new(basis.clone())), Analytic::Rational);
        let chart = offset(&spline, DISTANCE).unwrap();
        assert_eq!((chart.poles.len(), chart.period), (2, spline.period));
        let patches = judge(&chart, &basis, chart.range);
        assert!(patches <= 1536, "{patches}");
    }

    #[test]
    fn an_offset_of_a_swept_ellipse_takes_few_patches() {
        let frame = Frame { x: Vector::X, y: Vector::Z, z: -Vector::Y, ..Frame::IDENTITY };
        let arc = conic::arc(&frame, 1.0, [-FRAC_PI_2, FRAC_PI_2]);
        let spheroid = |p: &Homogeneous| (p.truncate() * Vector::new(AXES.x, AXES.x, AXES.z)).extend(p.w);
        let meridian = Curve { points: arc.points.iter().map(spheroid).collect(), ..arc };
        let turned = Chart::revolution(Frame::IDENTITY, meridian.clone());
        let chart = offset(&turned, DISTANCE).unwrap();
        assert!(chart.poles.len() == 2 && chart.error <= TOLERANCE);
        // The moved meridian against that of the spheroid of these half axes.
        let Kind::Revolution { meridian: fitted, .. } = &chart.kind else { panic!("{:?}", chart.kind) };
        let off = (0..=997).map(|k| {
            let p = meridian.evaluate(FRAC_PI_2 * f64::from(k) / 997.0 + meridian.domain()[0]);
            let n = (p / Vector::new(AXES.x * AXES.x, 1.0, AXES.z * AXES.z)).normalize();
            let t = FRAC_PI_2 * f64::from(k) / 997.0 + meridian.domain()[0];
            (fitted.evaluate(t) - p - DISTANCE * n).length()
        });
        assert!(off.fold(0.0, f64::max) <= 2.0 * TOLERANCE);
        let patches = chart.surface([[0.0, PI], chart.range[1]]).bezier_patches().len();
        assert!(patches <= 2 * 20, "{patches}");

        let extruded = Chart::new(Kind::Extrusion { base: meridian, direction: Vector::Y }, Analytic::Extrusion);
        let chart = offset(&extruded, DISTANCE).unwrap();
        let Kind::Extrusion { base, .. } = &chart.kind else { panic!("{:?}", chart.kind) };
        assert!(chart.error <= TOLERANCE && base.breakpoints().len() <= 21, "{:?}", base.breakpoints());
    }
}
