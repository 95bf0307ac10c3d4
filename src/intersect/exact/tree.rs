//! The hierarchy over the leaves' axis-parallel boxes: eight children to a node, from a binary tree by the binned surface-area
//! heuristic.
//!
//! Boxes are kept in `f32` about the middle of the scene, rounded outward, so that a node fills four cache lines and its
//! eight slab tests run side by side; a reported hit is computed in `f64`. Eight instead of four, and `f32` all through,
//! took 5,152 leaves of a sphere from 6.5 nodes a ray to 4.4.

use crate::math::{Aabb, Vector};
use smallvec::{SmallVec, smallvec};
use std::ops::Range;

/// From this depth on splits are at the median, which bounds the depth of any tree.
const MEDIAN_DEPTH: usize = 40;
/// Bins of centres along each axis, of which the borders are the planes that are priced.
const BINS: usize = 16;
/// Marks a child that is a leaf.
pub(super) const LEAF: u32 = 1 << 31;
/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// Eight boxes about [`Tree::center`] and what is in them; absent ones hold nothing.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Node {
    /// Lower planes by axis and child, then upper ones.
    pub(super) planes: [[[f32; WIDTH]; 3]; 2],
    /// Index of a node, or of a leaf with [`LEAF`] set; absent children have empty boxes, which no ray meets.
    pub(super) child: [u32; WIDTH],
}

/// Nodes, root first.
#[derive(Debug)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    /// About which boxes are kept in single precision.
    pub(super) center: Vector,
    /// Around everything, in the world.
    pub(super) bounds: Aabb,
}

/// Boxes of a node of the binary tree that the wide one is collapsed from, with the box around them.
#[derive(Clone, Copy)]
struct Subtree {
    bounds: Aabb,
    /// Where the boxes stand in the order that splits make, from the first to behind the last.
    start: usize,
    end: usize,
    /// Splits above it.
    depth: usize,
}

impl Tree {
    /// Builds the hierarchy over the boxes of leaves, in the world, which keep their indices; without boxes it has no nodes.
    pub(super) fn build(boxes: &[Aabb]) -> Self {
        if boxes.is_empty() {
            return Self { nodes: Vec::new(), center: Vector::ZERO, bounds: Aabb::EMPTY };
        }
        // Halves are made where a wide node opens them: no binary tree stands in memory.
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let root = Subtree::new(boxes, &order, 0..boxes.len(), 0);
        let (bounds, center) = (root.bounds, root.bounds.center());
        let mut tree = Self { nodes: vec![Node::EMPTY], center, bounds };
        let mut stack = vec![(0usize, root)];
        while let Some((wide, from)) = stack.pop() {
            // The root may be a leaf by itself. Else the largest child is opened until there are eight: it is met most often, so that
            // opening it spares most visits (Wald, Benthin and Boulos 2008).
            let mut children: SmallVec<[Subtree; WIDTH]> = smallvec![from];
            while children.len() < WIDTH {
                let inner = (0..children.len()).filter(|&k| !children[k].is_leaf());
                let area = |k: usize| children[k].bounds.half_area();
                let Some(open) = inner.max_by(|&a, &b| area(a).total_cmp(&area(b))) else { break };
                let [low, high] = children[open].halves(boxes, &mut order);
                children[open] = low;
                children.push(high);
            }
            for (k, child) in children.iter().enumerate() {
                tree.nodes[wide].set_child_box(k, child.bounds, center);
                if child.is_leaf() {
                    tree.nodes[wide].child[k] = order[child.start] | LEAF;
                } else {
                    let index = tree.nodes.len();
                    tree.nodes[wide].child[k] = index as u32;
                    tree.nodes.push(Node::EMPTY);
                    stack.push((index, *child));
                }
            }
        }
        tree
    }
}

impl Subtree {
    /// The boxes that `order` lists within a range.
    fn new(boxes: &[Aabb], order: &[u32], range: Range<usize>, depth: usize) -> Self {
        let bounds = order[range.clone()].iter().fold(Aabb::EMPTY, |b, &i| b.union(boxes[i as usize]));
        Self { bounds, start: range.start, end: range.end, depth }
    }

