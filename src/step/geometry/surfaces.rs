//! Surfaces of the file as charts.

use super::curves::{CurveShape, DirectedCurve, explicit_knots, knot_form};
use super::{Geometry, Outcome, Refusal};
use crate::math::{Aabb, Frame, Point, Vector};
use crate::model::Analytic;
use crate::nurbs::{Curve, conic, sanitise};
use crate::step::chart::{Chart, Kind, SplineChart};
use crate::step::part21::{Args, Entity};
use std::f64::consts::PI;

/// Where a face is, for surfaces whose curves have no ends or cross their axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FaceExtent<'r> {
    /// Middle of its edges.
    pub(crate) center: Point,
    /// Distance from there that holds them all, mm.
    pub(crate) radius: f64,
    /// Some points of its edges.
    pub(crate) points: &'r [Point],
}

impl<'r> FaceExtent<'r> {
    /// Nothing is known of the face.
    pub(crate) const UNKNOWN: Self = Self { center: Point::ZERO, radius: 0.0, points: &[] };

    /// Around edges in a box.
    pub(crate) fn from_bounds(bounds: Aabb, points: &'r [Point]) -> Self {
        if bounds.is_empty() {
            return Self::UNKNOWN;
        }
        Self { center: bounds.center(), radius: 0.5 * bounds.diagonal(), points }
    }

    fn grown_by(self, by: f64) -> Self {
        Self { radius: self.radius + by, ..self }
    }
}

/// Deepest chain of surfaces that refer to surfaces.
pub(crate) const MAX_DEPTH: usize = 8;

