//! The walk through the hierarchy, of one ray or of many at a time.
//!
//! In a batch a ray that has come to a leaf prefetches its memory and lets the others go on meanwhile: on 10,000 patches, which no
//! cache holds, waiting for memory took two fifths of the time of a ray by itself. Each ray takes the very steps that it takes
//! alone, so the bits are the same.

use super::leaf::NetPlace;
use super::query::Query;
use super::slabs;
use super::structure::Exact;
use super::tree::{LEAF, WIDTH};
use crate::intersect::prefetch::{prefetch, prefetch_range};
use crate::intersect::{Cost, Hit};
use crate::math::Ray;
use crate::math::simd::{self, Instructions, Kernel};
use smallvec::SmallVec;

/// Rays under way: enough to cover a fetch from memory, few enough for the first cache.
const LANES: usize = 8;

/// What is left to visit, with the distance at which it is entered.
type Stack = SmallVec<[(u32, f32); 64]>;

/// A ray under way.
struct Lane {
    /// Position in the batch.
    ray: usize,
    query: Query,
    stack: Stack,
    /// The leaf that it waits for; `None` when it has met all and waits for what names its hit.
    leaf: Option<u32>,
}

/// One ray, for [`simd::dispatch`].
struct Search<'a> {
    exact: &'a Exact,
    query: &'a mut Query,
}

impl Kernel for Search<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self) {
        self.exact.walk::<I>(self.query);
    }
}

/// Many rays, for [`simd::dispatch`].
struct BatchSearch<'a> {
    exact: &'a Exact,
    rays: &'a [Ray],
    hits: &'a mut [Option<Hit>],
    cost: &'a mut Cost,
}

impl Kernel for BatchSearch<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Instructions>(self) {
        self.exact.walk_batch::<I>(self.rays, self.hits, self.cost);
    }
}

/// Tests every leaf that the ray may touch; what is found is left in `query`, which has taken up a ray.
#[inline]
pub(super) fn search(exact: &Exact, query: &mut Query) {
    simd::dispatch(Search { exact, query });
}

/// Finds the first hits of many rays, with the bits that each has alone; overwrites `hits`, which is as long as `rays`.
#[inline]
pub(super) fn search_batch(exact: &Exact, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
    simd::dispatch(BatchSearch { exact, rays, hits, cost });
}

impl Exact {
    /// Tests every leaf that the ray may touch, nearest boxes first.
    #[inline(always)]
    fn walk<I: Instructions>(&self, query: &mut Query) {
        let mut stack = Stack::new();
        self.push_root(query, &mut stack);
        while let Some(leaf) = self.next_leaf::<I>(query, &mut stack) {
            self.test_leaf(query, leaf);
        }
    }

    /// Empties the stack and puts the root of the hierarchy on it, unless the ray misses everything.
    #[inline(always)]
    fn push_root(&self, query: &Query, stack: &mut Stack) {
        stack.clear();
        if !query.slabs.misses && !self.tree.nodes.is_empty() {
            stack.push((0, 0.0));
        }
    }

    /// Takes the next leaf that the ray may touch off the stack, nearest boxes first, and counts nodes; `None` when there is none left.
    #[inline(always)]
    fn next_leaf<I: Instructions>(&self, query: &mut Query, stack: &mut Stack) -> Option<u32> {
        while let Some((index, near)) = stack.pop() {
            // A root found since this was pushed may have ended the ray before it.
            if near > query.slabs.end {
                continue;
            }
            if index & LEAF != 0 {
                return Some(index & !LEAF);
            }
            query.nodes += 1;
            let node = &self.tree.nodes[index as usize];
            let (near, mut met) = slabs::intersect_boxes::<I>(&query.slabs, node);
            let first = stack.len();
            while met != 0 {
                let k = met.trailing_zeros() as usize % WIDTH;
                met &= met - 1;
                let entry = (node.child[k], near[k]);
                // Insertion, farthest first: the nearest is popped next.
                stack.push(entry);
                let new = &mut stack[first..];
                let mut at = new.len() - 1;
                while at > 0 && new[at - 1].1 < entry.1 {
                    new[at] = new[at - 1];
                    at -= 1;
                }
                new[at] = entry;
            }
        }
        None
    }

