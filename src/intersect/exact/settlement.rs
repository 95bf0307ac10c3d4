//! Roots whose place `f64` leaves open, settled by the surface as given.
//!
//! A root found in `f64` is right to its margin: rounding across the ray over the sine at which the ray meets the leaf. Where the margin
//! reaches over the leaf's border the root may be another leaf's, or lie beside the face; where it is large, t is as open. Such roots
//! are few, and are found again in 32 digits. What these leave open too is flagged, never certified.

use super::acceptance::Candidate;
use super::leaf::{Leaf, border_sides};
use super::patch::Patch;
use super::query::Query;
use super::reference::SettledRoot;
use super::structure::Exact;
use super::tolerances::{COORDINATE_ROUNDING, ROUND, contact_distance};
use crate::intersect::Certainty;
use crate::math::Uv;

/// Roots with a larger margin are settled wherever they lie, as a share of the leaf: of a leaf of 10 mm, 10 nm along the surface.
pub(super) const LOOSE: f64 = 1e-6;
/// Roots with a larger margin are settled where that reaches over the leaf's border: ten times where Newton's method ends, so that
/// no face is certified farther beside its border than a shared one is blurred.
const AMBIGUOUS: f64 = 1e-11;
/// A settled root farther than this many margins from the one that `f64` found is another one.
const STRAYED: f64 = 4.0;
/// Clipping steps that settling a root counts as: twenty microseconds.
const SETTLEMENT_WORK: u32 = 40;

/// Whether the place of a root with this margin, both in parameters of its leaf, must be settled in 32 digits.
#[inline(always)]
pub(super) fn needs_settling(local: [f64; 2], margin: [f64; 2]) -> bool {
    let open = |x: f64, margin: f64| margin > LOOSE || margin > AMBIGUOUS && !(x > margin && x < 1.0 - margin);
    open(local[0], margin[0]) || open(local[1], margin[1])
}

/// Position of a root relative to a leaf.
enum Place {
    OnLeaf,
    /// Beyond, where it is not the root of a neighbour's.
    Beside,
    /// Beyond the end of a closed surface, within its rounding.
    InCrack,
}

impl Exact {
    /// Finds a root on the leaf `index` again in 32 digits, and offers it if it lies on the leaf; where they find none near, or the budget
    /// is spent, offers it as uncertified and leaves the ray undecided there. Takes [`SETTLEMENT_WORK`] off the budget. `margin` is in
    /// parameters of the leaf.
    #[cold]
    pub(super) fn settle(&self, query: &mut Query, index: u32, found: Candidate, margin: [f64; 2]) {
        // Charged to the ray's budget and given up with it, so that a ray along a border, of which every root is open, ends as others do.
        if query.budget == 0 {
            return self.leave_open(query, index, found);
        }
        query.budget = query.budget.saturating_sub(SETTLEMENT_WORK);
        let leaf = &self.leaves[index as usize];
        let patch = &self.geometry.patches[leaf.patch as usize];
        let start = leaf.patch_parameters(found.local);
        let settled = self.geometry.reference(patch).settle([query.o, query.d], start);
        let near = |local: [f64; 2]| {
            (0..2).all(|k| (local[k] - found.local[k]).abs() <= (STRAYED * margin[k]).max(AMBIGUOUS))
        };
        let root = settled.filter(|root| near(leaf.leaf_parameters(root.local)));
        let Some(root) = root else {
            // Singular, or Newton's method ran to another root.
            return self.leave_open(query, index, found);
        };
        self.offer_settled(query, index, &root, margin);
    }

    /// Offers a root in 32 digits as certified if it lies on the leaf, as uncertified in the crack of a seam or at a pole, else not at all.
    pub(super) fn offer_settled(&self, query: &mut Query, index: u32, root: &SettledRoot, margin: [f64; 2]) {
        let leaf = &self.leaves[index as usize];
        let patch = &self.geometry.patches[leaf.patch as usize];
        let local = leaf.leaf_parameters(root.local);
        let found = Candidate { local, t: root.t, certainty: Certainty::Certified, settled: Some(root.uv) };
        match self.place_on_leaf(leaf, patch, margin, (root.uv, local)) {
            Place::OnLeaf => self.offer(query, index, found),
            Place::InCrack => self.leave_open(query, index, found),
            // The parameters of a pole are any: beside it they say nothing of where the face ends.
            Place::Beside if self.is_at_pole(query, patch, root.t) => self.leave_open(query, index, found),
            Place::Beside => {}
        }
    }

    /// Whether the ray's point at `t` is a pole of the patch's surface: within a contact, and what rounds the point.
    fn is_at_pole(&self, query: &Query, patch: &Patch, t: f64) -> bool {
        let reach = query.o.abs().max_element() + t.abs();
        let distance = contact_distance(patch.size()) + COORDINATE_ROUNDING * ROUND * reach;
        self.geometry.is_pole(patch, query.o + query.d * t, distance)
    }

