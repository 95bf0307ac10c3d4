//! Whether a root on a leaf is a crossing of the face: in range, not the point that the ray leaves, inside the trims.

use super::edge_use::EdgeUse;
use super::leaf::Leaf;
use super::net;
use super::patch::project;
use super::query::{Query, Root};
use super::structure::Exact;
use super::trim::Region;
use crate::intersect::Certainty;
use crate::math::{Uv, Vector};

/// A surface is regular where its normal is longer than this share of its longest derivative's square.
const REGULAR: f64 = 1e-6;
/// A contact at a smaller sine is a tangency: a ray that cuts a regular surface steeper than this meets it at a point.
const TANGENT_SINE: f64 = 1e-3;

/// A root that a leaf's search has found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// Local parameters of the leaf.
    pub(super) local: [f64; 2],
    /// mm along the ray.
    pub(super) t: f64,
    pub(super) certainty: Certainty,
    /// Surface parameters, where the surface as given settled it.
    pub(super) settled: Option<Uv>,
}

impl Exact {
    /// Keeps a root on the leaf `index` in `query` when it lies in range, inside the trims, and is not the point that the ray leaves. One
    /// that a trim in its band turns away is remembered as rejected.
    pub(super) fn offer(&self, query: &mut Query, index: u32, candidate: Candidate) {
        let Candidate { local, t, certainty, settled } = candidate;
        if !query.is_in_range(t) {
            return;
        }
        let leaf = &self.leaves[index as usize];
        // A ray that leaves a seam or a pole meets its own point again under other parameters: searches by leaf
        // exclude it by parameters alone.
        if query.departure.is_some_and(|own| own.is_same_point(leaf, local, t, &self.geometry)) {
            return;
        }
        let mut near_trim = false;
        // A leaf that no trim passes has nothing to ask: there every root in range is on the face.
        if !self.linearizations[index as usize].whole {
            let (inside, near) = self.trim_side(query, leaf, local);
            near_trim = near;
            if !inside {
                // Beside a trim and outside: another face should have taken it. Remembered, for where faces gape none does.
                if near {
                    query.reject_at_trim(t);
                }
                return;
            }
        }
        query.accept(Root { t, leaf: index, local, certainty, near_trim, settled });
    }

    /// Whether a root, in parameters of the leaf, lies inside the trims, and whether it is flagged as near one. Within the band of a shared
    /// edge the side on which the ray passes that edge decides.
    fn trim_side(&self, query: &Query, leaf: &Leaf, local: [f64; 2]) -> (bool, bool) {
        let face = &self.geometry.faces[leaf.face as usize];
        let trim = &self.geometry.trims[face.trim as usize];
        let patch = &self.geometry.patches[leaf.patch as usize];
        let uv = patch.uv(leaf.patch_parameters(local));
        // Cells keep so far off every trim that a decided one needs no distance (`trim::cell_margin`).
        match trim.cell_at(uv) {
            Region::Border => {}
            decided => return (decided == Region::Inside, false),
        }
        let jet = net::evaluate(leaf.net(&self.geometry.nets), leaf.degree, local[0], local[1]);
        let (_, du, dv) = project(&jet);
        // Distances across the ray, not along the surface: on a face that the ray grazes, the root strays from the edge by the
        // gap over the sine, and still the edge must decide for both of its faces.
        let scale = |d: usize| (leaf.rect[d][1] - leaf.rect[d][0]) * (patch.domain[d][1] - patch.domain[d][0]);
        let across = |a: Vector, d: usize| (a - query.d * a.dot(query.d)) / scale(d);
        let (su, sv) = (across(du, 0), across(dv, 1));
        // The first fundamental form of the surface as the ray sees it: trims live in (u, v), bands are in mm.
        let metric = [su.length_squared(), su.dot(sv), sv.length_squared()];
        let mut place = trim.locate(uv, metric, face.flagging_distance);
        let owner = |n: u32| -> &EdgeUse { &trim.uses[n as usize] };
        place.near.retain(|n| n.distance <= self.geometry.flagging_distance(owner(n.owner).gap, &face.placement));
        // Two radii: within the wider one, which grows with the file's gaps, a root is only flagged; within the
        // band the shared edge decides.
        let flagged = !place.near.is_empty();
        place.near.retain(|n| n.distance <= face.deciding_distance);
        if place.near.is_empty() {
            return (place.inside, flagged);
        }
        let facing = du.cross(dv).dot(query.d);
        // A ray that grazes a face beside its border meets it twice, before and behind where it bends away: the edge seen near both lies on
        // the sheet of one, and of the other it says nothing.
        place.near.retain(|n| self.geometry.facing(face, n.uv, query.d) * facing > 0.0);
        if place.near.is_empty() {
            return (place.inside, flagged);
        }
        let ray = [query.o, query.n1, query.n2];
        let inside = match self.geometry.side_of_edges(face, trim, ray, facing, &place.near) {
            Some(inside) => inside,
            // Seams and poles bound nothing in space: what lies on them is part of the face.
            None if place.near.iter().all(|n| owner(n.owner).edge.is_none()) => true,
            None => place.inside,
        };
        (inside, true)
    }

    /// The certainty of a contact: tangent where the surface is regular and the ray grazes it, else uncertified.
    pub(super) fn contact_certainty(&self, leaf: &Leaf, [u, v]: [f64; 2], query: &Query) -> Certainty {
        let jet = net::evaluate(leaf.net(&self.geometry.nets), leaf.degree, u, v);
        let (_, du, dv) = project(&jet);
        let n = du.cross(dv);
        let regular = n.length() > REGULAR * du.length().max(dv.length()).powi(2);
        let sine = n.dot(query.d).abs() / n.length().max(f64::MIN_POSITIVE);
        if regular && sine < TANGENT_SINE { Certainty::Tangent } else { Certainty::Uncertified }
    }
}
