//! Trees of obvhs over boxes, and boxes that are many times the same one.
//!
//! obvhs joins, pass by pass, neighbours in its list that are each other's nearest. Among boxes that are all equal these are the last two
//! alone: as many passes as boxes, and a tree as deep. Such boxes therefore stand in the tree as one primitive with many members, which no
//! walk is slower for, as a ray that meets one of them meets all.

use glam::Vec3A;
use obvhs::aabb::Aabb as Box32;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh};
use obvhs::ploc::PlocBuilder;
use obvhs::{Boundable, BvhBuildParams};
use rustc_hash::{FxBuildHasher, FxHashMap};
use std::hash::BuildHasher;
use std::ops::Range;

/// Equal boxes that are left to obvhs, whose passes they cost: both halves of a rectangle have one box, and facets that lie on each other.
const FEW_EQUAL: u32 = 64;
/// Counters of boxes, by their hash: a quarter of a megabyte, which stays in the cache.
const COUNTERS: usize = 1 << 16;
/// By how many times more than on average a counter may count without a reason to look closer.
const CROWDED: usize = 8;

/// The tree of obvhs, binary or of eight.
pub(super) enum Tree {
    Empty,
    Binary(Bvh2),
    Wide(CwBvh),
}

impl Tree {
    /// The primitives in the order in which leaves name them.
    pub(super) fn order(&self) -> &[u32] {
        match self {
            Self::Empty => &[],
            Self::Binary(tree) => &tree.primitive_indices,
            Self::Wide(tree) => &tree.primitive_indices,
        }
    }

    pub(super) fn bytes(&self) -> usize {
        match self {
            Self::Empty => 0,
            Self::Binary(tree) => size_of_val(&*tree.nodes) + size_of_val(&*tree.primitive_indices),
            Self::Wide(tree) => size_of_val(&*tree.nodes) + size_of_val(&*tree.primitive_indices),
        }
    }
}

/// A box as obvhs requires it.
#[derive(Clone, Copy)]
pub(super) struct Bounded(pub(super) Box32);

impl Boundable for Bounded {
    fn aabb(&self) -> Box32 {
        self.0
    }
}

/// Builds a wide tree over boxes, at least one, by the steps of `obvhs::cwbvh::builder::build_cwbvh`; where it is too deep for the 32
/// places of its stack, returns the binary tree it comes from.
pub(super) fn wide_or_binary(boxes: &[Bounded], params: &BvhBuildParams) -> Tree {
    let all = (0..boxes.len() as u32).collect();
    let (distance, threshold) = (params.ploc_search_distance, params.search_depth_threshold);
    let mut binary =
        PlocBuilder::with_capacity(boxes.len()).build(distance, boxes, all, params.sort_precision, threshold);
    ReinsertionOptimizer::default().run(&mut binary, params.reinsertion_batch_ratio, None);
    let wide = bvh2_to_cwbvh(&binary, params.max_prims_per_leaf.clamp(1, 3), true, false);
    if depth(&wide) < 32 { Tree::Wide(wide) } else { Tree::Binary(binary) }
}

/// Levels of nodes below each other, the root's included: 1 for a root alone.
fn depth(tree: &CwBvh) -> u32 {
    let mut deepest = 0;
    let mut open = vec![(0, 1)];
    while let Some((index, depth)) = open.pop() {
        deepest = deepest.max(depth);
        let Some(node) = tree.nodes.get(index as usize) else { continue };
        open.extend((0..node.imask.count_ones()).map(|k| (node.child_base_idx + k, depth + 1)));
    }
    deepest
}

/// Boxes by primitives of a tree: those that are equal are members of one.
pub(super) struct EqualBoxes {
    /// Members of each primitive, by their places in the list of boxes, in its order.
    members: Vec<Vec<u32>>,
}

