//! How far a border edge's curve strays from its chord, in space and in parameters.

use super::deviation::DeviationBounds;
use super::prover::Prover;
use super::refine::halve_net;
use crate::math::{Homogeneous, Point, Uv, Vector};
use crate::model::EdgeUse;
use crate::nurbs::Curve;
use crate::tessellate::face_surface::FaceSurface;
use rustc_hash::FxHashMap;
use smallvec::{SmallVec, smallvec};

/// Share of the tolerance below which the file's own gap is taken as it is known for the whole face.
const NEGLIGIBLE: f64 = 1e-3;
/// Where along a chord the file's gap between edge and face is measured, besides the ends.
const GAP_PROBES: [f64; 4] = [0.2, 0.4, 0.6, 0.8];
/// Share of the domain within which a uv curve is the straight line of its chord: rounding of its control points.
const STRAIGHT: f64 = 1e-12;
/// Share of the tolerance within which an edge is straight in space. Beside one that bends, the strip between it and its chord is about as
/// wide as the chord's sag, which is held to the tolerance by itself.
pub(in crate::tessellate) const STRAIGHT_EDGE: f64 = 0.1;
/// Share of the tolerance that is small for a curve's deviation: beyond it finer hulls are looked at.
const SMALL_SHARE: f64 = 0.5;
/// Halvings of one knot span, and the parts that several are cut into: coarse first, finer where that is not clearly small.
const MAX_HALVINGS: u32 = 3;
/// Knot spans that are parts by themselves.
const MOST_SPANS: usize = 8;
const PARTS: [i32; 2] = [2, 8];

/// The chords of a face's border by the edge between their nodes.
pub(in crate::tessellate) type BorderChords = FxHashMap<[u32; 2], BorderChord>;

/// How far the border strays from the chord between two of an edge's samples.
#[derive(Clone, Debug, Default)]
pub(in crate::tessellate) struct BorderChord {
    /// Bound of the distance between the edge's curve and the line of the chord, mm, with the offset of the chord's ends
    /// from the surface; of an edge that is straight in space no less than how far its chord in the parameter plane runs
    /// outside of the face.
    pub(in crate::tessellate) deviation: f64,
    /// The file's own gap between edge and face here, mm, which no shorter chord closes; included in `deviation`.
    pub(in crate::tessellate) gap: f64,
    /// A convex polygon, counter-clockwise, around what lies between chord and curve in the parameter plane; empty where that is nothing.
    pub(in crate::tessellate) between: Vec<Uv>,
    /// Bound of the distance from the surface there to the chord, mm; `None` while none is known.
    sliver: Option<f64>,
}

impl BorderChord {
    /// Bounds how far an edge strays from its chord between parameters `t` (in either order); `uv` and `xyz` are the chord's ends on one
    /// face, in the order of the loop. The gap to the surface is sampled, not proved.
    pub(in crate::tessellate) fn new(
        surface: &FaceSurface<'_>,
        curve: &Curve,
        side: &EdgeUse,
        t: [f64; 2],
        uv: [Uv; 2],
        xyz: [Point; 2],
    ) -> Self {
        let (a, b) = (t[0].min(t[1]), t[0].max(t[1]));
        // The file's own gap between edge and face, as measured at the ends and at places between; not where it is known to be small.
        let gap = |f: f64| {
            // Only as good as these places: the gap is the file's own, and no formula for it is known.
            let at = a + (b - a) * f;
            (surface.point(surface.spline.clamp(side.uv.evaluate(at))) - curve.evaluate(at)).length()
        };
        let ends = [0, 1].map(|i| (surface.point(uv[i]) - xyz[i]).length());
        let known = surface.gap.filter(|&g| g <= NEGLIGIBLE * surface.field.tightest());
        // Probing costs four evaluations a chord, and most files have a gap far below any tolerance: there the
        // face's largest is taken.
        let offset = match known {
            Some(gap) => ends[0].max(ends[1]).max(gap),
            None => GAP_PROBES.map(gap).into_iter().fold(ends[0].max(ends[1]), f64::max),
        };
        // Parameters in one place leave no curve, only its offset.
        if a >= b || a.is_nan() || b.is_nan() {
            return Self { deviation: offset, gap: offset, between: Vec::new(), sliver: None };
        }
        let deviation = curve_deviation(curve, [a, b], &xyz, SMALL_SHARE * surface.field.tightest() - offset);
        let mut chord = Self { deviation: deviation + offset, gap: offset, between: Vec::new(), sliver: None };
        // On a plane the piece between curve and chord lies in the plane of the facet.
        if !surface.affine {
            chord.between = parameter_hull(surface, side, [a, b], uv);
            if deviation <= STRAIGHT_EDGE * surface.field.tightest() {
                chord.deviation = chord.deviation.max(overshoot(surface, &chord.between, uv) + offset);
            }
        }
        chord
    }

