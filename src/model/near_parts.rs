//! Which parts that are placed often stand so near a curved face of another one that both may have to have the same facets there.
//!
//! Guarantee: by boxes, so that none is left out; a face of a part that is placed seldom, such as a dome over an array, is cut until its
//! boxes lie along it.

use super::{Analytic, Face, Instance, Model, Part};
use crate::math::{Aabb, BoxTree, Frame};
use crate::nurbs::BezierPatch;

/// Times that a patch of a face that is placed seldom is halved each way at most, where it comes near parts that are placed often: the
/// boxes of a quarter of a circle then reach inward by less than a hundredth of its radius.
const HALVINGS: usize = 5;

/// The curved faces of the parts that are placed often, as boxes, and what was found of them.
struct NearSearch {
    tree: BoxTree,
    /// The instance of each box.
    owners: Vec<u32>,
    /// Of each instance, whether another is near.
    near: Vec<bool>,
    /// Around every box, mm.
    room: f64,
}

/// Returns for every instance whether it is of a part that is placed often and a curved face of another may lie on one of its own.
/// `often` says of each part whether it is; 0 or less of `glue_mm` finds none.
pub(super) fn near_another(model: &Model, often: &[bool], glue_mm: f64) -> Vec<bool> {
    if glue_mm <= 0.0 {
        return vec![false; model.instances.len()];
    }
    let is_often = |instance: &Instance| often[instance.part.0 as usize];
    let tight = |(part, often): (&Part, &bool)| {
        if *often { curved(part).map(Face::tight_box).collect() } else { Vec::new() }
    };
    let faces: Vec<Vec<Aabb>> = model.parts.iter().zip(often).map(tight).collect();
    let room = 0.5 * glue_mm;
    let (mut boxes, mut owners) = (Vec::new(), Vec::new());
    for (k, instance) in model.instances.iter().enumerate() {
        for face in &faces[instance.part.0 as usize] {
            boxes.push(face.placed(&instance.placement).grown(room));
            owners.push(k as u32);
        }
    }
    let tree = BoxTree::new(&boxes);
    let mut near = vec![false; model.instances.len()];
    for (bounds, &owner) in boxes.iter().zip(&owners) {
        let is_other = |k: u32| owners[k as usize] != owner;
        near[owner as usize] = near[owner as usize] || tree.any_meeting(bounds, is_other);
    }
    let mut search = NearSearch { tree, owners, near, room };
    for instance in model.instances.iter().filter(|instance| !is_often(instance)) {
        curved(model.part(instance.part)).for_each(|face| search.mark_near_face(face, &instance.placement));
    }
    search.near
}

/// The faces that are not plane.
fn curved(part: &Part) -> impl Iterator<Item = &Face> {
    let faces = part.shells.iter().flat_map(|s| &s.faces);
    faces.filter(|f| !matches!(f.analytic, Analytic::Plane { .. }))
}

impl NearSearch {
    /// Marks the instances that a placed face, which may stray from its edges by its gap, comes near to.
    fn mark_near_face(&mut self, face: &Face, placement: &Frame) {
        let room = face.gap * placement.scale;
        // Before the face is cut: most come near nothing.
        if self.meets_unmarked(&face.surface.bounds().placed(placement).grown(room)) {
            for patch in face.surface.bezier_patches() {
                self.mark_near_patch(&patch, (placement, room), 2 * HALVINGS);
            }
        }
    }

    /// Marks the instances whose boxes come near to a patch, which is halved so many times for boxes that fit better; `place` is the
    /// patch's placement and how far, mm, its face may stray.
    fn mark_near_patch(&mut self, patch: &BezierPatch, place: (&Frame, f64), halvings: usize) {
        let (placement, room) = place;
        let bounds = patch.bounds().placed(placement).grown(room);
        if !self.meets_unmarked(&bounds) {
            return;
        }
        if halvings > 0 {
            for half in patch.halves(halvings % 2) {
                self.mark_near_patch(&half, place, halvings - 1);
            }
            return;
        }
        let Self { tree, owners, near, room } = self;
        tree.any_meeting(&bounds.grown(*room), |k| {
            near[owners[k as usize] as usize] = true;
            false
        });
    }

    /// Whether the box of an owner that is not marked yet lies within the room of these bounds.
    fn meets_unmarked(&self, bounds: &Aabb) -> bool {
        self.tree.any_meeting(&bounds.grown(self.room), |k| !self.near[self.owners[k as usize] as usize])
    }
}
