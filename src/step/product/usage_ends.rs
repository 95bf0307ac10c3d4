//! The ends of usages: which product uses which, for writers swap the ends of relationships; and which uses another by way of others.

use super::usage_names::Usage;
use rustc_hash::{FxHashMap, FxHashSet};
use std::ops::Range;

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
    pub(super) fn one_way(&self, pairs: &[[u64; 2]]) -> FxHashSet<[u64; 2]> {
        if pairs.is_empty() {
            return FxHashSet::default();
        }
        let mut users: FxHashMap<u64, Vec<u64>> = FxHashMap::default();
        for [parent, child] in &self.pairs {
            users.entry(*child).or_default().push(*parent);
        }
        let both_ways: Vec<[u64; 2]> =
            pairs.iter().flat_map(|&[first, second]| [[first, second], [second, first]]).collect();
        let above = ProductsAbove::new(both_ways.iter().map(|pair| pair[1]), &users);
        let used = above.pairs_in_use(&both_ways);
        let is_one_way =
            |&[first, second]: &[u64; 2]| used.contains(&[first, second]) && !used.contains(&[second, first]);
        pairs.iter().copied().filter(is_one_way).collect()
    }
}

/// Components that one sweep follows upwards: each has a bit of a number.
const SWEPT_AT_ONCE: usize = u64::BITS as usize;

/// Components and all that is above them, numbered so that what uses a product comes behind it, except in a circle of usages.
pub(super) struct ProductsAbove {
    products: Vec<u64>,
    numbers: FxHashMap<u64, usize>,
    /// The numbers of what uses each product.
    users: Vec<Vec<usize>>,
    has_circles: bool,
}

impl ProductsAbove {
    /// Numbers the components and what is above them; `users` are the products that use each.
    pub(super) fn new(components: impl IntoIterator<Item = u64>, users: &FxHashMap<u64, Vec<u64>>) -> Self {
        let users_of = |product: u64| users.get(&product).map_or(&[][..], Vec::as_slice);
        let mut products: Vec<u64> = Vec::new();
        let mut seen: FxHashSet<u64> = FxHashSet::default();
        for component in components {
            if !seen.insert(component) {
                continue;
            }
            // Depth first: a product is done once all that is above it is.
            let mut path = vec![(component, users_of(component).iter())];
            while let Some((product, rest)) = path.last_mut() {
                match rest.next() {
                    Some(&user) if seen.insert(user) => path.push((user, users_of(user).iter())),
                    Some(_) => {}
                    None => {
                        products.push(*product);
                        path.pop();
                    }
                }
            }
        }
        products.reverse();
        let numbers: FxHashMap<u64, usize> = products.iter().enumerate().map(|(k, id)| (*id, k)).collect();
        let users: Vec<Vec<usize>> =
            products.iter().map(|id| users_of(*id).iter().map(|user| numbers[user]).collect()).collect();
        let has_circles = users.iter().enumerate().any(|(k, users)| users.iter().any(|user| *user <= k));
        Self { products, numbers, users, has_circles }
    }

    /// Returns those of some pairs of a product and a component in which the product uses the component, by itself or by way of others.
    pub(super) fn pairs_in_use(&self, pairs: &[[u64; 2]]) -> FxHashSet<[u64; 2]> {
        let number = |id: &u64| self.numbers.get(id).copied();
        // What has no number is above no component.
        let mut numbered: Vec<[usize; 2]> =
            pairs.iter().filter_map(|[product, component]| Some([number(component)?, number(product)?])).collect();
        numbered.sort_unstable();
        let by_component: Vec<&[[usize; 2]]> = numbered.chunk_by(|a, b| a[0] == b[0]).collect();
        let mut found = FxHashSet::default();
        for pairs in by_component.chunks(SWEPT_AT_ONCE) {
            let window = self.window(pairs);
            let components: Vec<usize> = pairs.iter().map(|pairs| pairs[0][0]).collect();
            let below = self.sweep(&components, &window);
            for (bit, pairs) in pairs.iter().enumerate() {
                for &[component, product] in pairs.iter().filter(|pair| window.contains(&pair[1])) {
                    if below[product - window.start] & (1 << bit) != 0 {
                        found.insert([self.products[product], self.products[component]]);
                    }
                }
            }
        }
        found
    }

