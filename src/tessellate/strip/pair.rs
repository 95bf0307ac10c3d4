//! Joins pairs of triangles to quads: a facet is two triangles anyway, so the pairs cost nothing and halve the count.

use super::delaunay::{Node, Strip, key};
use super::sector;
use super::{crease, matching};
use crate::math::Uv;
use crate::tessellate::proof::bound::Prover;
use crate::tessellate::sheet::Sheet;
use rustc_hash::FxHashMap;

/// A facet of the strip; a triangle repeats its third corner.
pub(in crate::tessellate) struct StripFacet {
    pub(in crate::tessellate) nodes: [u32; 4],
    pub(in crate::tessellate) bound: f64,
    pub(in crate::tessellate) tolerance: f64,
    /// Other parameters for a corner: a pole, seen in the middle of its facet.
    pub(in crate::tessellate) pole: Option<(usize, Uv)>,
}

/// How far from square (negative: a triangle without area is taken in), two triangles, and the quad they make.
pub(in crate::tessellate) type Candidate = (f64, usize, usize, [u32; 4]);

/// Cosine of the sharpest and bluntest corner that a quad may have.
const SHARPEST: f64 = 0.9995;
/// Cosine below which a quad is made before any triangle's lack of mates is looked at.
const GOOD: f64 = 0.5;

/// Pairs greedily, squarest first. `fixed` edges are not crossed; triangles without area go into their neighbours.
pub(in crate::tessellate) fn join(
    strip: &Strip,
    fixed: &FxHashMap<[u32; 2], ()>,
    prover: &mut Prover<'_, '_>,
) -> Vec<StripFacet> {
    let t = &strip.triangles;
    let node = |n: u32| strip.nodes[n as usize];
    let collapsed: Vec<bool> = t.iter().map(|t| flat(t.map(node))).collect();
    let mut sides: FxHashMap<[u32; 2], (usize, usize)> = FxHashMap::default();
    let mut candidates: Vec<Candidate> = Vec::new();
    for (i, tri) in t.iter().enumerate() {
        for k in 0..3 {
            let (c, a) = (tri[k], tri[(k + 1) % 3]);
            let name = key(a, c);
            if fixed.contains_key(&name) || crease::along(prover.sheet, node(a).uv, node(c).uv) {
                continue;
            }
            let Some(&(j, m)) = sides.get(&name) else {
                sides.insert(name, (i, k));
                continue;
            };
            // This triangle is (a, b, c) and the other holds the edge a–c.
            let (b, d) = (tri[(k + 2) % 3], t[j][(m + 2) % 3]);
            if collapsed[i] || collapsed[j] {
                if collapsed[i] != collapsed[j] && node(a).position != node(c).position {
                    candidates.push((-1.0, i, j, [a, b, c, d]));
                }
            } else if both_hold(strip, i, j)
                && let Some(score) = squareness([a, b, c, d].map(node))
            {
                candidates.push((score, i, j, [a, b, c, d]));
            }
        }
    }
    candidates.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)).then(x.2.cmp(&y.2)));
    let mut taken = vec![false; t.len()];
    let mut facets = Vec::new();
    let first = choose(&candidates, &mut taken);
    for c in matching::augment(&candidates, t.len(), &first) {
        let (score, i, j, q) = candidates[c];
        (taken[i], taken[j]) = (true, true);
        let bound = strip.bounds[i].max(strip.bounds[j]);
        let tolerance = strip.tolerances[i].min(strip.tolerances[j]);
        if score < 0.0 {
            let (full, empty) = if collapsed[i] { (j, i) } else { (i, j) };
            // The collapsed triangle's piece of the surface is not empty: the facet must cover it too.
            let (uv, xyz) = (t[empty].map(|n| node(n).uv), t[full].map(|n| node(n).place));
            let whole = sector::covers(prover.sheet, t[full].map(|n| node(n).uv));
            let covered = if whole { bound } else { bound.max(prover.piece(uv, xyz, tolerance)) };
            facets.push(with_pole(strip, prover, t[full], q, [covered, tolerance]));
        } else {
            let pole = sector::seen(prover.sheet, &q.map(|n| node(n).uv));
            facets.push(StripFacet { nodes: q, bound, tolerance, pole });
        }
    }
    for (i, tri) in t.iter().enumerate() {
        if !taken[i] && !collapsed[i] {
            facets.push(alone(strip, prover.sheet, *tri, [strip.bounds[i], strip.tolerances[i]]));
        }
    }
    kites(strip, prover, facets)
}

/// Whether a facet is a triangle with a pole as its third corner.
fn is_sector(f: &StripFacet) -> bool {
    f.pole.is_some() && f.nodes[2] == f.nodes[3]
}

