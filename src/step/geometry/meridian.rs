//! Profiles of surfaces of revolution that cross their axis: the part that the face lies on.

use super::extent::FaceExtent;
use super::tolerances::{
    AXIS_SHARE, AXIS_SQUARE_SHARE, CLOSED_PROFILE, EVEN_FIT_MM, PROFILE_ERROR_SHARE, TWIN_SHARE,
};
use crate::math::{Frame, Point, Vector};
use crate::nurbs::Curve;
use crate::step::chart::profile_distance;

/// Samples that look for crossings of the axis.
const SAMPLES: i32 = 256;

/// Cuts a meridian where it crosses the axis, and returns the part nearest to the points of the face; the whole one where that fits as well
/// as any, or nothing crosses. Of two parts that fit alike it is the one that comes first on the curve, and the other its twin: whether
/// there is one is returned too.
pub(crate) fn keep_face_side_of_axis(frame: &Frame, curve: Curve, reach: FaceExtent<'_>) -> (Curve, bool) {
    let mut parts = split_at_axis(frame, &curve);
    let sides = parts.len();
    // A tube bent more tightly than its own radius passes through the axis.
    let size = curve.bounds().diagonal();
    parts.push(curve);
    let center = [reach.center];
    let points = if reach.points.is_empty() { &center[..] } else { reach.points };
    let off = |part: &Curve| -> f64 {
        let target = |p: &Point| {
            let q = frame.local_point(*p);
            Vector::new(q.x.hypot(q.y), 0.0, q.z)
        };
        points.iter().map(|p| profile_distance(frame, part, target(p))).sum()
    };
    let off: Vec<f64> = parts.iter().map(off).collect();
    let least = off.iter().copied().fold(f64::INFINITY, f64::min);
    // A conic about its own axis, or a circle about a point of the axis, fits on both sides: the first is taken.
    let scale = (PROFILE_ERROR_SHARE * size).clamp(PROFILE_ERROR_SHARE, 1.0);
    let even = EVEN_FIT_MM * points.len() as f64 * scale;
    let Some(first) = off.iter().position(|&o| o <= least + even) else {
        // Distances that are no numbers compare with nothing.
        return (parts.swap_remove(sides), false);
    };
    let alike = TWIN_SHARE * size * points.len() as f64;
    let has_twin = (0..sides).any(|k| k != first && off[k] <= off[first] + alike);
    (parts.swap_remove(first), has_twin)
}

/// Returns the parts between crossings of the axis, that of the curve's start first; none when there is no crossing. The first and last
/// part of a closed curve are one, unless it starts on the axis.
fn split_at_axis(frame: &Frame, curve: &Curve) -> Vec<Curve> {
    let [a, b] = curve.domain();
    let at = |t: f64| frame.local_point(curve.evaluate(t));
    let sample = |i: i32| a + (b - a) * f64::from(i) / f64::from(SAMPLES);
    let far = (0..=SAMPLES).map(|i| at(sample(i)));
    let Some(far) = far.max_by(|p, q| p.x.hypot(p.y).total_cmp(&q.x.hypot(q.y))) else { return Vec::new() };
    // Positive on the side of the farthest point, negative beyond the axis.
    let side = |t: f64| {
        let p = at(t);
        far.x * p.x + far.y * p.y
    };
    let size = far.x.hypot(far.y);
    let is_on_axis = |s: f64| s.abs() <= AXIS_SQUARE_SHARE * size * size;
    let mut cuts = Vec::new();
    // The last sample beside the axis, and the one after it where that is on the axis: vertices of conics often fall on a sample.
    let mut before: Option<(f64, f64)> = None;
    let mut touched = None;
    for t in (0..=SAMPLES).map(sample) {
        let s = side(t);
        if is_on_axis(s) {
            touched = Some(t);
            continue;
        }
        if let Some((t_before, s_before)) = before
            && s_before * s < 0.0
        {
            cuts.push(touched.unwrap_or_else(|| crossing(side, [t_before, t], s_before)));
        }
        (before, touched) = (Some((t, s)), None);
    }
    let (Some(&first), Some(&last)) = (cuts.first(), cuts.last()) else { return Vec::new() };
    let near = AXIS_SHARE * (b - a);
    let mut parts: Vec<Curve> = Vec::new();
    if first - a > near {
        parts.push(curve.restricted(a, first));
    }
    if b - last > near {
        let tail = curve.restricted(last, b);
        // The ends of a closed profile are one place: what lies before the first crossing goes on from what lies behind the last.
        let closed = (at(a) - at(b)).length() <= CLOSED_PROFILE * (1.0 + size) && !is_on_axis(side(a));
        match parts.pop() {
            Some(head) if closed => parts.push(tail.joined_with(&head)),
            Some(head) => parts.extend([head, tail]),
            None => parts.push(tail),
        }
    }
    let inner = cuts.windows(2).filter(|w| w[1] - w[0] > near).map(|w| curve.restricted(w[0], w[1]));
    parts.extend(inner);
    parts
}

/// Returns where `side` is zero between two parameters of opposite signs, by halving; `s_lo` is its value at the first.
fn crossing(side: impl Fn(f64) -> f64, [mut lo, mut hi]: [f64; 2], s_lo: f64) -> f64 {
    // A hundred halvings end at neighbouring numbers.
    for _ in 0..100 {
        let middle = 0.5 * (lo + hi);
        if side(middle) * s_lo > 0.0 { lo = middle } else { hi = middle }
    }
    0.5 * (lo + hi)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nurbs::conic;

    /// A circle about (-306, 0, -29) of radius 328 crosses the z axis near its parameter 0, where it is cut open.
    #[test]
    fn a_circle_across_the_axis_keeps_the_part_of_the_face() {
        // The circle's plane is xz, its start points along x.
        let at = Frame::from_axis(Point::new(0.0, -306.0, -29.0), -Vector::Y, Some(Vector::X));
        let circle = conic::arc(&at, 328.0, [0.0, 2.0 * std::f64::consts::PI]);
        let axis = Frame::from_axis(Point::new(0.0, -306.0, 0.0), Vector::X, None);
        let on = |z: f64| Point::new((328f64.powi(2) - (z + 29.0).powi(2)).sqrt(), -306.0, z);
        for z in [[0.6, 3.15], [-0.6, -3.15]] {
            let points = z.map(on);
            // The middle of ring-shaped faces is on the axis and decides nothing.
            let reach = FaceExtent {
                center: Point::new(327.0, -306.0, 0.0),
                radius: 3.2,
                points: &points,
                parameters: None,
            };
            let (part, has_twin) = keep_face_side_of_axis(&axis, circle.clone(), reach);
            assert!(!has_twin);
            for p in points {
                let (_, distance) = crate::nurbs::project::nearest(&part, p);
                let mirrored = crate::nurbs::project::nearest(&part, Point::new(p.x, p.y, -p.z)).1;
                assert!(distance.min(mirrored) < 1e-9, "{z:?}: {distance:e} {mirrored:e}");
            }
            let [a, b] = part.domain().map(|t| axis.local_point(part.evaluate(t)));
            assert!(a.x.hypot(a.y) < 1e-9 && b.x.hypot(b.y) < 1e-9, "{a} {b}");
        }
    }
}
