//! Usages that are referred to but are not in the file: their relationships still give the place of a component and its product.

use super::assembly::Assembly;
use super::open_usages::{OpenUsages, PlacedBy};
use super::relations::{has_transformation, property_attributes, related_representations, usage_attributes};
use super::usage_ends::UsageEnds;
use super::usage_names::{Usage, UsagePlacement};
use crate::step::part21::Entity;
use rustc_hash::{FxHashMap, FxHashSet};

/// A usage that is not in the file, as far as its relationship gives it.
pub(super) struct LostUsage {
    /// The CONTEXT_DEPENDENT_SHAPE_REPRESENTATION that refers to it.
    by: u64,
    pub(super) relation: u64,
    /// Says what is missing.
    absence: String,
    parent: u64,
    child: u64,
    placement: UsagePlacement,
}

/// Says that an attribute refers to nothing.
fn absence(what: &str, id: Option<u64>) -> String {
    id.map_or_else(|| format!("it names no {what}"), |id| format!("its {what} #{id} is not in the file"))
}

impl<'f, 'a> Assembly<'f, 'a> {
    /// Returns the usage that a CONTEXT_DEPENDENT_SHAPE_REPRESENTATION means whose relationship or usage is not in the file, where the
    /// representations of the relationship are those of two products; else `None`, which is noted. `used` are the relationships of usages
    /// that are there.
    pub(super) fn lost_usage(
        &mut self,
        e: Entity<'f, 'a>,
        ends: &UsageEnds,
        used: &FxHashSet<u64>,
    ) -> Option<LostUsage> {
        let args = e.args();
        let Some(relation) = args.entity(0) else {
            let absence = absence("relationship", args.id(0));
            self.problems.push(format!("#{}: {absence}: it places nothing", e.id));
            return None;
        };
        let absence = match args.entity(1) {
            Some(shape) => absence("usage", property_attributes(shape).id(2)),
            None => absence("PRODUCT_DEFINITION_SHAPE", args.id(1)),
        };
        let told = |what: &str| format!("#{}: {absence}; its relationship #{} {what}", e.id, relation.id);
        if used.contains(&relation.id) {
            self.problems.push(told("is that of another usage, which is used"));
            return None;
        }
        let Some([first, second]) = related_representations(relation) else {
            self.problems.push(told("lacks a representation: it places nothing"));
            return None;
        };
        let Some([child, parent]) = self.shown_products([first, second]) else {
            self.problems.push(told("counts without it"));
            return None;
        };
        let are_swapped = ends.are_swapped([child, parent]);
        let placement = if !has_transformation(relation) {
            UsagePlacement::Unstated
        } else if let Some(frame) = self.transformation(relation, [first, second]) {
            UsagePlacement::Stated(if are_swapped { frame.inverse() } else { frame })
        } else {
            UsagePlacement::Unreadable
        };
        let [parent, child] = if are_swapped { [child, parent] } else { [parent, child] };
        Some(LostUsage { by: e.id, relation: relation.id, absence, parent, child, placement })
    }

    /// Lets lost usages place their components, but where a usage puts them already: each by a usage of the same two products that has no
    /// placement, or else by one of its own.
    pub(super) fn restore_usages(&mut self, usages: &mut FxHashMap<u64, Vec<Usage>>, lost: Vec<LostUsage>) {
        let file = self.file;
        let mut open: FxHashMap<u64, OpenUsages> = FxHashMap::default();
        for LostUsage { by, relation, absence, parent, child, placement } in lost {
            let own = usages.entry(parent).or_default();
            let added = Usage { child, name: String::new(), id: by, placement };
            let told = match open.entry(parent).or_insert_with(|| OpenUsages::new(own)).place(own, added) {
                PlacedBy::Standing(id) => {
                    // What stands for a lost usage is none.
                    let is_usage = file.entity(id).and_then(usage_attributes).is_some();
                    let what = if is_usage { "usage".into() } else { file.entity_name(id) };
                    format!(
                        "{what} #{id} puts product #{child} where its relationship #{relation} does: it counts once"
                    )
                }
                PlacedBy::Free(id) => {
                    format!("usage #{id}, which has no place, takes that of its relationship #{relation}")
                }
                PlacedBy::Added => {
                    format!("its relationship #{relation} places product #{child} in #{parent} all the same")
                }
            };
            self.problems.push(format!("#{by}: {absence}; {told}"));
        }
    }
}