    /// Returns whether a root in 32 digits lies on the leaf that found it.
    ///
    /// Over an inner border the surface goes on, and in its own numbers without a gap: de Boor's points of two spans agree on their knot to
    /// 30 digits. So a ray that meets the face meets it on a leaf by that leaf's own polynomial, and that leaf's test in `f64`, which
    /// excludes nothing within its margin, finds it there; a root of the polynomial beyond its leaf need not count, and over a crease it is
    /// no point of the face. What the change to the leaf's parameters rounds is worth far less than a contact along the surface, and
    /// within that of a leaf is on the face to the accuracy that a hit promises.
    ///
    /// Over a seam the surface comes back with control points of its own, rounded on their own: between both lies a crack as high as their
    /// rounding, and a ray at a small sine passes it over a way of up to the margin. Nothing shows whether it is meant to.
    fn place_on_leaf(&self, leaf: &Leaf, patch: &Patch, margin: [f64; 2], (uv, local): (Uv, [f64; 2])) -> Place {
        let reach = leaf.reach;
        let beyond = [0, 1].map(|k: usize| [reach[k][0] - local[k], local[k] - reach[k][1]]);
        let is_over = |k: usize, end: usize| beyond[k][end] > 0.0;
        let sides = [(0, 0), (0, 1), (1, 0), (1, 1)];
        if !sides.iter().any(|&(k, end)| is_over(k, end)) {
            return Place::OnLeaf;
        }
        let face = &self.geometry.faces[patch.face as usize];
        let grid = &self.geometry.grids[face.grid as usize];
        let border = border_sides(grid, patch, leaf.rect);
        if sides.iter().any(|&(k, end)| is_over(k, end) && border[k][end]) {
            return Place::Beside;
        }
        let tangents = self.geometry.reference(patch).tangents(uv);
        let way = |k: usize| {
            let width = leaf.rect[k][1] - leaf.rect[k][0];
            beyond[k][0].max(beyond[k][1]).max(0.0) * width * tangents[k].length()
        };
        let is_seam = |k: usize, end: usize| {
            let ends = [grid.breaks[k][0], grid.breaks[k][grid.breaks[k].len() - 1]];
            grid.closed[k] && leaf.rect[k][end] == end as f64 && patch.domain[k][end] == ends[end]
        };
        let within_margin = sides.iter().all(|&(k, end)| beyond[k][end] <= margin[k].min(LOOSE));
        if way(0) + way(1) <= contact_distance(patch.size()) && within_margin {
            Place::OnLeaf
        } else if within_margin && sides.iter().any(|&(k, end)| is_over(k, end) && is_seam(k, end)) {
            Place::InCrack
        } else {
            Place::Beside
        }
    }

    /// Offers a root that cannot be settled as uncertified, and leaves the ray undecided from two radii of the leaf before it on.
    fn leave_open(&self, query: &mut Query, index: u32, found: Candidate) {
        let leaf = &self.leaves[index as usize];
        // Two radii before the root: no point of the leaf lies nearer.
        query.undecided_from = query.undecided_from.min(found.t - 2.0 * leaf.radius);
        self.offer(query, index, Candidate { certainty: Certainty::Uncertified, ..found });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::exact::Settings;
    use crate::math::{Frame, Point, Ray, Vector};
    use crate::model::{Face, Model, Part, Shell};
    use crate::nurbs::sweep;

    #[test]
    fn another_root_is_not_taken_for_the_one_that_was_found() {
        let plane = Face::whole(sweep::plane(&Frame::IDENTITY, [[0.0, 100.0]; 2]));
        let shells = vec![Shell { faces: vec![plane], ..Shell::default() }];
        let model = Model::from_part(Part { shells, ..Part::default() });
        let exact = Exact::build(&model, &Settings::default());
        let leaf = exact.leaves[0].rect;
        assert_eq!((exact.leaves.len(), leaf), (1, [[0.0, 1.0]; 2]));
        let ray = Ray::new(Point::new(80.0, 50.0, 7.0), -Vector::Z);
        for (x, right) in [(0.8, true), (0.2, false)] {
            let mut query = Query::IDLE;
            query.restart(&ray, &exact.geometry, &exact.tree, exact.settings.budget);
            let found = Candidate { local: [x, 0.5], t: 7.0, certainty: Certainty::Certified, settled: None };
            exact.settle(&mut query, 0, found, [1e-9; 2]);
            assert_eq!(query.undecided_from == f64::INFINITY, right, "found at {x}");
        }
    }
}
