//! Which angles a face on a surface of revolution covers: truck's surfaces always turn all the way round, ours only as far as the face.

use super::geometry::{curve, point, vector};
use super::modeling::{Curve as TruckCurve, Matrix4, Processor, RevolutedCurve};
use crate::math::{Frame, Homogeneous, Point};
use crate::nurbs::{ControlPoint, Curve, Surface, conic, sweep};
use std::f64::consts::PI;

/// Points of an edge at which its angle is taken.
const SAMPLES: usize = 24;

/// Distance from the axis below which a point is on it, as a share of a millimetre and of the part's size: above the rounding of
/// truck's points, which carry two or three transforms, below any edge that truck accepts.
const ON_AXIS: f64 = 1e-9;

/// Distance from the meridian's half-plane that is the rounding of a profile which was drawn in it, in the same measure; truck's own
/// tolerance of coincidence is 1e-6.
const OFF_PLANE: f64 = 1e-7;

/// Angles that differ by less are one, radians: 1 nm at a metre.
const SAME_ANGLE: f64 = 1e-9;

/// A surface of revolution before the angles of a face are known.
pub(super) struct Revolved {
    meridian: Curve,
    axis: Frame,
    matrix: Matrix4,
    inverse: Matrix4,
    /// Angle of the meridian about the axis, radians, from which u counts.
    azimuth: f64,
    /// Whether our normal points the other way than truck's.
    pub(super) flipped: bool,
    /// Of the meridian's box, mm.
    size: f64,
}

/// An edge of a loop in the direction of the loop, material on its left.
#[derive(Clone, Copy)]
pub(super) struct Side<'a> {
    pub(super) curve: &'a Curve,
    pub(super) reversed: bool,
}

/// A surface cut to a face, and for each loop the spline's parameter u in the middle of each edge.
pub(super) struct Cut {
    pub(super) surface: Surface,
    pub(super) middles: Vec<Vec<f64>>,
}

impl Revolved {
    /// Reads truck's surface; fails where its curve does not lie in a half-plane of the axis, or it is scaled to nothing.
    pub(super) fn new(s: &Processor<RevolutedCurve<TruckCurve>, Matrix4>) -> Result<Self, String> {
        use super::modeling::SquareMatrix;
        let entity = s.entity();
        let meridian = curve(entity.entity_curve())?;
        let axis = Frame::from_axis(point(entity.origin()), vector(entity.axis()), None);
        let inverse = s.transform().invert().ok_or("a surface of revolution scaled to nothing")?;
        let size = meridian.bounds().diagonal();
        let azimuth = meridian_azimuth(&meridian, &axis, size)?;
        // Truck's u runs along the curve and v about the axis, ours the other way round.
        Ok(Self { meridian, axis, matrix: *s.transform(), inverse, azimuth, flipped: s.orientation(), size })
    }

    /// Returns the surface over the angles of a face, given by its loops; fails where these close around the axis, or have no width.
    pub(super) fn cut_to_loops(&self, loops: &[Vec<Side>]) -> Result<Cut, String> {
        let mut range: Option<[f64; 2]> = None;
        let mut middles = Vec::new();
        for sides in loops {
            let (mut low, mut high, mut angles) = self.angles(sides)?;
            if let Some([a, b]) = range {
                // By whole turns beside the loops before it, for angles of a loop have no beginning of their own.
                let turn = 2.0 * PI * ((0.5 * (a + b) - 0.5 * (low + high)) / (2.0 * PI)).round();
                (low, high) = (low + turn, high + turn);
                angles.iter_mut().for_each(|x| *x += turn);
            }
            let [a, b] = range.unwrap_or([low, high]);
            range = Some([a.min(low), b.max(high)]);
            middles.push(angles);
        }
        let [a, mut b] = range.ok_or("a face without edges on an endless surface of revolution")?;
        if b - a > 2.0 * PI + SAME_ANGLE {
            return Err("a face that winds around its axis more than once".into());
        }
        if b - a < SAME_ANGLE {
            return Err("a face without width on a surface of revolution".into());
        }
        b = b.min(a + 2.0 * PI);
        let range = [a, b];
        let local = sweep::revolution(&self.meridian, &self.axis, range);
        // The spline's parameter is no angle but the tangent of a part of it.
        for angle in middles.iter_mut().flatten() {
            *angle = conic::parameter_of_angle(range, angle.clamp(a, b));
        }
        Ok(Cut { surface: local.transformed(|p| transform_point(&self.matrix, p)), middles })
    }

