//! Conic profiles of lenses and reflectors as truck curves.

use super::modeling::{BSplineCurve, Curve, KnotVec, Line, NurbsCurve, Point3, Vector4};
use thiserror::Error;

/// A parameter of an optical part that makes no shape.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{what} is {value}, but must be {allowed}")]
pub struct ShapeError {
    pub(super) what: &'static str,
    pub(super) value: f64,
    pub(super) allowed: &'static str,
}

/// Returns the value where it is finite and `good`, else an error that says what is allowed.
pub(super) fn check_value(
    what: &'static str,
    value: f64,
    good: bool,
    allowed: &'static str,
) -> Result<f64, ShapeError> {
    if good && value.is_finite() { Ok(value) } else { Err(ShapeError { what, value, allowed }) }
}

/// The profile of a rotationally symmetric optical surface: `z(h) = h²/R / (1 + √(1 − (1+K)·h²/R²))`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conic {
    /// Vertex radius R, mm; positive when the centre of curvature lies at higher z; infinite for a plane.
    pub radius: f64,
    /// Conic constant K: 0 sphere, −1 paraboloid, below −1 hyperboloid, between −1 and 0 ellipsoid.
    pub conic: f64,
}

impl Conic {
    /// A plane.
    pub const FLAT: Self = Self { radius: f64::INFINITY, conic: 0.0 };

    /// Returns a sphere of that radius, mm, whose sign is that of [`Self::radius`].
    pub fn sphere(radius: f64) -> Self {
        Self { radius, conic: 0.0 }
    }

    /// Returns a paraboloid of that focal length, mm, which opens towards +z if it is positive.
    pub fn paraboloid(focal_length: f64) -> Self {
        Self { radius: 2.0 * focal_length, conic: -1.0 }
    }

    /// Returns the height above the vertex at a distance from the axis, mm; `None` beyond the shape's reach.
    pub fn sag(&self, h: f64) -> Option<f64> {
        if self.radius.is_infinite() {
            return Some(0.0);
        }
        let c = 1.0 / self.radius;
        let inside = 1.0 - (1.0 + self.conic) * c * c * h * h;
        // In this form there is no difference of large numbers, as z = R − √(R² − …) would have.
        (inside > 0.0).then(|| c * h * h / (1.0 + inside.sqrt()))
    }

    /// Returns the height above the vertex, mm, at a half aperture.
    ///
    /// # Errors
    /// When the conic does not reach it.
    pub(super) fn sag_within(&self, aperture: f64) -> Result<f64, ShapeError> {
        self.sag(aperture).ok_or(ShapeError {
            what: "the half aperture",
            value: aperture,
            allowed: "smaller than the reach of the conic, R/√(1+K)",
        })
    }

    /// Returns the distance from the axis, mm, at which two conics have the same slope, other than on the axis itself, be it beyond their
    /// reach; `None` where there is none.
    pub(super) fn equal_slope(&self, other: &Self) -> Option<f64> {
        // From c₁²·(1 − (1+K₂)c₂²h²) = c₂²·(1 − (1+K₁)c₁²h²), for curvatures of one sign.
        let [r1, r2] = [self.radius, other.radius];
        let h = ((r2 * r2 - r1 * r1) / (other.conic - self.conic)).sqrt();
        (r1 * r2 > 0.0 && h.is_finite() && h > 0.0).then_some(h)
    }

    /// Returns the slope dz/dh at a distance from the axis within the shape's reach.
    fn slope(&self, h: f64) -> f64 {
        if self.radius.is_infinite() {
            return 0.0;
        }
        let c = 1.0 / self.radius;
        c * h / (1.0 - (1.0 + self.conic) * c * c * h * h).sqrt()
    }

    /// Returns the profile from the vertex `(0, z0)` to `(reach, z0 + sag)` in the x–z plane, mm, exact as one rational quadratic; a line
    /// where it is flat. Fails for a radius of zero, a reach that is not positive, a number that is not finite, and where the conic does
    /// not extend to the reach.
    pub(super) fn profile(&self, z0: f64, reach: f64) -> Result<Curve, ShapeError> {
        // The curvature must be a number, which a plane's is too: the radius itself need not be finite.
        if !(1.0 / self.radius).is_finite() {
            let (what, allowed) = ("a radius of curvature", "anything but zero");
            return Err(ShapeError { what, value: self.radius, allowed });
        }
        check_value("a conic constant", self.conic, true, "a finite number")?;
        check_value("the half aperture", reach, reach > 0.0, "positive")?;
        let sag = self.sag_within(reach)?;
        let start = Point3::new(0.0, 0.0, z0);
        let end = Point3::new(reach, 0.0, z0 + sag);
        // A flat profile is a line; the tangents of its ends meet nowhere.
        if sag == 0.0 {
            return Ok(Curve::Line(Line(start, end)));
        }
        // Control point where the tangents of both ends meet: (m, 0). With F = x² + (1+K)z² − 2Rz, the weight is
        // w² = −F(middle of the chord)/F(control point), and F(control point) = m².
        let m = reach - sag / self.slope(reach);
        let (x, z) = (0.5 * reach, 0.5 * sag);
        let w = ((2.0 * self.radius * z - x * x - (1.0 + self.conic) * z * z) / (m * m)).sqrt();
        let points = vec![
            Vector4::new(start.x, 0.0, start.z, 1.0),
            Vector4::new(m * w, 0.0, z0 * w, w),
            Vector4::new(end.x, 0.0, end.z, 1.0),
        ];
        Ok(Curve::NurbsCurve(NurbsCurve::new(BSplineCurve::new(KnotVec::bezier_knot(2), points))))
    }
}

#[cfg(test)]
mod tests {
    use super::super::modeling::{BoundedCurve, ParametricCurve};
    use super::*;

    #[test]
    fn profiles_satisfy_their_equation() {
        for conic in [
            Conic::sphere(50.0),
            Conic::sphere(-30.0),
            Conic::paraboloid(25.0),
            Conic { radius: 25.0, conic: -2.25 },
            Conic { radius: 18.0, conic: -0.64 },
            Conic { radius: 40.0, conic: 1.5 },
            Conic::FLAT,
        ] {
            let c = conic.profile(3.0, 17.0).unwrap();
            let (t0, t1) = c.range_tuple();
            for i in 0..=100 {
                let p = c.subs(t0 + (t1 - t0) * f64::from(i) / 100.0);
                let (x, z) = (p.x, p.z - 3.0);
                let off = if conic.radius.is_infinite() {
                    z
                } else {
                    (x * x + (1.0 + conic.conic) * z * z) / (2.0 * conic.radius) - z
                };
                assert!(off.abs() < 1e-13, "{conic:?} at {x}: {off:e}");
            }
        }
    }

    #[test]
    fn an_aperture_beyond_the_sphere_is_refused() {
        let e = Conic::sphere(10.0).profile(0.0, 11.0).unwrap_err();
        assert!(e.to_string().contains("half aperture is 11"), "{e}");
        let e = Conic::sphere(0.0).profile(0.0, 1.0).unwrap_err();
        assert_eq!(e.to_string(), "a radius of curvature is 0, but must be anything but zero");
    }
}
