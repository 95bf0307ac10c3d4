//! Uses of edges around a face: what bounds it, and which use follows which around a vertex.

use crate::model::{EdgeId, Face, Part};
use crate::nurbs::UvCurve;
use rustc_hash::FxHashMap;

/// Share of the domain within which a trim runs along its end: rounding of parameters in files of nine digits.
const ON_END: f64 = 1e-9;
/// Uses that may be passed around a vertex: a seam and a pole at each end are all that a vertex of a face can have.
const MOST_AROUND: usize = 8;

/// One use of an edge in a loop.
#[derive(Clone, Debug)]
pub(super) struct EdgeUse {
    /// The edge that ends the face here; `None` for poles, and for seams where the surface closes on itself.
    pub(super) edge: Option<EdgeId>,
    /// How far the faces on both sides lie off the edge, in the units of the part: rays pass between them, wherever only one of
    /// the two knows of it.
    pub(super) gap: f64,
    /// Whether the loop runs against the edge.
    pub(super) reversed: bool,
    /// Indices of the uses that follow and go before it in its loop.
    next: u32,
    previous: u32,
    /// The other use of the same seam.
    twin: Option<u32>,
}

/// How far the faces that share each of a part's edges lie off it at most, by edge, in the units of the part; 0 for unused edges.
pub(super) fn edge_gaps(part: &Part) -> Vec<f64> {
    let mut gaps = vec![0f64; part.edges.len()];
    for face in part.shells.iter().flat_map(|s| &s.faces) {
        for edge in face.loops.iter().flat_map(|l| &l.uses).filter_map(|u| u.edge) {
            if let Some(gap) = gaps.get_mut(edge.0 as usize) {
                *gap = gap.max(face.gap);
            }
        }
    }
    gaps
}

/// Lists all uses of a face in the order of its loops, seams paired; `closed` says in which parameters its surface closes on itself,
/// `gaps` how far faces lie off the part's edges.
pub(super) fn edge_uses(face: &Face, closed: [bool; 2], gaps: &[f64]) -> Vec<EdgeUse> {
    let mut by_edge: FxHashMap<EdgeId, Vec<u32>> = FxHashMap::default();
    for (k, u) in face.loops.iter().flat_map(|l| &l.uses).enumerate() {
        if let Some(edge) = u.edge {
            by_edge.entry(edge).or_default().push(k as u32);
        }
    }
    let mut uses: Vec<EdgeUse> = Vec::new();
    for trim in &face.loops {
        let (first, n) = (uses.len() as u32, trim.uses.len() as u32);
        for (k, u) in (0u32..).zip(&trim.uses) {
            // Used twice by one face, an edge is a seam or a slit; only where the surface closes on itself does the
            // face go on beyond it.
            let twin = u.edge.and_then(|e| match by_edge[&e].as_slice() {
                &[a, b] => Some(if a == first + k { b } else { a }),
                _ => None,
            });
            let twin = twin.filter(|_| is_seam(face, closed, &u.uv));
            uses.push(EdgeUse {
                edge: u.edge.filter(|_| twin.is_none()),
                gap: u.edge.and_then(|e| gaps.get(e.0 as usize)).map_or(face.gap, |g| g.max(face.gap)),
                reversed: u.reversed,
                next: first + (k + 1) % n,
                previous: first + (k + n - 1) % n,
                twin,
            });
        }
    }
    uses
}

/// The use that bounds the face on the other side of the vertex where `from` ends in the loop's direction, or begins
/// when not `forward`; across seams and poles, which bound nothing. `None` where [`MOST_AROUND`] uses in a row bound nothing.
pub(super) fn next_bounding_use(uses: &[EdgeUse], from: u32, forward: bool) -> Option<u32> {
    let step = |k: u32| if forward { uses[k as usize].next } else { uses[k as usize].previous };
    let mut at = from;
    for _ in 0..MOST_AROUND {
        at = step(at);
        let here = &uses[at as usize];
        if here.edge.is_some() {
            return Some(at);
        }
        at = here.twin.unwrap_or(at);
    }
    None
}

/// Whether a curve runs along an end of the domain where the surface closes on itself: nothing ends there.
fn is_seam(face: &Face, closed: [bool; 2], curve: &UvCurve) -> bool {
    let domain = face.surface.domain();
    (0..2).any(|d| {
        let [lo, hi] = domain[d];
        let on = |end: f64| curve.points.iter().all(|p| (p.truncate()[d] / p.z - end).abs() <= ON_END * (hi - lo));
        closed[d] && (on(lo) || on(hi))
    })
}
