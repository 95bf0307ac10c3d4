//! How far a border edge's curve strays from its chord, in space and in parameters.

use super::bound::Prover;
use super::flat::from_chord;
use super::sheet::Sheet;
use crate::math::{Point, Uv};
use crate::model::EdgeUse;
use crate::nurbs::Curve;

/// One chord of a border edge.
#[derive(Clone, Debug, Default)]
pub(super) struct Trim {
    /// Bound of the distance between the edge's curve and the line of the chord, mm, with the offset of the chord's ends
    /// from the surface.
    pub(super) deviation: f64,
    /// The file's own gap between edge and face here, mm, which no shorter chord closes.
    pub(super) gap: f64,
    /// Parameter triangles that cover what lies between the chord and the curve in the parameter plane.
    pub(super) between: Vec<[Uv; 3]>,
}

impl Trim {
    pub(super) fn new(
        sheet: &Sheet<'_>,
        curve: &Curve,
        side: &EdgeUse,
        t: [f64; 2],
        uv: [Uv; 2],
        xyz: [Point; 2],
    ) -> Self {
        let (a, b) = (t[0].min(t[1]), t[0].max(t[1]));
        // The file's own gap between edge and face, as measured at the ends and at places between.
        let gap = |f: f64| {
            let at = a + (b - a) * f;
            (sheet.point(sheet.surface.clamp(side.uv.evaluate(at))) - curve.evaluate(at)).length()
        };
        let ends = [0, 1].map(|i| (sheet.point(uv[i]) - xyz[i]).length());
        let offset = [0.2, 0.4, 0.6, 0.8].map(gap).into_iter().fold(ends[0].max(ends[1]), f64::max);
        if a >= b || a.is_nan() || b.is_nan() {
            return Self { deviation: offset, gap: offset, between: Vec::new() };
        }
        let over = |pieces: i32| {
            let cut = |k: i32| if k == pieces { b } else { a + (b - a) * k as f64 / pieces as f64 };
            let mut worst = 0f64;
            for k in 0..pieces {
                if cut(k) < cut(k + 1) {
                    let piece = curve.restricted_points(cut(k), cut(k + 1));
                    worst = piece.iter().map(|p| from_chord(p.project(), &xyz)).fold(worst, f64::max);
                }
            }
            worst
        };
        let mut deviation = over(if curve.degree == 1 { 1 } else { 2 });
        if curve.degree > 1 && deviation + offset > 0.5 * sheet.field.tightest() {
            deviation = over(8);
        }
        let mut trim = Self { deviation: deviation + offset, gap: offset, between: Vec::new() };
        if !sheet.affine {
            trim.between = fan(sheet, side, [a, b], uv);
        }
        trim
    }

    /// The part of the bound that the border adds to a triangle of facets.
    pub(super) fn bound(&self, prover: &mut Prover<'_, '_>, xyz: [Point; 3], limit: f64) -> f64 {
        let mut worst = self.deviation;
        for &uv in &self.between {
            if worst > limit {
                break;
            }
            worst = worst.max(prover.piece(uv, xyz, limit));
        }
        worst
    }
}

/// Triangles over the convex hull of the curve's control points in the parameter plane.
fn fan(sheet: &Sheet<'_>, side: &EdgeUse, [a, b]: [f64; 2], chord: [Uv; 2]) -> Vec<[Uv; 3]> {
    let [[u0, u1], [v0, v1]] = sheet.surface.domain();
    let extent = Uv::new(u1 - u0, v1 - v0);
    let [s0, s1] = side.uv.domain();
    let (a, b) = (a.clamp(s0, s1), b.clamp(s0, s1));
    if a >= b || a.is_nan() || b.is_nan() {
        return Vec::new();
    }
    let m = 0.5 * (a + b);
    let pieces = if side.uv.degree == 1 { vec![[a, b]] } else { vec![[a, m], [m, b]] };
    let mut points: Vec<Uv> = pieces
        .iter()
        .filter(|p| p[0] < p[1])
        .flat_map(|&[a, b]| side.uv.restricted_points(a, b))
        .map(|p| sheet.surface.clamp(p.truncate() / p.z))
        .collect();
    let d = (chord[1] - chord[0]) / extent;
    let off = |p: Uv| {
        let x = (p - chord[0]) / extent;
        if d.length() > 0.0 { x.perp_dot(d).abs() / d.length() } else { x.length() }
    };
    if points.iter().all(|&p| off(p) < 1e-12) {
        return Vec::new();
    }
    points.extend(chord);
    let hull = hull(points);
    (1..hull.len().saturating_sub(1)).map(|k| [hull[0], hull[k], hull[k + 1]]).collect()
}

/// Convex hull, counter-clockwise (Andrew's monotone chain).
fn hull(mut p: Vec<Uv>) -> Vec<Uv> {
    p.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    p.dedup();
    let half = |points: &mut dyn Iterator<Item = Uv>| {
        let mut h: Vec<Uv> = Vec::new();
        for q in points {
            while h.len() >= 2 && (h[h.len() - 1] - h[h.len() - 2]).perp_dot(q - h[h.len() - 1]) <= 0.0 {
                h.pop();
            }
            h.push(q);
        }
        h.pop();
        h
    };
    let mut lower = half(&mut p.iter().copied());
    lower.extend(half(&mut p.iter().rev().copied()));
    lower
}
