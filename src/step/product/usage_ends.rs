//! The ends of usages: which product uses which, for writers swap the ends of relationships; and which uses another by way of others.
//!
//! Known weakness: of 64 components each sweep goes up to the highest product that is asked for with one of them: with N products in one
//! chain, all asked for with the first, that is N²/128 steps.

use super::usage_names::Usage;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeMap;

/// Which products use which.
pub(super) struct UsageEnds {
    /// Parents with their children.
    pairs: FxHashSet<[u64; 2]>,
    parents: FxHashSet<u64>,
}

impl UsageEnds {
    /// Collects the ends of usages, which are given by their parents.
    pub(super) fn new(usages: &FxHashMap<u64, Vec<Usage>>) -> Self {
        let children = |(parent, usages): (&u64, &Vec<Usage>)| -> Vec<[u64; 2]> {
            usages.iter().map(|usage| [*parent, usage.child]).collect()
        };
        Self { pairs: usages.iter().flat_map(children).collect(), parents: usages.keys().copied().collect() }
    }

    /// Whether a product uses others.
    pub(super) fn is_assembly(&self, product: u64) -> bool {
        self.parents.contains(&product)
    }

    /// Whether the first of two products uses the second, and is not used by it: in a relationship the second is the parent.
    pub(super) fn are_swapped(&self, [first, second]: [u64; 2]) -> bool {
        self.pairs.contains(&[first, second]) && !self.pairs.contains(&[second, first])
    }

    /// Returns those of some pairs of products in which the first uses the second, by itself or by way of others, and is not used by it.
    pub(super) fn one_way_pairs(&self, pairs: &[[u64; 2]]) -> FxHashSet<[u64; 2]> {
        // What is no assembly uses nothing.
        let candidates: Vec<[u64; 2]> = pairs.iter().copied().filter(|pair| self.is_assembly(pair[0])).collect();
        if candidates.is_empty() {
            return FxHashSet::default();
        }
        let mut users: FxHashMap<u64, Vec<u64>> = FxHashMap::default();
        for [parent, child] in &self.pairs {
            users.entry(*child).or_default().push(*parent);
        }
        let both_ways: Vec<[u64; 2]> =
            candidates.iter().flat_map(|&[first, second]| [[first, second], [second, first]]).collect();
        let products = ProductsAbove::new(both_ways.iter().map(|pair| pair[1]), &users);
        let in_use = products.pairs_in_use(&both_ways);
        let is_one_way =
            |&[first, second]: &[u64; 2]| in_use.contains(&[first, second]) && !in_use.contains(&[second, first]);
        candidates.into_iter().filter(is_one_way).collect()
    }
}

/// Components that one sweep follows upwards: each has a bit of a number.
const SWEPT_AT_ONCE: usize = u64::BITS as usize;

/// Components and all that is above them, numbered so that what uses a product comes behind it; those of a circle have one number.
pub(super) struct ProductsAbove {
    numbers: FxHashMap<u64, usize>,
    /// The numbers of what uses the products of each number, rising; its own is the first in a circle.
    users: Vec<Vec<usize>>,
}

/// A query whether a product uses a component; in order of the component.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct NumberedPair {
    /// The number of the component.
    component: usize,
    /// The number of the product.
    product: usize,
    /// The product and the component in the file.
    ids: [u64; 2],
}

impl ProductsAbove {
    /// Numbers the components and what is above them; `users` are the products that use each.
    pub(super) fn new(components: impl IntoIterator<Item = u64>, users: &FxHashMap<u64, Vec<u64>>) -> Self {
        let mut search = CircleSearch::default();
        components.into_iter().for_each(|component| search.follow(component, users));
        let CircleSearch { mut numbers, count, .. } = search;
        // A circle is complete after all that is above it.
        numbers.values_mut().for_each(|number| *number = count - 1 - *number);
        let mut users_by_number: Vec<Vec<usize>> = vec![Vec::new(); count];
        for (product, number) in &numbers {
            let product_users = users.get(product).into_iter().flatten();
            users_by_number[*number].extend(product_users.map(|user| numbers[user]));
        }
        for numbered_users in &mut users_by_number {
            numbered_users.sort_unstable();
            numbered_users.dedup();
        }
        Self { numbers, users: users_by_number }
    }