    /// Fills in the bound between surface and chord, once for all facets that have the chord; leaves it open where none is found within the
    /// tolerance.
    pub(in crate::tessellate) fn bound_sliver(
        &mut self,
        surface: &FaceSurface<'_>,
        deviation: &mut DeviationBounds,
        uv: [Uv; 2],
        xyz: [Point; 2],
    ) {
        // Without a hull there is nothing between curve and chord.
        if self.between.len() < 3 {
            return;
        }
        let at = uv.map(|x| surface.point(x));
        // The chord runs between the edge's own points, the surface through its: both ends may be off by the gap.
        let off = (at[0] - xyz[0]).length().max((at[1] - xyz[1]).length()) + surface.rounding;
        // In the middle of the chord: facets on either side have tolerances of their own, and what does not fit
        // theirs is bounded anew.
        let limit = surface.tolerance(0.5 * (uv[0] + uv[1]));
        self.sliver = deviation.chord_bound(surface, &self.between, uv, at, limit - off).map(|x| x + off);
    }

    /// Returns a bound, mm, for what lies between the border and a triangle that has the chord as a side; the triangle's whole bound is the
    /// larger of this and its own. `xyz` are the triangle's corners; above `limit` the value only says that no bound is known.
    pub(in crate::tessellate) fn bound(&self, prover: &mut Prover<'_, '_>, xyz: [Point; 3], limit: f64) -> f64 {
        let mut worst = self.deviation;
        if let Some(sliver) = self.sliver.filter(|&x| x <= limit) {
            return worst.max(sliver);
        }
        if worst <= limit && self.between.len() > 2 {
            worst = worst.max(prover.polygon_bound(&self.between, xyz, limit));
        }
        worst
    }
}

/// Returns a bound, mm, of the distance from the curve over `[a, b]` to a chord, by hulls of its control points: of its halves, and of
/// finer parts where those exceed `small`. Of one arc of a conic it is sharp.
fn curve_deviation(curve: &Curve, [a, b]: [f64; 2], chord: &[Point; 2], small: f64) -> f64 {
    let frame = ChordFrame::new(chord);
    let over = |x: f64, y: f64| frame.moved(curve.restricted_points(x, y));
    let mut piece = over(a, b);
    let n = curve.degree;
    // A line is its own control polygon.
    if n == 1 {
        return frame.farthest(&piece);
    }
    if piece.len() == n + 1 {
        return if n == 2 { frame.conic_deviation(&piece) } else { frame.piece_deviation(&mut piece, n, small) };
    }
    // Several knot spans: each part has its own control points. A few are parts by themselves.
    let knots = curve.knots.iter().copied().filter(|&k| a < k && k < b);
    let mut ends: SmallVec<[f64; 16]> = std::iter::once(a).chain(knots).chain([b]).collect();
    ends.dedup();
    if ends.len() <= MOST_SPANS + 1 {
        let parts = ends.windows(2).map(|part| frame.piece_deviation(&mut over(part[0], part[1]), n, small));
        return parts.fold(0.0, f64::max);
    }
    let in_parts = |parts: i32| {
        let cut = |k: i32| if k == parts { b } else { a + (b - a) * k as f64 / parts as f64 };
        let parts = (0..parts).filter(|&k| cut(k) < cut(k + 1));
        parts.map(|k| frame.farthest(&over(cut(k), cut(k + 1)))).fold(0.0, f64::max)
    };
    let coarse = in_parts(PARTS[0]);
    if coarse > small { in_parts(PARTS[1]) } else { coarse }
}

/// Coordinates in which a chord runs along x from the origin, so that distances from it need no projection.
struct ChordFrame {
    origin: Point,
    axes: [Vector; 3],
    length: f64,
}

impl ChordFrame {
    fn new(&[a, b]: &[Point; 2]) -> Self {
        // Ends in one place have no direction, and need none.
        let along = (b - a).try_normalize().unwrap_or(Vector::X);
        let (y, z) = along.any_orthonormal_pair();
        Self { origin: a, axes: [along, y, z], length: (b - a).length() }
    }

    /// Returns control points in these coordinates.
    fn moved(&self, mut points: SmallVec<[Homogeneous; 8]>) -> SmallVec<[Homogeneous; 8]> {
        for c in &mut points {
            let x = c.truncate() - self.origin * c.w;
            *c = Point::from_array(self.axes.map(|axis| axis.dot(x))).extend(c.w);
        }
        points
    }

    /// Returns the square of the distance, mm², of a point in these coordinates from the chord.
    fn distance_squared(&self, p: Point) -> f64 {
        let beyond = (p.x - self.length).max(-p.x).max(0.0);
        beyond * beyond + p.y * p.y + p.z * p.z
    }

