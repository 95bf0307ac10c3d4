//! Corners of a border where two of its edges cross: one corner for both, so that no chord crosses another there.

use super::polygons::{BorderPolygons, BorderSide};
use crate::math::Point;
use crate::model::{EdgeId, TrimLoop};
use crate::tessellate::face_surface::FaceSurface;
use crate::tessellate::meetings::Meetings;
use crate::tessellate::nodes::Position;
use rustc_hash::FxHashMap;

/// Share of the domain within which the parameters of two samples in one place are one: the trims' own rounding.
const SAME_PARAMETERS: f64 = 1e-9;

impl BorderPolygons {
    /// Gives both samples of each pair in `meetings` that the polygons have the parameters and the position of the first. Pairs are left
    /// out of which a sample is not there or stands twice, and those that are not in one place. `loops` are those of the polygons, `shared`
    /// the part's positions.
    pub(in crate::tessellate) fn join_meeting_corners(
        &mut self,
        loops: &[TrimLoop],
        surface: &FaceSurface<'_>,
        shared: &[Point],
        meetings: &Meetings,
    ) {
        let edges: Vec<Option<EdgeId>> = loops.iter().flat_map(|l| &l.uses).map(|u| u.edge).collect();
        let pairs = meetings.on_edges(edges.iter().copied().flatten());
        if pairs.is_empty() {
            return;
        }
        let mut corners: FxHashMap<(EdgeId, u64), Vec<[usize; 2]>> = FxHashMap::default();
        for (i, polygon) in self.polygons.iter().enumerate() {
            for (k, corner) in polygon.iter().enumerate() {
                if let BorderSide::Edge { edge_use, t } = corner.side
                    && let Some(edge) = edges[edge_use as usize]
                {
                    corners.entry((edge, t[0].to_bits())).or_default().push([i, k]);
                }
            }
        }
        let corner_at = |(edge, t): (EdgeId, f64)| match corners.get(&(edge, t.to_bits())).map(Vec::as_slice) {
            Some(&[only]) => Some(only),
            _ => None,
        };
        for [first, second] in pairs {
            let (Some([i, k]), Some([j, l])) = (corner_at(first), corner_at(second)) else { continue };
            let (a, b) = (self.polygons[i][k], self.polygons[j][l]);
            let (Position::Shared(p), Position::Shared(q)) = (a.position, b.position) else { continue };
            let apart = ((a.uv - b.uv) / surface.extent()).abs().max_element();
            let are_one = shared[p as usize].distance(shared[q as usize]) <= surface.rounding;
            if p != q && are_one && apart <= SAME_PARAMETERS {
                let corner = &mut self.polygons[j][l];
                (corner.uv, corner.position) = (a.uv, a.position);
                self.coincident.push([p, q]);
                self.meets_itself = true;
            }
        }
    }
}
