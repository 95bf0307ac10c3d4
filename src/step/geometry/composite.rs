//! Bounded curves as splines: trimmed, composite, and whole curves.

use super::curves::{CurveShape, DirectedCurve, MAX_DEPTH, first_pcurve, polyline_lengths};
use super::tolerances::SEAM_SHARE;
use super::{GeometryReader, Outcome, Refusal};
use crate::math::{Homogeneous, Point};
use crate::nurbs::Curve;
use crate::step::part21::{Args, Entity};
use rustc_hash::FxHashMap;
use std::f64::consts::PI;

/// Most segments of one composite curve, those of its segments counted with them.
const MAX_SEGMENTS: u64 = 100_000;
/// Kinds of entities between a composite curve and the segments of the composite curves in it.
const AROUND_SEGMENTS: [&str; 12] = [
    "COMPOSITE_CURVE",
    "COMPOSITE_CURVE_ON_SURFACE",
    "BOUNDARY_CURVE",
    "OUTER_BOUNDARY_CURVE",
    "COMPOSITE_CURVE_SEGMENT",
    "REPARAMETRISED_COMPOSITE_CURVE_SEGMENT",
    "TRIMMED_CURVE",
    "CURVE_REPLICA",
    "OFFSET_CURVE_3D",
    "SURFACE_CURVE",
    "SEAM_CURVE",
    "INTERSECTION_CURVE",
];

impl<'f, 'a> GeometryReader<'f, 'a> {
    /// Reads a bounded curve, mm, as a spline in its own direction; conics that are closed become one turn. Refuses unbounded curves, and
    /// chains of more than [`MAX_DEPTH`] references, of which `depth` are behind.
    pub(crate) fn bounded_curve(&self, id: u64, depth: usize) -> Outcome<Curve> {
        let e = self.entity(id)?;
        if depth > MAX_DEPTH {
            return Err(Refusal::new(e, "curves refer to each other too deeply"));
        }
        if let Some(trimmed) = e.attributes("TRIMMED_CURVE", 1) {
            return self.trimmed_curve(e, trimmed, depth);
        }
        if e.is_one_of(&["SURFACE_CURVE", "SEAM_CURVE", "INTERSECTION_CURVE", "BOUNDED_SURFACE_CURVE"]) {
            // In a complex instance the curve is the first of its own attributes; in a simple one it stands behind
            // the name.
            let curve = e.attributes("SURFACE_CURVE", 1).and_then(|a| a.id(0)).or_else(|| e.args().id(1));
            let basis = self.resolve(e, curve.or_else(|| first_pcurve(e)), "curve_3d of the surface curve")?;
            return self.bounded_curve(basis.id, depth + 1);
        }
        if e.is_one_of(&["PCURVE", "BOUNDED_PCURVE"]) {
            return self.pcurve(e, depth);
        }
        let DirectedCurve { shape, reversed } = self.curve(id, depth)?;
        let whole = match &shape {
            CurveShape::Ellipse { .. } => shape.segment(0.0, 2.0 * PI),
            CurveShape::Spline { curve, .. } => curve.clone(),
            _ => return Err(Refusal::new(e, "an unbounded curve where a bounded one is needed")),
        };
        Ok(if reversed { whole.reversed() } else { whole })
    }

