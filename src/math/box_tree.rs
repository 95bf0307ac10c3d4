//! A tree of boxes: which of very many a ray crosses, about the nearest first, which of them another box meets, and which of them meet
//! each other.
//!
//! Guarantee: no box is left out that a box meets, or that a ray crosses by more than rounding: to find what touches a side,
//! grow the boxes first, see [`Aabb::with_room`]. The tree depends on the boxes and their order alone.

use super::{Aabb, Ray, Vector};
use smallvec::SmallVec;

/// Children of a node: as many as keep a tree of a hundred thousand boxes at nine levels, and a node within four lines of the cache.
const WIDTH: usize = 4;

/// Entries that a stack on its place has room for: three that wait on each level of a tree of a million boxes.
const STACK: usize = 32;

/// Marks a link as a box in place of a node.
const BOX: u32 = 1 << 31;

/// Boxes, by their index: fewer than 2³¹.
#[derive(Clone, Debug)]
pub struct BoxTree {
    bounds: Aabb,
    /// The root first; none where there are no boxes.
    nodes: Vec<Node>,
}

/// Up to four boxes around others, by axis and child: their sides lie next to each other, so that four are tried at once.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: [[f64; WIDTH]; 3],
    high: [[f64; WIDTH]; 3],
    /// Of each child its node, or its box with [`BOX`].
    links: [u32; WIDTH],
    children: u32,
}

impl Default for BoxTree {
    fn default() -> Self {
        Self::new(&[])
    }
}

impl BoxTree {
    /// Builds a tree of these boxes, halved and halved again at the middle one along the longest side of the box around their centres;
    /// there may be none. Panics for 2³¹ boxes and more.
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
        assert!(boxes.len() < BOX as usize, "a tree of boxes holds fewer than 2^31");
        let mut tree = Self { bounds: union(0..boxes.len() as u32, boxes), nodes: Vec::new() };
        let mut leaves: Vec<u32> = (0..boxes.len() as u32).collect();
        if !leaves.is_empty() {
            tree.add_node(&mut leaves, boxes);
        }
        tree
    }

    /// Adds the node of these boxes, at least one, and all below it; returns its index. `leaves`, the boxes' indices, are reordered.
    fn add_node(&mut self, leaves: &mut [u32], boxes: &[Aabb]) -> u32 {
        let index = self.nodes.len();
        let (zeros, none) = ([[0.0; WIDTH]; 3], [0; WIDTH]);
        self.nodes.push(Node { low: zeros, high: zeros, links: none, children: 0 });
        let (left, right) = halves(leaves, boxes);
        for half in [left, right] {
            let (first, second) = halves(half, boxes);
            for group in [first, second] {
                let link = match group {
                    [] => continue,
                    [only] => *only | BOX,
                    _ => self.add_node(group, boxes),
                };
                self.nodes[index].add_child(union(group.iter().copied(), boxes), link);
            }
        }
        index as u32
    }

    /// The box around all boxes; empty without any.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes)
    }

    /// Whether one of the boxes that meet `bounds`, or touch it, is wanted: `is_wanted` is called by index, in no order, up to the first.
    #[inline]
    pub fn any_meeting(&self, bounds: &Aabb, mut is_wanted: impl FnMut(u32) -> bool) -> bool {
        if bounds.is_empty() {
            return false;
        }
        let mut open: SmallVec<[u32; STACK]> = self.nodes.first().map(|_| 0).into_iter().collect();
        while let Some(node) = open.pop() {
            let node = &self.nodes[node as usize];
            let mut met = node.children_meeting(bounds);
            while met != 0 {
                let link = node.links[met.trailing_zeros() as usize % WIDTH];
                met &= met - 1;
                if link & BOX == 0 {
                    open.push(link);
                } else if is_wanted(link & !BOX) {
                    return true;
                }
            }
        }
        false
    }

    /// Finds the pairs `[i, j]`, `i` below `j`, of boxes that meet or touch, in the order in which a loop over all pairs would: by `i`,
    /// then by `j`. Boxes that are empty meet none. Where the boxes are small beside the space that they fill, be it a plane or a line, a
    /// box takes log n steps and one for each pair. The pairs with one `i` are held at a time.
    pub(crate) fn meeting_pairs(boxes: &[Aabb]) -> impl Iterator<Item = [usize; 2]> {
        let tree = Self::new(boxes);
        boxes.iter().enumerate().flat_map(move |(i, bounds)| {
            let mut later: Vec<usize> = Vec::new();
            tree.any_meeting(bounds, |k| {
                if k as usize > i {
                    later.push(k as usize);
                }
                false
            });
            later.sort_unstable();
            later.into_iter().map(move |j| [i, j])
        })
    }

    /// Starts a walk through the boxes that a ray crosses from its `t_min` on. Where it ends is passed to [`BoxWalk::next`]; its `t_max`
    /// does not count.
    #[inline]
    pub fn walk(&self, ray: &Ray) -> BoxWalk<'_> {
        let mut walk = self.ended_walk();
        walk.restart(ray);
        walk
    }

    /// Makes a walk that has passed all boxes, to be restarted.
    #[inline(always)]
    pub fn ended_walk(&self) -> BoxWalk<'_> {
        BoxWalk { tree: self, origin: Vector::ZERO, inverse: Vector::ZERO, least: 0.0, open: SmallVec::new() }
    }
}

