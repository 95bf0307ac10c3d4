//! The receivers that a ray may meet: all of them where they are few, those whose boxes it meets, by a tree of boxes, where they are
//! many.
//!
//! Guarantee: whoever asks goes through them in the order of the scene, and leaves out none that the ray crosses; so a tally has the
//! same bits with and without the tree.

use crate::math::{Aabb, Ray};
use crate::simulate::receiver::Receiver;
use smallvec::SmallVec;

/// Up to so many receivers asking each costs less than a tree.
const FEW: usize = 8;
/// Receivers in a leaf.
const LEAF: usize = 4;
/// By how much boxes are grown, in their own size and in the largest coordinate: far above the rounding of a crossing.
const ROOM: [f64; 2] = [1e-6, 1e-9];
/// Levels that a stack on its place has room for: of 2¹⁶ receivers.
const LEVELS: usize = 16;

/// Receivers, by index.
pub(super) type Candidates = SmallVec<[u32; 16]>;

/// Receivers of one kind, to be asked by rays.
#[derive(Clone, Debug, Default)]
pub(super) struct ReceiverIndex {
    /// In the order of the scene.
    receivers: Vec<u32>,
    /// In the order of the leaves.
    leaves: Vec<u32>,
    /// The root first; none where the receivers are few.
    nodes: Vec<Node>,
}

/// A box around receivers.
#[derive(Clone, Debug)]
struct Node {
    bounds: Aabb,
    /// Of a leaf its first receiver, otherwise the first of two children next to each other.
    first: usize,
    /// Receivers of a leaf; 0 otherwise.
    count: usize,
}

impl ReceiverIndex {
    /// Of those that are wanted.
    pub(super) fn new(all: &[Receiver], is_wanted: impl Fn(&Receiver) -> bool) -> Self {
        let receivers: Vec<u32> = (0..all.len()).filter(|&i| is_wanted(&all[i])).map(|i| i as u32).collect();
        let mut index = Self { receivers, ..Self::default() };
        if index.receivers.len() > FEW {
            let boxes: Vec<Aabb> = all.iter().map(|receiver| with_room(receiver.bounds())).collect();
            index.leaves = index.receivers.clone();
            index.nodes.push(Node { bounds: Aabb::EMPTY, first: 0, count: 0 });
            index.divide(0, 0..index.leaves.len(), &boxes);
        }
        index
    }

    /// Makes a node of these leaves, halved at the middle one along the longest side of their centres.
    fn divide(&mut self, node: usize, range: std::ops::Range<usize>, boxes: &[Aabb]) {
        let leaves = &mut self.leaves[range.clone()];
        let bounds = leaves.iter().fold(Aabb::EMPTY, |sum, &r| sum.union(boxes[r as usize]));
        if leaves.len() <= LEAF {
            self.nodes[node] = Node { bounds, first: range.start, count: range.len() };
            return;
        }
        let size = Aabb::from_points(leaves.iter().map(|&r| boxes[r as usize].center())).size();
        let axis = if size.x >= size.y.max(size.z) { 0 } else { 1 + usize::from(size.z > size.y) };
        let middle = leaves.len() / 2;
        // By index among equals: the tree is the same wherever it is built.
        leaves.select_nth_unstable_by(middle, |&a, &b| {
            let center = |r: u32| boxes[r as usize].center()[axis];
            center(a).total_cmp(&center(b)).then(a.cmp(&b))
        });
        let first = self.nodes.len();
        let child = Node { bounds: Aabb::EMPTY, first: 0, count: 0 };
        self.nodes.extend([child.clone(), child]);
        self.nodes[node] = Node { bounds, first, count: 0 };
        self.divide(first, range.start..range.start + middle, boxes);
        self.divide(first + 1, range.start + middle..range.end, boxes);
    }

    #[inline(always)]
    pub(super) fn is_empty(&self) -> bool {
        self.receivers.is_empty()
    }

    /// The receivers that a ray may cross nearer than `end`, in the order of the scene; `room` is where they are put.
    #[inline(always)]
    pub(super) fn candidates<'a>(&'a self, ray: &Ray, end: f64, room: &'a mut Candidates) -> &'a [u32] {
        if self.nodes.is_empty() {
            return &self.receivers;
        }
        self.collect(ray, end, room);
        room
    }

    /// Adds the receivers whose boxes the ray meets before `end`, in the order of the scene.
    #[inline(never)]
    fn collect(&self, ray: &Ray, end: f64, found: &mut Candidates) {
        let inverse = ray.direction.recip();
        let mut open: SmallVec<[usize; LEVELS]> = SmallVec::from_slice(&[0]);
        while let Some(node) = open.pop() {
            let node = &self.nodes[node];
            let (a, b) = ((node.bounds.min - ray.origin) * inverse, (node.bounds.max - ray.origin) * inverse);
            // NaN of 0 · ∞, where a ray runs in a side of the box, fails no comparison below: the box is taken.
            let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
            if near > far || far < 0.0 || near > end {
                continue;
            }
            if node.count == 0 {
                open.extend([node.first, node.first + 1]);
            } else {
                found.extend_from_slice(&self.leaves[node.first..node.first + node.count]);
            }
        }
        // In the order of the scene, or the bits of a tally would depend on the tree.
        found.sort_unstable();
    }
}

/// A box with room for the rounding of crossings.
fn with_room(bounds: Aabb) -> Aabb {
    let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
    bounds.grown(ROOM[0] * bounds.diagonal() + ROOM[1] * largest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Point, Vector};
    use crate::simulate::Scene;
    use std::fmt::Write;
    use std::path::Path;

    /// Enough that a thousand planes are crossed.
    const RAYS: usize = 12_000;

    /// Planes that stand anywhere, looked at from anywhere: none that is crossed is left out, and most others are.
    #[test]
    fn no_receiver_that_is_crossed_is_left_out() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let mut text = "[[source]]\nkind = 'point'\n".to_owned();
        for k in 0..300 {
            let [x, y, z] = [(); 3].map(|()| 100.0 * random());
            // Some exactly along an axis, where a box is flat.
            let normal = if k % 3 == 0 { [0.0, 0.0, 1.0] } else { [(); 3].map(|()| random()) };
            let _ = writeln!(
                text,
                "[[receiver]]\nname = 'r{k}'\nat = [{x}, {y}, {z}]\nnormal = {normal:?}\nsize = [9, 7]"
            );
        }
        let scene = Scene::parse(&text, "test.toml", Path::new(".")).unwrap();
        let receivers: Vec<Receiver> = scene.receivers.iter().map(|r| Receiver::new(r, Vec::new())).collect();
        let index = ReceiverIndex::new(&receivers, |_| true);
        let (mut crossed, mut asked) = (0, 0);
        for k in 0..RAYS {
            let mut vector = || Vector::from([(); 3].map(|()| random()));
            let direction = if k % 4 == 0 { Vector::Y } else { vector().normalize() };
            let ray = Ray::new(Point::ZERO + vector() * 200.0, direction);
            let end = if k % 2 == 0 { f64::INFINITY } else { 80.0 };
            let mut room = Candidates::new();
            let candidates = index.candidates(&ray, end, &mut room);
            assert!(candidates.is_sorted());
            asked += candidates.len();
            for (i, receiver) in receivers.iter().enumerate() {
                if receiver.crossing(&ray, 0.0, end).is_some() {
                    crossed += 1;
                    assert!(candidates.contains(&(i as u32)), "{k} {i}");
                }
            }
        }
        assert!(crossed > 1000 && asked < 60 * RAYS, "{crossed} crossed, {asked} asked");
    }
}