/// Joins triangles that meet at a pole, two and two: what is left of a sector there is a triangle, but two of them are a
/// convex quad with the meridian between them as its diagonal.
fn kites(strip: &Strip, prover: &mut Prover<'_, '_>, facets: Vec<StripFacet>) -> Vec<StripFacet> {
    let node = |n: u32| strip.nodes[n as usize];
    // A sector is (a, b, pole): the next one around starts at b.
    let mut starts: FxHashMap<u32, usize> = FxHashMap::default();
    for (i, f) in facets.iter().enumerate().filter(|(_, f)| is_sector(f)) {
        starts.insert(f.nodes[0], i);
    }
    let next = |f: &StripFacet| {
        let j = *starts.get(&f.nodes[1])?;
        (node(facets[j].nodes[2]).position == node(f.nodes[2]).position).then_some(j)
    };
    let follows: Vec<Option<usize>> = facets.iter().map(|f| if is_sector(f) { next(f) } else { None }).collect();
    let mut led = vec![false; facets.len()];
    follows.iter().flatten().for_each(|&j| led[j] = true);
    let heads = (0..facets.len()).filter(|&i| !led[i]).chain((0..facets.len()).filter(|&i| led[i]));
    let mut into: Vec<Option<(usize, Uv, f64)>> = vec![None; facets.len()];
    let mut gone = vec![false; facets.len()];
    // Facets that were looked at: sectors all around a pole follow each other for ever.
    let mut seen = vec![false; facets.len()];
    for head in heads {
        let mut at = Some(head);
        while let Some(i) = at {
            if gone[i] || into[i].is_some() || std::mem::replace(&mut seen[i], true) {
                break;
            }
            at = follows[i];
            let Some(j) = follows[i].filter(|&j| j != i && !gone[j] && into[j].is_none()) else { continue };
            let (f, g) = (&facets[i], &facets[j]);
            let tolerance = f.tolerance.min(g.tolerance);
            let Some(((_, x), (_, y))) = f.pole.zip(g.pole).filter(|_| f.bound.max(g.bound) <= tolerance) else {
                continue;
            };
            if squareness([f.nodes[1], g.nodes[1], f.nodes[2], f.nodes[0]].map(node)).is_none() {
                continue;
            }
            // Both sectors hold the line between them; other poles have to be looked at anew.
            let quad = [f.nodes[1], g.nodes[1], f.nodes[2], f.nodes[0]].map(|n| node(n).uv);
            let (pole, also) = match sector::seen(prover.sheet, &quad) {
                Some((2, pole)) => (pole, [Some(0.0); 2]),
                _ => {
                    let pole = 0.5 * (x + y);
                    (pole, [f, g].map(|h| seen_from(strip, prover, h.nodes, pole, tolerance)))
                }
            };
            if let [Some(also), Some(too)] = also {
                (into[i], gone[j]) = (Some((j, pole, also.max(too))), true);
                at = follows[j];
            }
        }
    }
    let mut out = Vec::with_capacity(facets.len());
    for (i, f) in facets.iter().enumerate().filter(|(i, _)| !gone[*i]) {
        let Some((j, pole, also)) = into[i] else {
            out.push(StripFacet { ..*f });
            continue;
        };
        let g = &facets[j];
        out.push(StripFacet {
            nodes: [f.nodes[1], g.nodes[1], f.nodes[2], f.nodes[0]],
            bound: f.bound.max(g.bound).max(also),
            tolerance: f.tolerance.min(g.tolerance),
            pole: Some((2, pole)),
        });
    }
    out
}

/// Pairs to make: good quads in order of squareness, then those of triangles that have but one mate left, then the rest.
fn choose(candidates: &[Candidate], taken: &mut [bool]) -> Vec<usize> {
    let mut chosen = Vec::new();
    let mut of: Vec<[u32; 3]> = vec![[u32::MAX; 3]; taken.len()];
    for (c, &(score, i, j, _)) in candidates.iter().enumerate() {
        if score < GOOD && !taken[i] && !taken[j] {
            (taken[i], taken[j]) = (true, true);
            chosen.push(c);
        }
        for t in [i, j] {
            if let Some(slot) = of[t].iter_mut().find(|s| **s == u32::MAX) {
                *slot = c as u32;
            }
        }
    }
    let mates = |t: usize, taken: &[bool]| -> Vec<usize> {
        let open = of[t].iter().filter(|&&c| c != u32::MAX).map(|&c| c as usize);
        open.filter(|&c| !taken[candidates[c].1] && !taken[candidates[c].2]).collect()
    };
    let mut single: Vec<usize> = (0..taken.len()).rev().collect();
    let mut rest = 0..candidates.len();
    loop {
        let c = match single.pop() {
            Some(t) if taken[t] => continue,
            Some(t) => match mates(t, taken).as_slice() {
                [one] => *one,
                _ => continue,
            },
            None => match rest.next() {
                Some(c) if taken[candidates[c].1] || taken[candidates[c].2] => continue,
                Some(c) => c,
                None => return chosen,
            },
        };
        let (_, i, j, _) = candidates[c];
        (taken[i], taken[j]) = (true, true);
        chosen.push(c);
        for t in [i, j] {
            for &c in of[t].iter().filter(|&&c| c != u32::MAX) {
                let (_, i, j, _) = candidates[c as usize];
                single.extend([i, j].into_iter().filter(|&x| !taken[x]));
            }
        }
    }
}

