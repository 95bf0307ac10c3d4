//! Sharp creases of the surface through the transition: lines that no triangle and no quad crosses, so that each side keeps its own
//! normals.

use crate::math::Uv;
use crate::math::polygon::is_inside_sides;
use crate::tessellate::face_surface::FaceSurface;
use crate::tessellate::nodes::{Nodes, edge_key};
use rustc_hash::FxHashSet;

/// Returns the lines between neighbouring nodes on each sharp crease, as pairs of nodes, where their middle lies inside what `segments`
/// bound and they are no segments themselves.
pub(in crate::tessellate) fn crease_lines(
    surface: &FaceSurface<'_>,
    nodes: &Nodes,
    segments: &[[u32; 2]],
) -> Vec<[u32; 2]> {
    let mut out = Vec::new();
    if !surface.is_sharp() || segments.is_empty() {
        return out;
    }
    let known: FxHashSet<[u32; 2]> = segments.iter().map(|s| edge_key(s[0], s[1])).collect();
    let mut used: Vec<u32> = segments.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let uv = |n: u32| nodes[n].uv;
    // Even–odd over what bounds the transition.
    let is_inside = |p: Uv| is_inside_sides(segments.iter().map(|s| s.map(uv)), p);
    for d in 0..2 {
        for &crease in &surface.sharp[d] {
            let mut on: Vec<u32> =
                used.iter().copied().filter(|&n| surface.on_creases(uv(n))[d] == Some(crease)).collect();
            on.sort_by(|&a, &b| uv(a)[1 - d].total_cmp(&uv(b)[1 - d]));
            on.dedup_by(|b, a| uv(*a) == uv(*b));
            // Neighbours along the crease; a line between others would run through the nodes between.
            let pairs = on.windows(2).map(|w| [w[0], w[1]]);
            out.extend(
                pairs.filter(|&[a, b]| !known.contains(&edge_key(a, b)) && is_inside(0.5 * (uv(a) + uv(b)))),
            );
        }
    }
    out
}

/// Whether the line between two places runs along a sharp crease: both lie on the same one.
pub(in crate::tessellate) fn runs_along_crease(surface: &FaceSurface<'_>, a: Uv, b: Uv) -> bool {
    if !surface.is_sharp() {
        return false;
    }
    let (a, b) = (surface.on_creases(a), surface.on_creases(b));
    (0..2).any(|d| a[d].is_some_and(|c| surface.sharp[d].contains(&c)) && a[d] == b[d])
}
