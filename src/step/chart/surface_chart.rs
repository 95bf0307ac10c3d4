//! The chart of a surface: its kind, its periods, bounds and poles, and the three questions that it answers.

use super::tolerances::{CLOSED_MM, CLOSED_SHARE};
use super::{Pole, SplineChart, analytic, spline, swept};
use crate::math::{Frame, Point, Uv, Vector};
use crate::model::Analytic;
use crate::nurbs::{Curve, Derivatives, Surface, conic};
use std::f64::consts::PI;

/// The kinds of surfaces.
#[derive(Clone, Debug)]
pub(in crate::step) enum Kind {
    Plane {
        frame: Frame,
    },
    /// Radius `radius + v·tan(half_angle)` about z at height v, negative beyond the apex; a cylinder of angle 0. Angles in radians.
    Cone {
        frame: Frame,
        radius: f64,
        half_angle: f64,
    },
    /// A sphere when `major` is 0.
    Torus {
        frame: Frame,
        major: f64,
        minor: f64,
    },
    /// `meridian(v)`, in the model's coordinates, turned about z by u; `plane` when the meridian lies in one through the axis.
    Revolution {
        frame: Frame,
        meridian: Curve,
        plane: Option<swept::Plane>,
    },
    /// `base(u) + v·direction`.
    Extrusion {
        base: Curve,
        direction: Vector,
    },
    Spline(SplineChart),
}

/// A surface in its own parameters.
#[derive(Clone, Debug)]
pub(in crate::step) struct Chart {
    pub(in crate::step) kind: Kind,
    /// What the face was in the file.
    pub(in crate::step) analytic: Analytic,
    /// Differences of u, of v, after which the surface repeats; `None` where it does not.
    pub(in crate::step) period: [Option<f64>; 2],
    /// Natural bounds; infinite where there is none, meaningless in periodic directions.
    pub(in crate::step) range: [[f64; 2]; 2],
    pub(in crate::step) poles: Vec<Pole>,
    /// Something like the size of the surface, mm.
    pub(in crate::step) size: f64,
    /// Whether `Su × Sv` is opposite to that of the file's surface.
    pub(in crate::step) flipped: bool,
    /// Whether the angles of a torus run or begin otherwise than in the file's surface.
    pub(in crate::step) has_other_angles: bool,
    /// Whether the file's surface has every place twice, with opposite normals, as a profile turned about its own axis of symmetry has:
    /// only the direction of a face's edges decides which is meant.
    pub(in crate::step) has_two_normals: bool,
    /// Whether the swept curve of an extrusion or a revolution has the file's own parameter although its weights differ, as a spline of the
    /// file has; a conic that was made into a spline has another.
    pub(in crate::step) sweeps_spline: bool,
    /// Distance from what the file means, where that had to be fitted, mm.
    pub(in crate::step) error: f64,
}

impl Chart {
    /// Returns the surface of revolution of a meridian, in the model's coordinates, about the frame's z axis.
    pub(in crate::step) fn revolution(frame: Frame, meridian: Curve) -> Self {
        let plane = swept::plane(&frame, &meridian);
        Self::new(Kind::Revolution { frame, meridian, plane }, Analytic::Revolution)
    }

    /// Returns a cylinder: a cone that does not widen.
    pub(in crate::step) fn cylinder(frame: Frame, radius: f64) -> Self {
        Self::new(Kind::Cone { frame, radius, half_angle: 0.0 }, Analytic::Cylinder { frame, radius })
    }

    /// Makes a chart of this kind; periods, ranges, poles and size follow from it. Not flipped, of one normal, without an error.
    pub(in crate::step) fn new(kind: Kind, analytic: Analytic) -> Self {
        const FREE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
        let mut chart = Self {
            kind,
            analytic,
            period: [None; 2],
            range: [FREE; 2],
            poles: Vec::new(),
            size: 1.0,
            flipped: false,
            has_other_angles: false,
            has_two_normals: false,
            sweeps_spline: false,
            error: 0.0,
        };
        chart.characterise();
        chart
    }

