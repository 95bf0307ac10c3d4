//! Every promise of a tessellation, looked at by sampling that shares nothing with the bound: splines by de Boor's recursion, the
//! piece of a facet as its triangle of parameters with the trim's own curve for a side, cut up until it is flat.

use super::pieces::{Poles, pieces};
use lampyris::math::{Homogeneous, Point, Uv, Vector};
use lampyris::model::{Face, Model};
use lampyris::nurbs::Surface;
use lampyris::tessellate::Tessellation;
use std::collections::HashMap;

/// The point of a curve by de Boor's recursion, in the span that ends before `t` where `left`.
fn de_boor(knots: &[f64], degree: usize, points: &[Homogeneous], t: f64, left: bool) -> Homogeneous {
    let n = points.len();
    let inside = |k: &f64| if left { *k < t } else { *k <= t };
    let span = (knots[..n].partition_point(inside).max(degree + 1) - 1).min(n - 1);
    let mut d = [Homogeneous::ZERO; 12];
    d[..=degree].copy_from_slice(&points[span - degree..=span]);
    for r in 1..=degree {
        for j in (r..=degree).rev() {
            let i = j + span - degree;
            let f = (t - knots[i]) / (knots[i + degree + 1 - r] - knots[i]);
            d[j] = d[j - 1] * (1.0 - f) + d[j] * f;
        }
    }
    d[degree]
}

/// Position and both derivatives, each parameter's span to the left or right of it.
pub(crate) fn look(s: &Surface, uv: Uv, left: [bool; 2]) -> (Point, [Vector; 2]) {
    let [p, q] = s.degree;
    let m = s.points.len() / (s.knots[0].len() - p - 1);
    let change = |knots: &[f64], degree: usize, points: &[Homogeneous]| -> Vec<Homogeneous> {
        let step = |i: usize| (knots[i + degree + 1] - knots[i + 1]).max(1e-300);
        (0..points.len() - 1).map(|i| (points[i + 1] - points[i]) * (degree as f64 / step(i))).collect()
    };
    let rows: Vec<&[Homogeneous]> = s.points.chunks_exact(m).collect();
    let along = |f: &dyn Fn(&[Homogeneous]) -> Homogeneous| rows.iter().map(|r| f(r)).collect::<Vec<_>>();
    let (ku, kv) = (&s.knots[0][..], &s.knots[1][..]);
    let at = along(&|r| de_boor(kv, q, r, uv.y, left[1]));
    let dv = along(&|r| de_boor(&kv[1..kv.len() - 1], q - 1, &change(kv, q, r), uv.y, left[1]));
    let a = de_boor(ku, p, &at, uv.x, left[0]);
    let av = de_boor(ku, p, &dv, uv.x, left[0]);
    let au = de_boor(&ku[1..ku.len() - 1], p - 1, &change(ku, p, &at), uv.x, left[0]);
    let point = a.truncate() / a.w;
    (point, [au, av].map(|d| (d.truncate() - point * d.w) / a.w))
}

/// The point alone.
pub(crate) fn place(s: &Surface, uv: Uv) -> Point {
    let [p, q] = s.degree;
    let m = s.points.len() / (s.knots[0].len() - p - 1);
    let n = s.points.len() / m;
    let span = (s.knots[0][..n].partition_point(|k| *k <= uv.x).max(p + 1) - 1).min(n - 1);
    let mut at = [Homogeneous::ZERO; 12];
    for (k, slot) in at[..=p].iter_mut().enumerate() {
        let i = span - p + k;
        *slot = de_boor(&s.knots[1], q, &s.points[i * m..(i + 1) * m], uv.y, false);
    }
    let a = de_boor(&s.knots[0][span - p..=span + p + 1], p, &at[..=p], uv.x, false);
    a.truncate() / a.w
}

