//! The border of a face in space, as sampled curves.

use crate::math::{Aabb, Point, Uv, Vector};
use crate::model::Face;
use crate::nurbs::{Surface, UvCurve};
use rustc_hash::FxHashMap;

/// Sides of the domain this near, as a share of the surface's size, are one seam or one pole: far above rounding (1e-15), far below
/// what a CAD system closes (1e-6).
const COINCIDENT: f64 = 1e-9;

/// Samples of a curve or of a side of a surface, to begin with.
pub(super) const SAMPLES: usize = 16;
/// Samples of a curve of many knots, to begin with, as far as that leaves two to [`MOST_IN_SPAN`] between each pair of them: fitted curves
/// have hundreds of spans, whose samples took two thirds of a check, and 16 of each of 12,000 took 6 MB.
const MANY_SAMPLES: usize = 256;
/// The most samples between two knots of such a curve.
const MOST_IN_SPAN: usize = 4;
/// How often the stretch between two samples is halved.
const FINEST: u32 = 8;

/// One curve of a border.
pub(super) struct Border {
    curve: UvCurve,
    samples: Vec<(f64, Point)>,
    bounds: Aabb,
}

impl Border {
    /// Samples a border curve of a surface so closely that it strays from no chord by more than a quarter of its length.
    pub(super) fn new(curve: UvCurve, surface: &Surface) -> Self {
        let breaks = curve.breakpoints();
        let mut samples = Vec::new();
        // From knot to knot: within a span the curve is smooth, and even samples follow it.
        let spans = breaks.len().saturating_sub(1).max(1);
        let count = SAMPLES.div_ceil(spans).max((MANY_SAMPLES / spans).clamp(2, MOST_IN_SPAN));
        for pair in breaks.windows(2) {
            for i in 0..count {
                let t = pair[0] + (pair[1] - pair[0]) * i as f64 / count as f64;
                samples.push((t, surface.evaluate(curve.evaluate(t))));
            }
        }
        let end = curve.domain()[1];
        samples.push((end, surface.evaluate(curve.evaluate(end))));
        // A straight line of parameters may be a helix of many turns in space.
        samples = with_short_chords(samples, |t| surface.evaluate(curve.evaluate(t)));
        // The curve strays from its chords by no more than a quarter of their length, as it was straightened.
        let longest = samples.windows(2).map(|w| w[0].1.distance(w[1].1)).fold(0.0, f64::max);
        let bounds = Aabb::from_points(samples.iter().map(|s| s.1)).grown(0.25 * longest);
        Self { curve, samples, bounds }
    }

    /// Whether `p` may lie within `enough`, mm, of the curve, by its box.
    pub(super) fn reaches(&self, p: Point, enough: f64) -> bool {
        self.bounds.grown(enough).contains(p)
    }

    /// Returns the distance of `p` from some place of the border within `enough`, mm, where there is one, not always the nearest; else a
    /// number above `enough`.
    pub(super) fn distance(&self, surface: &Surface, p: Point, enough: f64) -> f64 {
        // On parts smaller than the band every sample is near: one of them is enough.
        if let Some(near) = self.samples.iter().map(|s| s.1.distance(p)).find(|&d| d <= enough) {
            return near;
        }
        let mut best = f64::INFINITY;
        for pair in self.samples.windows(2) {
            let ((ta, a), (tb, b)) = (pair[0], pair[1]);
            let chord = b - a;
            let s = if chord == Vector::ZERO { 0.0 } else { (p - a).dot(chord) / chord.length_squared() };
            let coarse = p.distance(a + chord * s.clamp(0.0, 1.0));
            // Samples keep the curve within a quarter of a chord's length of it at three places; half is room for what lies between.
            if coarse > enough + 0.5 * chord.length() || coarse > best + 0.5 * chord.length() {
                continue;
            }
            let at = |t: f64| p.distance_squared(surface.evaluate(self.curve.evaluate(t)));
            let (mut lo, mut hi) = (ta, tb);
            // Each third that is dropped leaves two: 24 of them leave 6e-5 of the stretch.
            for _ in 0..24 {
                let (x, y) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
                if at(x) < at(y) { hi = y } else { lo = x }
            }
            best = best.min(at(0.5 * (lo + hi)).sqrt());
        }
        best
    }
}

/// Inserts further samples until the curve, judged at three parameters of each stretch, stays within a quarter of the chord's length from
/// the chord; each stretch is halved at most [`FINEST`] times, and may stray farther then.
fn with_short_chords(samples: Vec<(f64, Point)>, at: impl Fn(f64) -> Point) -> Vec<(f64, Point)> {
    let mut out = Vec::with_capacity(samples.len());
    for pair in samples.windows(2) {
        let mut stack = vec![(pair[0], pair[1], 0)];
        while let Some((a, b, depth)) = stack.pop() {
            let chord = b.1 - a.1;
            // Not in the middle alone, nor evenly: an S-curve crosses its chord there.
            let bent = [0.21, 0.5, 0.83].iter().any(|f| {
                let x = at(a.0 + (b.0 - a.0) * f) - a.1;
                let s = if chord == Vector::ZERO { 0.0 } else { x.dot(chord) / chord.length_squared() };
                (x - chord * s.clamp(0.0, 1.0)).length() > 0.25 * chord.length()
            });
            if bent && depth < FINEST {
                let t = 0.5 * (a.0 + b.0);
                let m = (t, at(t));
                stack.extend([(m, b, depth + 1), (a, m, depth + 1)]);
            } else {
                out.push(a);
            }
        }
    }
    out.extend(samples.last());
    out
}