    /// Fills in `period`, `range`, `poles` and `size` from the kind.
    fn characterise(&mut self) {
        const TURN: f64 = 2.0 * PI;
        match &self.kind {
            Kind::Plane { .. } => {}
            Kind::Cone { frame, radius, half_angle } => {
                self.period[0] = Some(TURN);
                self.size = radius.abs().max(1.0);
                if *half_angle != 0.0 {
                    // The apex, where the radius has shrunk to nothing.
                    let at = -radius / half_angle.tan();
                    self.poles.push(Pole { fixed: 1, parameter: at, point: frame.point(Point::new(0.0, 0.0, at)) });
                }
            }
            Kind::Torus { frame, major, minor } => {
                self.period[0] = Some(TURN);
                self.size = major.abs() + minor;
                let range = analytic::minor_range(*major, *minor);
                match range {
                    None => self.period[1] = Some(TURN),
                    Some(range) => {
                        self.range[1] = range;
                        for at in range {
                            let point = frame.point(Point::new(0.0, 0.0, minor * at.sin()));
                            self.poles.push(Pole { fixed: 1, parameter: at, point });
                        }
                    }
                }
            }
            Kind::Revolution { frame, meridian, .. } => {
                self.period[0] = Some(TURN);
                let range = meridian.domain();
                self.range[1] = range;
                self.size = meridian.bounds().diagonal();
                let ends = range.map(|t| meridian.evaluate(t));
                let near = self.closure();
                for (at, p) in range.into_iter().zip(ends) {
                    let q = frame.local_point(p);
                    if q.x.hypot(q.y) <= near {
                        self.poles.push(Pole { fixed: 1, parameter: at, point: p });
                    }
                }
                // With poles at its ends the meridian closes through the axis, and no period joins them.
                if self.poles.is_empty() && (ends[0] - ends[1]).length() <= near {
                    self.period[1] = Some(range[1] - range[0]);
                }
            }
            Kind::Extrusion { base, .. } => {
                let range = base.domain();
                self.range[0] = range;
                self.size = base.bounds().diagonal();
                if (base.evaluate(range[0]) - base.evaluate(range[1])).length() <= self.closure() {
                    self.period[0] = Some(range[1] - range[0]);
                }
            }
            Kind::Spline(s) => {
                self.range = s.surface.domain();
                self.size = s.size;
                self.period = s.period();
                self.poles = s.poles();
            }
        }
    }

    /// Returns the distance below which ends of the surface are one, mm.
    fn closure(&self) -> f64 {
        CLOSED_SHARE * self.size + CLOSED_MM
    }

    /// Whether u, and v, are angles, from which the spline's parameters differ.
    pub(in crate::step) fn angular_directions(&self) -> [bool; 2] {
        match self.kind {
            Kind::Cone { .. } | Kind::Revolution { .. } => [true, false],
            Kind::Torus { .. } => [true, true],
            _ => [false, false],
        }
    }

    /// Returns the parameters of a nearest point of the surface; shifted by periods, those nearest to `hint`. A hint also starts the search
    /// on curves and splines, and the foot near it is taken.
    pub(in crate::step) fn locate(&self, p: Point, hint: Option<Uv>) -> Uv {
        let uv = match &self.kind {
            Kind::Plane { frame } => analytic::locate_plane(frame, p),
            Kind::Cone { frame, radius, half_angle } => analytic::locate_cone(frame, *radius, *half_angle, p),
            Kind::Torus { frame, major, .. } => analytic::locate_torus(frame, *major, self.range[1], p),
            Kind::Revolution { frame, meridian, plane } => {
                let hint = hint.map(|h| self.wrap(h));
                swept::locate_revolution((frame, meridian, *plane), p, hint, self.size)
            }
            Kind::Extrusion { base, direction } => {
                swept::locate_extrusion(base, *direction, p, hint.map(|h| self.wrap(h).x), self.size)
            }
            Kind::Spline(s) => s.locate(p, hint),
        };
        hint.map_or(uv, |h| self.nearest_representative(uv, h))
    }

    /// Returns `uv` shifted by whole periods to within half a period of `to`; directions without a period stay.
    pub(in crate::step) fn nearest_representative(&self, uv: Uv, to: Uv) -> Uv {
        let shift = |d: usize| self.period[d].map_or(0.0, |p| p * ((to[d] - uv[d]) / p).round());
        uv + Uv::new(shift(0), shift(1))
    }

    /// Returns the displacement by `count` whole periods; 0 in directions without one.
    pub(in crate::step) fn whole_periods(&self, count: [i32; 2]) -> Uv {
        let one = |d: usize| self.period[d].map_or(0.0, |p| p * f64::from(count[d]));
        Uv::new(one(0), one(1))
    }

