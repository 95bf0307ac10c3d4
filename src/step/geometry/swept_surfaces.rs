//! Surfaces of revolution and of linear extrusion; those of circles, and of lines parallel to the axis, in closed form.

use super::composite::is_part_of_spline;
use super::curves::{CurveShape, DirectedCurve};
use super::extent::FaceExtent;
use super::meridian::keep_face_side_of_axis;
use super::tolerances::{
    COPLANAR_MM, MERGED_POINTS_MM, PARALLEL_AXIS, REACH_MARGIN, SMALLEST_REACH_MM, STEEP_RADIUS,
};
use super::{GeometryReader, Outcome, Refusal};
use crate::math::{Frame, Point, Vector};
use crate::model::Analytic;
use crate::nurbs::Curve;
use crate::step::chart::{Chart, Kind};
use crate::step::part21::{Args, Entity};
use std::f64::consts::PI;

impl<'f, 'a> GeometryReader<'f, 'a> {
    /// Returns the curve that a surface sweeps, cut to what can matter within the face's extent, as a spline, mm; for a line of a face
    /// with edges, its origin and the direction in which it is run too. Without edges its parameter is the file's, and one without ends
    /// is cut to the range of the surface's parameter `swept`, 0 for u, or refused where there is none.
    fn swept_curve(
        &self,
        id: u64,
        FaceExtent { center, radius, points, parameters }: FaceExtent<'_>,
        swept: usize,
        depth: usize,
    ) -> Outcome<(Curve, Option<(Point, Vector)>)> {
        let e = self.entity(id)?;
        let by_parameters = points.is_empty();
        if by_parameters && let Some(a) = e.attributes("POLYLINE", 1) {
            return Ok((self.counted_polyline(e, a.list(0))?, None));
        }
        if by_parameters && e.is_a("COMPOSITE_CURVE") {
            return Ok((self.counted_composite(e, depth)?, None));
        }
        // Of an offset with edges the whole has a closed form more often than the part.
        let is_bounded_offset = by_parameters && e.is_a("OFFSET_CURVE_3D");
        if (is_bounded_offset || e.is_one_of(&["TRIMMED_CURVE", "COMPOSITE_CURVE", "POLYLINE", "CURVE_REPLICA"]))
            && let Ok(curve) = self.bounded_curve(id, depth + 1)
        {
            return Ok((curve, None));
        }
        let directed = self.curve(id, depth + 1)?;
        // A line has no ends: as much of it is taken as the face can reach, with room, since more would only make the surface larger.
        let around = |t: f64, speed: f64| {
            let reach = REACH_MARGIN * radius.max(SMALLEST_REACH_MM) / speed;
            directed.shape.segment(t - reach, t + reach)
        };
        let mut line = None;
        let curve = match &directed.shape {
            CurveShape::Line { .. } | CurveShape::Parabola { .. } if by_parameters => {
                let range = parameters.map(|p| p[swept]).filter(|[a, b]| a < b && (b - a).is_finite());
                let [a, b] = range.ok_or_else(|| Refusal::new(e, "it has no ends, and neither has the surface"))?;
                directed.shape.segment(a, b)
            }
            CurveShape::Line { origin, direction } => {
                line = Some((*origin, if directed.reversed { -*direction } else { *direction }));
                around(directed.shape.parameter(center), direction.length())
            }
            CurveShape::Ellipse { .. } => directed.shape.segment(0.0, 2.0 * PI),
            CurveShape::Hyperbola { a, b, .. } => {
                let t = directed.shape.parameter(center);
                // Both ends out of reach: distance grows with sinh t along a hyperbola, with t² along a parabola.
                let reach = (1.0 + 2.0 * radius / a.min(*b)).asinh() + t.abs();
                directed.shape.segment(-reach, reach)
            }
            CurveShape::Parabola { f, .. } => {
                let t = directed.shape.parameter(center);
                let reach = t.abs() + (2.0 * radius / f).sqrt().max(radius / f);
                directed.shape.segment(-reach, reach)
            }
            CurveShape::Spline { curve, joints, .. } => {
                self.require_joined(joints)?;
                curve.clone()
            }
        };
        Ok((if directed.reversed { curve.reversed() } else { curve }, line))
    }

