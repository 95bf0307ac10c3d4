//! Each edge is sampled once, in space, for the tighter of its faces; both faces use those very points.

use super::opposite;
use crate::math::{Point, Uv, Vector};
use crate::model::{Edge, EdgeUse, Face, Part};
use crate::nurbs::Curve;
use crate::tessellate::proof::flat::from_chord;
use crate::tessellate::sheet::{CREASE, Sheet};
use rayon::prelude::*;
use smallvec::SmallVec;

/// Share of the tolerance that chords of edges may take; the rest is left to rounding and to the proof's slack.
const SHARE: f64 = 0.96;
/// Samples that look at a curve's shape before it is divided.
const LOOKS: usize = 64;
/// Most chords of one edge.
const MOST: usize = 20_000;

/// One side of an edge on a face.
pub(in crate::tessellate) struct Side<'s, 'a> {
    pub(in crate::tessellate) sheet: &'s Sheet<'a>,
    pub(in crate::tessellate) side: &'s EdgeUse,
}

/// Where an edge is divided: parameters ascending, ends included.
#[derive(Clone, Debug, Default)]
pub(in crate::tessellate) struct Division {
    pub(in crate::tessellate) t: Vec<f64>,
    /// Index of the first inner point among the part's shared positions.
    pub(in crate::tessellate) first: u32,
}