impl<'f, 'a> Geometry<'f, 'a> {
    /// A surface.
    pub(crate) fn chart(&self, id: u64, reach: FaceExtent<'_>, depth: usize) -> Outcome<Chart> {
        let e = self.entity(id)?;
        if depth > MAX_DEPTH {
            return Err(Refusal::new(e, "surfaces refer to each other too deeply"));
        }
        let position = |name: &str| -> Option<Outcome<(Frame, Args<'f, 'a>)>> {
            let args = e.attributes(name, 1)?;
            // In complex form the position belongs to ELEMENTARY_SURFACE.
            let separate = e.attributes("ELEMENTARY_SURFACE", 1).filter(|_| e.keyword().is_empty());
            let at = separate.map_or_else(|| args.id(0), |p| p.id(0));
            Some(self.resolve(e, at, "position").and_then(|p| self.placement(p.id)).map(|f| (f, args)))
        };
        let skip = usize::from(!e.keyword().is_empty());
        let length = |x: Option<f64>| x.map(|x| x * self.units.length).filter(|x| x.is_finite());
        let positive = |x: Option<f64>, what: &str| {
            length(x).filter(|x| *x > 0.0).ok_or_else(|| Refusal::new(e, format!("{what} is not positive")))
        };
        if let Some(found) = position("PLANE") {
            let (frame, _) = found?;
            return Ok(Chart::new(Kind::Plane { frame }, Analytic::Plane { frame }));
        }
        if let Some(found) = position("CYLINDRICAL_SURFACE") {
            let (frame, a) = found?;
            let radius = positive(a.real(skip), "radius")?;
            return Ok(Chart::new(
                Kind::Cone { frame, radius, half_angle: 0.0 },
                Analytic::Cylinder { frame, radius },
            ));
        }
        if let Some(found) = position("CONICAL_SURFACE") {
            let (frame, a) = found?;
            let radius = length(a.real(skip)).filter(|r| *r >= 0.0);
            let radius = radius.ok_or_else(|| Refusal::new(e, "radius is negative"))?;
            let half_angle = a.real(skip + 1).map_or(f64::NAN, |x| x * self.units.angle);
            if !(half_angle.abs() < 0.5 * PI - 1e-9) {
                return Err(Refusal::new(e, "half angle is not below 90°"));
            }
            if half_angle.abs() < 1e-12 && radius > 0.0 {
                return Ok(Chart::new(
                    Kind::Cone { frame, radius, half_angle: 0.0 },
                    Analytic::Cylinder { frame, radius },
                ));
            }
            return Ok(Chart::new(
                Kind::Cone { frame, radius, half_angle },
                Analytic::Cone { frame, radius, half_angle },
            ));
        }
        if let Some(found) = position("SPHERICAL_SURFACE") {
            let (frame, a) = found?;
            let radius = positive(a.real(skip), "radius")?;
            return Ok(Chart::new(
                Kind::Torus { frame, major: 0.0, minor: radius },
                Analytic::Sphere { frame, radius },
            ));
        }
        for name in ["TOROIDAL_SURFACE", "DEGENERATE_TOROIDAL_SURFACE"] {
            if let Some(found) = position(name) {
                let (frame, a) = found?;
                let (major, minor) =
                    (length(a.real(skip)).unwrap_or(f64::NAN), positive(a.real(skip + 1), "minor radius")?);
                // A negative major radius, which real files hold, is the inner part of a self-touching torus.
                if !(major.abs() > 0.0 && major > -minor) {
                    return Err(Refusal::new(e, "major radius leaves no surface"));
                }
                let degenerate = name.starts_with("DEG").then(|| a.flag(skip + 2) == Some(false));
                // A plain torus may touch itself too; then the edges say on which part the face lies.
                let inner = if major > 0.0 && major < minor {
                    let part = torus_region(&frame, major, minor, reach.points);
                    match degenerate
                        .map(|lemon| if lemon { TorusRegion::Lemon } else { TorusRegion::Apple })
                        .unwrap_or(part)
                    {
                        TorusRegion::Both => {
                            return Ok(Chart::revolution(frame, tube_circle(&frame, major, minor)));
                        }
                        part => part == TorusRegion::Lemon,
                    }
                } else {
                    false
                };
                let signed = if inner { -major } else { major };
                let mut chart = Chart::new(
                    Kind::Torus { frame, major: signed, minor },
                    Analytic::Torus { frame, major: signed, minor },
                );
                chart.flipped = inner;
                return Ok(chart);
            }
        }
        if let Some(a) = e.attributes("SURFACE_OF_REVOLUTION", 1) {
            return self.revolution(e, a, reach, depth);
        }
        if let Some(a) = e.attributes("SURFACE_OF_LINEAR_EXTRUSION", 1) {
            return self.extrusion(e, a, reach, depth);
        }
        if let Some(a) =
            e.attributes("RECTANGULAR_TRIMMED_SURFACE", 1).or_else(|| e.attributes("CURVE_BOUNDED_SURFACE", 1))
        {
            let basis = self.resolve(e, a.id(0), "basis surface")?;
            return self.chart(basis.id, reach, depth + 1);
        }
        if let Some(a) = e.attributes("OFFSET_SURFACE", 1) {
            let basis = self.resolve(e, a.id(0), "basis surface")?;
            let distance = length(a.real(1)).ok_or_else(|| Refusal::new(e, "its distance is missing"))?;
            let basis = self.chart(basis.id, reach.grown_by(distance.abs()), depth + 1)?;
            // Along the normal of the file's surface, which the chart's may oppose.
            let signed = if basis.flipped { -distance } else { distance };
            return crate::step::chart::offset::offset(&basis, signed)
                .ok_or_else(|| Refusal::new(e, "the offset leaves nothing of its basis"));
        }
        const SPLINES: [&str; 5] = [
            "B_SPLINE_SURFACE",
            "B_SPLINE_SURFACE_WITH_KNOTS",
            "BEZIER_SURFACE",
            "UNIFORM_SURFACE",
            "QUASI_UNIFORM_SURFACE",
        ];
        if e.is_one_of(&SPLINES) {
            return self.spline_surface(e);
        }
        Err(Refusal::new(e, "this kind of surface is not supported"))
    }

    /// The curve of a swept surface, cut to what can matter within reach.
    fn swept_curve(
        &self,
        id: u64,
        FaceExtent { center, radius, .. }: FaceExtent<'_>,
        depth: usize,
    ) -> Outcome<(Curve, Option<(Point, Vector)>)> {
        let e = self.entity(id)?;
        if e.is_one_of(&["TRIMMED_CURVE", "COMPOSITE_CURVE", "POLYLINE"])
            && let Ok(curve) = self.bounded_curve(id, depth + 1)
        {
            return Ok((curve, None));
        }
        let directed = self.curve(id, depth + 1)?;
        let around = |t: f64, speed: f64| {
            let reach = 1.1 * radius.max(1e-3) / speed;
            directed.shape.segment(t - reach, t + reach)
        };
        let curve = match &directed.shape {
            CurveShape::Line { origin, direction } => {
                let curve = around(directed.shape.parameter(center), direction.length());
                let line = Some((*origin, *direction));
                return Ok((curve, line));
            }
            CurveShape::Ellipse { .. } => directed.shape.segment(0.0, 2.0 * PI),
            CurveShape::Hyperbola { a, b, .. } => {
                let t = directed.shape.parameter(center);
                let reach = (1.0 + 2.0 * radius / a.min(*b)).asinh() + t.abs();
                directed.shape.segment(-reach, reach)
            }
            CurveShape::Parabola { f, .. } => {
                let t = directed.shape.parameter(center);
                let reach = t.abs() + (2.0 * radius / f).sqrt().max(radius / f);
                directed.shape.segment(-reach, reach)
            }
            CurveShape::Spline { curve, .. } => curve.clone(),
        };
        Ok((if directed.reversed { curve.reversed() } else { curve }, None))
    }