/// Distance of a point to a triangle: to its plane over its inside, else to the nearest of its sides.
pub(crate) fn to_triangle(p: Point, [a, b, c]: [Point; 3]) -> f64 {
    let side = |x: Point, y: Point| {
        let l = (y - x).length_squared();
        let t = if l > 0.0 { ((p - x).dot(y - x) / l).clamp(0.0, 1.0) } else { 0.0 };
        (x + (y - x) * t - p).length()
    };
    let sides = side(a, b).min(side(b, c)).min(side(c, a));
    let (e, f, g) = (b - a, c - a, p - a);
    let (ee, ef, ff, ge, gf) = (e.dot(e), e.dot(f), f.dot(f), g.dot(e), g.dot(f));
    let det = ee * ff - ef * ef;
    if det <= 1e-14 * ee * ff {
        return sides;
    }
    let (s, t) = ((ff * ge - ef * gf) / det, (ee * gf - ef * ge) / det);
    if s >= 0.0 && t >= 0.0 && s + t <= 1.0 { sides.min((g - e * s - f * t).length()) } else { sides }
}

/// A triangle of parameters and its corners in space.
type Bit = [(Uv, Point); 3];

/// Most bits that a piece is cut into.
const MOST_BITS: usize = 3000;

/// A piece cut up until its bits are flat to within `fine` and no larger than `size`.
fn bits(s: &Surface, piece: &[[Uv; 3]], [fine, size]: [f64; 2]) -> Vec<Bit> {
    let at = |uv: Uv| (uv, place(s, uv));
    let mut open: std::collections::VecDeque<Bit> = piece.iter().map(|t| t.map(at)).collect();
    let mut out = Vec::new();
    while let Some(t) = open.pop_front() {
        // Middles of its sides and its centre show how it bends; the side that is longest or bends most is halved.
        let middle = [0, 1, 2].map(|k| at(t[k].0.lerp(t[(k + 1) % 3].0, 0.5)));
        let off = [0, 1, 2].map(|k| (middle[k].1 - t[k].1.lerp(t[(k + 1) % 3].1, 0.5)).length());
        let long = [0, 1, 2].map(|k| (t[(k + 1) % 3].1 - t[k].1).length());
        let need = |k: usize| (off[k] / fine).max(long[k] / size);
        let k = (0..3).max_by(|&a, &b| need(a).total_cmp(&need(b))).unwrap();
        if need(k) <= 1.0 || out.len() + open.len() >= MOST_BITS {
            out.push(t);
            continue;
        }
        let (a, b, c, m) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3], middle[k]);
        open.extend([[a, m, c], [m, b, c]]);
    }
    out
}

/// What was found besides broken promises.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Found {
    pub(crate) facets: usize,
    pub(crate) proved: usize,
    /// Largest sampled distance of a proved facet from the surface and back, in its tolerance.
    pub(crate) worst: [f64; 2],
}

/// Looks at all promises of a model that stands at the origin, unscaled, whose trims stray up to `gap` from their edges; the first
/// that is broken is reported.
pub(crate) fn judge(model: &Model, made: &Tessellation, gap: f64) -> Result<Found, String> {
    let mut found = Found { facets: made.mesh.facets.len(), ..Found::default() };
    if made.report.faces.failed > 0 {
        return Err(format!("{} faces failed", made.report.faces.failed));
    }
    let certified = made.quality.iter().filter(|q| q.certified).count();
    if certified != made.report.certified {
        return Err("certified facets are counted wrongly".into());
    }
    found.proved = certified;
    watertight(model, made)?;
    let faces: Vec<&Face> = model.placed_faces().filter_map(|f| f.face).collect();
    let mut start = 0;
    for (i, face) in faces.iter().enumerate() {
        let end = start + made.mesh.facets[start..].iter().take_while(|f| f.face.index() == i).count();
        if start == end {
            return Err(format!("face {i} has no facets"));
        }
        corners(face, made, start..end, gap)?;
        let pieces = pieces(face, made, start..end).map_err(|e| format!("face {i}: {e}"))?;
        for (f, piece) in (start..end).zip(pieces) {
            let q = made.quality[f];
            if q.certified != (q.bound <= q.tolerance) {
                return Err(format!("facet {f}: {q:?}"));
            }
            if q.certified {
                let off = sag(&face.surface, made, f, &piece);
                let ratio = off.map(|x| (x - gap - 1e-9 * extent(&face.surface)).max(0.0) / q.tolerance);
                found.worst = [found.worst[0].max(ratio[0]), found.worst[1].max(ratio[1])];
                if ratio[0].max(ratio[1]) > 1.0 + 1e-6 {
                    let uv = made.mesh.facets[f].vertices.map(|v| made.mesh.vertices[v as usize].uv.to_array());
                    let asked = q.tolerance;
                    return Err(format!(
                        "facet {f} of face {i} at {uv:?} is proved within {asked} and off by {off:?}"
                    ));
                }
            }
        }
        start = end;
    }
    Ok(found)
}