/// The box around the boxes with these indices; empty without any.
fn union(leaves: impl Iterator<Item = u32>, boxes: &[Aabb]) -> Aabb {
    leaves.fold(Aabb::EMPTY, |sum, k| sum.union(boxes[k as usize]))
}

/// Parts the indices of boxes at the middle one along the longest side of the box around their centres, reordering them in place; the
/// first half of a single box is empty.
fn halves<'l>(leaves: &'l mut [u32], boxes: &[Aabb]) -> (&'l mut [u32], &'l mut [u32]) {
    let middle = leaves.len() / 2;
    if middle > 0 {
        let center = |k: u32| boxes[k as usize].center();
        let size = Aabb::from_points(leaves.iter().map(|&k| center(k))).size();
        let axis = if size.x >= size.y.max(size.z) { 0 } else { 1 + usize::from(size.z > size.y) };
        // By index among equals: the tree is the same wherever it is built.
        leaves.select_nth_unstable_by(middle, |&a, &b| center(a)[axis].total_cmp(&center(b)[axis]).then(a.cmp(&b)));
    }
    leaves.split_at_mut(middle)
}

impl Node {
    /// Adds a child with its box; a node takes up to [`WIDTH`].
    fn add_child(&mut self, bounds: Aabb, link: u32) {
        let child = self.children as usize;
        for axis in 0..3 {
            self.low[axis][child] = bounds.min[axis];
            self.high[axis][child] = bounds.max[axis];
        }
        self.links[child] = link;
        self.children += 1;
    }

    /// Which children's boxes meet `bounds`, which is not empty, one bit each: all four tried at once.
    #[inline(always)]
    fn children_meeting(&self, bounds: &Aabb) -> u32 {
        let mut apart = [false; WIDTH];
        for axis in 0..3 {
            for child in 0..WIDTH {
                apart[child] |=
                    (self.low[axis][child] > bounds.max[axis]) | (self.high[axis][child] < bounds.min[axis]);
            }
        }
        let met = (0..WIDTH).fold(0, |met, child| met | u32::from(!apart[child]) << child);
        met & ((1 << self.children) - 1)
    }
}

/// The boxes that a ray crosses, in about the order in which it enters them: a farther one may come first where nodes overlap, so that a
/// search for the nearest goes on, with a nearer `end`, until none is left.
#[derive(Clone, Debug)]
pub struct BoxWalk<'t> {
    tree: &'t BoxTree,
    origin: Vector,
    inverse: Vector,
    /// The ray's `t_min`.
    least: f64,
    /// Links with where the ray enters them, the nearest last.
    open: SmallVec<[(f64, u32); STACK]>,
}