    /// Reads a POLYLINE by the parameter that the file gives it, which counts its points from 0; refused where two of them in a row
    /// coincide.
    fn counted_polyline(&self, e: Entity<'f, 'a>, list: Args<'f, 'a>) -> Outcome<Curve> {
        let points = self.points(e, list)?;
        let coincide = points.windows(2).any(|w| (w[1] - w[0]).length() <= MERGED_POINTS_MM);
        if points.len() < 2 || coincide {
            return Err(Refusal::new(e, "points of it coincide, and its parameter counts them"));
        }
        let counts: Vec<f64> = (0..points.len()).map(|k| k as f64).collect();
        Ok(Curve::polyline(&counts, &points))
    }

    /// Reads a SURFACE_OF_REVOLUTION with attributes `a`; a sphere, torus or cylinder in closed form where it is one and the face has
    /// edges.
    pub(super) fn revolution(
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
        let (curve, line) = self.swept_curve(profile.id, around, 1, depth)?;
        if let Some((origin, direction)) = line
            && let Some(chart) = revolved_line(&frame, origin, direction)
        {
            return Ok(chart);
        }
        let (side, has_two_normals) = keep_face_side_of_axis(&frame, curve, reach);
        let sweeps_spline = is_part_of_spline(profile);
        Ok(Chart { has_two_normals, sweeps_spline, ..Chart::revolution(frame, side) })
    }

    /// Reads a SURFACE_OF_LINEAR_EXTRUSION with attributes `a` as a chart: u is the profile's parameter, v how many times the file's vector
    /// the point lies from the profile, without bounds. An unbounded profile is cut to what the face can need of it, by `reach`.
    pub(super) fn extrusion(
        &self,
        e: Entity<'f, 'a>,
        a: Args<'f, 'a>,
        reach: FaceExtent<'_>,
        depth: usize,
    ) -> Outcome<Chart> {
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
        let (base, _) = self.swept_curve(profile.id, reach.grown_by(d), 0, depth)?;
        let sweeps_spline = is_part_of_spline(profile);
        Ok(Chart { sweeps_spline, ..Chart::new(Kind::Extrusion { base, direction }, Analytic::Extrusion) })
    }
}

/// Returns the sphere, or torus that does not touch itself, that a circle of `radius`, mm, makes about an axis in its plane; `None` for any
/// other circle.
fn revolved_circle(frame: &Frame, circle: &Frame, radius: f64) -> Option<Chart> {
    let (o, n) = (frame.local_point(circle.origin), frame.local_direction(circle.z.try_normalize()?));
    let major = o.x.hypot(o.y);
    let near = COPLANAR_MM * (1.0 + radius);
    // The plane of the circle holds the axis: its normal is across the axis and across the way to the center.
    if n.z.abs() > PARALLEL_AXIS || (o.x * n.x + o.y * n.y).abs() > near {
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
        if x.x.hypot(x.y) > STEEP_RADIUS { across(x)? } else { across(n.cross(x))? }
    };
    chart.flipped = n.cross(outward).z < 0.0;
    Some(chart)
}

/// Returns a line turned about an axis that it is parallel to: a cylinder with the orientation of the revolution; `None` for any other
/// line.
fn revolved_line(frame: &Frame, origin: Point, direction: Vector) -> Option<Chart> {
    let (o, d) = (frame.local_point(origin), frame.local_direction(direction.try_normalize()?));
    // Only lines that lie in a plane through the axis.
    let out_of_plane = o.cross(d).z.abs();
    let r = o.x.hypot(o.y);
    if out_of_plane > COPLANAR_MM * (1.0 + r) {
        return None;
    }
    if d.x.hypot(d.y) < PARALLEL_AXIS && r > COPLANAR_MM {
        let mut chart = Chart::cylinder(*frame, r);
        chart.flipped = d.z < 0.0;
        return Some(chart);
    }
    None
}
