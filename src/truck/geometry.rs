//! Curves and surfaces in both directions: truck's homogeneous control points and ours are the same numbers.

use super::modeling::{
    BSplineCurve, BSplineSurface, BoundedCurve, Curve as TruckCurve, KnotVec, NurbsCurve, NurbsSurface, Point3,
    Vector3, Vector4,
};
use crate::math::{Homogeneous, Point, Vector};
use crate::nurbs::{ControlPoint, Curve, MAX_DEGREE, Spline, Surface, fit_cubic};

/// Largest distance between an intersection curve and the spline that stands for it, mm.
const FIT: f64 = 1e-7;

pub(super) fn point(p: Point3) -> Point {
    Point::new(p.x, p.y, p.z)
}

pub(super) fn vector(v: Vector3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

pub(super) fn to_truck(p: Point) -> Point3 {
    Point3::new(p.x, p.y, p.z)
}

fn homogeneous(v: &Vector4) -> Homogeneous {
    Homogeneous::new(v.x, v.y, v.z, v.w)
}

/// Returns a truck curve as a clamped spline over the same parameters; intersection curves are fitted within [`FIT`]. Fails for what our
/// splines do not hold.
pub(super) fn curve(c: &TruckCurve) -> Result<Curve, String> {
    let spline = match c {
        TruckCurve::Line(line) => Curve::line(point(line.0), point(line.1), [0.0, 1.0]),
        TruckCurve::BSplineCurve(c) => Spline {
            degree: c.degree(),
            knots: c.knot_vec().iter().copied().collect(),
            points: c.control_points().iter().map(|p| Homogeneous::weighted(point(*p), 1.0)).collect(),
        },
        TruckCurve::NurbsCurve(c) => Spline {
            degree: c.degree(),
            knots: c.knot_vec().iter().copied().collect(),
            points: c.control_points().iter().map(homogeneous).collect(),
        },
        TruckCurve::IntersectionCurve(c) => fit_curve(c)?,
    };
    checked_curve(spline)
}

/// Returns a cubic spline of a curve that is not a spline, the middle of each piece within [`FIT`] of it; fails where that takes too many
/// pieces, or a place is no number.
fn fit_curve(c: &impl BoundedCurve<Point = Point3, Vector = Vector3>) -> Result<Curve, String> {
    let (t0, t1) = c.range_tuple();
    let (spline, error) = fit_cubic([t0, t1], |t| (point(c.subs(t)), vector(c.der(t))), FIT);
    // An error that is no number is none within the limit.
    if error <= FIT {
        Ok(spline)
    } else {
        Err(format!("an intersection curve that cubic pieces follow to {error:.1e} mm alone, not to {FIT:e} mm"))
    }
}

/// Returns a curve clamped to its domain; fails for degrees, control points, weights and knots that are of no use. Truck itself checks
/// little of what it is given.
fn checked_curve(c: Curve) -> Result<Curve, String> {
    if c.degree == 0 || c.degree > MAX_DEGREE {
        return Err(format!("a curve of degree {}; 1 to {MAX_DEGREE} are supported", c.degree));
    }
    check_points(&c.points)?;
    let [a, b] = c.domain();
    if !is_interval([a, b], &c.knots) {
        return Err("a curve over an empty parameter interval".into());
    }
    // Cut to its domain a spline is clamped, as all our curves are.
    Ok(c.restricted(a, b))
}

/// Whether a range of parameters has a length and all knots are finite numbers.
fn is_interval([a, b]: [f64; 2], knots: &[f64]) -> bool {
    a < b && knots.iter().all(|k| k.is_finite())
}

/// Refuses control points that are not finite and weights that are not positive.
fn check_points(points: &[Homogeneous]) -> Result<(), String> {
    if points.iter().any(|p| !p.is_finite()) {
        return Err("a control point that is no finite number".into());
    }
    match points.iter().find(|p| p.w <= 0.0) {
        Some(p) => Err(format!("a weight of {}; weights must be positive", p.w)),
        None => Ok(()),
    }
}

/// Makes a surface from rows of control points, one for each u, clamped to its domain; fails for degrees, control points, weights and
/// ranges of knots that are of no use.
pub(super) fn surface(knots: (&KnotVec, &KnotVec), rows: Vec<Vec<Homogeneous>>) -> Result<Surface, String> {
    let knots = [knots.0.iter().copied().collect::<Vec<f64>>(), knots.1.iter().copied().collect()];
    let counts = [rows.len(), rows.first().map_or(0, Vec::len)];
    // Truck gives no degree of a surface: it follows from knots and control points.
    let degree = [0, 1].map(|k| knots[k].len().saturating_sub(counts[k] + 1));
    if counts.contains(&0) || degree.iter().any(|d| *d == 0 || *d > MAX_DEGREE) {
        return Err(format!("a surface of degrees {degree:?}; 1 to {MAX_DEGREE} are supported"));
    }
    let s = Surface { degree, knots, points: rows.into_iter().flatten().collect() };
    check_points(&s.points)?;
    let domain = s.domain();
    if !(0..2).all(|k| is_interval(domain[k], &s.knots[k])) {
        return Err("a surface over an empty parameter range".into());
    }
    Ok(s.restricted(domain))
}

/// Returns a polynomial surface of truck's as ours, with weights of 1; fails as [`surface`].
pub(super) fn bspline_surface(s: &BSplineSurface<Point3>) -> Result<Surface, String> {
    let rows = s.control_points().iter().map(|r| r.iter().map(|p| Homogeneous::weighted(point(*p), 1.0)).collect());
    surface((s.uknot_vec(), s.vknot_vec()), rows.collect())
}

/// Returns a rational surface of truck's as ours; fails as [`surface`].
pub(super) fn nurbs_surface(s: &NurbsSurface<Vector4>) -> Result<Surface, String> {
    let rows = s.control_points().iter().map(|r| r.iter().map(homogeneous).collect());
    surface((s.uknot_vec(), s.vknot_vec()), rows.collect())
}

fn vector4(p: &Homogeneous) -> Vector4 {
    Vector4::new(p.x, p.y, p.z, p.w)
}

/// Returns our curve as truck's.
///
/// # Errors
/// What truck says of it: it takes an interval of parameters below 1e-6 for a single value.
pub fn curve_to_truck(c: &Curve) -> Result<NurbsCurve<Vector4>, String> {
    let curve = BSplineCurve::try_new(KnotVec::from(c.knots.clone()), c.points.iter().map(vector4).collect());
    curve.map(NurbsCurve::new).map_err(|e| format!("truck refuses a curve: {e}"))
}

/// Returns our surface as truck's, with the same parameters.
///
/// # Errors
/// What truck says of it, as for [`curve_to_truck`].
pub fn surface_to_truck(s: &Surface) -> Result<NurbsSurface<Vector4>, String> {
    let knots = (KnotVec::from(s.knots[0].clone()), KnotVec::from(s.knots[1].clone()));
    let rows = s.points.chunks(s.counts()[1]).map(|r| r.iter().map(vector4).collect()).collect();
    BSplineSurface::try_new(knots, rows)
        .map(NurbsSurface::new)
        .map_err(|e| format!("truck refuses the surface: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What truck was given without a check is refused, not passed on: a fit to places that are no numbers, an endless range.
    #[test]
    fn geometry_without_numbers_is_refused() {
        let knots = |end: f64| KnotVec::from(vec![0.0, 0.0, end, end]);
        let torn = BSplineCurve::new(knots(1.0), vec![Point3::new(0.0, 0.0, 0.0), Point3::new(f64::NAN, 0.0, 0.0)]);
        assert!(fit_curve(&torn).is_err());
        let corner = |x, y| Homogeneous::weighted(Point::new(x, y, 0.0), 1.0);
        let rows = || vec![vec![corner(0.0, 0.0), corner(0.0, 1.0)], vec![corner(1.0, 0.0), corner(1.0, 1.0)]];
        assert!(surface((&knots(1.0), &knots(1.0)), rows()).is_ok());
        assert!(surface((&knots(f64::INFINITY), &knots(1.0)), rows()).is_err());
        assert!(surface((&knots(1.0), &knots(f64::INFINITY)), rows()).is_err());
    }
}
