//! Trimming loops as polygons in the parameter plane, for what is drawn or sampled on a face.

use crate::math::Uv;
use crate::model::{EdgeUse, Face};

/// Samples along each edge of a loop.
const EDGE_SAMPLES: usize = 24;

/// Returns the trimming loops of a face as polygons in its spline parameters, [`EDGE_SAMPLES`] points an edge; none for an untrimmed face.
pub(crate) fn trim_polygons(face: &Face) -> Vec<Vec<Uv>> {
    let points = |u: &EdgeUse| {
        let [a, b] = u.uv.domain();
        let reversed = u.reversed;
        (0..EDGE_SAMPLES)
            .map(move |i| {
                let s = i as f64 / EDGE_SAMPLES as f64;
                a + (b - a) * if reversed { 1.0 - s } else { s }
            })
            .map(|t| u.uv.evaluate(t))
            .collect::<Vec<_>>()
    };
    face.loops.iter().map(|l| l.uses.iter().flat_map(points).collect()).collect()
}

/// Whether a parameter point lies inside the loops: an odd number of crossings. Without loops every point does.
pub(crate) fn is_inside(loops: &[Vec<Uv>], p: Uv) -> bool {
    let crossings = loops
        .iter()
        .flat_map(|l| (0..l.len()).map(move |i| (l[i], l[(i + 1) % l.len()])))
        // Even–odd along u, half open in v, so that a corner counts once.
        .filter(|(a, b)| (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x))
        .count();
    loops.is_empty() || crossings % 2 == 1
}