    /// Returns the lowest and highest angle of a loop, unwrapped, radians, and the angle in the middle of each edge, 0 on the axis. Fails
    /// for a loop on the axis or around it.
    fn angles(&self, sides: &[Side]) -> Result<(f64, f64, Vec<f64>), String> {
        let ends_on_axis = |s: &Side| {
            let [t0, t1] = s.curve.domain();
            self.on_axis(s.curve.evaluate(if s.reversed { t0 } else { t1 }))
        };
        let n = sides.len();
        // Begin after a pole, if there is one, so that each group between poles is walked through once.
        let first = (0..n).find(|&i| ends_on_axis(&sides[i])).map_or(0, |i| i + 1);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut middles = vec![0.0; n];
        let mut last: Option<f64> = None;
        let mut jump: Option<f64> = None;
        let mut start = None;
        for i in (0..n).map(|k| (first + k) % n) {
            let side = &sides[i];
            let [t0, t1] = side.curve.domain();
            // Steps of less than half a turn, so that unwrapping cannot go wrong.
            for k in 0..=SAMPLES {
                let s = k as f64 / SAMPLES as f64;
                let s = if side.reversed { 1.0 - s } else { s };
                let p = side.curve.evaluate(t0 + (t1 - t0) * s);
                if self.on_axis(p) {
                    continue;
                }
                let raw = self.angle(p);
                let angle = match (last, jump.take()) {
                    // Past a pole: towards lower angles at the end of the meridian, higher ones at its start.
                    (Some(before), Some(sign)) => before + sign * positive_turn(sign * (raw - before)),
                    (Some(before), None) => before + wrap_angle(raw - before),
                    (None, _) => raw,
                };
                start.get_or_insert(angle);
                (low, high) = (low.min(angle), high.max(angle));
                last = Some(angle);
                if k == SAMPLES / 2 {
                    middles[i] = angle;
                }
            }
            if ends_on_axis(side) {
                let [v0, v1] = self.meridian.domain();
                let at_end = |v: f64| (self.meridian.evaluate(v) - self.local(side_end(side))).length();
                jump = Some(if at_end(v1) < at_end(v0) { -1.0 } else { 1.0 });
            }
        }
        let (Some(start), Some(last)) = (start, last) else {
            return Err("a loop on the axis of its surface".into());
        };
        let has_pole = sides.iter().any(ends_on_axis);
        // Without a pole a loop must end at the angle at which it began.
        if !has_pole && (last - start).abs() > 1.0 {
            return Err(
                "a face that closes around its axis; cut it into sectors, as truck's own builder does".into()
            );
        }
        Ok((low, high, middles))
    }

    /// Returns the point before truck's transform.
    fn local(&self, p: Point) -> Point {
        transform_point(&self.inverse, p)
    }

    /// Whether a point lies on the axis, within [`ON_AXIS`].
    fn on_axis(&self, p: Point) -> bool {
        let q = self.axis.local_point(self.local(p));
        q.x.hypot(q.y) < ON_AXIS * (1.0 + self.size)
    }

    /// Returns the angle of a point about the axis, radians, from the meridian on; not unwrapped.
    fn angle(&self, p: Point) -> f64 {
        let q = self.axis.local_point(self.local(p));
        q.y.atan2(q.x) - self.azimuth
    }
}

/// Returns the one angle about the axis, radians, that all points of a meridian have; fails where they have none or several. `size` is the
/// meridian's, mm.
fn meridian_azimuth(meridian: &Curve, axis: &Frame, size: f64) -> Result<f64, String> {
    let [t0, t1] = meridian.domain();
    let samples =
        (0..=SAMPLES).map(|k| axis.local_point(meridian.evaluate(t0 + (t1 - t0) * k as f64 / SAMPLES as f64)));
    let samples: Vec<Point> = samples.collect();
    let radius = |p: &Point| p.x.hypot(p.y);
    let farther = |far: Point, p: Point| if radius(&p) >= radius(&far) { p } else { far };
    // The farthest point gives the angle best.
    let farthest = samples.iter().copied().fold(samples[0], farther);
    let reach = radius(&farthest);
    if reach < ON_AXIS * (1.0 + size) {
        return Err("a curve on the axis it is turned about".into());
    }
    let (x, y) = (farthest.x / reach, farthest.y / reach);
    let slack = OFF_PLANE * (1.0 + size);
    let off = |p: &Point| (p.y * x - p.x * y).abs() > slack || p.x * x + p.y * y < -slack;
    if samples.iter().any(off) {
        return Err("a surface of revolution whose curve does not lie in a half-plane of the axis".into());
    }
    Ok(y.atan2(x))
}

/// Returns where a side ends as the loop runs.
fn side_end(side: &Side) -> Point {
    let [t0, t1] = side.curve.domain();
    side.curve.evaluate(if side.reversed { t0 } else { t1 })
}

/// Returns the angle, radians, moved by whole turns to within half a turn of 0.
fn wrap_angle(angle: f64) -> f64 {
    angle - 2.0 * PI * (angle / (2.0 * PI)).round()
}

/// Returns the angle, radians, moved by whole turns to `(0, 2π]`; next to nothing is a whole turn.
fn positive_turn(angle: f64) -> f64 {
    let a = angle.rem_euclid(2.0 * PI);
    if a < SAME_ANGLE { 2.0 * PI } else { a }
}

/// Moves a point by a matrix that must be affine, as truck's are.
pub(super) fn transform_point(m: &Matrix4, p: Point) -> Point {
    let h = Homogeneous::weighted(p, 1.0);
    Point::new(
        m.x.x * h.x + m.y.x * h.y + m.z.x * h.z + m.w.x,
        m.x.y * h.x + m.y.y * h.y + m.z.y * h.z + m.w.y,
        m.x.z * h.x + m.y.z * h.y + m.z.z * h.z + m.w.z,
    )
}
