//! The hierarchy over the leaves' axis-parallel boxes: binary, binned surface-area heuristic.

use crate::math::{Aabb, Vector};

/// Deepest path; below [`MEDIAN_DEPTH`] splits are at the median, so 2³² leaves still fit.
pub(super) const MAX_DEPTH: usize = 96;
const MEDIAN_DEPTH: usize = 60;
const BINS: usize = 16;

/// A box with either two children, side by side, or a run of leaves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) lo: [f64; 3],
    pub(super) hi: [f64; 3],
    /// First child, or first position in the order of leaves.
    pub(super) first: u32,
    /// Number of leaves; 0 for an inner node.
    pub(super) count: u32,
}

/// Nodes, root first, and the order in which they refer to leaves.
#[derive(Debug, Default)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    pub(super) order: Vec<u32>,
}

impl Tree {
    pub(super) fn build(boxes: &[Aabb], leaf_size: usize) -> Self {
        let mut tree = Self { nodes: Vec::new(), order: (0..boxes.len() as u32).collect() };
        if boxes.is_empty() {
            return tree;
        }
        tree.nodes.push(Node { lo: [0.0; 3], hi: [0.0; 3], first: 0, count: 0 });
        let mut stack = vec![(0usize, 0usize, boxes.len(), 0usize)];
        while let Some((me, start, end, depth)) = stack.pop() {
            let slice = &mut tree.order[start..end];
            let bounds = slice.iter().fold(Aabb::EMPTY, |b, &i| b.union(boxes[i as usize]));
            let node = &mut tree.nodes[me];
            (node.lo, node.hi) = (bounds.min.to_array(), bounds.max.to_array());
            if slice.len() <= leaf_size {
                (node.first, node.count) = (start as u32, slice.len() as u32);
                continue;
            }
            let middle = if depth < MEDIAN_DEPTH { partition(boxes, slice) } else { slice.len() / 2 };
            let first = tree.nodes.len();
            tree.nodes[me].first = first as u32;
            let empty = Node { lo: [0.0; 3], hi: [0.0; 3], first: 0, count: 0 };
            tree.nodes.extend([empty, empty]);
            stack.push((first, start, start + middle, depth + 1));
            stack.push((first + 1, start + middle, end, depth + 1));
        }
        tree
    }
}

/// Sorts the slice into two parts by the cheapest of the binned planes; the length of the first part.
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
    for axis in 0..3 {
        if !(hi[axis] > lo[axis]) {
            continue;
        }
        let mut bins = [(Aabb::EMPTY, 0usize); BINS];
        for &i in slice.iter() {
            let b = &mut bins[bin(i, axis)];
            *b = (b.0.union(boxes[i as usize]), b.1 + 1);
        }
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