    /// Returns the part of a basis curve between the two trimming values of a TRIMMED_CURVE, whose attributes are `args`. On closed curves
    /// equal values mean once around; elsewhere they are refused.
    fn trimmed_curve(&self, e: Entity<'f, 'a>, args: Args<'f, 'a>, depth: usize) -> Outcome<Curve> {
        let basis = self.resolve(e, args.id(0), "basis curve")?;
        let DirectedCurve { shape, reversed } = self.curve(basis.id, depth + 1)?;
        let sense = args.flag(3) != Some(false);
        let by_point = args.word(4) == Some("CARTESIAN");
        // Conics are parametrised by angles, which files give in a unit of their own.
        let scale = match &shape {
            CurveShape::Ellipse { .. } => self.units.angle,
            _ => 1.0,
        };
        let limit = |list: Args<'f, 'a>| -> Option<f64> {
            let point = || (0..list.len()).find_map(|i| self.point(list.id(i)?).ok()).map(|p| shape.parameter(p));
            let number =
                || (0..list.len()).find_map(|i| list.real(i)).map(|x| self.curve_parameter(basis, x) * scale);
            // The file says which of its two trimming values it means; writers that give only the other are understood too.
            if by_point { point().or_else(number) } else { number().or_else(point) }
        };
        let (Some(t1), Some(t2)) = (limit(args.list(1)), limit(args.list(2))) else {
            return Err(Refusal::new(e, "a trimming value is missing"));
        };
        let (from, mut to) = if sense { (t1, t2) } else { (t2, t1) };
        // On a closed curve the second end lies ahead of the first; both in one place mean once around.
        if let Some(period) = shape.period() {
            to = from + (to - from).rem_euclid(period);
            if to - from <= SEAM_SHARE * period {
                to = from + period;
            }
        }
        if !(to > from) {
            return Err(Refusal::new(e, "trimming values are in the wrong order or equal"));
        }
        let curve = shape.segment(from, to);
        Ok(if sense == reversed { curve.reversed() } else { curve })
    }

    /// Returns the parameter of our curve for one of the file's: a POLYLINE's counts points, and ours is its arc length, mm.
    fn curve_parameter(&self, basis: Entity<'f, 'a>, x: f64) -> f64 {
        let points = basis.attributes("POLYLINE", 1).and_then(|a| self.points(basis, a.list(0)).ok());
        let Some(lengths) = points.map(|p| polyline_lengths(&p)).filter(|l| l.len() > 1) else { return x };
        let last = (lengths.len() - 1) as f64;
        let x = x.clamp(0.0, last);
        let k = x.floor().min(last - 1.0) as usize;
        lengths[k] + (lengths[k + 1] - lengths[k]) * (x - k as f64)
    }

    /// Returns how many segments a composite curve has, also inside of its segments; 1 for any other curve. `known` holds the numbers of
    /// entities that were met; those of a cycle, whose reading ends at [`MAX_DEPTH`], count once.
    fn segment_count(&self, e: Entity<'f, 'a>, depth: usize, known: &mut FxHashMap<u64, u64>) -> u64 {
        // A curve and its segment are two entities, and a trim between them a third.
        if depth > 3 * MAX_DEPTH || !e.is_one_of(&AROUND_SEGMENTS) {
            return 1;
        }
        if let Some(&count) = known.get(&e.id) {
            return count;
        }
        known.insert(e.id, 1);
        let mut inner = Vec::new();
        e.all_args().for_each(|args| args.deep_ids(&mut inner));
        let curves = inner.into_iter().filter_map(|id| self.file.entity(id));
        let curves = curves.filter(|inner| inner.is_one_of(&AROUND_SEGMENTS));
        let count: u64 =
            curves.fold(0, |n: u64, inner| n.saturating_add(self.segment_count(inner, depth + 1, known)));
        known.insert(e.id, count.max(1));
        count.max(1)
    }

