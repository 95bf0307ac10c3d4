//! Whether a root on a leaf is a crossing of the face: in range, not the point that the ray leaves, inside the trims.

use super::geometry::FaceRecord;
use super::leaf::Leaf;
use super::net;
use super::patch::{Patch, metric, project};
use super::query::{Query, Root};
use super::structure::Exact;
use super::trim::{Near, Region, Trim};
use crate::intersect::Certainty;
use crate::math::{Uv, Vector};
use smallvec::SmallVec;

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
        let leaf_is_whole = self.linearizations[index as usize].whole;
        // A leaf that no trim passes has nothing to test: there every root in range is on the face.
        let (inside, near_trim) = if leaf_is_whole { (true, false) } else { self.trim_side(query, leaf, local) };
        let counts = match &query.gap_start {
            Some(start) => self.counts_in_gap(query, start, &candidate, leaf, [inside, near_trim]),
            None => inside,
        };
        if !counts {
            // Beside a trim and outside: another face should have taken it. Remembered, because where faces gape none does.
            if near_trim {
                query.reject_at_trim(t);
            }
            return;
        }
        query.accept(Root { t, leaf: index, local, certainty, near_trim, settled });
    }

    /// Whether a root, in parameters of the leaf, lies inside the trims, and whether it is flagged as near one. Near a shared edge the side
    /// on which the ray passes that edge decides.
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
        let place = trim.locate(uv, seen_metric(query.d, leaf, patch, [du, dv]), face.flagging_distance);
        let flagging = self.flagging_uses(face, trim, place.near);
        if flagging.is_empty() {
            return (place.inside, false);
        }
        let facing = du.cross(dv).dot(query.d);
        let deciding = self.deciding_uses(face, flagging, query.d, facing);
        if deciding.is_empty() {
            return (place.inside, true);
        }
        let ray = [query.o, query.n1, query.n2];
        let inside = match self.geometry.side_of_edges(face, trim, ray, facing, &deciding) {
            Some(inside) => inside,
            // Seams and poles bound nothing in space: what lies on them is part of the face.
            None if deciding.iter().all(|n| trim.uses[n.owner as usize].edge.is_none()) => true,
            None => place.inside,
        };
        (inside, true)
    }

    /// Of uses near a root those that flag it: each as far as its own gap says.
    #[inline]
    fn flagging_uses(&self, face: &FaceRecord, trim: &Trim, mut near: SmallVec<[Near; 2]>) -> SmallVec<[Near; 2]> {
        near.retain(|n| {
            let gap = trim.uses[n.owner as usize].gap;
            n.distance <= self.geometry.flagging_distance(gap, &face.placement)
        });
        near
    }

    /// Of uses that flag a root those whose edge decides on which side it lies: within the face's own distance, which a file's gaps do not
    /// widen as far, and on the root's sheet. `facing` has the sign of `(Su × Sv) · d` at the root.
    #[inline]
    fn deciding_uses(
        &self,
        face: &FaceRecord,
        mut near: SmallVec<[Near; 2]>,
        d: Vector,
        facing: f64,
    ) -> SmallVec<[Near; 2]> {
        near.retain(|n| n.distance <= face.deciding_distance);
        // A ray that grazes a face beside its border meets it twice, before and behind where it bends away: the edge seen near both lies on
        // the sheet of one, and of the other it says nothing.
        near.retain(|n| self.geometry.facing(face, n.uv, d) * facing > 0.0);
        near
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

/// The first fundamental form of a surface as a ray along `d` sees it, by parameters of the face: trims live in (u, v), distances from them
/// are in mm. `tangents` are the derivatives by the leaf's parameters.
///
/// Distances across the ray, not along the surface: on a face that the ray grazes, the root strays from the edge by the gap over the sine,
/// and still the edge must decide for both of its faces.
#[inline]
fn seen_metric(d: Vector, leaf: &Leaf, patch: &Patch, tangents: [Vector; 2]) -> [f64; 3] {
    let scale = |k: usize| (leaf.rect[k][1] - leaf.rect[k][0]) * (patch.domain[k][1] - patch.domain[k][0]);
    let across = |a: Vector, k: usize| (a - d * a.dot(d)) / scale(k);
    metric([across(tangents[0], 0), across(tangents[1], 1)])
}
