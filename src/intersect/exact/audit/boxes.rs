//! A coarse hierarchy of boxes: halved at the median, plain `f64` slabs.

use crate::math::{Aabb, Ray};

/// Share of its diagonal, and of a millimetre, by which a box is grown: a million times what the slabs round.
const GROWN: f64 = 1e-9;

/// Boxes in a binary tree, root first.
#[derive(Debug)]
pub(super) struct Boxes {
    nodes: Vec<Node>,
}

/// A box with what lies in it.
#[derive(Debug)]
struct Node {
    bounds: Aabb,
    content: Content,
}

/// What lies in a node's box.
#[derive(Clone, Copy, Debug)]
enum Content {
    /// The second child, the first being the next node.
    Inner { second: u32 },
    /// A box by its position.
    Box(u32),
}

impl Boxes {
    /// Builds the tree of these boxes, each grown a little; there may be none.
    pub(super) fn new(boxes: &[Aabb]) -> Self {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut tree = Self { nodes: Vec::with_capacity(2 * boxes.len()) };
        if !boxes.is_empty() {
            tree.add(boxes, &mut order);
        }
        tree
    }

    /// Adds a node over the boxes that `order`, not empty, lists, with all below it; `order` is sorted on the way. Depth is the logarithm
    /// of the number of boxes, since each split is in the middle.
    fn add(&mut self, boxes: &[Aabb], order: &mut [u32]) {
        let bounds = order.iter().fold(Aabb::EMPTY, |b, &i| b.union(boxes[i as usize]));
        // The place in the list is taken before the children's: the first child is then the next node and needs no
        // index.
        let me = self.nodes.len();
        self.nodes.push(Node {
            bounds: bounds.grown(GROWN * (1.0 + bounds.diagonal())),
            // Until it is known to be an inner node.
            content: Content::Box(order[0]),
        });
        if order.len() == 1 {
            return;
        }
        let size = bounds.size();
        let axis = size.max_position();
        let middle = order.len() / 2;
        let key = |i: &u32| boxes[*i as usize].center()[axis];
        order.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
        let (low, high) = order.split_at_mut(middle);
        self.add(boxes, low);
        self.nodes[me].content = Content::Inner { second: self.nodes.len() as u32 };
        self.add(boxes, high);
    }

    /// Fills `met` with the boxes that a ray meets in its range, each with the distance, mm, where it enters them, the nearest first.
    pub(super) fn intersected(&self, ray: &Ray, met: &mut Vec<(f64, u32)>) {
        met.clear();
        let mut stack = vec![0u32];
        while let Some(index) = stack.pop() {
            let Some(node) = self.nodes.get(index as usize) else { continue };
            let Some((near, _)) = node.bounds.clip(ray) else { continue };
            match node.content {
                Content::Inner { second } => stack.extend([second, index + 1]),
                Content::Box(own) => met.push((near, own)),
            }
        }
        met.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }
}
