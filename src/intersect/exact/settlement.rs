//! Roots whose place `f64` leaves open, settled by the surface as given.
//!
//! A root found in `f64` is right to its margin: rounding across the ray over the sine at which the ray meets the leaf. Where the margin
//! reaches over the leaf's border the root may be another leaf's, or lie beside the face; where it is large, t is as open. Such roots
//! are few, and are found again in 32 digits. What these cannot tell either is flagged, never certified.

use super::acceptance::Candidate;
use super::leaf::border_sides;
use super::query::Query;
use super::structure::Exact;
use super::tolerances::TANGENT;
use crate::intersect::Certainty;

/// Roots with a larger margin are settled wherever they lie, as a share of the leaf: of a leaf of 10 mm, 10 nm along the surface.
const LOOSE: f64 = 1e-6;
/// Roots with a larger margin are settled where that reaches over the leaf's border: ten times where Newton's method ends, so that
/// no face is certified farther beside its border than a shared one is blurred.
const AMBIGUOUS: f64 = 1e-11;
/// A settled root farther than this many margins from the one that `f64` found is another one.
const STRAYED: f64 = 4.0;
/// Clipping steps that settling a root counts as: twenty microseconds.
const WORK: u32 = 40;

/// Whether the place of a root with this margin must be settled.
#[inline(always)]
pub(super) fn is_open(local: [f64; 2], margin: [f64; 2]) -> bool {
    let open = |x: f64, margin: f64| margin > LOOSE || margin > AMBIGUOUS && !(x > margin && x < 1.0 - margin);
    open(local[0], margin[0]) || open(local[1], margin[1])
}

impl Exact {
    /// Offers a root at its place in 32 digits, if that lies on the leaf; flags what stays open.
    #[cold]
    pub(super) fn settle(&self, query: &mut Query, index: u32, found: Candidate, margin: [f64; 2]) {
        // Charged to the ray's budget, so that a ray along a border, of which every root is open, ends as others
        // do.
        query.budget = query.budget.saturating_sub(WORK);
        let leaf = &self.leaves[index as usize];
        let patch = &self.geometry.patches[leaf.patch as usize];
        let start = leaf.patch_parameters(found.local);
        let settled = self.geometry.reference(patch).settle([query.o, query.d], start);
        let near = |local: [f64; 2]| {
            (0..2).all(|k| (local[k] - found.local[k]).abs() <= (STRAYED * margin[k]).max(AMBIGUOUS))
        };
        let root = settled.map(|root| (root, leaf.leaf_parameters(root.local)));
        let Some((root, local)) = root.filter(|(_, local)| near(*local)) else {
            // Singular, or Newton's method ran to another root.
            return self.leave_open(query, index, found);
        };
        // Over an inner border the face goes on, and over a seam it comes back: there neither side may let a ray pass that rounding
        // puts on the other. Where the surface ends, it ends.
        let face = &self.geometry.faces[patch.face as usize];
        let border = border_sides(&self.geometry.grids[face.grid as usize], patch, leaf.rect);
        let counts = (0..2).all(|k| {
            let [low, high] = [0, 1].map(|end| if border[k][end] { 0.0 } else { margin[k].min(LOOSE) });
            local[k] >= leaf.reach[k][0] - low && local[k] <= leaf.reach[k][1] + high
        });
        if counts {
            self.offer(query, index, Candidate { local, t: root.t, settled: Some(root.uv), ..found });
        } else if self.geometry.is_pole(patch, query.o + query.d * root.t, TANGENT) {
            // The parameters of a pole are any: beside it they say nothing of where the face ends.
            self.leave_open(query, index, found);
        }
    }

    /// Flags a root that nothing tells, from where on it may lie along the ray: anywhere in the leaf's extent.
    fn leave_open(&self, query: &mut Query, index: u32, found: Candidate) {
        let leaf = &self.leaves[index as usize];
        // Two radii before the root: no point of the leaf lies nearer.
        query.undecided_from = query.undecided_from.min(found.t - 2.0 * leaf.radius);
        self.offer(query, index, Candidate { certainty: Certainty::Uncertified, ..found });
    }
}
