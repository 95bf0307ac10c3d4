//! Parts of curves by blossoms: knot insertion, clamping and cutting in one; and parts put together.

use super::basis::{BROAD, MAX_DEGREE, MIDDLE, NARROW, WIDE, find_span};
use super::curve::{ControlPoint, Curve, Spline};
use smallvec::SmallVec;

/// Sets `out` to the Bézier points over `[a, b]` of the polynomial piece over knot span `span`, not empty: the i-th is the blossom at p − i
/// times `a` and i times `b`. The bits are those of [`Spline::blossom`].
fn bezier_points<P: ControlPoint>(
    degree: usize,
    knots: &[f64],
    points: &[P],
    span: usize,
    ends: [f64; 2],
    out: &mut [P],
) {
    match degree {
        1 => bezier_points_in::<NARROW, P>(1, knots, points, span, ends, out),
        2 => bezier_points_in::<NARROW, P>(2, knots, points, span, ends, out),
        3 => bezier_points_in::<NARROW, P>(3, knots, points, span, ends, out),
        0..MIDDLE => bezier_points_in::<MIDDLE, P>(degree, knots, points, span, ends, out),
        MIDDLE..BROAD => bezier_points_in::<BROAD, P>(degree, knots, points, span, ends, out),
        _ => bezier_points_in::<WIDE, P>(degree, knots, points, span, ends, out),
    }
}

/// As [`bezier_points`], with room for `W` points.
#[inline(always)]
fn bezier_points_in<const W: usize, P: ControlPoint>(
    p: usize,
    knots: &[f64],
    points: &[P],
    span: usize,
    [a, b]: [f64; 2],
    out: &mut [P],
) {
    // How far `a` and `b` lie from either end of each interval of each round, as shares of it: the same for all points. Each is a
    // difference of knots: what is left to 1 of a share near it has lost its digits.
    let mut shares = [[[[0.0; 2]; 2]; W]; W];
    for r in 0..p {
        for j in 0..p - r {
            let (lo, hi) = (knots[span - p + j + r + 1], knots[span + j + 1]);
            shares[r][j] = [a, b].map(|x| [(hi - x) / (hi - lo), (x - lo) / (hi - lo)]);
        }
    }
    let round = |d: &mut [P; W], r: usize, end: usize| {
        for j in 0..p - r {
            let [before, after] = shares[r][j][end];
            d[j] = d[j] * before + d[j + 1] * after;
        }
    };
    let mut at_a = [P::ZERO; W];
    at_a[..=p].copy_from_slice(&points[span - p..=span]);
    // After r rounds at `a`, p − r rounds at `b` end in point p − r.
    for r in 0..=p {
        let mut d = at_a;
        (r..p).for_each(|q| round(&mut d, q, 1));
        out[p - r] = d[0];
        if r < p {
            round(&mut at_a, r, 0);
        }
    }
}

/// Appends to `out` the Bézier points of a spline over each knot span that is not empty, in order.
pub(super) fn append_bezier_pieces<P: ControlPoint>(degree: usize, knots: &[f64], points: &[P], out: &mut Vec<P>) {
    let p = degree;
    for k in (p..points.len()).filter(|&k| knots[k] < knots[k + 1]) {
        // Most analytic surfaces are Bézier pieces already.
        if knots[k + 1 - p] == knots[k] && knots[k + p] == knots[k + 1] {
            out.extend_from_slice(&points[k - p..=k]);
            continue;
        }
        let start = out.len();
        out.resize(start + p + 1, P::ZERO);
        bezier_points(p, knots, points, k, [knots[k], knots[k + 1]], &mut out[start..]);
    }
}

impl<P: ControlPoint> Spline<P> {
    /// The blossom (polar form), homogeneous, of the polynomial piece over knot span `span`, not empty, at `degree` arguments.
    pub(super) fn blossom(&self, span: usize, arguments: &[f64]) -> P {
        // Known degrees leave no loops: these are a twentieth of what a short run takes.
        match self.degree {
            1 => self.blossom_of_degree::<NARROW>(span, arguments, 1),
            2 => self.blossom_of_degree::<NARROW>(span, arguments, 2),
            3 => self.blossom_of_degree::<NARROW>(span, arguments, 3),
            p @ 0..MIDDLE => self.blossom_of_degree::<MIDDLE>(span, arguments, p),
            p @ MIDDLE..BROAD => self.blossom_of_degree::<BROAD>(span, arguments, p),
            p => self.blossom_of_degree::<WIDE>(span, arguments, p),
        }
    }