    /// Returns the segments of a composite curve, in its order, turned around where that joins them clearly better than the file's own
    /// senses. Gaps stay.
    pub(crate) fn segments(&self, e: Entity<'f, 'a>, depth: usize) -> Outcome<Vec<Curve>> {
        let own = ["COMPOSITE_CURVE", "COMPOSITE_CURVE_ON_SURFACE", "BOUNDARY_CURVE", "OUTER_BOUNDARY_CURVE"]
            .into_iter()
            .find_map(|n| e.attributes(n, 1).filter(|a| a.list(0).len() > 0));
        let Some(own) = own else { return Err(Refusal::new(e, "composite curve without segments")) };
        let list = own.list(0);
        // Six lines can name a million segments: they are counted before one is read.
        if self.segment_count(e, 0, &mut FxHashMap::default()) > MAX_SEGMENTS {
            return Err(Refusal::new(e, "composite curve with too many segments"));
        }
        let mut curves: Vec<Curve> = Vec::with_capacity(list.len());
        for i in 0..list.len() {
            let segment = self.resolve(e, list.id(i), "segment")?;
            let args = segment.attributes("COMPOSITE_CURVE_SEGMENT", 0).unwrap_or_else(|| segment.args());
            let parent = self.resolve(segment, args.id(2), "parent curve")?;
            let curve = if parent.is_one_of(&["COMPOSITE_CURVE", "COMPOSITE_CURVE_ON_SURFACE"]) && depth < MAX_DEPTH
            {
                self.composite_curve(parent, depth + 1)?
            } else {
                self.bounded_curve(parent.id, depth + 1)?
            };
            curves.push(if args.flag(1) == Some(false) { curve.reversed() } else { curve });
        }
        // Senses are often wrong: turn a segment around when that joins it better.
        let ends = |c: &Curve| {
            let [a, b] = c.domain();
            (c.evaluate(a), c.evaluate(b))
        };
        if let [first, second, ..] = &curves[..] {
            let (a, b) = ends(second);
            let to = |p: Point| (p - a).length().min((p - b).length());
            let (start, end) = ends(first);
            // Only by a clear margin, and with a third segment to tell: two alone may join either way.
            if to(start) < 0.5 * to(end) && curves.len() > 2 {
                curves[0] = curves[0].reversed();
            }
        }
        for i in 1..curves.len() {
            let end = ends(&curves[i - 1]).1;
            let (a, b) = ends(&curves[i]);
            if (b - end).length() < 0.5 * (a - end).length() {
                curves[i] = curves[i].reversed();
            }
        }
        Ok(curves)
    }

    /// Reads a composite curve, mm, as one spline, of the highest degree of its segments. Segments are turned around as in
    /// [`Self::segments`]; at gaps, however wide, each begins where the one before ends. Refuses a curve without segments, one with more
    /// than [`MAX_SEGMENTS`], and chains of more than [`MAX_DEPTH`] references, of which `depth` are behind.
    pub(crate) fn composite_curve(&self, e: Entity<'f, 'a>, depth: usize) -> Outcome<Curve> {
        if depth > MAX_DEPTH {
            return Err(Refusal::new(e, "curves refer to each other too deeply"));
        }
        let segments = self.segments(e, depth)?;
        let degree = segments.iter().map(|c| c.degree).max().unwrap_or(1);
        let parts = segments.iter().map(|c| elevate_degree(c, degree)).collect();
        Curve::join(parts).ok_or_else(|| Refusal::new(e, "composite curve without segments"))
    }
}

/// Returns the same curve with a higher degree, piecewise Bézier; `degree` is not below its own.
fn elevate_degree(curve: &Curve, degree: usize) -> Curve {
    if curve.degree == degree {
        return curve.clone();
    }
    let mut points: Vec<Homogeneous> = Vec::new();
    for mut piece in curve.bezier_pieces() {
        while piece.len() <= degree {
            let n = piece.len();
            let mut up = vec![piece[0]];
            // Degree elevation: the new points divide the legs of the polygon at i/n.
            up.extend(
                (1..n).map(|i| piece[i - 1] * (i as f64 / n as f64) + piece[i] * (1.0 - i as f64 / n as f64)),
            );
            up.push(piece[n - 1]);
            piece = up;
        }
        // At a joint both pieces have one control point.
        points.extend(&piece[usize::from(!points.is_empty())..]);
    }
    let breaks = curve.breakpoints();
    let mut knots = vec![breaks[0]];
    knots.extend(breaks.iter().flat_map(|&b| std::iter::repeat_n(b, degree)));
    knots.push(breaks[breaks.len() - 1]);
    Curve { degree, knots, points }
}

/// Whether two points are at most `tolerance`, mm, apart.
pub(crate) fn coincident(a: Point, b: Point, tolerance: f64) -> bool {
    (a - b).length() <= tolerance
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::nurbs::conic;

    #[test]
    fn elevation_keeps_the_curve() {
        let c = conic::arc(&Frame::IDENTITY, 2.0, [0.0, 5.0]);
        let e = elevate_degree(&c, 4);
        assert_eq!(e.knots.len(), e.points.len() + 5);
        for i in 0..=40 {
            let t = 0.125 * f64::from(i);
            assert!((c.evaluate(t) - e.evaluate(t)).length() < 1e-13);
        }
    }
}