impl EqualBoxes {
    /// Looks for boxes that are equal to the last bit; `None` where none is there much more than [`FEW_EQUAL`] times, so that each may be a
    /// primitive of its own.
    pub(super) fn find(boxes: &[Bounded]) -> Option<Self> {
        let mut counts = vec![0u32; COUNTERS];
        let limit = FEW_EQUAL as usize + CROWDED * boxes.len() / COUNTERS;
        let mut is_crowded = false;
        for bounded in boxes {
            let hash = FxBuildHasher.hash_one(bits(bounded));
            let count = &mut counts[(hash ^ (hash >> 32)) as usize % COUNTERS];
            *count += 1;
            is_crowded |= *count as usize > limit;
        }
        is_crowded.then(|| Self::group(boxes))
    }

    fn group(boxes: &[Bounded]) -> Self {
        let mut members: Vec<Vec<u32>> = Vec::new();
        let mut known: FxHashMap<[u32; 6], usize> = FxHashMap::default();
        for (k, bounded) in boxes.iter().enumerate() {
            let primitive = *known.entry(bits(bounded)).or_insert(members.len());
            if primitive == members.len() {
                members.push(Vec::new());
            }
            members[primitive].push(k as u32);
        }
        Self { members }
    }

    /// Returns one of `list`, which is parallel to the boxes, for each primitive: that of its first member.
    pub(super) fn first_of_each<T: Copy>(&self, list: &[T]) -> Vec<T> {
        self.members.iter().map(|members| list[members[0] as usize]).collect()
    }

    /// Returns the places of all members, in the `order` of primitives, and where those of each primitive lie among them.
    pub(super) fn in_order(&self, order: &[u32]) -> (Vec<u32>, MemberRanges) {
        let (mut places, mut starts) = (Vec::new(), vec![0]);
        for &primitive in order {
            places.extend(&self.members[primitive as usize]);
            starts.push(places.len() as u32);
        }
        (places, MemberRanges { starts: Some(starts) })
    }
}

/// Where the members of each primitive lie in a list that has them in the order of primitives.
#[derive(Default)]
pub(super) struct MemberRanges {
    /// Where those of each primitive begin, and the end of the list; `None` where each primitive has one.
    starts: Option<Vec<u32>>,
}

impl MemberRanges {
    /// The members of a primitive.
    pub(super) fn of(&self, primitive: usize) -> Range<usize> {
        match &self.starts {
            None => primitive..primitive + 1,
            Some(starts) => starts[primitive] as usize..starts[primitive + 1] as usize,
        }
    }

    pub(super) fn bytes(&self) -> usize {
        self.starts.as_ref().map_or(0, |starts| size_of_val(&**starts))
    }
}

fn bits(bounded: &Bounded) -> [u32; 6] {
    let corner = |p: Vec3A| p.to_array().map(f32::to_bits);
    let ([a, b, c], [d, e, f]) = (corner(bounded.0.min), corner(bounded.0.max));
    [a, b, c, d, e, f]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_box(x: f32) -> Bounded {
        Bounded(Box32 { min: Vec3A::new(x, 0.0, 0.0), max: Vec3A::new(x + 1.0, 1.0, 1.0) })
    }

    #[test]
    fn boxes_that_are_there_many_times_are_one_primitive() {
        // As a mesh of rectangles has them: two of each.
        let pairs: Vec<Bounded> = (0..1000).map(|k| unit_box((k / 2) as f32)).collect();
        assert!(EqualBoxes::find(&pairs).is_none());
        let mut boxes = vec![unit_box(0.0); 20_000];
        boxes.insert(7, unit_box(3.0));
        let equal = EqualBoxes::find(&boxes).unwrap();
        let lengths: Vec<usize> = equal.members.iter().map(Vec::len).collect();
        assert_eq!(lengths, [20_000, 1]);
        assert_eq!(equal.first_of_each(&boxes).len(), 2);
        let (places, ranges) = equal.in_order(&[1, 0]);
        assert_eq!((places[0], ranges.of(0), ranges.of(1)), (7, 0..1, 1..20_001));
        assert_eq!(MemberRanges::default().of(5), 5..6);
        // Trees over few primitives are shallow, however many members these have.
        let params = BvhBuildParams::medium_build();
        let Tree::Wide(tree) = wide_or_binary(&equal.first_of_each(&boxes), &params) else { panic!() };
        assert_eq!((depth(&tree), tree.primitive_indices.len()), (1, 2));
    }
}