    /// Whether it is one box.
    fn is_leaf(&self) -> bool {
        self.end - self.start == 1
    }

    /// Parts at least two boxes, and sorts `order` by that.
    fn halves(&self, boxes: &[Aabb], order: &mut [u32]) -> [Self; 2] {
        let slice = &mut order[self.start..self.end];
        // The heuristic can peel off one box at a time; the median halves what is left.
        let low = if self.depth < MEDIAN_DEPTH { partition(boxes, slice) } else { slice.len() / 2 };
        let middle = self.start + low;
        [self.start..middle, middle..self.end].map(|range| Self::new(boxes, order, range, self.depth + 1))
    }
}

impl Node {
    const EMPTY: Self =
        // An empty box, with its planes turned inside out: every slab test fails on it.
        Self { planes: [[[f32::INFINITY; WIDTH]; 3], [[f32::NEG_INFINITY; WIDTH]; 3]], child: [LEAF; WIDTH] };

    /// Sets the box, in the world, of child `k`, rounded outward to f32 about `center`; its link stays.
    fn set_child_box(&mut self, k: usize, bounds: Aabb, center: Vector) {
        for axis in 0..3 {
            // One rounding in the shift, one to f32: two steps outward cover both.
            let (lo, hi) = (bounds.min[axis] - center[axis], bounds.max[axis] - center[axis]);
            self.planes[0][axis][k] = (lo.next_down() as f32).next_down();
            self.planes[1][axis][k] = (hi.next_up() as f32).next_up();
        }
    }
}

/// Sorts a slice of at least two into two parts by the cheapest of the binned planes; returns the length of the first part, half of it
/// where no plane parts them.
fn partition(boxes: &[Aabb], slice: &mut [u32]) -> usize {
    let centre = |i: u32| boxes[i as usize].center();
    let (mut lo, mut hi) = (Vector::INFINITY, Vector::NEG_INFINITY);
    for &i in slice.iter() {
        (lo, hi) = (lo.min(centre(i)), hi.max(centre(i)));
    }
    let mut best: Option<(f64, usize, usize)> = None;
    let bin = |i: u32, axis: usize| {
        (((centre(i)[axis] - lo[axis]) / (hi[axis] - lo[axis]) * BINS as f64) as usize).min(BINS - 1)
    };
    let wide = [0, 1, 2].map(|axis| hi[axis] > lo[axis]);
    // Surface area heuristic over bins of centres (Wald 2007): a plane costs area × number on both of its sides.
    let mut all = [[(Aabb::EMPTY, 0usize); BINS]; 3];
    for &i in slice.iter() {
        for axis in (0..3).filter(|&axis| wide[axis]) {
            let b = &mut all[axis][bin(i, axis)];
            *b = (b.0.union(boxes[i as usize]), b.1 + 1);
        }
    }
    for axis in (0..3).filter(|&axis| wide[axis]) {
        let bins = &all[axis];
        // What lies right of each plane is gathered first, so that one sweep from the left prices all planes.
        let mut right = [(Aabb::EMPTY, 0usize); BINS + 1];
        for s in (0..BINS).rev() {
            right[s] = (right[s + 1].0.union(bins[s].0), right[s + 1].1 + bins[s].1);
        }
        let mut left = (Aabb::EMPTY, 0usize);
        for s in 1..BINS {
            left = (left.0.union(bins[s - 1].0), left.1 + bins[s - 1].1);
            if left.1 == 0 || right[s].1 == 0 {
                continue;
            }
            let cost = left.0.half_area() * left.1 as f64 + right[s].0.half_area() * right[s].1 as f64;
            if best.is_none_or(|b| cost < b.0) {
                best = Some((cost, axis, s));
            }
        }
    }
    // All centres lie in one bin: no plane parts them, and any half does.
    let Some((_, axis, at)) = best else { return slice.len() / 2 };
    let (mut i, mut j) = (0, slice.len());
    while i < j {
        if bin(slice[i], axis) < at {
            i += 1;
        } else {
            j -= 1;
            slice.swap(i, j);
        }
    }
    i
}