    /// Returns those of some pairs of a product and a component in which the product uses the component, by itself or by way of others.
    pub(super) fn pairs_in_use(&self, pairs: &[[u64; 2]]) -> FxHashSet<[u64; 2]> {
        let mut numbered_pairs: Vec<NumberedPair> =
            pairs.iter().filter_map(|pair| self.number_pair(*pair)).collect();
        numbered_pairs.sort_unstable();
        let by_component: Vec<&[NumberedPair]> =
            numbered_pairs.chunk_by(|a, b| a.component == b.component).collect();
        let mut in_use = FxHashSet::default();
        for batch in by_component.chunks(SWEPT_AT_ONCE) {
            let components: Vec<usize> = batch.iter().map(|same_component| same_component[0].component).collect();
            let last = batch.iter().copied().flatten().map(|pair| pair.product).max().unwrap_or(0);
            let bits_by_user = self.sweep(&components, last);
            for (bit, same_component) in batch.iter().enumerate() {
                let is_used = |pair: &&NumberedPair| {
                    bits_by_user.get(&pair.product).is_some_and(|bits| *bits & (1 << bit) != 0)
                };
                in_use.extend(same_component.iter().filter(is_used).map(|pair| pair.ids));
            }
        }
        in_use
    }

    /// Returns a product and a component with their numbers; `None` where the numbers show that the one does not use the other: that of
    /// which nothing is above, or what comes behind the product.
    fn number_pair(&self, ids: [u64; 2]) -> Option<NumberedPair> {
        // What has no number is above no component.
        let [product, component] = [*self.numbers.get(&ids[0])?, *self.numbers.get(&ids[1])?];
        let may_use = component <= product && !self.users[component].is_empty();
        may_use.then_some(NumberedPair { component, product, ids })
    }

    /// Returns for each number up to `last` whose products use some of these components, by themselves or by way of others, the bits of
    /// those.
    fn sweep(&self, components: &[usize], last: usize) -> FxHashMap<usize, u64> {
        let mut front: BTreeMap<usize, u64> = BTreeMap::new();
        for (bit, component) in components.iter().enumerate() {
            for user in self.users[*component].iter().take_while(|user| **user <= last) {
                *front.entry(*user).or_default() |= 1 << bit;
            }
        }
        let mut bits_by_user: FxHashMap<usize, u64> = FxHashMap::default();
        // What uses the first is behind it: no more bits come to that.
        while let Some((number, bits)) = front.pop_first() {
            bits_by_user.insert(number, bits);
            let users = self.users[number].iter().take_while(|user| **user <= last);
            for user in users.filter(|user| **user != number) {
                *front.entry(*user).or_default() |= bits;
            }
        }
        bits_by_user
    }
}

/// The search for circles of usages, upwards and depth first: products that use each other both ways. One that is in none is
/// complete by itself.
///
/// Source: H. N. Gabow, Path-based depth-first search for strong and biconnected components, Information Processing Letters 74 (2000).
#[derive(Default)]
struct CircleSearch {
    /// The position that each product got in `open` when it was met.
    positions: FxHashMap<u64, usize>,
    /// Products whose circles may not be complete.
    open: Vec<u64>,
    /// The positions in `open` at which circles begin, as far as is known.
    starts: Vec<usize>,
    /// The number of the circle of each other product, in the order in which they were complete.
    numbers: FxHashMap<u64, usize>,
    /// The number of complete circles.
    count: usize,
}

