//! Many rays at a time. A ray that has come to a leaf asks for its memory and lets the others go on meanwhile: on 10,000
//! patches, which no cache holds, waiting for memory took two fifths of the time of a ray by itself.
//!
//! Each ray takes the very steps that it takes alone, so the bits are the same.

use super::Exact;
use super::query::Query;
use super::trace::Stack;
use crate::intersect::prefetch::{prefetch, prefetch_range};
use crate::intersect::{Cost, Hit};
use crate::math::Ray;

/// Rays under way: enough to cover a fetch from memory, few enough for the first cache.
const LANES: usize = 8;

/// A ray under way.
struct Lane {
    /// Position in the batch.
    ray: usize,
    q: Query,
    stack: Stack,
    /// The leaf that it waits for; `None` when it has met all and waits for what names its hit.
    leaf: Option<u32>,
}

impl Exact {
    /// Meets every leaf that the ray may touch, nearest boxes first.
    #[inline(always)]
    pub(super) fn walk<const WIDE: bool>(&self, q: &mut Query) {
        let mut stack = Stack::new();
        self.enter(q, &mut stack);
        while let Some(leaf) = self.advance::<WIDE>(q, &mut stack) {
            self.test_leaf(q, leaf);
        }
    }

    /// Where every search begins: at the root of the hierarchy.
    #[inline(always)]
    fn enter(&self, q: &Query, stack: &mut Stack) {
        stack.clear();
        if !q.slabs.misses && !self.tree.nodes.is_empty() {
            stack.push((0, 0.0));
        }
    }

    #[inline(always)]
    fn begin(&self, lane: &mut Lane, ray: &Ray) {
        self.restart(&mut lane.q, ray, self.settings.budget);
        self.enter(&lane.q, &mut lane.stack);
    }

    /// Finds the first hits of many rays; `WIDE` only where [`super::wide`] found the features.
    #[inline(always)]
    pub(super) fn batch<const WIDE: bool>(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        let mut waiting = rays.iter().enumerate();
        let mut lanes: Vec<Lane> = Vec::with_capacity(LANES);
        for (ray, r) in waiting.by_ref().take(LANES) {
            let mut lane = Lane { ray, q: Query::IDLE, stack: Stack::new(), leaf: None };
            self.begin(&mut lane, r);
            self.go_on::<WIDE>(&mut lane);
            lanes.push(lane);
        }
        while !lanes.is_empty() {
            let mut k = 0;
            while k < lanes.len() {
                let lane = &mut lanes[k];
                if let Some(leaf) = lane.leaf {
                    self.test_leaf(&mut lane.q, leaf);
                } else {
                    hits[lane.ray] = self.answer(&lane.q, cost).hit;
                    let Some((ray, r)) = waiting.next() else {
                        lanes.swap_remove(k);
                        continue;
                    };
                    lane.ray = ray;
                    self.begin(lane, r);
                }
                self.go_on::<WIDE>(lane);
                k += 1;
            }
        }
    }

    /// Walks to the next leaf and asks for its memory.
    #[inline(always)]
    fn go_on<const WIDE: bool>(&self, lane: &mut Lane) {
        lane.leaf = self.advance::<WIDE>(&mut lane.q, &mut lane.stack);
        if let Some(leaf) = lane.leaf {
            prefetch(&self.probes, leaf as usize);
            let [from, to] = [0, 1].map(|k| self.starts[leaf as usize + k] as usize);
            prefetch_range(&self.pool, from, to - from);
        } else if let Some(root) = &lane.q.best {
            prefetch(&self.labels, root.leaf as usize);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::Intersector;
    use crate::intersect::exact::Settings;
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
                let from = Departure { face: hit.face, primitive: hit.primitive, uv: hit.uv };
                rays[k] = Ray::new(rays[k].at(hit.t), rays[k].direction).leaving(from);
            } else if k % 3 == 1 {
                rays[k] = rays[k].within(20.0, 120.0);
            }
        }
        rays[7].direction = Vector::ZERO;
        rays[8].from = Some(Departure { face: crate::math::FaceId(99), primitive: 0, uv: Uv::ZERO });
        let mut hits = vec![None; rays.len()];
        let (mut together, mut single) = (Cost::default(), Cost::default());
        exact.intersect_batch(&rays, &mut hits, &mut together);
        let mut found = 0;
        for (ray, hit) in rays.iter().zip(&hits) {
            let alone = exact.intersect(ray, &mut single);
            assert_eq!(*hit, alone);
            found += usize::from(alone.is_some());
        }
        assert!(found > 200);
        assert_eq!((together.rays, together.nodes, together.tests), (single.rays, single.nodes, single.tests));
        exact.batch::<false>(&rays, &mut hits, &mut Cost::default());
        for (ray, hit) in rays.iter().zip(&hits) {
            assert_eq!(*hit, exact.intersect(ray, &mut Cost::default()));
        }
        exact.intersect_batch(&[], &mut [], &mut Cost::default());
    }
}
