//! A binary tree of boxes: which of very many a ray crosses, nearest first, and which of them another box meets.
//!
//! Guarantee: no box is left out that a box meets, or that a ray crosses by more than rounding: whoever looks for what touches a side
//! grows the boxes first, see [`Aabb::with_room`]. The tree depends on the boxes and their order alone.

use super::{Aabb, Ray, Vector};
use smallvec::SmallVec;

/// Levels that a stack on its place has room for: of a million boxes.
const LEVELS: usize = 24;

/// Boxes, by their index.
#[derive(Clone, Debug, Default)]
pub struct BoxTree {
    /// The root first.
    nodes: Vec<Node>,
}

/// A box around others.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Aabb,
    /// Of a leaf its box, otherwise the first of two children next to each other.
    first: u32,
    is_leaf: bool,
}

impl BoxTree {
    /// A tree of these boxes, halved at the middle one along the longest side of their centres.
    ///
    /// ```
    /// use lampyris::math::{Aabb, BoxTree, Point, Ray, Vector};
    /// let boxes: Vec<Aabb> = (0..100)
    ///     .map(|k| Aabb::from_points([Point::ZERO, Point::ONE].map(|p| p + 3.0 * f64::from(k) * Vector::X)))
    ///     .collect();
    /// let tree = BoxTree::new(&boxes);
    /// let mut walk = tree.walk(&Ray::new(Point::new(150.5, 0.5, 0.5), Vector::X));
    /// assert_eq!((walk.next(f64::INFINITY), walk.next(f64::INFINITY)), (Some(50), Some(51)));
    /// assert_eq!(walk.next(4.0), None);
    /// ```
    pub fn new(boxes: &[Aabb]) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity(2 * boxes.len()) };
        let mut leaves: Vec<u32> = (0..boxes.len() as u32).collect();
        if !leaves.is_empty() {
            tree.nodes.push(Node { bounds: Aabb::EMPTY, first: 0, is_leaf: true });
            tree.divide(0, &mut leaves, boxes);
        }
        tree
    }

    fn divide(&mut self, node: usize, leaves: &mut [u32], boxes: &[Aabb]) {
        let bounds = leaves.iter().fold(Aabb::EMPTY, |sum, &k| sum.union(boxes[k as usize]));
        if let [only] = leaves {
            self.nodes[node] = Node { bounds, first: *only, is_leaf: true };
            return;
        }
        let center = |k: u32| boxes[k as usize].center();
        let size = Aabb::from_points(leaves.iter().map(|&k| center(k))).size();
        let axis = if size.x >= size.y.max(size.z) { 0 } else { 1 + usize::from(size.z > size.y) };
        let middle = leaves.len() / 2;
        // By index among equals: the tree is the same wherever it is built.
        leaves.select_nth_unstable_by(middle, |&a, &b| center(a)[axis].total_cmp(&center(b)[axis]).then(a.cmp(&b)));
        let first = self.nodes.len();
        let child = Node { bounds: Aabb::EMPTY, first: 0, is_leaf: true };
        self.nodes.extend([child, child]);
        self.nodes[node] = Node { bounds, first: first as u32, is_leaf: false };
        let (left, right) = leaves.split_at_mut(middle);
        self.divide(first, left, boxes);
        self.divide(first + 1, right, boxes);
    }

    /// Around all boxes.
    pub fn bounds(&self) -> Aabb {
        self.nodes.first().map_or(Aabb::EMPTY, |root| root.bounds)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes)
    }

    /// Whether one of the boxes that meet this one is wanted.
    pub fn any_meeting(&self, bounds: &Aabb, mut is_wanted: impl FnMut(u32) -> bool) -> bool {
        let mut open: SmallVec<[u32; LEVELS]> = self.nodes.first().map(|_| 0).into_iter().collect();
        while let Some(node) = open.pop() {
            let node = &self.nodes[node as usize];
            if node.bounds.intersection(*bounds).is_empty() {
                continue;
            }
            if !node.is_leaf {
                open.extend([node.first, node.first + 1]);
            } else if is_wanted(node.first) {
                return true;
            }
        }
        false
    }

    /// Goes through the boxes that a ray crosses.
    #[inline]
    pub fn walk(&self, ray: &Ray) -> BoxWalk<'_> {
        let mut walk = BoxWalk {
            tree: self,
            origin: ray.origin,
            inverse: ray.direction.recip(),
            least: ray.t_min,
            open: SmallVec::new(),
        };
        if let Some(near) = self.nodes.first().and_then(|root| walk.entry(root, ray.t_max)) {
            walk.open.push((near, 0));
        }
        walk
    }
}