    /// As [`Spline::blossom`], with room for `W` points; `p` is the curve's degree, below `W`.
    #[inline(always)]
    fn blossom_of_degree<const W: usize>(&self, span: usize, arguments: &[f64], p: usize) -> P {
        let (points, knots) = (&self.points[span - p..=span], &self.knots[span + 1 - p..=span + p]);
        let mut d = [P::ZERO; W];
        d[..=p].copy_from_slice(points);
        // De Boor's algorithm with an argument of its own in each round: with equal ones it gives the point of the
        // curve.
        for (r, &u) in arguments[..p].iter().enumerate() {
            for j in 0..p - r {
                let (lo, hi) = (knots[j + r], knots[j + p]);
                let [before, after] = [(hi - u) / (hi - lo), (u - lo) / (hi - lo)];
                d[j] = d[j] * before + d[j + 1] * after;
            }
        }
        d[0]
    }

    /// Control points of the Bézier piece over each non-empty knot span, in order of [`Spline::breakpoints`].
    pub fn bezier_pieces(&self) -> Vec<Vec<P>> {
        let mut points = Vec::new();
        append_bezier_pieces(self.degree, &self.knots, &self.points, &mut points);
        points.chunks_exact(self.degree + 1).map(<[P]>::to_vec).collect()
    }

    /// Returns the same curve over another knot vector, one that refines this one on its domain `[knots[degree], knots[n]]`.
    ///
    /// New knots may start and end inside the domain (the curve is then cut there) and must hold every old knot
    /// between, at least as often. This is knot insertion, clamping and cutting in one (Oslo algorithm by blossoms).
    pub fn refined(&self, knots: Vec<f64>) -> Self {
        let (p, n) = (self.degree, knots.len() - self.degree - 1);
        let points = (0..n)
            .map(|i| {
                // Any span that the new point's knots enclose will do: pieces that meet smoothly agree on blossoms
                // that hold the knots between them (Ramshaw).
                let middle = 0.5 * (knots[i] + knots[i + p + 1]);
                self.blossom(find_span(&self.knots, p, middle), &knots[i + 1..=i + p])
            })
            .collect();
        Self { degree: p, knots, points }
    }

    /// The part over `[a, b]`, which must lie in the domain with `a < b`, clamped; its domain is `[a, b]`.
    pub fn restricted(&self, a: f64, b: f64) -> Self {
        if [a, b] == self.domain() && self.is_clamped() {
            return self.clone();
        }
        let first = self.knots.partition_point(|&k| k <= a);
        let inner = self.knots[first..].iter().copied().take_while(|&k| k < b);
        let p1 = self.degree + 1;
        let knots = std::iter::repeat_n(a, p1).chain(inner).chain(std::iter::repeat_n(b, p1)).collect();
        self.refined(knots)
    }

    /// Returns the control points of [`Spline::restricted`], whose hull holds the curve over `[a, b]`, without cutting the whole curve. The
    /// same conditions hold for `a` and `b`.
    pub fn restricted_points(&self, a: f64, b: f64) -> SmallVec<[P; 8]> {
        let p = self.degree;
        // The common case by itself: cutting the whole curve would make points of every span.
        let span = find_span(&self.knots, p, a);
        if !(self.knots[span] <= a && a < b && b <= self.knots[span + 1]) {
            return self.restricted_across(span, a, b);
        }
        let mut out = SmallVec::from_elem(P::ZERO, p + 1);
        bezier_points(p, &self.knots, &self.points, span, [a, b], &mut out);
        out
    }

    /// [`Spline::restricted_points`] over several spans, of which `span` is the first: points whose knots all lie inside are the curve's
    /// own.
    fn restricted_across(&self, span: usize, a: f64, b: f64) -> SmallVec<[P; 8]> {
        let (p, end) = (self.degree, self.knots.partition_point(|&k| k < b));
        if end <= span || self.knots[span] > a || a >= b || b > self.domain()[1] {
            return self.restricted(a, b).points.into();
        }
        let inner = &self.knots[span + 1..end];
        // Knot i of the cut curve.
        let knot = |i: usize| match i.checked_sub(p + 1) {
            None => a,
            Some(j) => inner.get(j).copied().unwrap_or(b),
        };
        let n = inner.len() + p + 1;
        let mut arguments = [a; MAX_DEGREE];
        (0..n)
            .map(|i| {
                if i >= p && i < inner.len() + 1 {
                    return self.points[span + i - p];
                }
                let middle = 0.5 * (knot(i) + knot(i + p + 1));
                (0..p).for_each(|k| arguments[k] = knot(i + 1 + k));
                self.blossom(find_span(&self.knots, p, middle), &arguments[..p])
            })
            .collect()
    }
}