/// How large numbers are that a surface is computed with.
pub(crate) fn extent(s: &Surface) -> f64 {
    s.points.iter().map(|p| (p.truncate() / p.w).abs().max_element()).fold(0.0, f64::max)
}

/// Each side of a facet in a closed shell is met by exactly one other that runs against it, its ends the same bits. Sides inside two faces
/// may lie on each other where the tolerance is larger than the shell is thick.
fn watertight(model: &Model, made: &Tessellation) -> Result<(), String> {
    let mut sides: HashMap<[[u64; 3]; 2], Vec<u32>> = HashMap::new();
    for f in 0..made.mesh.facets.len() {
        let c = made.mesh.corners(f).map(|p| p.to_array().map(|x| (x + 0.0).to_bits()));
        for k in (0..4).filter(|&k| c[k] != c[(k + 1) % 4]) {
            sides.entry([c[k], c[(k + 1) % 4]]).or_default().push(made.mesh.facets[f].face.0);
        }
    }
    if !model.parts[0].shells[0].closed {
        return Ok(());
    }
    for ([a, b], of) in &sides {
        let against = sides.get(&[*b, *a]);
        let single = of.len() == 1 && against.is_some_and(|x| x.len() == 1);
        let inside = |x: &Vec<u32>| x == of && of[..].windows(2).all(|w| w[0] < w[1]);
        if !single && !against.is_some_and(inside) {
            let [a, b] = [a, b].map(|x| x.map(f64::from_bits));
            return Err(format!("sides from {a:?} to {b:?} of faces {of:?}, against them {against:?}"));
        }
    }
    Ok(())
}

/// Corners lie on the surface at their parameters, with its unit normal there.
fn corners(face: &Face, made: &Tessellation, facets: std::ops::Range<usize>, gap: f64) -> Result<(), String> {
    let s = &face.surface;
    let rounding = 1e-9 * extent(s);
    let poles = Poles::new(s);
    for f in facets {
        for v in made.mesh.facets[f].vertices {
            let v = made.mesh.vertices[v as usize];
            let p = made.mesh.positions[v.position as usize];
            let off = (place(s, v.uv) - p).length();
            if off > gap + rounding {
                return Err(format!("corner of facet {f} at {:?} lies {off} off its parameters", v.uv));
            }
            if (v.normal.length() - 1.0).abs() > 1e-12 {
                return Err(format!("normal {:?} of facet {f}", v.normal));
            }
            // At a pole the limit along the parameter line.
            if let Some(d) = poles.of(v.uv) {
                let [a, b] = poles.domain[d];
                let mut beside = v.uv;
                beside[d] += 1e-8 * (0.5 * (a + b) - beside[d]);
                let seen = [[false, false], [true, false], [false, true], [true, true]].map(|left| {
                    let (_, [du, dv]) = look(s, beside, left);
                    let n = du.cross(dv) * if face.reversed { -1.0 } else { 1.0 };
                    (n.length() > 1e-3 * du.length() * dv.length()).then_some(n)
                });
                if seen.iter().all(|n| n.is_some_and(|n| n.angle_between(v.normal) > 0.03)) {
                    return Err(format!("normal at the pole {:?}: {} for {seen:?}", v.uv, v.normal));
                }
                continue;
            }
            // On a crease, or so near to it that a facet beyond may end here, the normal of any side will do; where there is none, or one
            // that rounding decides, any at all.
            let at = Uv::from_array([0, 1].map(|d| {
                let [a, b] = poles.domain[d];
                let times = |k: &f64| s.knots[d].iter().filter(|x| *x == k).count();
                let crease = |k: &f64| *k > a && *k < b && times(k) >= s.degree[d];
                let near = |k: &f64| (k - v.uv[d]).abs() <= 2e-7 * (b - a);
                s.knots[d].iter().copied().find(|k| near(k) && crease(k)).unwrap_or(v.uv[d])
            }));
            let most = if at == v.uv { 1e-6 } else { 1e-3 };
            let seen = [[false, false], [true, false], [false, true], [true, true]].map(|left| {
                let (_, [du, dv]) = look(s, at, left);
                let n = du.cross(dv);
                (n.length() > 1e-6 * du.length() * dv.length())
                    .then(|| if face.reversed { -n } else { n }.normalize())
            });
            let known = seen.iter().all(|n| n.is_some());
            let near = seen.iter().flatten().map(|n| n.angle_between(v.normal)).fold(f64::INFINITY, f64::min);
            if known && near > most {
                return Err(format!("normal of facet {f} at {:?} is {near} off", v.uv));
            }
        }
    }
    Ok(())
}

