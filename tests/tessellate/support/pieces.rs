//! Which piece of its face a facet stands for: its triangle of parameters, with the trim's own curve for a side.

use super::judge::{extent, place};
use lampyris::math::Uv;
use lampyris::model::Face;
use lampyris::nurbs::Surface;
use lampyris::tessellate::Tessellation;
use std::collections::HashMap;

/// The loops of a face as closed polygons of parameters, fine where they bend.
fn outlines(face: &Face) -> Vec<Vec<Uv>> {
    let points = |u: &lampyris::model::EdgeUse| -> Vec<Uv> {
        let mut p: Vec<Uv> = if u.uv.degree == 1 {
            u.uv.points.iter().map(|p| p.truncate() / p.z).collect()
        } else {
            let [a, b] = u.uv.domain();
            (0..=4096).map(|i| u.uv.evaluate(a + (b - a) * i as f64 / 4096.0)).collect()
        };
        if u.reversed {
            p.reverse();
        }
        p.pop();
        p
    };
    if face.loops.is_empty() {
        let [[u0, u1], [v0, v1]] = face.surface.domain();
        return vec![vec![Uv::new(u0, v0), Uv::new(u1, v0), Uv::new(u1, v1), Uv::new(u0, v1)]];
    }
    face.loops.iter().map(|l| l.uses.iter().flat_map(points).collect()).collect()
}

/// The sides of the domain that are one point in space.
pub(crate) struct Poles {
    pub(crate) domain: [[f64; 2]; 2],
    at: [[bool; 2]; 2],
}

impl Poles {
    pub(crate) fn new(s: &Surface) -> Self {
        let domain = [0, 1].map(|d| [s.knots[d][0], s.knots[d][s.knots[d].len() - 1]]);
        let is = |d: usize, end: usize| {
            let on = |f: f64| {
                let [a, b] = domain[1 - d];
                let mut uv = Uv::splat(a + (b - a) * f);
                uv[d] = domain[d][end];
                place(s, uv)
            };
            (0..=16).all(|k| (on(k as f64 / 16.0) - on(0.0)).length() <= 1e-9 * extent(s))
        };
        Self { domain, at: [0, 1].map(|d| [0, 1].map(|end| is(d, end))) }
    }

    /// The parameter that is constant on the pole where `uv` lies.
    pub(crate) fn of(&self, uv: Uv) -> Option<usize> {
        let near = |d: usize, end: usize| {
            let [a, b] = self.domain[d];
            (uv[d] - self.domain[d][end]).abs() <= 1e-9 * (b - a)
        };
        (0..2).find(|&d| (0..2).any(|end| self.at[d][end] && near(d, end)))
    }
}

/// Where on a closed polygon a point lies: index of the side and the share of it, and how far off, in shares of the extent.
fn locate(polygon: &[Uv], at: Uv, extent: Uv) -> (f64, f64) {
    let n = polygon.len();
    let mut best = (0.0, f64::INFINITY);
    for i in 0..n {
        let (a, b) = (polygon[i], polygon[(i + 1) % n]);
        let (d, x) = ((b - a) / extent, (at - a) / extent);
        let t = if d.length_squared() > 0.0 { (x.dot(d) / d.length_squared()).clamp(0.0, 1.0) } else { 0.0 };
        let off = (x - d * t).length();
        if off < best.1 {
            best = (i as f64 + t, off);
        }
    }
    best
}

/// The polygon from one place on it to another, onwards.
fn path(polygon: &[Uv], [from, to]: [f64; 2], ends: [Uv; 2]) -> (Vec<Uv>, f64) {
    let n = polygon.len();
    let length = (to - from).rem_euclid(n as f64);
    let mut out = vec![ends[0]];
    let mut k = from.floor() + 1.0;
    while k < from + length - 1e-9 {
        if k > from + 1e-9 {
            out.push(polygon[k as usize % n]);
        }
        k += 1.0;
    }
    out.push(ends[1]);
    (out, length)
}