impl Curve {
    /// Joins this curve and another of its degree that starts where it ends, both clamped; the parameter runs on at the joint, from where
    /// `tail` keeps its speed. Where the two do not meet, the end of this one is kept, which changes the shape of `tail`.
    pub fn joined_with(&self, tail: &Self) -> Self {
        let p = self.degree;
        debug_assert_eq!(p, tail.degree, "curves of unequal degrees are joined after one is raised");
        let (end, start) = (self.domain()[1], tail.domain()[0]);
        // One control point at the joint: weights are scaled to agree there.
        let scale = self.points[self.points.len() - 1].w / tail.points[0].w;
        let mut points = self.points.clone();
        points.extend(tail.points[1..].iter().map(|&q| q * scale));
        // The knot of the joint stays as often as the degree: the curve is continuous there, and no more is
        // promised.
        let mut knots = self.knots[..self.knots.len() - 1].to_vec();
        knots.extend(tail.knots[p + 1..].iter().map(|k| end + (k - start)));
        Self { degree: p, knots, points }
    }

    /// Joins curves of one degree, each of which starts where the one before ends, as [`Self::joined_with`] does; `None` of none.
    pub fn join(mut parts: Vec<Self>) -> Option<Self> {
        // Neighbours first: joined one by one to the whole, each would copy all before it.
        while parts.len() > 1 {
            parts = parts
                .chunks(2)
                .map(|pair| pair[1..].iter().fold(pair[0].clone(), |a, b| a.joined_with(b)))
                .collect();
        }
        parts.pop()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Frame, Homogeneous};
    use crate::nurbs::conic;

    /// Loops over a degree and the straight code for it, on pseudo-random points and weights over uneven knots.
    #[test]
    fn a_degree_known_to_the_compiler_gives_the_same_bits() {
        let unit = |k: usize| (k as f64 * 0.618_033_988_75).fract();
        for p in 1..12 {
            let knots = [vec![0.0; p + 1], vec![0.3, 0.7, 0.7], vec![1.0; p + 1]].concat();
            let points = (0..p + 4).map(|k| Homogeneous::new(unit(k), unit(3 * k), unit(7 * k), 0.5 + unit(5 * k)));
            let curve = Spline { degree: p, points: points.collect(), knots };
            for span in [p, p + 1, p + 3] {
                let arguments: Vec<f64> = (0..p).map(|k| unit(11 * k + span)).collect();
                let looped = curve.blossom_of_degree::<WIDE>(span, &arguments, std::hint::black_box(p));
                assert_eq!(curve.blossom(span, &arguments), looped, "degree {p}, span {span}");
                // Point i of a part is the blossom at p − i times its start and i times its end.
                let ends = [unit(span), 1.0];
                let mut part = vec![Homogeneous::ZERO; p + 1];
                bezier_points(p, &curve.knots, &curve.points, span, ends, &mut part);
                let one_by_one = (0..=p).map(|i| {
                    let arguments = [vec![ends[0]; p - i], vec![ends[1]; i]].concat();
                    curve.blossom(span, &arguments)
                });
                assert_eq!(part, one_by_one.collect::<Vec<_>>(), "degree {p}, span {span}");
            }
        }
    }

    #[test]
    fn two_arcs_put_together_are_one_circle() {
        let arc = |a: f64, b: f64| conic::arc(&Frame::IDENTITY, 2.0, [a, b]);
        let whole = arc(0.0, 2.0).joined_with(&arc(2.0, 5.0).reparametrised([7.0, 8.0]));
        assert_eq!(whole.domain(), [0.0, 3.0]);
        for k in 0..=30 {
            let t = 0.1 * f64::from(k);
            let p = whole.evaluate(t);
            assert!((p.length() - 2.0).abs() < 1e-14, "{t} {p}");
        }
        assert!((whole.evaluate(2.0).y.atan2(whole.evaluate(2.0).x) - 2.0).abs() < 1e-14);
    }
}