/// The boxes that a ray crosses, those that it enters first before others but where boxes overlap.
#[derive(Clone, Debug)]
pub struct BoxWalk<'t> {
    tree: &'t BoxTree,
    origin: Vector,
    inverse: Vector,
    least: f64,
    /// Nodes with where the ray enters them, the nearest last.
    open: SmallVec<[(f64, u32); LEVELS]>,
}

impl BoxWalk<'_> {
    /// The next box that is entered at `end` or before.
    #[inline]
    pub fn next(&mut self, end: f64) -> Option<u32> {
        while let Some((near, node)) = self.open.pop() {
            if near > end {
                continue;
            }
            let node = &self.tree.nodes[node as usize];
            if node.is_leaf {
                return Some(node.first);
            }
            let [a, b] = [node.first, node.first + 1].map(|k| (self.entry(&self.tree.nodes[k as usize], end), k));
            let (near, far) = if b.0 < a.0 { (b, a) } else { (a, b) };
            self.open.extend([far, near].into_iter().filter_map(|(entry, k)| Some((entry?, k))));
        }
        None
    }

    /// Where the ray enters a box, if it does so before `end`.
    #[inline(always)]
    fn entry(&self, node: &Node, end: f64) -> Option<f64> {
        // NaN of 0 · ∞, where a ray runs in a side of the box, fails both comparisons: the box is taken.
        let (a, b) =
            ((node.bounds.min - self.origin) * self.inverse, (node.bounds.max - self.origin) * self.inverse);
        let (near, far) = (a.min(b).max_element().max(self.least), a.max(b).min_element());
        (!(near > far || near > end)).then_some(near)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Point;

    struct Random(u64);

    impl Random {
        fn unit(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }

        fn vector(&mut self) -> Vector {
            Vector::new(self.unit(), self.unit(), self.unit()) - 0.5
        }
    }

    #[test]
    fn rays_and_boxes_meet_what_they_meet_without_a_tree() {
        let mut r = Random(7);
        let boxes: Vec<Aabb> = (0..300)
            .map(|_| {
                let at: Point = 100.0 * r.vector();
                Aabb::from_points([at, at + 12.0 * r.vector()])
            })
            .collect();
        let tree = BoxTree::new(&boxes);
        assert_eq!(tree.bounds(), boxes.iter().fold(Aabb::EMPTY, |a, b| a.union(*b)));
        for k in 0..2000 {
            let direction = if k % 5 == 0 { Vector::Y } else { r.vector().normalize() };
            let ray = Ray::new(150.0 * r.vector(), direction).with_range(0.0, if k % 2 == 0 { 40.0 } else { 1e3 });
            let (mut walk, mut found) = (tree.walk(&ray), Vec::new());
            while let Some(k) = walk.next(ray.t_max) {
                found.push(k);
            }
            found.sort_unstable();
            for (i, bounds) in boxes.iter().enumerate() {
                if bounds.grown(-1e-9).clip(&ray).is_some() {
                    assert!(found.contains(&(i as u32)), "ray {k} crosses box {i}");
                }
            }
            assert!(found.iter().all(|&i| boxes[i as usize].grown(1e-9).clip(&ray).is_some()));
            let around = Aabb::from_points([ray.origin, ray.origin + 9.0 * r.vector()]);
            let meets = |b: &Aabb| !b.intersection(around).is_empty();
            assert_eq!(tree.any_meeting(&around, |_| true), boxes.iter().any(meets));
        }
        assert!(!BoxTree::new(&[]).any_meeting(&Aabb::from_points([Point::ZERO]), |_| true));
    }
}