    /// Returns the greatest distance, mm, of a control point from the chord. It is a convex function: no point of the curve is farther.
    fn farthest(&self, points: &[Homogeneous]) -> f64 {
        points.iter().map(|c| self.distance_squared(c.project())).fold(0.0, f64::max).sqrt()
    }

    /// Returns a bound, mm, of the distance of the Bézier curve of degree `n` that `piece` holds: by hulls of its halves, further halved
    /// while they exceed `small`. The piece is used up.
    fn piece_deviation(&self, piece: &mut SmallVec<[Homogeneous; 8]>, n: usize, small: f64) -> f64 {
        let mut worst = 0f64;
        let mut depths: SmallVec<[u32; 8]> = smallvec![0];
        // Halves by de Casteljau, the last one first.
        while let Some(depth) = depths.pop() {
            let start = piece.len() - n - 1;
            let off = self.farthest(&piece[start..]);
            // A coarse hull that is no worse than the worst so far needs no finer one.
            if depth == MAX_HALVINGS || depth > 0 && off <= small || off <= worst {
                worst = worst.max(off);
                piece.truncate(start);
                continue;
            }
            for k in 0..=n {
                piece.push(piece[start + k]);
            }
            let (low, high) = piece[start..].split_at_mut(n + 1);
            halve_net(low, high, [n, 0], 0);
            depths.extend([depth + 1, depth + 1]);
        }
        worst
    }

    /// Returns a bound, mm, of the distance of the rational curve of degree two with these three control points. The middle one's share of
    /// the curve is at most ω/(1 + ω) with ω = w₁/√(w₀w₂): that cuts the corner off their triangle.
    fn conic_deviation(&self, piece: &[Homogeneous]) -> f64 {
        let [first, middle, last] = [0, 1, 2].map(|i| piece[i].project());
        let omega = piece[1].w / (piece[0].w * piece[2].w).sqrt();
        let cut = |end: Point| end.lerp(middle, omega / (1.0 + omega));
        let corners = [first, last, cut(first), cut(last)];
        corners.map(|p| self.distance_squared(p)).into_iter().fold(0.0, f64::max).sqrt()
    }
}

/// Returns how far the surface over `hull`, around a curve and its `chord` in parameters, reaches beyond the curve, mm: facets that end at
/// the chord do. 0 where the curve does not lie to the left of the chord, as the face does. How long lines across are is sampled, not
/// proved.
fn overshoot(surface: &FaceSurface<'_>, hull: &[Uv], chord: [Uv; 2]) -> f64 {
    let d = chord[1] - chord[0];
    let left = hull.iter().map(|&q| d.perp_dot(q - chord[0])).fold(0.0, f64::max);
    if left <= STRAIGHT * d.length() * surface.extent().max_element() {
        return 0.0;
    }
    // Across the chord on the surface: orthogonal to it in space, one mm long there.
    let middle = surface.second_derivatives(0.5 * (chord[0] + chord[1]));
    let along = middle.du * d.x + middle.dv * d.y;
    let [e, f, g] = [middle.du.dot(middle.du), middle.du.dot(middle.dv), middle.dv.dot(middle.dv)];
    let across = Uv::new(-(f * d.x + g * d.y), e * d.x + f * d.y) / (along.length() * (e * g - f * f).sqrt());
    let height = left / d.perp_dot(across);
    // At a pole nothing is across.
    if !(height > 0.0 && height.is_finite()) {
        return 0.0;
    }
    // Any place between lies on a line across from the chord to the curve: no farther from the curve than that is long.
    let stretch = |&q: &Uv| {
        let at = surface.second_derivatives(q);
        (at.du * across.x + at.dv * across.y).length()
    };
    height * hull.iter().map(stretch).fold(1.0, f64::max)
}