/// Whether a triangle has two corners in one place.
fn flat(n: [Node; 3]) -> bool {
    n[0].position == n[1].position || n[1].position == n[2].position || n[2].position == n[0].position
}

/// The triangle at a pole, turned so that the pole is its third corner and seen in its middle, where that is proved too.
fn with_pole(
    strip: &Strip,
    prover: &mut Prover<'_, '_>,
    full: [u32; 3],
    quad: [u32; 4],
    [bound, tolerance]: [f64; 2],
) -> StripFacet {
    let position = |n: u32| strip.nodes[n as usize].position;
    let twin = quad.iter().copied().find_map(|n| {
        let k = full.iter().position(|&f| f != n && position(f) == position(n) && !full.contains(&n))?;
        Some((k, n))
    });
    let Some((k, n)) = twin.filter(|_| !sector::applies(prover.sheet, full.map(|n| strip.nodes[n as usize].uv)))
    else {
        return alone(strip, prover.sheet, full, [bound, tolerance]);
    };
    let nodes = [full[(k + 1) % 3], full[(k + 2) % 3], full[k], full[k]];
    let middle = 0.5 * (strip.nodes[full[k] as usize].uv + strip.nodes[n as usize].uv);
    match seen_from(strip, prover, nodes, middle, tolerance) {
        Some(also) => StripFacet { nodes, bound: bound.max(also), tolerance, pole: Some((2, middle)) },
        None => alone(strip, prover.sheet, full, [bound, tolerance]),
    }
}

/// A triangle by itself, a pole as its third corner.
fn alone(strip: &Strip, sheet: &Sheet<'_>, t: [u32; 3], [bound, tolerance]: [f64; 2]) -> StripFacet {
    let uv = t.map(|n| strip.nodes[n as usize].uv);
    let pole = sector::seen(sheet, &uv).filter(|_| sector::applies(sheet, uv));
    let k = pole.map_or(2, |(k, _)| k);
    let nodes = [t[(k + 1) % 3], t[(k + 2) % 3], t[k], t[k]];
    StripFacet { nodes, bound, tolerance, pole: pole.map(|(_, uv)| (2, uv)) }
}

/// Bound of a triangle at a pole with other parameters of its third corner, where it holds: they are those of the facet that is
/// handed on, whose piece of the surface may lie outside the one that was proved.
fn seen_from(
    strip: &Strip,
    prover: &mut Prover<'_, '_>,
    [a, b, c, _]: [u32; 4],
    pole: Uv,
    tolerance: f64,
) -> Option<f64> {
    let n = [a, b, c].map(|n| strip.nodes[n as usize]);
    let (uv, xyz) = ([n[0].uv, n[1].uv, pole], n.map(|n| n.place));
    let mut worst = prover.piece(uv, xyz, tolerance);
    for i in 0..2 {
        worst = worst.max(prover.side([uv[i], pole], [xyz[i], xyz[2]], tolerance));
    }
    (worst <= tolerance).then_some(worst)
}

/// Whether two triangles that hold their own tolerances hold that of both together, which is the tighter of the two.
fn both_hold(strip: &Strip, i: usize, j: usize) -> bool {
    let (b, x) = (&strip.bounds, &strip.tolerances);
    b[i].max(b[j]) <= x[i].min(x[j]) || b[i] > x[i] || b[j] > x[j]
}

/// Largest cosine of a corner of a quad; `None` when it is not convex or folds along its diagonal.
fn squareness(n: [Node; 4]) -> Option<f64> {
    let p = n.map(|x| x.place);
    let (n1, n2) = ((p[1] - p[0]).cross(p[2] - p[0]), (p[2] - p[0]).cross(p[3] - p[0]));
    let (l1, l2) = (n1.length(), n2.length());
    if !(l1 > 0.0 && l2 > 0.0) || n1.dot(n2) < 0.5 * l1 * l2 {
        return None;
    }
    let up = n1 + n2;
    let mut worst = 0f64;
    for i in 0..4 {
        let (x, y) = (p[(i + 1) % 4] - p[i], p[(i + 3) % 4] - p[i]);
        if x.cross(y).dot(up) <= 0.0 {
            return None;
        }
        worst = worst.max((x.dot(y) / (x.length() * y.length())).abs());
    }
    (worst < SHARPEST).then_some(worst)
}