/// Returns the uv curves that bound a face in space, seams and poles left out; for a face without loops, or with holes alone, the sides of
/// its domain too. `size`, mm, is that of the surface.
pub(super) fn border_curves(face: &Face, surface: &Surface, size: f64) -> Vec<UvCurve> {
    let mut border = Vec::new();
    if !face.loops.is_empty() {
        let mut uses = FxHashMap::default();
        for u in face.loops.iter().flat_map(|l| &l.uses) {
            if let Some(edge) = u.edge {
                *uses.entry(edge).or_insert(0) += 1;
            }
        }
        // An edge that the face uses twice is a seam.
        let is_border = |edge| uses.get(&edge) == Some(&1);
        let all = face.loops.iter().flat_map(|l| &l.uses);
        border.extend(all.filter(|u| u.edge.is_some_and(is_border)).map(|u| u.uv.clone()));
        if !face.has_holes_alone() {
            return border;
        }
    }
    let [[u0, u1], [v0, v1]] = surface.domain();
    let side = |a: Uv, b: Uv| UvCurve::line(a, b, [0.0, 1.0]);
    let corners = [Uv::new(u0, v0), Uv::new(u1, v0), Uv::new(u1, v1), Uv::new(u0, v1)];
    // In pairs of opposite sides, each along the other: `i ^ 1` is the opposite one.
    let sides = [
        side(corners[0], corners[1]),
        side(corners[3], corners[2]),
        side(corners[0], corners[3]),
        side(corners[1], corners[2]),
    ];
    let points = |c: &UvCurve| -> Vec<Point> {
        (0..=SAMPLES).map(|i| surface.evaluate(c.evaluate(i as f64 / SAMPLES as f64))).collect()
    };
    let traced: Vec<Vec<Point>> = sides.iter().map(points).collect();
    // Opposite sides that coincide are a seam, a side that is one point is a pole.
    let close = |a: &[Point], b: &[Point]| a.iter().zip(b).all(|(p, q)| p.distance(*q) < COINCIDENT * size);
    let pole = |a: &[Point]| a.iter().all(|p| p.distance(a[0]) < COINCIDENT * size);
    let bounds = |i: &usize| !close(&traced[*i], &traced[*i ^ 1]) && !pole(&traced[*i]);
    border.extend((0..4).filter(bounds).map(|i| sides[i].clone()));
    border
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::nurbs::sweep;
    use std::f64::consts::PI;

    #[test]
    fn a_straight_line_of_parameters_may_wind_many_times() {
        // Eight turns around the tube of a torus, first seen at every half turn.
        let surface = sweep::torus(&Frame::IDENTITY, 20.0, 5.0, [0.0, 2.0 * PI], [0.0, 2.0 * PI]);
        let turns = 8.0;
        let wound = |t: f64| Uv::new(2.0 * PI * t / turns, 2.0 * PI * t.fract());
        let ts: Vec<f64> = (0..).map(|i| f64::from(i) / 64.0).take_while(|&t| t < turns).collect();
        let at = |t: f64| surface.evaluate(wound(t));
        let coarse = (0..=16).map(|i| f64::from(i) * 0.5 * (1.0 - 1e-12)).map(|t| (t, at(t))).collect();
        let fine = with_short_chords(coarse, at);
        for t in ts {
            let p = at(t);
            let near = fine.windows(2).any(|w| {
                let chord = w[1].1 - w[0].1;
                let s = ((p - w[0].1).dot(chord) / chord.length_squared()).clamp(0.0, 1.0);
                p.distance(w[0].1 + chord * s) <= 0.5 * chord.length()
            });
            assert!(near, "{t}");
        }
    }

    #[test]
    fn a_border_of_many_knots_is_sampled_twice_between_them() {
        // A saw of 2,000 teeth along a plane, 1e-3 high.
        let surface = sweep::plane(&Frame::IDENTITY, [[0.0, 20.0], [0.0, 1.0]]);
        let teeth = 2000;
        let points: Vec<glam::DVec3> =
            (0..=teeth).map(|k| glam::DVec3::new(0.01 * f64::from(k), 1e-3 * f64::from(k % 2), 1.0)).collect();
        let ends = [0.0, f64::from(teeth)];
        let knots = ends[..1].iter().copied().chain((0..=teeth).map(f64::from)).chain([ends[1]]).collect();
        let border = Border::new(UvCurve { degree: 1, knots, points }, &surface);
        assert_eq!(border.samples.len(), 2 * teeth as usize + 1);
        // Half a millimetre above the tip of a tooth, and no sample within what is enough.
        let found = border.distance(&surface, Point::new(5.01, 0.501, 0.0), 0.499);
        // The tip is found to 6e-5 of a side of 5e-3 mm, which rises by a fifth.
        assert!((found - 0.5).abs() < 1e-7, "{found}");
    }
}