    /// Returns the numbers between which all ways from these components up to the products lie that are asked for.
    fn window(&self, pairs: &[&[[usize; 2]]]) -> Range<usize> {
        if self.has_circles {
            return 0..self.products.len();
        }
        let numbers = pairs.iter().flat_map(|pairs| pairs.iter());
        let [start, end] = numbers.fold([usize::MAX, 0], |[start, end], [component, product]| {
            [start.min(*component), end.max(product + 1)]
        });
        start..end.max(start)
    }

    /// Returns for each product in `window` the bits of the components that it uses, by itself or by way of others in there.
    fn sweep(&self, components: &[usize], window: &Range<usize>) -> Vec<u64> {
        let mut below = vec![0u64; window.len()];
        // A component is below itself in a circle only.
        for (bit, component) in components.iter().enumerate() {
            for user in self.users[*component].iter().filter(|user| window.contains(*user)) {
                below[user - window.start] |= 1 << bit;
            }
        }
        let mut open: Vec<usize> = Vec::new();
        for k in window.clone() {
            open.push(k);
            while let Some(product) = open.pop() {
                let bits = below[product - window.start];
                for &user in self.users[product].iter().filter(|user| window.contains(*user)) {
                    let known = &mut below[user - window.start];
                    let is_behind = bits & !*known != 0 && user <= k;
                    *known |= bits;
                    // The sweep has passed it: a circle leads back to it, at most once for each bit.
                    if is_behind {
                        open.push(user);
                    }
                }
            }
        }
        below
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
        let above = ProductsAbove::new(pairs.iter().map(|pair| pair[1]), &users(usages));
        let mut found: Vec<[u64; 2]> = above.pairs_in_use(pairs).into_iter().collect();
        found.sort_unstable();
        found
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
        let one_way = ends(&[[1, 2], [2, 3]]).one_way(&pairs);
        assert_eq!(one_way, FxHashSet::from_iter([[1, 3], [1, 2]]));
        let in_circle = ends(&[[1, 2], [2, 3], [3, 1], [3, 4]]).one_way(&pairs);
        assert_eq!(in_circle, FxHashSet::from_iter([[3, 4]]));
    }

    #[test]
    fn what_is_in_a_circle_uses_itself() {
        for usages in [[[1, 2], [2, 3], [3, 1], [3, 4]], [[3, 4], [3, 1], [2, 3], [1, 2]]] {
            let pairs = [[1, 1], [2, 1], [3, 2], [1, 4], [4, 1], [4, 4]];
            assert_eq!(in_use(&usages, &pairs), [[1, 1], [1, 4], [2, 1], [3, 2]], "{usages:?}");
        }
    }

    /// Each of a chain of products is promised to the third above it, or all to the first.
    #[test]
    fn a_long_chain_is_swept_in_short_windows() {
        const LENGTH: u64 = 12_000;
        let usages: Vec<[u64; 2]> = (1..LENGTH).map(|k| [k - 1, k]).collect();
        let near: Vec<[u64; 2]> = (3..LENGTH).map(|k| [k - 3, k]).collect();
        let far: Vec<[u64; 2]> = (1..LENGTH).map(|k| [0, k]).collect();
        let upwards: Vec<[u64; 2]> = (3..LENGTH).map(|k| [k, k - 3]).collect();
        assert_eq!(in_use(&usages, &near), near);
        assert_eq!(in_use(&usages, &far), far);
        assert!(in_use(&usages, &upwards).is_empty());
        let above = ProductsAbove::new(3..LENGTH, &users(&usages));
        // 64 components next to each other, the first at number 0, and three products above the last.
        let pairs: Vec<[usize; 2]> = (0..SWEPT_AT_ONCE).map(|k| [k, k + 3]).collect();
        let by_component: Vec<&[[usize; 2]]> = pairs.chunks(1).collect();
        assert_eq!(above.window(&by_component), 0..SWEPT_AT_ONCE + 3);
    }
}
