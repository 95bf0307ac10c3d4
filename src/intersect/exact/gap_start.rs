//! Rays that leave a face in the gap of an edge.
//!
//! Where a file's faces lie off the edge that they share, the sides on which rays pass that edge decide which of the faces they meet, and
//! the point may lie beyond the other face. What is reflected there would leave the shell unseen: its crossing with that face lies before
//! its start. So the other face is looked for there as well: what leaves inward goes out next, and what leaves outward comes in.

use super::acceptance::Candidate;
use super::geometry::{DECIDING_OF_GAP, FaceRecord, bridged_gap};
use super::leaf::Leaf;
use super::patch::{metric, project};
use super::query::{GapStart, Query};
use super::structure::Exact;
use super::tolerances::FLAGGED_OF_GAP;
use super::trim::{Near, Region};
use crate::math::Vector;
use smallvec::SmallVec;

/// The other face lies within so many times the width along the ray: at sines down to a sixteenth.
const REACH_OF_GAP: f64 = 16.0;

impl Exact {
    /// How the ray starts, if it leaves a face of a closed shell in the gap of an edge.
    #[inline(always)]
    pub(super) fn gap_start(&self, query: &Query) -> Option<GapStart> {
        let own = query.departure.as_ref()?;
        let face = &self.geometry.faces[own.face as usize];
        // A query with a later range is past what surrounds its start, and would be given that again.
        let is_at_start = query.t_min <= 0.0 && query.t_min <= query.limit;
        if !(face.gapes && is_at_start) || self.geometry.trims[face.trim as usize].cell_at(own.uv) != Region::Border
        {
            return None;
        }
        self.start_beside_edges(query, face)
    }

    /// [`Self::gap_start`] of a ray that leaves a face where no cell of its trims is decided.
    #[cold]
    fn start_beside_edges(&self, query: &Query, face: &FaceRecord) -> Option<GapStart> {
        let own = query.departure.as_ref()?;
        let trim = &self.geometry.trims[face.trim as usize];
        let patch = &self.geometry.patches[own.patch as usize];
        let (_, du, dv) = project(&self.geometry.jet(patch, patch.local(own.uv)));
        let [su, sv] = patch.surface_tangents([du, dv]);
        let normal = su.cross(sv);
        let curves = &self.geometry.edges[face.part as usize];
        let outward = face.sign * normal.dot(query.d) > 0.0;
        let mut start = GapStart { reach: 0.0, outward, edges: SmallVec::new() };
        for near in trim.locate(own.uv, metric([su, sv]), face.flagging_distance + own.off).near {
            let edge_use = &trim.uses[near.owner as usize];
            // As far as roots stray; a start beside its own point, as one that was met before its range, may lie farther.
            let gap = bridged_gap(edge_use.gap, &face.placement);
            let Some(edge) = edge_use.edge.filter(|_| near.distance <= FLAGGED_OF_GAP * gap + own.off) else {
                continue;
            };
            let along = curves.get(edge.0 as usize)?.derivatives(near.parameter).first;
            let way = face.placement.direction(if edge_use.reversed { -along } else { along });
            // A face lies to the left of its loops. At a pole, or where a curve has no direction, no side is known.
            let into = normal.cross(way);
            if into == Vector::ZERO {
                continue;
            }
            start.reach = start.reach.max(REACH_OF_GAP * gap);
            start.edges.push((edge, into));
        }
        // A probe from before the face starts in no gap.
        (!start.edges.is_empty() && own.off <= start.reach).then_some(start)
    }

    /// Whether a root on a leaf counts for a ray with this start; `inside` and `near_trim` are what the trims say of it.
    ///
    /// Faces beside the edge count where they are crossed the other way than its own was left. Within an edge like a roof's, and outside
    /// of one like a valley's, they do so on either side of their trims, and if they lie before the ray's range too: its start may lie
    /// beyond them.
    #[cold]
    pub(super) fn counts_in_gap(
        &self,
        query: &Query,
        start: &GapStart,
        root: &Candidate,
        leaf: &Leaf,
        [inside, near_trim]: [bool; 2],
    ) -> bool {
        let counts = inside && root.t >= query.t_min;
        let Some(own) = &query.departure else { return counts };
        let [left, met] = [own.face, leaf.face].map(|face| &self.geometry.faces[face as usize]);
        let is_close = root.t.abs() <= start.reach;
        if !(near_trim && is_close && leaf.face != own.face && left.solid == met.solid) {
            return counts;
        }
        let trim = &self.geometry.trims[met.trim as usize];
        let shared = start.edges.iter().find(|(edge, _)| trim.uses.iter().any(|u| u.edge == Some(*edge)));
        let Some((_, into)) = shared else { return counts };
        let patch = &self.geometry.patches[leaf.patch as usize];
        let uv = patch.uv(leaf.patch_parameters(root.local));
        let (_, du, dv) = project(&self.geometry.jet(patch, patch.local(uv)));
        let normal = met.sign * du.cross(dv);
        let is_other_way = (normal.dot(query.d) > 0.0) != start.outward;
        if !is_other_way || counts {
            return is_other_way;
        }
        // Beyond another of its edges, as in a notch or below a step, the face's surface goes on where nothing is.
        let metric = metric(patch.surface_tangents([du, dv]));
        let (ray, facing) = ([query.o, query.n1, query.n2], du.cross(dv).dot(query.d));
        // Within the gaps of those edges, as at a corner, sides are unknown.
        let is_open = |near: &Near| {
            let edge_use = &trim.uses[near.owner as usize];
            let gap = bridged_gap(edge_use.gap, &met.placement);
            near.distance <= DECIDING_OF_GAP * gap
                || start.edges.iter().any(|(edge, _)| edge_use.edge == Some(*edge))
        };
        (normal.dot(*into) > 0.0) == start.outward
            && (trim.locate(uv, metric, met.flagging_distance).near.iter())
                .all(|near| is_open(near) || self.geometry.is_within_edge(met, trim, ray, facing, near))
    }
}
