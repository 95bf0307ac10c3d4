//! Every intersector over the same facets and the same model, and how fast each is.

use crate::cli::console::Console;
use crate::intersect::bvh::{self, Bvh};
use crate::intersect::exact::{self, Exact};
use crate::intersect::octree::{self, Octree};
use crate::intersect::{Intersector, NormalMode};
use crate::math::Ray;
use crate::mesh::FacetMesh;
use crate::model::Model;
use crate::study::cross_check::{Competitor, CrossCheck, measure};

/// Rays of a timed round: enough for a tenth of a second on the slowest.
const TIMED_RAYS: usize = 20_000;
/// Timed rounds of every intersector, alternating.
const TIMED_ROUNDS: usize = 3;
/// Shortest time of a round that a rate is made of, s: below it a clock tells nothing.
const SHORTEST_ROUND: f64 = 1e-12;
/// Rays of a million rays per second.
const MILLION: f64 = 1e6;
/// Every intersector over the same facets and the same model.
pub(crate) struct Contenders<'a> {
    pub(crate) octree: Octree<'a>,
    bvh2: Bvh<'a>,
    pub(crate) cwbvh: Bvh<'a>,
    cwbvh_as_shipped: Bvh<'a>,
    pub(crate) exact: Exact,
}

impl<'a> Contenders<'a> {
    /// Builds them all over one mesh and its model; the spline's structure is cut for so many rays. Shows a sign of life.
    pub(crate) fn build(
        mesh: &'a FacetMesh,
        model: &Model,
        normals: NormalMode,
        rays: u64,
        console: &Console,
    ) -> Self {
        let spinner = console.spinner("building octree, BVHs and spline");
        let cwbvh = bvh::Settings { normals, ..Default::default() };
        let contenders = Self {
            octree: Octree::build(mesh, &octree::Settings { normals, ..Default::default() }),
            bvh2: Bvh::build(mesh, &bvh::Settings { kind: bvh::Kind::Bvh2, ..cwbvh }),
            cwbvh: Bvh::build(mesh, &cwbvh),
            cwbvh_as_shipped: Bvh::build(mesh, &bvh::Settings { cured: false, ..cwbvh }),
            exact: Exact::build(model, &exact::Settings::for_rays(model, rays)),
        };
        spinner.finish_and_clear();
        contenders
    }

    /// Returns all intersectors, the polished octree included, under the names of the document; `octree_single` is asked ray by ray.
    pub(crate) fn competitors<'s>(&'s self, polish: &'s dyn Intersector) -> [Competitor<'s>; 7] {
        let competitor = |name, who, batch| Competitor { name, who, batch };
        [
            competitor("octree", &self.octree as &dyn Intersector, true),
            competitor("octree_single", &self.octree, false),
            competitor("bvh2", &self.bvh2, true),
            competitor("cwbvh", &self.cwbvh, true),
            competitor("cwbvh_as_shipped", &self.cwbvh_as_shipped, true),
            competitor("polish", polish, true),
            competitor("exact", &self.exact, true),
        ]
    }
}

/// Measures build time, size and rate of every intersector on a sample of the rays, and fills them into `found`.
pub(crate) fn time_all(found: &mut CrossCheck, contenders: &[Competitor], rays: &[Ray], console: &Console) {
    let spinner = console.spinner("timing");
    for contender in contenders {
        let footprint = contender.who.footprint();
        found.build_seconds.set(contender.name, footprint.build_seconds);
        let bytes_per_facet = footprint.bytes as f64 / footprint.primitives.max(1) as f64;
        found.bytes_per_facet.set(contender.name, bytes_per_facet);
    }
    // Evenly over the rays, so that every kind of them is among the timed.
    let timed: Vec<Ray> = rays.iter().copied().step_by(rays.len().div_ceil(TIMED_RAYS).max(1)).collect();
    for (name, timing) in measure(contenders, &timed, TIMED_ROUNDS) {
        found.mrays_per_s.set(&name, timed.len() as f64 / timing.median.max(SHORTEST_ROUND) / MILLION);
    }
    spinner.finish_and_clear();
}
