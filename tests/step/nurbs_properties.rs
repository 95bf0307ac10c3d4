//! Properties of NURBS evaluation on random rational splines: degrees 1 to 7, weights 1e-2 to 1e2, knots up to full
//! multiplicity. The reference is the recursive definition of B-splines, written here and sharing nothing with the crate.

use lampyris::math::{Homogeneous, Point, Uv};
use lampyris::nurbs::{ControlPoint, Curve, Surface};
use proptest::prelude::*;

/// Cox–de Boor recursion straight from the definition, with 0/0 = 0; the last span is closed at the right.
fn basis_function(knots: &[f64], i: usize, degree: usize, t: f64, end: f64) -> f64 {
    if degree == 0 {
        let inside = knots[i] <= t && t < knots[i + 1];
        let last = t == end && knots[i] < knots[i + 1] && knots[i + 1] == end;
        return if inside || last { 1.0 } else { 0.0 };
    }
    let ratio = |a: f64, b: f64| if b == 0.0 { 0.0 } else { a / b };
    ratio(t - knots[i], knots[i + degree] - knots[i]) * basis_function(knots, i, degree - 1, t, end)
        + ratio(knots[i + degree + 1] - t, knots[i + degree + 1] - knots[i + 1])
            * basis_function(knots, i + 1, degree - 1, t, end)
}

fn reference(curve: &Curve, t: f64) -> Point {
    let end = curve.domain()[1];
    let sum = curve
        .points
        .iter()
        .enumerate()
        .fold(Homogeneous::ZERO, |s, (i, &p)| s + p * basis_function(&curve.knots, i, curve.degree, t, end));
    sum.truncate() / sum.w
}

/// The tensor product by the definition: Σᵢⱼ Nᵢ(u) Nⱼ(v) Pᵢⱼ, of points that stand row by row of constant u.
fn surface_reference(surface: &Surface, uv: Uv) -> Point {
    let [degree_u, degree_v] = surface.degree;
    let [knots_u, knots_v] = &surface.knots;
    let [[_, end_u], [_, end_v]] = surface.domain();
    let columns = knots_v.len() - degree_v - 1;
    let sum = surface.points.iter().enumerate().fold(Homogeneous::ZERO, |sum, (k, &point)| {
        let along_u = basis_function(knots_u, k / columns, degree_u, uv.x, end_u);
        sum + point * along_u * basis_function(knots_v, k % columns, degree_v, uv.y, end_v)
    });
    sum.truncate() / sum.w
}

/// Value, first and second derivative of the numerator and weight, each by the definition: the derivative of a B-spline has
/// the control points `p·(P[i+1] − P[i])/(t[i+p+1] − t[i+1])` one degree lower.
fn homogeneous_derivatives(curve: &Curve, t: f64) -> [Homogeneous; 3] {
    let end = curve.domain()[1];
    let (mut knots, mut points, mut degree) = (curve.knots.clone(), curve.points.clone(), curve.degree);
    let mut result = [Homogeneous::ZERO; 3];
    for value in &mut result {
        for (i, &p) in points.iter().enumerate() {
            *value += p * basis_function(&knots, i, degree, t, end);
        }
        if degree == 0 {
            break;
        }
        points = (0..points.len() - 1)
            .map(|i| {
                let width = knots[i + degree + 1] - knots[i + 1];
                if width == 0.0 { Homogeneous::ZERO } else { (points[i + 1] - points[i]) * (degree as f64 / width) }
            })
            .collect();
        knots = knots[1..knots.len() - 1].to_vec();
        degree -= 1;
    }
    result
}

fn knots(degree: usize) -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec((0.05..2.0f64, 1..=degree), 0..5).prop_map(move |inner| {
        let mut knots = vec![-0.5; degree + 1];
        let mut at = -0.5;
        for (gap, multiplicity) in inner {
            at += gap;
            knots.extend(std::iter::repeat_n(at, multiplicity));
        }
        knots.extend(std::iter::repeat_n(at + 0.7, degree + 1));
        knots
    })
}

fn control_points(n: usize) -> impl Strategy<Value = Vec<Homogeneous>> {
    let one = (prop::array::uniform3(-10.0..10.0f64), -2.0..2.0f64);
    prop::collection::vec(one, n)
        .prop_map(|v| v.into_iter().map(|(p, w)| Homogeneous::weighted(p.into(), 10f64.powf(w))).collect())
}

