//! The usages of products: which of them count, what they are called, and where they put their components.
//!
//! Source: ISO 10303-44. Several entities may speak of one component in one assembly: those that promise or count it add none to those that
//! place it.

use super::assembly::Assembly;
use super::lost_usages::LostUsage;
use super::relations::{INDIVIDUAL_USAGE, PROMISE, is_promise, usage_attributes};
use super::subassemblies::ProductLink;
use super::usage_ends::ProductsAbove;
use super::usage_names::{Usage, UsagePlacement, name_usages};
use crate::math::Frame;
use crate::step::part21::Entity;
use rustc_hash::{FxHashMap, FxHashSet};

impl<'f, 'a> Assembly<'f, 'a> {
    /// Returns usages by their parents, promises last; their names and placements are not known yet.
    pub(super) fn read_usages(entities: &[Entity<'f, 'a>]) -> FxHashMap<u64, Vec<Usage>> {
        let mut usages: FxHashMap<u64, Vec<Usage>> = FxHashMap::default();
        let (promises, others): (Vec<Entity<'f, 'a>>, Vec<Entity<'f, 'a>>) =
            entities.iter().copied().partition(|e| is_promise(*e));
        for e in others.into_iter().chain(promises) {
            let ends = usage_attributes(e).and_then(|args| Some((args.id(3)?, args.id(4)?)));
            let Some((parent, child)) = ends else { continue };
            let usage = Usage { child, name: String::new(), id: e.id, placement: UsagePlacement::Unstated };
            usages.entry(parent).or_default().push(usage);
        }
        usages
    }

    /// Leaves out promises that are kept, where other usages below the same assembly use the component, which is noted for one that has a
    /// place; and those without a place of what is used anywhere else.
    fn leave_out_promises(&mut self, usages: &mut FxHashMap<u64, Vec<Usage>>) {
        let file = self.file;
        if file.entities_named(&[PROMISE]).next().is_none() {
            return;
        }
        let is_promised = |usage: &Usage| file.entity(usage.id).is_some_and(is_promise);
        let is_placed = |usage: &Usage| usage.placement != UsagePlacement::Unstated;
        // What uses each product.
        let mut users: FxHashMap<u64, Vec<u64>> = FxHashMap::default();
        let mut parents: Vec<u64> = Vec::new();
        // Promises with a place, by parent and component.
        let mut promised: Vec<[u64; 2]> = Vec::new();
        for (parent, siblings) in &*usages {
            for usage in siblings {
                if !is_promised(usage) {
                    users.entry(usage.child).or_default().push(*parent);
                    continue;
                }
                parents.push(*parent);
                if is_placed(usage) {
                    promised.push([*parent, usage.child]);
                }
            }
        }
        let kept = ProductsAbove::new(promised.iter().map(|pair| pair[1]), &users).pairs_in_use(&promised);
        parents.sort_unstable();
        parents.dedup();
        for parent in parents {
            let Some(siblings) = usages.get_mut(&parent) else { continue };
            siblings.retain(|usage| {
                if !is_promised(usage) {
                    return true;
                }
                if !is_placed(usage) {
                    return !users.contains_key(&usage.child);
                }
                let is_kept = kept.contains(&[parent, usage.child]);
                if is_kept {
                    self.problems.push(format!(
                        "#{}: promises product #{}, which other usages put into #{parent}: only these are used",
                        usage.id, usage.child
                    ));
                }
                !is_kept
            });
        }
    }

    /// Takes over the usages that count, each with its placement, once for each where it has several, and with its name; `lost` are those
    /// that are not in the file, `related` the relationships that stand for others.
    pub(super) fn settle_usages(
        &mut self,
        mut usages: FxHashMap<u64, Vec<Usage>>,
        lost: Vec<LostUsage>,
        related: Vec<ProductLink>,
    ) {
        for usages in usages.values_mut() {
            *usages = self.placed_usages(std::mem::take(usages));
        }
        self.leave_out_promises(&mut usages);
        self.restore_usages(&mut usages, lost);
        self.place_assemblies(&mut usages, related);
        for usages in usages.values_mut() {
            self.leave_out_counts(usages);
            name_usages(self.file, &mut self.products, usages);
        }
        self.usages = usages.into_iter().map(|(parent, usages)| (parent, usages.into())).collect();
    }

    /// Returns usages with their placements: one that has several once for each.
    fn placed_usages(&mut self, usages: Vec<Usage>) -> Vec<Usage> {
        let mut placed = Vec::with_capacity(usages.len());
        for usage in usages {
            let Usage { child, id, .. } = usage;
            let at =
                |frame: Frame| Usage { child, name: String::new(), id, placement: UsagePlacement::Stated(frame) };
            match self.placements.remove(&id) {
                None => placed.push(usage),
                Some(frames) if frames.is_empty() => {
                    placed.push(Usage { placement: UsagePlacement::Unreadable, ..usage });
                }
                Some(frames) => placed.extend(frames.into_iter().map(at)),
            }
        }
        placed
    }

    /// Leaves out usages of one product that place nothing, and only count or promise a component that another one puts there.
    fn leave_out_counts(&self, usages: &mut Vec<Usage>) {
        let is_individual = |id: u64| self.file.entity(id).is_some_and(|e| e.is_a(INDIVIDUAL_USAGE));
        let stands = |usage: &Usage| usage.placement != UsagePlacement::Unstated || is_individual(usage.id);
        let standing: FxHashSet<u64> =
            usages.iter().filter(|usage| stands(usage)).map(|usage| usage.child).collect();
        usages.retain(|usage| stands(usage) || !standing.contains(&usage.child));
    }
}
