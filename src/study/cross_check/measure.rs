//! Alternating timing of intersectors over the same rays.

use super::verdict::PerIntersector;
use crate::intersect::{Cost, Intersector};
use crate::math::Ray;
use crate::study::{Rounds, Timing};
use std::cell::RefCell;
use std::hint::black_box;

/// Rays of a batch: as many as a task of the cross-check has. The hits of all timed rays at once took as much memory as an octree.
const BATCH: usize = 2048;

/// An intersector and how it is called while it is timed.
#[derive(Clone, Copy)]
pub struct TimedIntersector<'a> {
    /// As in [`PerIntersector`]: `octree`, `octree_single`, `bvh2`, `cwbvh`, `cwbvh_as_shipped`, `polish`, `exact`.
    pub name: &'a str,
    /// The intersector that is timed.
    pub intersector: &'a dyn Intersector,
    /// Whether it gets the rays in batches or one by one.
    pub batch: bool,
}

/// Times intersectors on the same rays, on this thread, in alternating rounds; returns seconds per pass over the rays, by name.
pub fn measure(intersectors: &[TimedIntersector<'_>], rays: &[Ray], rounds: usize) -> Vec<(String, Timing)> {
    // One after the other they write to the same place.
    let hits = RefCell::new(vec![None; rays.len().min(BATCH)]);
    let mut race = Rounds::default();
    for c in intersectors {
        let TimedIntersector { intersector, batch, .. } = *c;
        let hits = &hits;
        race.add(c.name, move || {
            let mut cost = Cost::default();
            let hits = &mut *hits.borrow_mut();
            for rays in rays.chunks(BATCH) {
                let hits = &mut hits[..rays.len()];
                if batch {
                    intersector.intersect_batch(rays, hits, &mut cost);
                } else {
                    for (ray, hit) in rays.iter().zip(&mut *hits) {
                        *hit = intersector.intersect(ray, &mut cost);
                    }
                }
                // Without it the compiler could leave out unused hits.
                black_box(hits);
            }
        });
    }
    race.run(rounds)
}

impl PerIntersector {
    /// Returns the figures with what people call the intersectors, in a fixed order.
    pub fn named(&self) -> [(&'static str, Option<f64>); 7] {
        [
            ("octree, batch", self.octree),
            ("octree, ray by ray", self.octree_single),
            ("obvhs Bvh2", self.bvh2),
            ("obvhs CwBvh", self.cwbvh),
            ("obvhs CwBvh, as shipped", self.cwbvh_as_shipped),
            ("octree, hits moved to the spline", self.polish),
            ("exact spline (memory per patch)", self.exact),
        ]
    }

    /// Sets the figure of the intersector of that name; an unknown name is ignored.
    pub fn set(&mut self, name: &str, figure: f64) {
        let slot = match name {
            "octree" => &mut self.octree,
            "octree_single" => &mut self.octree_single,
            "bvh2" => &mut self.bvh2,
            "cwbvh" => &mut self.cwbvh,
            "cwbvh_as_shipped" => &mut self.cwbvh_as_shipped,
            "polish" => &mut self.polish,
            "exact" => &mut self.exact,
            _ => return,
        };
        *slot = Some(figure);
    }
}