/// Returns a convex polygon, counter-clockwise in the parameter plane, that holds the chord and the curve over `[a, b]`; empty where the
/// curve is the chord itself or the interval has no length.
fn parameter_hull(surface: &FaceSurface<'_>, side: &EdgeUse, [a, b]: [f64; 2], chord: [Uv; 2]) -> Vec<Uv> {
    let [[u0, u1], [v0, v1]] = surface.spline.domain();
    let extent = Uv::new(u1 - u0, v1 - v0);
    let [s0, s1] = side.uv.domain();
    let (a, b) = (a.clamp(s0, s1), b.clamp(s0, s1));
    // Reparametrised uv curves may end a digit before the edge does.
    if a >= b || a.is_nan() || b.is_nan() {
        return Vec::new();
    }
    let d = (chord[1] - chord[0]) / extent;
    let off = |p: Uv| {
        let x = (p - chord[0]) / extent;
        if d.length() > 0.0 { x.perp_dot(d).abs() / d.length() } else { x.length() }
    };
    let line = side.uv.degree == 1 && side.uv.points.len() == 2;
    // The straight line of its own chord encloses nothing: most edges along parameter lines are of this kind.
    if line && [a, b].iter().all(|&t| off(surface.spline.clamp(side.uv.evaluate(t))) < STRAIGHT) {
        return Vec::new();
    }
    let m = 0.5 * (a + b);
    let over = |from: f64, to: f64| if from < to { side.uv.restricted_points(from, to) } else { SmallVec::new() };
    // Two halves hull a curve four times as closely as one, and a line as well as one.
    let halves = if side.uv.degree == 1 { [over(a, b), SmallVec::new()] } else { [over(a, m), over(m, b)] };
    let mut points: SmallVec<[Uv; 16]> =
        halves.iter().flatten().map(|p| surface.spline.clamp(p.truncate() / p.z)).collect();
    if points.iter().all(|&p| off(p) < STRAIGHT) {
        return Vec::new();
    }
    // With the chord's own ends, which the clamped curve may miss by a digit.
    points.extend(chord);
    convex_hull(points)
}

/// Returns the convex hull, counter-clockwise, without points on its sides (Andrew's monotone chain).
fn convex_hull(mut p: SmallVec<[Uv; 16]>) -> Vec<Uv> {
    p.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    p.dedup();
    let mut hull: Vec<Uv> = Vec::with_capacity(p.len() + 1);
    let mut add_half = |points: &mut dyn Iterator<Item = &Uv>| {
        let start = hull.len();
        for &q in points {
            while hull.len() >= start + 2
                && (hull[hull.len() - 1] - hull[hull.len() - 2]).perp_dot(q - hull[hull.len() - 1]) <= 0.0
            {
                hull.pop();
            }
            hull.push(q);
        }
        // The next half begins there.
        hull.pop();
    };
    add_half(&mut p.iter());
    add_half(&mut p.iter().rev());
    hull
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use crate::nurbs::conic;
    use crate::tessellate::proof::flat_triangle::distance_to_chord;

    /// An arc of radius 10 and angle φ is 10·(1 − cos φ/2) from its chord: by one conic to the last digits, across knots nearly.
    #[test]
    fn an_arc_is_as_far_from_its_chord_as_its_closed_form_says() {
        let arc = conic::arc(&Frame::IDENTITY, 10.0, [0.0, 4.0]);
        let breaks = arc.breakpoints();
        let bound = |t: [f64; 2]| {
            let chord = t.map(|t| arc.evaluate(t));
            let angle = chord[0].angle_between(chord[1]);
            (curve_deviation(&arc, t, &chord, 0.0), 10.0 * (1.0 - (0.5 * angle).cos()))
        };
        for [from, to] in [[0.0, 1.0], [0.1, 0.4], [0.05, 0.95]] {
            let (found, sag) = bound([from, to].map(|share| breaks[0] + share * (breaks[1] - breaks[0])));
            assert!((found - sag).abs() < 1e-12 * 10.0, "{found} {sag}");
        }
        let (found, sag) = bound([0.7 * breaks[1], 1.2 * breaks[1]]);
        assert!(sag <= found && found < 1.01 * sag, "{found} {sag}");
    }

    /// Ends that the file has moved off the curve, and a curve of degree three with an inflection: no sample is beyond the bound.
    #[test]
    fn no_sample_is_farther_from_a_chord_than_the_bound() {
        let arc = conic::arc(&Frame::IDENTITY, 10.0, [0.0, 1.0]);
        let points = [(0.0, 0.0), (1.0, 2.0), (2.0, -1.5), (4.0, 0.5)];
        let points = points.map(|(x, y)| Homogeneous::new(x, y, 0.1 * x * y, 1.0)).to_vec();
        let wave = Curve { degree: 3, knots: [[0.0; 4], [1.0; 4]].concat(), points };
        for curve in [arc, wave] {
            let [a, b] = curve.domain();
            for moved in [Vector::ZERO, 0.3 * Vector::X, 0.3 * Vector::Y, -0.3 * Vector::Y, 0.3 * Vector::Z] {
                let chord = [curve.evaluate(a) + moved, curve.evaluate(b)];
                let off = |k: u32| distance_to_chord(curve.evaluate(a + (b - a) * f64::from(k) / 1000.0), &chord);
                let farthest = (0..=1000).map(off).fold(0.0, f64::max);
                let found = curve_deviation(&curve, [a, b], &chord, 0.0);
                assert!(farthest <= found + 1e-12 && found <= 1.3 * farthest, "{found} {farthest} {moved}");
            }
        }
    }
}