    fn revolution(
        &self,
        e: Entity<'f, 'a>,
        a: Args<'f, 'a>,
        reach: FaceExtent<'_>,
        depth: usize,
    ) -> Outcome<Chart> {
        let axis = self.resolve(e, a.id(1), "axis")?;
        let frame = self.placement(axis.id)?;
        let profile = self.resolve(e, a.id(0), "swept curve")?;
        // The profile passes the same heights and radii as the face, at another azimuth.
        let local = frame.local_point(reach.center);
        let around = reach.grown_by(2.0 * local.x.hypot(local.y));
        // Without edges the parameters of the surface matter, which a closed form would change.
        if let (Ok(DirectedCurve { shape: CurveShape::Ellipse { frame: circle, a, b }, reversed: false }), false) =
            (self.curve(profile.id, depth + 1), reach.points.is_empty())
            && a == b
            && let Some(chart) = revolved_circle(&frame, &circle, a)
        {
            return Ok(chart);
        }
        let (curve, line) = self.swept_curve(profile.id, around, depth)?;
        if let Some((origin, direction)) = line
            && let Some(chart) = revolved_line(&frame, origin, direction)
        {
            return Ok(chart);
        }
        Ok(Chart::revolution(frame, super::meridian::keep_face_side_of_axis(&frame, curve, reach)))
    }

    fn extrusion(&self, e: Entity<'f, 'a>, a: Args<'f, 'a>, reach: FaceExtent<'_>, depth: usize) -> Outcome<Chart> {
        let axis = self.resolve(e, a.id(1), "extrusion axis")?;
        let direction = self.vector(axis.id)?;
        let profile = self.resolve(e, a.id(0), "swept curve")?;
        // Moved along the direction, the face may lie anywhere beside the profile.
        let base_point = self.curve(profile.id, depth + 1).map(|c| match c.shape {
            CurveShape::Line { origin, .. } => origin,
            CurveShape::Ellipse { frame, .. }
            | CurveShape::Hyperbola { frame, .. }
            | CurveShape::Parabola { frame, .. } => frame.origin,
            CurveShape::Spline { .. } => reach.center,
        });
        let d = base_point.map_or(0.0, |b| (b - reach.center).length());
        let (base, _) = self.swept_curve(profile.id, reach.grown_by(d), depth)?;
        Ok(Chart::new(Kind::Extrusion { base, direction }, Analytic::Extrusion))
    }

    /// A B-spline surface in any of its forms.
    fn spline_surface(&self, e: Entity<'f, 'a>) -> Outcome<Chart> {
        let simple = !e.keyword().is_empty();
        let base = e.attributes("B_SPLINE_SURFACE", 1).unwrap_or_else(|| e.args());
        let shift = usize::from(simple && e.keyword() != "B_SPLINE_SURFACE");
        let degree = [base.count(shift).unwrap_or(0), base.count(shift + 1).unwrap_or(0)];
        let rows = base.list(shift + 2);
        let nu = rows.len();
        let nv = rows.list(0).len();
        let mut points = Vec::with_capacity(nu.saturating_mul(nv).min(1 << 16));
        for i in 0..nu {
            let row = rows.list(i).ids();
            if row.len() != nv {
                return Err(Refusal::new(e, "rows of control points differ in length"));
            }
            for id in row {
                points.push(self.point(id)?);
            }
        }
        let weights = e.attributes("RATIONAL_B_SPLINE_SURFACE", 7).map(|a| {
            let rows = a.list(0);
            (0..rows.len()).map(|i| rows.list(i).reals()).collect::<Option<Vec<_>>>().map(|w| w.concat())
        });
        let weights = match weights {
            Some(None) => return Err(Refusal::new(e, "weights are no numbers")),
            Some(w) => w,
            None => None,
        };
        let form = knot_form(e, "SURFACE");
        let knots = match e.attributes("B_SPLINE_SURFACE_WITH_KNOTS", 7) {
            Some(a) => (
                explicit_knots(a.list(if simple { 1 } else { 0 }), a.list(if simple { 3 } else { 2 })),
                explicit_knots(a.list(if simple { 2 } else { 1 }), a.list(if simple { 4 } else { 3 })),
            ),
            None => (form.knots(degree[0], nu), form.knots(degree[1], nv)),
        };
        let (Some(ku), Some(kv)) = knots else {
            return Err(Refusal::new(e, "knots and multiplicities do not fit"));
        };
        let rational = weights.as_ref().is_some_and(|w| w.iter().any(|x| (x - w[0]).abs() > 1e-12 * w[0].abs()));
        let (surface, _) = sanitise::surface(degree, [ku, kv], [nu, nv], &points, weights.as_deref())
            .map_err(|d| Refusal::new(e, d.to_string()))?;
        let analytic = if rational { Analytic::Rational } else { Analytic::Bspline };
        Ok(Chart::new(Kind::Spline(SplineChart::new(surface)), analytic))
    }
}

