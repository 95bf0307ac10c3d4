//! The receivers that a ray may meet: all of them where they are few, those whose boxes it meets, by a tree of boxes, where they are
//! many.
//!
//! Guarantee: a query visits them in the order of the scene and leaves out none that the ray crosses; so a tally has the
//! same bits with and without the tree.

use crate::math::simd::{self, Instructions, Kernel};
use crate::math::{Aabb, BoxTree, Ray};
use crate::simulate::receiver::Receiver;
use smallvec::SmallVec;

/// Up to so many receivers, testing each costs less than a tree.
const FEW: usize = 8;

/// Receivers, by index.
pub(super) type Candidates = SmallVec<[u32; 16]>;

/// Receivers of one kind, queried by rays.
#[derive(Clone, Debug, Default)]
pub(super) struct ReceiverIndex {
    /// Their indices, in the order of the scene.
    receivers: Vec<u32>,
    /// Their boxes; none where the receivers are few.
    tree: Option<BoxTree>,
}

impl ReceiverIndex {
    /// Makes an index of the receivers that are wanted; a tree of boxes where there are more than [`FEW`].
    pub(super) fn new(all: &[Receiver], is_wanted: impl Fn(&Receiver) -> bool) -> Self {
        let receivers: Vec<u32> = (0..all.len()).filter(|&i| is_wanted(&all[i])).map(|i| i as u32).collect();
        let boxes = || receivers.iter().map(|&i| all[i as usize].bounds().with_room()).collect::<Vec<Aabb>>();
        let tree = (receivers.len() > FEW).then(|| BoxTree::new(&boxes()));
        Self { receivers, tree }
    }

    #[inline(always)]
    pub(super) fn is_empty(&self) -> bool {
        self.receivers.is_empty()
    }

    /// Returns the receivers that a ray may cross nearer than `end`, mm, in the order of the scene; all of them where they are few. `room`,
    /// which must be empty, is where they are put.
    #[inline(always)]
    pub(super) fn candidates<'a>(&'a self, ray: &Ray, end: f64, room: &'a mut Candidates) -> &'a [u32] {
        let Some(tree) = &self.tree else { return &self.receivers };
        self.collect_candidates(tree, ray, end, room);
        room
    }

    /// Appends the receivers whose boxes the ray meets nearer than `end`, mm, to `found`, and sorts it.
    #[inline(never)]
    fn collect_candidates(&self, tree: &BoxTree, ray: &Ray, end: f64, found: &mut Candidates) {
        simd::dispatch(Crossed { receivers: &self.receivers, tree, ray, end, found });
        // In the order of the scene, or the bits of a tally would depend on the tree.
        if found.len() > 1 {
            found.sort_unstable();
        }
    }
}

/// The walk through a tree of boxes, for [`simd::dispatch`]: the four children of a node are tried at once.
struct Crossed<'a> {
    receivers: &'a [u32],
    tree: &'a BoxTree,
    ray: &'a Ray,
    end: f64,
    found: &'a mut Candidates,
}

impl Kernel for Crossed<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self) {
        let Self { receivers, tree, ray, end, found } = self;
        let mut walk = tree.ended_walk();
        walk.restart(&ray.with_range(0.0, end));
        while let Some(k) = walk.next(end) {
            found.push(receivers[k as usize]);
        }
    }
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