    /// Finds the first hits of many rays, [`LANES`] of them side by side, and writes each into `hits` at its ray's index.
    #[inline(always)]
    fn walk_batch<I: Instructions>(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        let mut waiting = rays.iter().enumerate();
        let mut lanes: Vec<Lane> = Vec::with_capacity(LANES);
        for (ray, r) in waiting.by_ref().take(LANES) {
            let mut lane = Lane { ray, query: Query::IDLE, stack: Stack::new(), leaf: None };
            self.begin(&mut lane, r);
            self.walk_to_leaf::<I>(&mut lane);
            lanes.push(lane);
        }
        while !lanes.is_empty() {
            let mut k = 0;
            while k < lanes.len() {
                let lane = &mut lanes[k];
                if let Some(leaf) = lane.leaf {
                    self.test_leaf(&mut lane.query, leaf);
                } else {
                    hits[lane.ray] = self.answer(&lane.query, cost).hit;
                    let Some((ray, r)) = waiting.next() else {
                        lanes.swap_remove(k);
                        // No ray waits: the last lane takes this place and is looked at next, so `k` stays.
                        continue;
                    };
                    lane.ray = ray;
                    self.begin(lane, r);
                }
                self.walk_to_leaf::<I>(lane);
                k += 1;
            }
        }
    }

    /// Puts a ray on a lane in place of the one before, at the root of the hierarchy.
    #[inline(always)]
    fn begin(&self, lane: &mut Lane, ray: &Ray) {
        self.restart(&mut lane.query, ray, self.settings.budget);
        self.push_root(&lane.query, &mut lane.stack);
    }

    /// Walks to the next leaf, sets `lane.leaf` and prefetches its memory; where none is left, for that of what names the hit.
    #[inline(always)]
    fn walk_to_leaf<I: Instructions>(&self, lane: &mut Lane) {
        lane.leaf = self.next_leaf::<I>(&mut lane.query, &mut lane.stack);
        // Prefetched now and read when the other lanes have had their turn.
        if let Some(leaf) = lane.leaf {
            prefetch(&self.linearizations, leaf as usize);
            let NetPlace { first, points } = self.net_places[leaf as usize];
            prefetch_range(&self.geometry.nets, first as usize, usize::from(points));
        } else if let Some(root) = &lane.query.best {
            prefetch(&self.labels, root.leaf as usize);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::Intersector;
    use crate::intersect::exact::Settings;
    use crate::math::simd::Portable;
    use crate::math::{Departure, Frame, Point, Uv, Vector};
    use crate::model::{Face, Model, Part, Shell};
    use crate::nurbs::sweep;
    use std::f64::consts::PI;

    fn torus() -> Exact {
        let surface = sweep::torus(&Frame::IDENTITY, 50.0, 15.0, [0.0, 2.0 * PI], [0.0, 2.0 * PI]);
        let part = Part {
            shells: vec![Shell { faces: vec![Face::whole(surface)], ..Shell::default() }],
            ..Part::default()
        };
        Exact::build(&Model::from_part(part), &Settings::default())
    }

    #[test]
    fn a_batch_and_every_processor_give_the_bits_of_a_single_ray() {
        let exact = torus();
        let mut seed = 5u64;
        let mut next = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 40) as f64 / (1u64 << 24) as f64 * 2.0 - 1.0
        };
        let mut rays: Vec<Ray> = (0..1003)
            .map(|k| {
                let o = Point::new(next(), next(), next()) * if k % 5 == 0 { 1e6 } else { 100.0 };
                let to = Point::new(60.0 * next(), 60.0 * next(), 14.0 * next());
                Ray::new(o, (to - o).normalize())
            })
            .collect();
        // Some leave the surface, some are cut short, one is unsound.
        for k in 0..rays.len() {
            let hit = exact.intersect(&rays[k], &mut Cost::default());
            if let (Some(hit), 0) = (hit, k % 3) {
                let from = hit.departure();
                rays[k] = Ray::new(rays[k].point_at(hit.t), rays[k].direction).with_departure(from);
            } else if k % 3 == 1 {
                rays[k] = rays[k].with_range(20.0, 120.0);
            }
        }
        rays[7].direction = Vector::ZERO;
        rays[8].departure =
            Some(Departure { face: crate::math::FaceId(99), primitive: 0, uv: Uv::ZERO, triangle: None });
        let mut hits = vec![None; rays.len()];
        let mut together = Cost::default();
        let mut single = Cost::default();
        exact.intersect_batch(&rays, &mut hits, &mut together);
        let mut found = 0;
        for (ray, hit) in rays.iter().zip(&hits) {
            let alone = exact.intersect(ray, &mut single);
            assert_eq!(*hit, alone);
            found += usize::from(alone.is_some());
        }
        assert!(found > 200);
        assert_eq!((together.rays, together.nodes, together.tests), (single.rays, single.nodes, single.tests));
        exact.walk_batch::<Portable>(&rays, &mut hits, &mut Cost::default());
        for (ray, hit) in rays.iter().zip(&hits) {
            assert_eq!(*hit, exact.intersect(ray, &mut Cost::default()));
        }
        exact.intersect_batch(&[], &mut [], &mut Cost::default());
    }
}
