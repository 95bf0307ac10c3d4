//! Elementary surfaces: plane, cylinder, cone, sphere, torus.

use super::extent::FaceExtent;
use super::tolerances::{CONE_SLOPE_MARGIN, FLAT_CONE_ANGLE, TORUS_REGION_SHARE};
use super::{GeometryReader, Outcome, Refusal};
use crate::math::{Frame, Point};
use crate::model::Analytic;
use crate::nurbs::{Curve, conic};
use crate::step::chart::{Chart, Kind};
use crate::step::part21::{Args, Entity};
use std::f64::consts::PI;

/// An elementary surface as read: where it stands, and the attributes with its sizes.
struct Elementary<'f, 'a> {
    entity: Entity<'f, 'a>,
    frame: Frame,
    sizes: Args<'f, 'a>,
    /// Index of the first size in `sizes`: a simple instance has its position before it.
    first: usize,
}

impl<'f, 'a> GeometryReader<'f, 'a> {
    /// Returns the chart of an elementary surface, or why it is refused; `None` for any other kind. `extent` decides which part of a
    /// self-touching torus is meant.
    pub(super) fn elementary_surface(&self, e: Entity<'f, 'a>, extent: FaceExtent<'_>) -> Option<Outcome<Chart>> {
        type Reader<'f, 'a> = fn(&GeometryReader<'f, 'a>, Elementary<'f, 'a>, FaceExtent<'_>) -> Outcome<Chart>;
        let readers: [(&str, Reader<'f, 'a>); 6] = [
            ("PLANE", |_, s, _| Ok(Chart::new(Kind::Plane { frame: s.frame }, Analytic::Plane { frame: s.frame }))),
            ("CYLINDRICAL_SURFACE", |g, s, _| g.cylinder(&s)),
            ("CONICAL_SURFACE", |g, s, _| g.cone(&s)),
            ("SPHERICAL_SURFACE", |g, s, _| g.sphere(&s)),
            ("TOROIDAL_SURFACE", |g, s, extent| g.torus(&s, None, extent)),
            ("DEGENERATE_TOROIDAL_SURFACE", |g, s, extent| {
                let lemon = s.sizes.flag(s.first + 2) == Some(false);
                g.torus(&s, Some(if lemon { TorusRegion::Lemon } else { TorusRegion::Apple }), extent)
            }),
        ];
        let (reader, sizes) = readers.into_iter().find_map(|(name, r)| Some((r, e.attributes(name, 1)?)))?;
        // In complex form the position belongs to ELEMENTARY_SURFACE.
        let separate = e.attributes("ELEMENTARY_SURFACE", 1).filter(|_| e.keyword().is_empty());
        let position = separate.map_or_else(|| sizes.id(0), |p| p.id(0));
        let first = usize::from(!e.keyword().is_empty());
        let frame = self.resolve(e, position, "position").and_then(|p| self.placement(p.id));
        Some(frame.and_then(|frame| reader(self, Elementary { entity: e, frame, sizes, first }, extent)))
    }

    /// Returns the `k`-th size in mm; `None` if it is no finite number.
    fn size(&self, s: &Elementary<'f, 'a>, k: usize) -> Option<f64> {
        s.sizes.real(s.first + k).map(|x| x * self.units.length).filter(|x| x.is_finite())
    }

    /// The `k`-th size in mm; a refusal that calls it `what` unless it is positive.
    fn positive_size(&self, s: &Elementary<'f, 'a>, k: usize, what: &str) -> Outcome<f64> {
        let size = self.size(s, k).filter(|x| *x > 0.0);
        size.ok_or_else(|| Refusal::new(s.entity, format!("{what} is not positive")))
    }

    fn cylinder(&self, s: &Elementary<'f, 'a>) -> Outcome<Chart> {
        let radius = self.positive_size(s, 0, "radius")?;
        Ok(Chart::cylinder(s.frame, radius))
    }

    /// Makes the chart of a CONICAL_SURFACE; one of next to no angle is a cylinder. Refuses a negative radius and half angles of 90° or
    /// more.
    fn cone(&self, s: &Elementary<'f, 'a>) -> Outcome<Chart> {
        let frame = s.frame;
        let radius = self.size(s, 0).filter(|r| *r >= 0.0);
        let radius = radius.ok_or_else(|| Refusal::new(s.entity, "radius is negative"))?;
        let half_angle = s.sizes.real(s.first + 1).map_or(f64::NAN, |x| x * self.units.angle);
        if !(half_angle.abs() < 0.5 * PI - CONE_SLOPE_MARGIN) {
            return Err(Refusal::new(s.entity, "half angle is not below 90°"));
        }
        if half_angle.abs() < FLAT_CONE_ANGLE && radius > 0.0 {
            return Ok(Chart::cylinder(frame, radius));
        }
        Ok(Chart::new(Kind::Cone { frame, radius, half_angle }, Analytic::Cone { frame, radius, half_angle }))
    }

    /// Makes the chart of a SPHERICAL_SURFACE, a torus of major radius 0; refuses a radius that is not positive.
    fn sphere(&self, s: &Elementary<'f, 'a>) -> Outcome<Chart> {
        let radius = self.positive_size(s, 0, "radius")?;
        Ok(Chart::new(
            Kind::Torus { frame: s.frame, major: 0.0, minor: radius },
            Analytic::Sphere { frame: s.frame, radius },
        ))
    }

    /// Returns the chart of a torus; `stated` is the part of a self-touching one that the file names. Without it the points of the face
    /// decide, and a face on both parts becomes a surface of revolution. Refuses radii that leave no surface.
    ///
    /// With C + (R + r·cos v)·e(u) + r·sin v·z the normal Su × Sv is R + r·cos v times the vector from the tube's middle: a negative r
    /// shifts v by half a turn and leaves the normal, R below −|r| makes the torus of |R| with its normal inwards.
    fn torus(&self, s: &Elementary<'f, 'a>, stated: Option<TorusRegion>, extent: FaceExtent<'_>) -> Outcome<Chart> {
        let frame = s.frame;
        let stated_minor = self.size(s, 1).filter(|r| *r != 0.0);
        let stated_minor =
            stated_minor.ok_or_else(|| Refusal::new(s.entity, "minor radius is zero or no number"))?;
        let stated_major = self.size(s, 0).filter(|r| *r != 0.0);
        let stated_major = stated_major.ok_or_else(|| Refusal::new(s.entity, "major radius leaves no surface"))?;
        let minor = stated_minor.abs();
        // A negative major radius above −minor, which real files hold, is the inner part of a self-touching torus.
        let is_inverted = stated_major <= -minor;
        let major = if is_inverted { -stated_major } else { stated_major };
        let mut region = TorusRegion::Apple;
        if major > 0.0 && major < minor {
            // A plain torus may touch itself too; then the edges say on which part the face lies.
            region = stated.unwrap_or_else(|| torus_region(&frame, major, minor, extent.points));
        }
        let signed = match region {
            TorusRegion::Both => return Ok(Chart::revolution(frame, tube_circle(&frame, major, minor))),
            TorusRegion::Lemon => -major,
            TorusRegion::Apple => major,
        };
        let mut chart = Chart::new(
            Kind::Torus { frame, major: signed, minor },
            Analytic::Torus { frame, major: signed, minor },
        );
        chart.flipped = is_inverted || region == TorusRegion::Lemon;
        chart.has_other_angles = is_inverted || stated_minor < 0.0;
        Ok(chart)
    }
}

/// The parts of a torus that touches itself: the outer apple, the inner lemon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TorusRegion {
    Apple,
    Lemon,
    /// Bent tubes pass through the axis.
    Both,
}

/// Returns on which part of a self-touching torus (radii in mm) points lie; the apple where none decides.
fn torus_region(frame: &Frame, major: f64, minor: f64, points: &[Point]) -> TorusRegion {
    let off = |center: f64, p: &Point| {
        let q = frame.local_point(*p);
        ((q.x.hypot(q.y) - center).hypot(q.z) - minor).abs()
    };
    let near = TORUS_REGION_SHARE * minor;
    // Points on the circles where the parts meet decide nothing.
    let only = |a: f64, b: f64| points.iter().any(|p| off(a, p) < near && off(b, p) > near);
    match (only(major, -major), only(-major, major)) {
        (true, true) => TorusRegion::Both,
        (false, true) => TorusRegion::Lemon,
        _ => TorusRegion::Apple,
    }
}

/// Returns the circle that a torus turns about its axis, in the model's coordinates.
fn tube_circle(frame: &Frame, major: f64, minor: f64) -> Curve {
    let circle = Frame::from_axis(frame.point(Point::new(major, 0.0, 0.0)), -frame.y, Some(frame.x));
    conic::arc(&circle, minor, [0.0, 2.0 * PI])
}