/// The pieces of the facets of a face, as triangles of parameters, the trim's curve in place of a chord; an error where facets do not
/// cover what the loops enclose once.
pub(crate) fn pieces(
    face: &Face,
    made: &Tessellation,
    facets: std::ops::Range<usize>,
) -> Result<Vec<Vec<[Uv; 3]>>, String> {
    let (mut outlines, poles) = (outlines(face), Poles::new(&face.surface));
    // Facets run about the outward normal.
    if face.reversed {
        outlines.iter_mut().for_each(|o| o.reverse());
    }
    let domain = face.surface.domain().map(|[a, b]| b - a);
    let polar = poles.at.as_flattened().contains(&true);
    let extent = Uv::from_array(domain);
    // On a crease each side has corners of its own, in one place.
    let corners = |f: usize| {
        made.mesh.facets[f].vertices.map(|v| {
            let v = made.mesh.vertices[v as usize];
            (v.position, v.uv.to_array().map(|x| (x + 0.0).to_bits()))
        })
    };
    type Corner = (u32, [u64; 2]);
    let mut sides: HashMap<[Corner; 2], usize> = HashMap::new();
    for f in facets.clone() {
        let v = corners(f);
        for k in 0..4 {
            *sides.entry([v[k], v[(k + 1) % 4]]).or_default() += 1;
        }
    }
    let mut covered = vec![0f64; outlines.len()];
    let mut out = Vec::new();
    for f in facets {
        let v = corners(f);
        let uv = made.mesh.facets[f].vertices.map(|v| made.mesh.vertices[v as usize].uv);
        let cuts: &[[usize; 3]] =
            if made.mesh.facets[f].is_triangle() { &[[0, 1, 2]] } else { &[[0, 1, 2], [0, 2, 3]] };
        let mut piece = Vec::new();
        for t in cuts {
            let x = t.map(|k| uv[k]);
            let area = ((x[1] - x[0]) / extent).perp_dot((x[2] - x[0]) / extent);
            if (area < 0.0) != face.reversed && area.abs() > 1e-13 && x.iter().all(|&x| poles.of(x).is_none()) {
                return Err(format!("facet {f} is turned in the parameter plane: {area}"));
            }
            // At a pole the piece lies between the parameter lines into it; a triangle with two corners there has none.
            let at = [0, 1, 2].map(|k| poles.of(x[k]));
            if let Some(k) =
                (0..3).find(|&k| at[k].is_some() && at[(k + 1) % 3].is_none() && at[(k + 2) % 3].is_none())
            {
                let (i, j) = (t[(k + 1) % 3], t[(k + 2) % 3]);
                let inside = [i.min(j), i.max(j)] == [0, 2] && cuts.len() == 2 || sides.contains_key(&[v[j], v[i]]);
                let along = if inside { &[][..] } else { &outlines[..] };
                piece.extend(sector(along, [x[k], uv[i], uv[j]], at[k].unwrap_or(0), extent));
            }
            // From pole to pole: between its own line and the parameter line of the third corner.
            if let Some(k) =
                (0..3).find(|&k| at[k].is_none() && at[(k + 1) % 3].is_some() && at[(k + 2) % 3].is_some())
            {
                let (d, [y, a, b]) = (at[(k + 1) % 3].unwrap_or(0), [x[k], x[(k + 1) % 3], x[(k + 2) % 3]]);
                if (a[d] - b[d]).abs() > 0.5 * extent[d] {
                    let mut feet = [y; 2];
                    (feet[0][d], feet[1][d]) = (a[d], b[d]);
                    piece.extend([[a, b, feet[1]], [a, feet[1], feet[0]]]);
                }
            }
            if x.iter().any(|&x| poles.of(x).is_some()) {
                continue;
            }
            let mut whole = true;
            for k in 0..3 {
                let (i, j, far) = (t[k], t[(k + 1) % 3], x[(k + 2) % 3]);
                if (i, j) == (2, 0) && cuts.len() == 2 || (i, j) == (0, 2) || sides.contains_key(&[v[j], v[i]]) {
                    continue;
                }
                // A side without a neighbour in its face: a chord of some loop, which runs the same way.
                let (a, b) = (uv[i], uv[j]);
                let on = |o: &Vec<Uv>| {
                    let ((from, x), (to, y)) = (locate(o, a, extent), locate(o, b, extent));
                    ([from, to], x.max(y))
                };
                let each = outlines.iter().map(on).enumerate();
                let (l, (range, off)) = each.min_by(|x, y| x.1.1.total_cmp(&y.1.1)).unwrap();
                if off > 1e-9 {
                    return Err(format!("side {a:?} {b:?} of facet {f} has no neighbour and lies on no trim"));
                }
                let (curve, length) = path(&outlines[l], range, [a, b]);
                covered[l] += length;
                whole = false;
                for w in curve.windows(2) {
                    piece.push([far, w[0], w[1]]);
                }
            }
            if whole {
                piece.push(x);
            }
        }
        out.push(piece);
    }
    for (o, c) in outlines.iter().zip(covered) {
        if !polar && (c - o.len() as f64).abs() > 1e-6 * o.len() as f64 {
            return Err(format!("chords cover {c} of {} sides of a loop", o.len()));
        }
    }
    Ok(out)
}

/// The piece of a triangle with a pole as its first corner: between the parameter lines of both others, down to the trim that its base is a
/// chord of, if any.
fn sector(trims: &[Vec<Uv>], [pole, a, b]: [Uv; 3], d: usize, extent: Uv) -> Vec<[Uv; 3]> {
    let foot = |mut x: Uv| {
        x[d] = pole[d];
        x
    };
    let on = |o: &Vec<Uv>| {
        let ((from, x), (to, y)) = (locate(o, a, extent), locate(o, b, extent));
        (x.max(y) <= 1e-9).then(|| path(o, [from, to], [a, b]))
    };
    // A chord is short: what goes around the face the other way is none.
    let length = |p: &[Uv]| p.windows(2).map(|w| ((w[1] - w[0]) / extent).length()).sum::<f64>();
    let chord = |p: &(Vec<Uv>, f64)| length(&p.0) <= 1.5 * ((b - a) / extent).length();
    let base = trims.iter().filter_map(on).find(chord).map_or(vec![a, b], |p| p.0);
    base.windows(2).flat_map(|w| [[w[0], w[1], foot(w[1])], [w[0], foot(w[1]), foot(w[0])]]).collect()
}