fn curves() -> impl Strategy<Value = Curve> {
    (1usize..=7).prop_flat_map(|degree| (Just(degree), knots(degree))).prop_flat_map(|(degree, knots)| {
        control_points(knots.len() - degree - 1).prop_map(move |points| Curve {
            degree,
            knots: knots.clone(),
            points,
        })
    })
}

fn surfaces() -> impl Strategy<Value = Surface> {
    (1usize..=4, 1usize..=4).prop_flat_map(|(p, q)| (Just([p, q]), knots(p), knots(q))).prop_flat_map(
        |(degree, ku, kv)| {
            let n = (ku.len() - degree[0] - 1) * (kv.len() - degree[1] - 1);
            control_points(n).prop_map(move |points| Surface { degree, knots: [ku.clone(), kv.clone()], points })
        },
    )
}

/// A place strictly inside the domain or at its ends.
fn at([a, b]: [f64; 2], s: f64) -> f64 {
    if s == 1.0 { b } else { a + s * (b - a) }
}

proptest! {
    #[test]
    fn evaluation_is_the_definition(curve in curves(), s in 0.0..=1.0f64) {
        let t = at(curve.domain(), s);
        prop_assert!((curve.evaluate(t) - reference(&curve, t)).length() < 1e-11);
    }

    #[test]
    fn cutting_and_splitting_change_no_point(curve in curves(), s in prop::array::uniform3(0.0..=1.0f64)) {
        let domain = curve.domain();
        let (a, b) = (at(domain, s[0].min(s[1])), at(domain, s[0].max(s[1])));
        prop_assume!(b - a > 1e-6);
        let cut = curve.restricted(a, b);
        prop_assert!(cut.is_clamped());
        prop_assert_eq!(cut.domain(), [a, b]);
        let t = at([a, b], s[2]);
        prop_assert!((cut.evaluate(t) - reference(&curve, t)).length() < 1e-9, "{} at {t}", curve.degree);
        prop_assert!((cut.points[0].position() - curve.evaluate(a)).length() < 1e-9);
    }

    #[test]
    fn bezier_pieces_are_the_curve(curve in curves(), s in 0.0..=1.0f64) {
        for (piece, ends) in curve.bezier_pieces().into_iter().zip(curve.breakpoints().windows(2)) {
            let n = curve.degree;
            let alone = Curve { degree: n, knots: [vec![0.0; n + 1], vec![1.0; n + 1]].concat(), points: piece };
            let t = at([ends[0], ends[1]], s);
            // At an inner full knot the curve takes its right limit; compare left of it.
            if s < 1.0 {
                prop_assert!((alone.evaluate(s) - reference(&curve, t)).length() < 1e-9);
            }
        }
    }

    #[test]
    fn patches_and_isolines_are_the_surface(surface in surfaces(), s in 0.0..1.0f64, r in 0.0..1.0f64) {
        for patch in surface.bezier_patches() {
            let uv = patch.surface_uv(Uv::new(s, r));
            let here = surface_reference(&surface, uv);
            prop_assert!((surface.evaluate(uv) - here).length() < 1e-9);
            let local = patch.local_jet(Uv::new(s, r))[0].position();
            prop_assert!((local - here).length() < 1e-9);
            prop_assert!((surface.isoline(0, uv.x).evaluate(uv.y) - here).length() < 1e-9);
            prop_assert!((surface.isoline(1, uv.y).evaluate(uv.x) - here).length() < 1e-9);
            prop_assert!(patch.bounds().grown(1e-9).contains(here));
        }
    }

    #[test]
    fn derivatives_are_those_of_the_hodograph(surface in surfaces(), s in 0.0..1.0f64, r in 0.0..1.0f64) {
        let [[u0, u1], [v0, v1]] = surface.domain();
        let uv = Uv::new(at([u0, u1], s), at([v0, v1], r));
        let d = surface.second_derivatives(uv);
        for (curve, t, first, second) in
            [(surface.isoline(1, uv.y), uv.x, d.du, d.duu), (surface.isoline(0, uv.x), uv.y, d.dv, d.dvv)]
        {
            let [a, a1, a2] = homogeneous_derivatives(&curve, t);
            let point = a.truncate() / a.w;
            let expected = (a1.truncate() - point * a1.w) / a.w;
            prop_assert!((first - expected).length() < 1e-9 * (a1.length() / a.w + 1.0));
            let expected = (a2.truncate() - expected * (2.0 * a1.w) - point * a2.w) / a.w;
            let scale = (a2.length() + 2.0 * a1.length() * a1.w.abs() / a.w) / a.w + 1.0;
            prop_assert!((second - expected).length() < 1e-8 * scale);
        }
    }
}
