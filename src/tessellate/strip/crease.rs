//! Sharp creases of the surface through the strip: lines that no triangle and no quad crosses, so that each side keeps its own normals.

use super::delaunay::{Node, key};
use crate::math::Uv;
use crate::tessellate::sheet::Sheet;
use rustc_hash::FxHashMap;

/// Lines between neighbouring nodes on each crease, where they run inside what `segments` bound.
pub(in crate::tessellate) fn lines(sheet: &Sheet<'_>, nodes: &[Node], segments: &[[u32; 2]]) -> Vec<[u32; 2]> {
    let mut out = Vec::new();
    if !sheet.is_sharp() || segments.is_empty() {
        return out;
    }
    let known: FxHashMap<[u32; 2], ()> = segments.iter().map(|s| (key(s[0], s[1]), ())).collect();
    let mut used: Vec<u32> = segments.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let uv = |n: u32| nodes[n as usize].uv;
    let inside = |p: Uv| {
        let crosses = |&&[a, b]: &&[u32; 2]| {
            let (a, b) = (uv(a), uv(b));
            (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)
        };
        segments.iter().filter(crosses).count() % 2 == 1
    };
    for d in 0..2 {
        for &crease in &sheet.sharp[d] {
            let mut on: Vec<u32> =
                used.iter().copied().filter(|&n| sheet.on_creases(uv(n))[d] == Some(crease)).collect();
            on.sort_by(|&a, &b| uv(a)[1 - d].total_cmp(&uv(b)[1 - d]));
            on.dedup_by(|b, a| uv(*a) == uv(*b));
            let pairs = on.windows(2).map(|w| [w[0], w[1]]);
            out.extend(pairs.filter(|&[a, b]| !known.contains_key(&key(a, b)) && inside(0.5 * (uv(a) + uv(b)))));
        }
    }
    out
}

/// Whether the line between two places runs along a sharp crease.
pub(in crate::tessellate) fn along(sheet: &Sheet<'_>, a: Uv, b: Uv) -> bool {
    if !sheet.is_sharp() {
        return false;
    }
    let (a, b) = (sheet.on_creases(a), sheet.on_creases(b));
    (0..2).any(|d| a[d].is_some_and(|c| sheet.sharp[d].contains(&c)) && a[d] == b[d])
}