/// Divides all edges of a part (`alone` keeps how often each was asked for more and what it then had by itself), and returns the shared positions: vertices, then inner points edge by edge.
pub(in crate::tessellate) fn divide(
    part: &Part,
    faces: &[(&Face, &Sheet<'_>)],
    sides: &[Vec<Side<'_, '_>>],
    denser: &[u32],
    alone: &mut Vec<(u32, Vec<f64>)>,
) -> (Vec<Division>, Vec<Point>) {
    let fresh = |(i, (edge, sides)): (usize, (&Edge, &Vec<Side<'_, '_>>))| match alone.get(i) {
        Some((before, t)) if *before == denser[i] => (*before, t.clone()),
        _ if sides.is_empty() => (denser[i], edge.curve.domain().to_vec()),
        _ => (denser[i], edge_parameters(&edge.curve, sides, denser[i])),
    };
    *alone = part.edges.par_iter().zip(sides).enumerate().map(fresh).collect();
    let mut times: Vec<Vec<f64>> = alone.iter().map(|(_, t)| t.clone()).collect();
    opposite::align(part, faces, sides, denser, &mut times);
    open_lenses(part, faces, &mut times);
    part_twins(part, sides, &mut times);
    let inner = |(edge, t): (&Edge, &Vec<f64>)| -> Vec<Point> {
        t[1..t.len() - 1].iter().map(|&t| edge.curve.evaluate(t)).collect()
    };
    let inner: Vec<Vec<Point>> = part.edges.par_iter().zip(&times).with_min_len(16).map(inner).collect();
    let mut divisions = Vec::with_capacity(times.len());
    let mut positions = part.vertices.clone();
    for (inner, t) in inner.into_iter().zip(times) {
        divisions.push(Division { t, first: positions.len() as u32 });
        positions.extend(inner);
    }
    (divisions, positions)
}

/// Edges around a face that all are one chord between the same two places leave nothing of it, be they two or the seam of a sphere that runs
/// from pole to pole: the one that bends most gets a corner.
fn open_lenses(part: &Part, faces: &[(&Face, &Sheet<'_>)], times: &mut [Vec<f64>]) {
    for trim in faces.iter().flat_map(|(face, _)| &face.loops).filter(|l| l.uses.len() <= 4) {
        let edges: SmallVec<[usize; 4]> = trim.uses.iter().filter_map(|u| Some(u.edge?.0 as usize)).collect();
        if edges.len() < 2 || edges.iter().any(|&e| times.get(e).is_none_or(|t| t.len() != 2)) {
            continue;
        }
        let chord = |e: usize| {
            let [a, b] = part.edges[e].vertices;
            [a.0.min(b.0), a.0.max(b.0)]
        };
        if edges.iter().any(|&e| chord(e) != chord(edges[0])) {
            continue;
        }
        let off = |e: usize| {
            let (curve, t) = (&part.edges[e].curve, &times[e]);
            from_chord(curve.evaluate(0.5 * (t[0] + t[1])), &[curve.evaluate(t[0]), curve.evaluate(t[1])])
        };
        let most = edges.iter().rev().map(|&e| (off(e), e)).max_by(|x, y| x.0.total_cmp(&y.0));
        if let Some((_, e)) = most.filter(|x| x.0 > 0.0) {
            bisect_all(&mut times[e]);
        }
    }
}

/// Several edges between the same two vertices that all are one chord would be one edge of the mesh with more than two facets: all but
/// the straightest get a corner.
fn part_twins(part: &Part, sides: &[Vec<Side<'_, '_>>], times: &mut [Vec<f64>]) {
    let chord = |e: usize| {
        let [a, b] = part.edges[e].vertices;
        [a.0.min(b.0), a.0.max(b.0)]
    };
    let mut single: Vec<usize> =
        (0..times.len()).filter(|&e| times[e].len() == 2 && !sides[e].is_empty()).collect();
    single.sort_unstable_by_key(|&e| (chord(e), e));
    for twins in single.chunk_by(|&a, &b| chord(a) == chord(b)).filter(|t| t.len() > 1) {
        let middle = |e: usize| part.edges[e].curve.evaluate(0.5 * (times[e][0] + times[e][1]));
        let off = |e: usize| from_chord(middle(e), &[0, 1].map(|i| part.edges[e].curve.evaluate(times[e][i])));
        let mut bent: Vec<(f64, usize)> = twins.iter().map(|&e| (off(e), e)).collect();
        bent.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        // One edge that stands twice in a file stays one.
        let straightest = middle(bent[0].1);
        bent.retain(|&(off, e)| off > 0.0 && (middle(e) - straightest).length() > 1e-3 * off);
        for (_, e) in bent {
            bisect_all(&mut times[e]);
        }
    }
}

/// Tolerance for chords of a curve on a face at `uv`, running along `along` there: all of the face's tolerance where
/// the face is straight across the curve, half of it where it bends that way too.
fn chord_tolerance(sheet: &Sheet<'_>, uv: Uv, along: Vector) -> f64 {
    if sheet.affine {
        return sheet.field.loosest();
    }
    let xi = sheet.tolerance(uv);
    let d = sheet.second_derivatives(uv);
    let Some(forms) = crate::nurbs::FundamentalForms::new(&d) else { return 0.5 * xi };
    // The direction across, in parameters: orthogonal to `along` in the tangent plane.
    let across = forms.normal.cross(along);
    let ([e, f, g], det) = (forms.first, forms.first[0] * forms.first[2] - forms.first[1] * forms.first[1]);
    let (x, y) = (across.dot(d.du), across.dot(d.dv));
    let direction = Uv::new((g * x - f * y) / det, (e * y - f * x) / det);
    let sag = forms.along(direction).abs() * (0.25 * sheet.size).powi(2) / 8.0;
    let xi = xi.min(sheet.field.turning(forms.sharpest()));
    xi * (1.0 - (sag / xi).min(0.5))
}

/// Tolerance for chords of an edge on all of its faces.
fn tightest(sides: &[Side<'_, '_>], denser: u32, t: f64, along: Vector) -> f64 {
    let each = sides.iter().map(|s| chord_tolerance(s.sheet, s.sheet.surface.clamp(s.side.uv.evaluate(t)), along));
    SHARE * each.fold(f64::INFINITY, f64::min) / 4f64.powi(denser as i32)
}

fn edge_parameters(curve: &Curve, sides: &[Side<'_, '_>], denser: u32) -> Vec<f64> {
    // A straight edge is one chord, whatever its faces ask.
    let t = if curve.degree == 1 && curve.points.len() == 2 {
        curve.domain().to_vec()
    } else {
        parameters(&breaks(curve), |t| curve.evaluate(t), |t, along| tightest(sides, denser, t, along))
    };
    let mut t = beside(curve, sides, denser, t);
    let (first, last) = (curve.evaluate(t[0]), curve.evaluate(t[t.len() - 1]));
    let closed = (first - last).length() <= 1e-9 + 1e-9 * curve.bounds().diagonal();
    let fewest = if closed { 3 } else { 1 };
    while t.len() <= fewest {
        bisect_all(&mut t);
    }
    t
}

/// Divides further where a chord of given samples is too long.
pub(in crate::tessellate) fn hold(curve: &Curve, sides: &[Side<'_, '_>], denser: u32, mut t: Vec<f64>) -> Vec<f64> {
    shorten(&mut t, |t| curve.evaluate(t), |t, along| tightest(sides, denser, t, along));
    beside(curve, sides, denser, t)
}

/// In the parameter plane the chord must stay by its curve too, or loops would cross; closer still where facets beside it could not
/// be proved. What the file's own gap takes no division gives back: a gap of 9 mm once made 67,000 chords.
fn beside(curve: &Curve, sides: &[Side<'_, '_>], denser: u32, mut t: Vec<f64>) -> Vec<f64> {
    cross_creases(curve, sides, &mut t);
    let at = |t: f64| curve.evaluate(t);
    let slack = |s: &Side<'_, '_>| 2.0 * s.sheet.field.tightest() / 4f64.powi(denser as i32);
    bisect(&mut t, |a, b| {
        let chord = [at(a), at(b)];
        sides.iter().any(|s| {
            let (ua, ub) = (s.side.uv.evaluate(a), s.side.uv.evaluate(b));
            [0.25, 0.5, 0.75].iter().any(|&f| {
                let on = s.sheet.point(s.sheet.surface.clamp(ua.lerp(ub, f)));
                // At the same parameter it is usually close enough; only else is the nearest point looked for.
                if (on - at(a + (b - a) * f)).length() <= slack(s) {
                    return false;
                }
                let near = nearest_on(&at, a, b, on);
                let off = (on - near).length();
                if off <= slack(s) || denser == 0 && off <= 0.02 * (chord[1] - chord[0]).length() {
                    return false;
                }
                let t = a + (b - a) * f;
                let gap = (s.sheet.point(s.sheet.surface.clamp(s.side.uv.evaluate(t))) - at(t)).length();
                off > slack(s) + 2.0 * gap
            })
        })
    });
    t
}

/// Adds corners where the edge crosses sharp creases of its faces.
fn cross_creases(curve: &Curve, sides: &[Side<'_, '_>], t: &mut Vec<f64>) {
    let mut found: Vec<f64> = Vec::new();
    for s in sides.iter().filter(|s| s.sheet.is_sharp()) {
        for (d, creases) in s.sheet.sharp.iter().enumerate() {
            let near = CREASE * s.sheet.extent()[d];
            let at = |t: f64| s.side.uv.evaluate(t)[d];
            for (pair, &crease) in t.windows(2).flat_map(|pair| creases.iter().map(move |c| (pair, c))) {
                let (mut lo, mut hi) = (pair[0], pair[1]);
                let (x, y) = (at(lo) - crease, at(hi) - crease);
                if x * y >= 0.0 || x.abs() <= near || y.abs() <= near {
                    continue;
                }
                for _ in 0..60 {
                    let m = 0.5 * (lo + hi);
                    if (at(m) < crease) == (x < 0.0) { lo = m } else { hi = m }
                }
                // Uneven weights crowd parameters: far from both ends there, it may be in the very place of one.
                let (m, least) = (0.5 * (lo + hi), 1e-3 * s.sheet.field.tightest());
                let p = curve.evaluate(m);
                if pair.iter().all(|&end| (curve.evaluate(end) - p).length() > least) {
                    found.push(m);
                }
            }
        }
    }
    // Both faces may have the same crease there.
    found.sort_by(f64::total_cmp);
    let least = sides.iter().map(|s| 1e-3 * s.sheet.field.tightest()).fold(f64::INFINITY, f64::min);
    found.dedup_by(|b, a| (curve.evaluate(*a) - curve.evaluate(*b)).length() <= least);
    t.extend(found);
    t.sort_by(f64::total_cmp);
}

/// Distance-wise nearest of a few points of the curve over `[a, b]`, refined once.
fn nearest_on(at: &impl Fn(f64) -> Point, a: f64, b: f64, p: Point) -> Point {
    let (mut lo, mut hi) = (a, b);
    let mut best = at(0.5 * (a + b));
    for _ in 0..3 {
        let n = 6;
        let k = (0..=n)
            .min_by(|&i, &j| {
                let d = |k: i32| (at(lo + (hi - lo) * k as f64 / n as f64) - p).length();
                d(i).total_cmp(&d(j))
            })
            .unwrap_or(0);
        let step = (hi - lo) / n as f64;
        let x = lo + step * k as f64;
        best = at(x);
        (lo, hi) = ((x - step).max(a), (x + step).min(b));
    }
    best
}

/// The ends of a curve and the kinks between them, with enough looks in each piece.
pub(in crate::tessellate) fn breaks(curve: &Curve) -> Vec<f64> {
    let b = curve.breakpoints();
    let n = b.len();
    let kink = |i: usize| {
        let k = b[i];
        if curve.knots.iter().filter(|&&x| x == k).count() < curve.degree {
            return false;
        }
        let step = 1e-6 * (b[i + 1] - k).min(k - b[i - 1]);
        let tangent = |t: f64| curve.derivatives(t).first.try_normalize();
        match (tangent(k - step), tangent(k + step)) {
            (Some(x), Some(y)) => x.cross(y).length() > 0.05 || x.dot(y) < 0.0,
            _ => false,
        }
    };
    (0..n).filter(|&i| i == 0 || i + 1 == n || kink(i)).map(|i| b[i]).collect()
}

/// Parameters so that chords stay within the tolerance, spread evenly in `√(curvature / tolerance)`.
pub(in crate::tessellate) fn parameters(
    breaks: &[f64],
    at: impl Fn(f64) -> Point,
    tolerance: impl Fn(f64, Vector) -> f64,
) -> Vec<f64> {
    let mut t = vec![breaks[0]];
    for pair in breaks.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let looks = if breaks.len() > 10 { 8 } else { LOOKS };
        let ts: Vec<f64> = (0..=looks).map(|i| a + (b - a) * i as f64 / looks as f64).collect();
        let p: Vec<Point> = ts.iter().map(|&t| at(t)).collect();
        // Curvature at each look from the circle through three points; ends take their neighbour's.
        let bend = |i: usize| {
            let i = i.clamp(1, looks - 1);
            let (x, y) = (p[i] - p[i - 1], p[i + 1] - p[i]);
            let scale = x.length() * y.length() * (p[i + 1] - p[i - 1]).length();
            if scale > 0.0 { 2.0 * x.cross(y).length() / scale } else { 0.0 }
        };
        let chord = [p[0], p[looks]];
        if p.iter().all(|&q| from_chord(q, &chord) <= 1e-12 * (p[looks] - p[0]).length()) {
            t.push(b);
            continue;
        }
        // Tolerances vary slowly: every fourth look asks for its own.
        let own = |i: usize| tolerance(ts[i], p[(i + 1).min(looks)] - p[i.saturating_sub(1)]);
        let some: Vec<f64> = (0..=looks / 4).map(|k| own(4 * k)).collect();
        let density = |i: usize| {
            let (k, f) = (i / 4, (i % 4) as f64 / 4.0);
            let xi = some[k] + (some[(k + 1).min(looks / 4)] - some[k]) * f;
            (bend(i) / (8.0 * xi)).sqrt()
        };
        let d: Vec<f64> = (0..=looks).map(density).collect();
        let mut sum = vec![0.0];
        for i in 0..looks {
            sum.push(sum[i] + 0.5 * (d[i] + d[i + 1]) * (p[i + 1] - p[i]).length());
        }
        let total = sum[looks];
        let mut n = if total.is_finite() { (total - 1e-3).ceil().clamp(1.0, MOST as f64) } else { 1.0 };
        let spread = |n: f64| -> Vec<f64> {
            let inner = (1..n as usize).map(|k| {
                let goal = total * k as f64 / n;
                let i = sum.partition_point(|&s| s <= goal).clamp(1, looks) - 1;
                ts[i] + (ts[i + 1] - ts[i]) * (goal - sum[i]) / (sum[i + 1] - sum[i])
            });
            inner.collect()
        };
        let mut inner = spread(n);
        // The looks' own chords miss a little of the curve: ask for more while the worst chord is too long.
        for _ in 0..3 {
            let ends = |k: usize| if k == 0 { a } else { inner.get(k - 1).copied().unwrap_or(b) };
            let excess = |k: usize| {
                let (x, y) = (ends(k), ends(k + 1));
                let i = (4.0 * ((0.5 * (x + y) - a) / (b - a) * (looks / 4) as f64)) as usize / 4;
                from_chord(at(0.5 * (x + y)), &[at(x), at(y)]) / some[i.min(looks / 4)]
            };
            let worst = (0..=inner.len()).map(excess).fold(0.0, f64::max);
            if worst <= 1.02 || worst > 2.0 {
                break;
            }
            n = (n * worst.sqrt()).ceil().max(n + 1.0);
            inner = spread(n);
        }
        t.extend(inner);
        t.push(b);
    }
    shorten(&mut t, at, tolerance);
    t
}

/// Halves chords that stray too far from the curve.
fn shorten(t: &mut Vec<f64>, at: impl Fn(f64) -> Point, tolerance: impl Fn(f64, Vector) -> f64) {
    bisect(t, |a, b| {
        let chord = [at(a), at(b)];
        let along = chord[1] - chord[0];
        let xi = tolerance(0.5 * (a + b), along) * 1.03;
        [0.2, 0.35, 0.5, 0.65, 0.8].iter().any(|f| from_chord(at(a + (b - a) * f), &chord) > xi)
    });
}

/// Halves intervals until `coarse` holds for none.
fn bisect(t: &mut Vec<f64>, coarse: impl Fn(f64, f64) -> bool) {
    let mut out = Vec::with_capacity(t.len());
    for pair in t.windows(2) {
        let mut stack = vec![(pair[0], pair[1], 0)];
        while let Some((a, b, depth)) = stack.pop() {
            let m = 0.5 * (a + b);
            if depth < 12 && a < m && m < b && out.len() < MOST && coarse(a, b) {
                stack.push((m, b, depth + 1));
                stack.push((a, m, depth + 1));
            } else {
                out.push(a);
            }
        }
    }
    out.extend(t.last());
    *t = out;
}

fn bisect_all(t: &mut Vec<f64>) {
    let mut out = Vec::with_capacity(2 * t.len());
    for pair in t.windows(2) {
        out.extend([pair[0], 0.5 * (pair[0] + pair[1])]);
    }
    out.extend(t.last());
    *t = out;
}