impl BoxWalk<'_> {
    /// Turns to another ray, as [`BoxTree::walk`], in its place: a walk takes half a kilobyte, which would take longer to move.
    #[inline(always)]
    pub fn restart(&mut self, ray: &Ray) {
        self.end();
        (self.origin, self.inverse, self.least) = (ray.origin, ray.direction.recip(), ray.t_min);
        if !self.tree.nodes.is_empty() {
            self.open.push((ray.t_min, 0));
        }
    }

    /// Ends it: no box is next.
    #[inline]
    pub fn end(&mut self) {
        self.open.clear();
    }

    /// The index of the next box that is entered at `end` or before; `None` when there is none left. `end` must not grow from call to call:
    /// what lay beyond it is forgotten.
    #[inline(always)]
    pub fn next(&mut self, end: f64) -> Option<u32> {
        while let Some((near, link)) = self.open.pop() {
            if near > end {
                continue;
            }
            if link & BOX != 0 {
                return Some(link & !BOX);
            }
            self.open_node(link, end);
        }
        None
    }

    /// Puts the children of a node that the ray enters at `end` or before on `open`, the nearest last, which is taken first.
    #[inline(always)]
    fn open_node(&mut self, link: u32, end: f64) {
        let node = &self.tree.nodes[link as usize];
        let (mut near, mut far) = ([self.least; WIDTH], [f64::INFINITY; WIDTH]);
        for axis in 0..3 {
            let (origin, inverse) = (self.origin[axis], self.inverse[axis]);
            for child in 0..WIDTH {
                let a = (node.low[axis][child] - origin) * inverse;
                let b = (node.high[axis][child] - origin) * inverse;
                let (first, last) = if a < b { (a, b) } else { (b, a) };
                // NaN is 0 · ∞: a ray that runs in a side of the box is within it there.
                let is_in_side = a.is_nan() || b.is_nan();
                near[child] = if first > near[child] && !is_in_side { first } else { near[child] };
                far[child] = if last < far[child] && !is_in_side { last } else { far[child] };
            }
        }
        let base = self.open.len();
        for child in 0..node.children as usize {
            if near[child] > far[child] || near[child] > end {
                continue;
            }
            // At most three come before it: sorted in as it is found.
            let mut place = self.open.len();
            self.open.push((near[child], node.links[child]));
            while place > base && self.open[place - 1].0 < near[child] {
                self.open.swap(place - 1, place);
                place -= 1;
            }
        }
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
        // Interpreted, as by Miri, two thousand take an hour.
        let rays = if cfg!(miri) { 20 } else { 2000 };
        for k in 0..rays {
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

    #[test]
    fn boxes_that_meet_are_those_of_all_pairs_in_the_same_order() {
        let mut r = Random(11);
        // The second lot is flat in x, as an array of parts in a plane is.
        for extent in [Vector::ONE, Vector::new(0.0, 1.0, 1.0)] {
            let mut boxes: Vec<Aabb> = (0..200)
                .map(|_| {
                    // At whole numbers, so that some touch in a side, an edge or a corner alone.
                    let corner: Point = (20.0 * r.vector()).round() * extent;
                    Aabb::from_points([corner, corner + (4.0 * r.vector()).round() * extent])
                })
                .collect();
            boxes[17] = Aabb::EMPTY;
            let all = (0..boxes.len()).flat_map(|i| (i + 1..boxes.len()).map(move |j| [i, j]));
            let meeting: Vec<[usize; 2]> =
                all.filter(|&[i, j]| !boxes[i].intersection(boxes[j]).is_empty()).collect();
            assert!(!meeting.is_empty());
            assert_eq!(BoxTree::meeting_pairs(&boxes).collect::<Vec<_>>(), meeting);
        }
        assert_eq!(BoxTree::meeting_pairs(&[]).next(), None);
    }

    #[test]
    fn a_ray_in_a_side_of_a_box_is_within_it() {
        let tree = BoxTree::new(&[Aabb::from_points([Point::ZERO, Point::ONE])]);
        for side in [0.0, 1.0] {
            for direction in [Vector::X, -Vector::X] {
                let ray = Ray::new(Point::new(0.5, side, 0.5) - 2.0 * direction, direction);
                assert_eq!(tree.walk(&ray).next(f64::INFINITY), Some(0), "{ray:?}");
            }
        }
    }
}