    /// Returns the position, mm, and first derivatives; parameters beyond the bounds are wrapped into them first, see [`Self::wrap`].
    pub(in crate::step) fn derivatives(&self, uv: Uv) -> Derivatives {
        match &self.kind {
            Kind::Plane { frame } => {
                Derivatives { point: frame.point(Point::new(uv.x, uv.y, 0.0)), du: frame.x, dv: frame.y }
            }
            Kind::Cone { frame, radius, half_angle } => analytic::cone(frame, *radius, *half_angle, uv),
            Kind::Torus { frame, major, minor } => analytic::torus(frame, *major, *minor, uv),
            Kind::Revolution { frame, meridian, .. } => {
                let v = self.wrap(uv).y;
                swept::revolution(frame, meridian, Uv::new(uv.x, v))
            }
            Kind::Extrusion { base, direction } => {
                let d = base.derivatives(self.wrap(uv).x);
                Derivatives { point: d.point + uv.y * *direction, du: d.first, dv: *direction }
            }
            Kind::Spline(s) => s.surface.derivatives(self.wrap(uv)),
        }
    }

    /// Moves parameters into the base period, or without one to the nearest natural bound; a periodic parameter without a base period
    /// stays.
    pub(in crate::step) fn wrap(&self, uv: Uv) -> Uv {
        let one = |d: usize| {
            let [a, b] = self.range[d];
            match self.period[d] {
                Some(p) if a.is_finite() => {
                    // Both ends of the base period stay, so that a point on the seam keeps the side it was given.
                    if uv[d] >= a && uv[d] <= b { uv[d] } else { a + (uv[d] - a).rem_euclid(p) }
                }
                Some(_) => uv[d],
                None => uv[d].clamp(a, b),
            }
        };
        Uv::new(one(0), one(1))
    }

    /// Returns the spline that covers a rectangle of the parameters. It may reach beyond: splines and profiles keep their own domain.
    pub(in crate::step) fn surface(&self, domain: [[f64; 2]; 2]) -> Surface {
        use crate::nurbs::sweep;
        match &self.kind {
            Kind::Plane { frame } => sweep::plane(frame, domain),
            Kind::Cone { frame, radius, half_angle } => {
                sweep::cone(frame, *radius, *half_angle, domain[0], domain[1])
            }
            Kind::Torus { frame, major, minor } => sweep::torus(frame, *major, *minor, domain[0], domain[1]),
            Kind::Revolution { frame, meridian, .. } => sweep::revolution(
                &spline::extend_periodically(meridian, domain[1], self.period[1]),
                frame,
                domain[0],
            ),
            Kind::Extrusion { base, direction } => sweep::extrusion(
                &spline::extend_periodically(base, domain[0], self.period[0]),
                *direction,
                domain[1],
            ),
            Kind::Spline(s) => s.extend_periodically(domain),
        }
    }

    /// Turns the chart's parameters into those of the spline that is made over `domain`, the ranges of u and v.
    ///
    /// Angles, in radians, become the parameter of the rational arc; other directions stay as they are. Nothing is clamped: beyond the
    /// domain the outer pieces go on.
    pub(in crate::step) fn spline_parameters(&self, domain: [[f64; 2]; 2], uv: Uv) -> Uv {
        let [u, v] = self.angular_directions();
        let one = |d: usize, angular: bool| {
            if angular { conic::parameter_of_angle(domain[d], uv[d]) } else { uv[d] }
        };
        Uv::new(one(0, u), one(1, v))
    }

    /// Returns the factors from the file's parameters to the chart's, given mm and radians to the file's units; `None` where they are not
    /// proportional.
    pub(in crate::step) fn parameter_scale(&self, length: f64, angle: f64) -> Option<[f64; 2]> {
        // Weights alike leave a curve's parameter proportional to the file's; a rational arc has its own.
        let direct = |c: &Curve| self.sweeps_spline || c.points.iter().all(|p| p.w == c.points[0].w);
        match &self.kind {
            Kind::Plane { .. } => Some([length; 2]),
            Kind::Cone { .. } => Some([angle, length]),
            // A lemon's angles run the other way here, and from another place.
            Kind::Torus { major, .. } => (*major >= 0.0 && !self.has_other_angles).then_some([angle; 2]),
            Kind::Revolution { meridian, .. } => direct(meridian).then_some([angle, 1.0]),
            Kind::Extrusion { base, .. } => direct(base).then_some([1.0; 2]),
            Kind::Spline(_) => Some([1.0; 2]),
        }
    }

    /// Returns the same sphere with its poles along another axis; `None` for any other surface.
    pub(in crate::step) fn with_axis(&self, axis: Vector, x_hint: Vector) -> Option<Self> {
        let Kind::Torus { frame, major: 0.0, minor } = self.kind else { return None };
        let frame = Frame::from_axis(frame.origin, axis, Some(x_hint));
        let kind = Kind::Torus { frame, major: 0.0, minor };
        Some(Self::new(kind, Analytic::Sphere { frame, radius: minor }))
    }
}