/// The parts of a torus that touches itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TorusRegion {
    Apple,
    Lemon,
    /// Bent tubes pass through the axis.
    Both,
}

/// On which part of a self-touching torus points lie.
fn torus_region(frame: &Frame, major: f64, minor: f64, points: &[Point]) -> TorusRegion {
    let off = |center: f64, p: &Point| {
        let q = frame.local_point(*p);
        ((q.x.hypot(q.y) - center).hypot(q.z) - minor).abs()
    };
    let near = 1e-3 * minor;
    let only = |a: f64, b: f64| points.iter().any(|p| off(a, p) < near && off(b, p) > near);
    match (only(major, -major), only(-major, major)) {
        (true, true) => TorusRegion::Both,
        (false, true) => TorusRegion::Lemon,
        _ => TorusRegion::Apple,
    }
}

/// The circle that a torus turns about its axis.
fn tube_circle(frame: &Frame, major: f64, minor: f64) -> Curve {
    let circle = Frame::from_axis(frame.point(Point::new(major, 0.0, 0.0)), -frame.y, Some(frame.x));
    conic::arc(&circle, minor, [0.0, 2.0 * PI])
}

/// A circle turned about an axis in its plane: a sphere, or a torus that does not touch itself.
fn revolved_circle(frame: &Frame, circle: &Frame, radius: f64) -> Option<Chart> {
    let (o, n) = (frame.local_point(circle.origin), frame.local_direction(circle.z.try_normalize()?));
    let major = o.x.hypot(o.y);
    let near = 1e-9 * (1.0 + radius);
    // The plane of the circle holds the axis: its normal is across the axis and across the way to the center.
    if n.z.abs() > 1e-9 || (o.x * n.x + o.y * n.y).abs() > near {
        return None;
    }
    let at = Frame { origin: frame.point(Point::new(0.0, 0.0, o.z)), ..*frame };
    let mut chart = if major <= near {
        let (kind, analytic) =
            (Kind::Torus { frame: at, major: 0.0, minor: radius }, Analytic::Sphere { frame: at, radius });
        Chart::new(kind, analytic)
    } else if major > radius {
        Chart::new(
            Kind::Torus { frame: at, major, minor: radius },
            Analytic::Torus { frame: at, major, minor: radius },
        )
    } else {
        return None;
    };
    // Around the circle from outside towards the axis direction is the sense of the torus. A circle about a point of
    // the axis runs in both senses on its two sides; its parameter 0 says which side is meant.
    let across = |d: Vector| Vector::new(d.x, d.y, 0.0).try_normalize();
    let outward = if major > near {
        across(o)?
    } else {
        let x = frame.local_direction(circle.x.try_normalize()?);
        if x.x.hypot(x.y) > 1e-6 { across(x)? } else { across(n.cross(x))? }
    };
    chart.flipped = n.cross(outward).z < 0.0;
    Some(chart)
}

/// A line turned about an axis in its plane: a plane, cylinder or cone, with the orientation of the revolution.
fn revolved_line(frame: &Frame, origin: Point, direction: Vector) -> Option<Chart> {
    let (o, d) = (frame.local_point(origin), frame.local_direction(direction.try_normalize()?));
    // Only lines that lie in a plane through the axis.
    let out_of_plane = o.cross(d).z.abs();
    let r = o.x.hypot(o.y);
    if out_of_plane > 1e-9 * (1.0 + r) {
        return None;
    }
    if d.x.hypot(d.y) < 1e-9 && r > 1e-9 {
        let mut chart = Chart::new(
            Kind::Cone { frame: *frame, radius: r, half_angle: 0.0 },
            Analytic::Cylinder { frame: *frame, radius: r },
        );
        chart.flipped = d.z < 0.0;
        return Some(chart);
    }
    None
}