impl CircleSearch {
    /// Completes the circles of a product and of all that is above it; `users` are the products that use each.
    fn follow(&mut self, component: u64, users: &FxHashMap<u64, Vec<u64>>) {
        if self.positions.contains_key(&component) {
            return;
        }
        let users_of = |product: u64| users.get(&product).map_or(&[][..], Vec::as_slice);
        self.enter(component);
        let mut path = vec![(component, users_of(component).iter())];
        while let Some((product, rest)) = path.last_mut() {
            let Some(&user) = rest.next() else {
                self.leave(*product);
                path.pop();
                continue;
            };
            match self.positions.get(&user).copied() {
                None => {
                    self.enter(user);
                    path.push((user, users_of(user).iter()));
                }
                // All that was met since is between it and what it uses: one circle.
                Some(position) if !self.numbers.contains_key(&user) => {
                    while self.starts.last().is_some_and(|start| *start > position) {
                        self.starts.pop();
                    }
                }
                Some(_) => {}
            }
        }
    }

    /// Opens a circle for a product that is met.
    fn enter(&mut self, product: u64) {
        self.positions.insert(product, self.open.len());
        self.starts.push(self.open.len());
        self.open.push(product);
    }

    /// Completes the circle that begins with a product above which all was followed, if one does.
    fn leave(&mut self, product: u64) {
        let position = self.positions[&product];
        if self.starts.last() != Some(&position) {
            return;
        }
        self.starts.pop();
        for member in self.open.drain(position..) {
            self.numbers.insert(member, self.count);
        }
        self.count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the products that use each, of pairs of a product and what it uses.
    fn users(usages: &[[u64; 2]]) -> FxHashMap<u64, Vec<u64>> {
        let mut users: FxHashMap<u64, Vec<u64>> = FxHashMap::default();
        usages.iter().for_each(|[parent, child]| users.entry(*child).or_default().push(*parent));
        users
    }

    fn in_use(usages: &[[u64; 2]], pairs: &[[u64; 2]]) -> Vec<[u64; 2]> {
        let products = ProductsAbove::new(pairs.iter().map(|pair| pair[1]), &users(usages));
        let mut in_use: Vec<[u64; 2]> = products.pairs_in_use(pairs).into_iter().collect();
        in_use.sort_unstable();
        in_use
    }

    #[test]
    fn a_product_uses_what_those_below_it_use() {
        // A diamond over 5 and 6, and 7 on its own.
        let usages = [[1, 2], [1, 3], [2, 4], [3, 4], [4, 5], [3, 6], [7, 6]];
        let pairs =
            [[1, 5], [2, 5], [4, 5], [5, 5], [7, 5], [2, 6], [3, 6], [1, 6], [7, 6], [6, 1], [9, 5], [1, 9]];
        assert_eq!(in_use(&usages, &pairs), [[1, 5], [1, 6], [2, 5], [3, 6], [4, 5], [7, 6]]);
    }

    #[test]
    fn products_in_a_circle_use_each_other_both_ways() {
        let ends = |usages: &[[u64; 2]]| UsageEnds {
            pairs: usages.iter().copied().collect(),
            parents: usages.iter().map(|pair| pair[0]).collect(),
        };
        let pairs = [[1, 3], [3, 1], [1, 2], [3, 4]];
        let in_chain = ends(&[[1, 2], [2, 3]]).one_way_pairs(&pairs);
        assert_eq!(in_chain, FxHashSet::from_iter([[1, 3], [1, 2]]));
        let in_circle = ends(&[[1, 2], [2, 3], [3, 1], [3, 4]]).one_way_pairs(&pairs);
        assert_eq!(in_circle, FxHashSet::from_iter([[3, 4]]));
    }

    #[test]
    fn what_is_in_a_circle_uses_itself() {
        for usages in [[[1, 2], [2, 3], [3, 1], [3, 4]], [[3, 4], [3, 1], [2, 3], [1, 2]]] {
            let pairs = [[1, 1], [2, 1], [3, 2], [1, 4], [4, 1], [4, 4]];
            assert_eq!(in_use(&usages, &pairs), [[1, 1], [1, 4], [2, 1], [3, 2]], "{usages:?}");
        }
    }

    /// Each fifth way in which four products may use each other and themselves, against the closure by Warshall.
    #[test]
    fn whole_graphs_are_in_use_as_their_closures_say() {
        let all: Vec<[u64; 2]> = (0..16).map(|k| [k / 4, k % 4]).collect();
        for graph in (0..1u32 << 16).step_by(5) {
            let usages: Vec<[u64; 2]> = (0..16_usize).filter(|k| graph & (1 << *k) != 0).map(|k| all[k]).collect();
            let mut closure = [[false; 4]; 4];
            usages.iter().for_each(|[parent, child]| closure[*parent as usize][*child as usize] = true);
            for (between, first, second) in (0..64_usize).map(|k| (k / 16, k / 4 % 4, k % 4)) {
                closure[first][second] |= closure[first][between] && closure[between][second];
            }
            let mut expected = all.clone();
            expected.retain(|[product, component]| closure[*product as usize][*component as usize]);
            assert_eq!(in_use(&usages, &all), expected, "{usages:?}");
        }
    }

    const LENGTH: u64 = 12_000;

    /// Each of a chain of products is promised to the third above it, or all to the first; the first two may use each other.
    #[test]
    fn a_long_chain_is_swept_in_short_steps() {
        let near: Vec<[u64; 2]> = (3..LENGTH).map(|k| [k - 3, k]).collect();
        let far: Vec<[u64; 2]> = (1..LENGTH).map(|k| [0, k]).collect();
        let upwards: Vec<[u64; 2]> = (3..LENGTH).map(|k| [k, k - 3]).collect();
        for circle in [None, Some([1, 0])] {
            let usages: Vec<[u64; 2]> = (1..LENGTH).map(|k| [k - 1, k]).chain(circle).collect();
            assert_eq!(in_use(&usages, &near), near, "{circle:?}");
            assert_eq!(in_use(&usages, &far), far, "{circle:?}");
            assert!(in_use(&usages, &upwards).is_empty(), "{circle:?}");
            let products = ProductsAbove::new(3..LENGTH, &users(&usages));
            // 64 components next to each other, the first at number 0, and three products above the last.
            let components: Vec<usize> = (0..SWEPT_AT_ONCE).collect();
            assert_eq!(products.sweep(&components, SWEPT_AT_ONCE + 2).len(), SWEPT_AT_ONCE + 2, "{circle:?}");
        }
    }

    /// The assembly is the last of all numbers.
    #[test]
    fn a_sweep_of_a_flat_assembly_reaches_the_assembly_alone() {
        let usages: Vec<[u64; 2]> = (1..LENGTH).map(|k| [0, k]).collect();
        assert_eq!(in_use(&usages, &usages), usages);
        let products = ProductsAbove::new(1..LENGTH, &users(&usages));
        let components: Vec<usize> = (0..SWEPT_AT_ONCE).collect();
        let reached = products.sweep(&components, LENGTH as usize - 1);
        assert_eq!(reached, FxHashMap::from_iter([(LENGTH as usize - 1, u64::MAX)]));
    }

    #[test]
    fn nothing_is_swept_for_what_numbers_tell() {
        let products = ProductsAbove::new([1, 2, 3], &users(&[[1, 2]]));
        let is_swept = |pair: [u64; 2]| products.number_pair(pair).is_some();
        assert!(is_swept([1, 2]));
        // Nothing uses 1 or 3, and 4 is above none of these.
        assert_eq!([[2, 1], [1, 3], [3, 1], [4, 2]].map(is_swept), [false; 4]);
        let chain = ProductsAbove::new([3], &users(&[[1, 2], [2, 3]]));
        assert!(chain.number_pair([3, 2]).is_none());
    }
}