/// Largest distance of the piece to the facet, and of the facet to the piece.
fn sag(s: &Surface, made: &Tessellation, f: usize, piece: &[[Uv; 3]]) -> [f64; 2] {
    let xyz = made.mesh.corners(f);
    let q = made.quality[f];
    let cuts: &[[usize; 3]] =
        if made.mesh.facets[f].is_triangle() { &[[0, 1, 2]] } else { &[[0, 1, 2], [0, 2, 3]] };
    let size = (0..4).map(|k| (xyz[k] - xyz[0]).length()).fold(0.0, f64::max);
    let bits = bits(s, piece, [0.02 * q.tolerance, (0.25 * size).max(0.1 * q.tolerance)]);
    let to_facet = |p: Point| cuts.iter().map(|t| to_triangle(p, t.map(|k| xyz[k]))).fold(f64::INFINITY, f64::min);
    let there = bits.iter().flatten().map(|b| to_facet(b.1)).fold(0.0, f64::max);
    let to_piece = |p: Point| bits.iter().map(|b| to_triangle(p, b.map(|x| x.1))).fold(f64::INFINITY, f64::min);
    let mut back = 0f64;
    const N: usize = 4;
    for t in cuts {
        for i in 0..=N {
            for j in 0..=N - i {
                let (a, b) = (i as f64 / N as f64, j as f64 / N as f64);
                let x = xyz[t[0]] * (1.0 - a - b) + xyz[t[1]] * a + xyz[t[2]] * b;
                let mut off = to_piece(x);
                if off > 0.9 * q.tolerance {
                    off = nearest(s, x, &bits);
                }
                back = back.max(off);
            }
        }
    }
    [there, back]
}

/// Distance of a point to a piece, its nearest bits halved over and over.
fn nearest(s: &Surface, x: Point, bits: &[Bit]) -> f64 {
    let off = |b: &Bit| to_triangle(x, b.map(|p| p.1));
    let mut near: Vec<Bit> = bits.to_vec();
    for _ in 0..24 {
        near.sort_by(|a, b| off(a).total_cmp(&off(b)));
        near.truncate(12);
        let halves = |t: &Bit| {
            let long = |k: usize| (t[(k + 1) % 3].1 - t[k].1).length();
            let k = (0..3).max_by(|&a, &b| long(a).total_cmp(&long(b))).unwrap();
            let uv = t[k].0.lerp(t[(k + 1) % 3].0, 0.5);
            let m = (uv, place(s, uv));
            let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
            [[a, m, c], [m, b, c]]
        };
        near = near.iter().flat_map(halves).collect();
    }
    near.iter().flatten().map(|p| (p.1 - x).length()).fold(f64::INFINITY, f64::min)
}
