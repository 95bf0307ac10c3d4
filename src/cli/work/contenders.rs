//! Every intersector over the same facets and the same model, and how fast each is.

use crate::cli::console::Console;
use crate::intersect::bvh::{self, Bvh};
use crate::intersect::exact::{self, Exact};
use crate::intersect::octree::{self, Octree};
use crate::intersect::polish::Polished;
use crate::intersect::{Intersector, NormalMode};
use crate::math::Ray;
use crate::mesh::FacetMesh;
use crate::model::{Instancing, Model};
use crate::pipeline::in_one_scene;
use crate::study::Timing;
use crate::study::cross_check::{CrossCheck, GroupedIntersectors, TimedIntersector, measure};
use crate::tessellate::GroupedFacets;
use std::borrow::Cow;

/// Most rays of a timed round.
const TIMED_RAYS: usize = 20_000;
/// Time of a round, s, that is enough for the slowest: where that takes longer for [`TIMED_RAYS`], fewer are timed.
const ROUND_SECONDS: f64 = 0.1;
/// Rays by which their number is estimated.
const PROBED_RAYS: usize = 500;
/// Timed rounds of every intersector, alternating.
const TIMED_ROUNDS: usize = 3;

/// The structures of all intersectors over the facets and the model of each group.
pub(crate) struct Structures<'a> {
    groups: Vec<GroupStructures<'a>>,
    instancing: Option<&'a Instancing>,
}

struct GroupStructures<'a> {
    model: &'a Model,
    mesh: &'a FacetMesh,
    octree: Octree<'a>,
    cwbvh: Bvh<'a>,
    exact: Exact,
    /// How [`Self::cwbvh`] was built.
    bvh_settings: bvh::Settings,
}

/// The intersectors that are compared, which answer in the scene's coordinates.
pub(crate) struct Contenders<'s> {
    groups: Vec<(&'s Model, &'s FacetMesh)>,
    instancing: Option<&'s Instancing>,
    pub(crate) octree: Box<dyn Intersector + 's>,
    cwbvh: Box<dyn Intersector + 's>,
    pub(crate) exact: Box<dyn Intersector + 's>,
}

impl<'a> Structures<'a> {
    /// Builds those that are compared, of a part that is placed often once; the spline's patches are cut for as many rays as are traced.
    /// Shows a spinner.
    pub(crate) fn build(
        model: &'a Model,
        facets: &'a GroupedFacets,
        normals: NormalMode,
        rays: u64,
        console: &Console,
    ) -> Self {
        let spinner = console.spinner("building octree, BVH and spline");
        let instancing = facets.instancing.as_deref();
        let models: Vec<&Model> = instancing.map_or_else(|| vec![model], |i| i.groups.iter().collect());
        let groups = facets.meshes().zip(models).enumerate().map(|(k, (mesh, model))| {
            // A start that is far away comes to the part with the rounding that it has there.
            let farthest_start = instancing.map_or(0.0, |i| i.reach(k));
            let bvh_settings = bvh::Settings { normals, farthest_start, ..Default::default() };
            GroupStructures {
                model,
                mesh,
                octree: Octree::build(mesh, &octree::Settings { normals, farthest_start, ..Default::default() }),
                cwbvh: Bvh::build(mesh, &bvh_settings),
                exact: Exact::build(model, &exact::Settings { farthest_start, ..exact::Settings::for_rays(rays) }),
                bvh_settings,
            }
        });
        let structures = Self { groups: groups.collect(), instancing };
        spinner.finish_and_clear();
        structures
    }

    /// Joins what `of_group` takes of each group to one intersector.
    fn joined<'s>(
        &'s self,
        of_group: impl Fn(&'s GroupStructures<'a>) -> Box<dyn Intersector + 's>,
    ) -> Box<dyn Intersector + 's> {
        in_one_scene(self.instancing, self.groups.iter().map(of_group).collect())
    }

    /// Returns those that are compared, each of which stands for the whole model.
    pub(crate) fn contenders(&self) -> Contenders<'_> {
        Contenders {
            groups: self.groups.iter().map(|g| (g.model, g.mesh)).collect(),
            instancing: self.instancing,
            octree: self.joined(|g| Box::new(&g.octree)),
            cwbvh: self.joined(|g| Box::new(&g.cwbvh)),
            exact: self.joined(|g| Box::new(&g.exact)),
        }
    }

    /// Returns the octree with hits moved to the spline.
    pub(crate) fn polished(&self) -> Box<dyn Intersector + '_> {
        self.joined(|g| Box::new(Polished::new(&g.octree, g.mesh, &g.exact)))
    }

    /// Builds a BVH of other settings than that which is compared.
    fn bvh_of(&self, settings: impl Fn(bvh::Settings) -> bvh::Settings) -> Box<dyn Intersector + '_> {
        self.joined(|g| Box::new(Bvh::build(g.mesh, &settings(g.bvh_settings))))
    }

    /// Measures build time, size and rate of every intersector on a sample of the rays, and fills them into `found`. The BVHs that are only
    /// timed are built here: while answers were compared they would stand in memory for nothing.
    pub(crate) fn time_all(
        &self,
        found: &mut CrossCheck,
        contenders: &Contenders<'_>,
        polish: &dyn Intersector,
        rays: &[Ray],
        console: &Console,
    ) {
        let spinner = console.spinner("timing");
        let bvh2 = self.bvh_of(|settings| bvh::Settings { kind: bvh::Kind::Bvh2, ..settings });
        let cwbvh_as_shipped = self.bvh_of(|settings| bvh::Settings { cured: false, ..settings });
        let asked = |name, intersector, batch| TimedIntersector { name, intersector, batch };
        let intersectors = [
            asked("octree", &*contenders.octree, true),
            // Asked ray by ray.
            asked("octree_single", &*contenders.octree, false),
            asked("bvh2", &*bvh2, true),
            asked("cwbvh", &*contenders.cwbvh, true),
            asked("cwbvh_as_shipped", &*cwbvh_as_shipped, true),
            asked("polish", polish, true),
            asked("exact", &*contenders.exact, true),
        ];
        for contender in &intersectors {
            let footprint = contender.intersector.footprint();
            found.build_seconds.set(contender.name, footprint.build_seconds);
            let bytes_per_facet = footprint.bytes as f64 / footprint.primitives.max(1) as f64;
            found.bytes_per_facet.set(contender.name, bytes_per_facet);
        }
        let pace = measure(&intersectors, &evenly(rays, PROBED_RAYS), 1);
        let slowest = pace.iter().map(|(_, timing)| timing.median).fold(0.0, f64::max);
        let enough = (ROUND_SECONDS / slowest.max(Timing::SHORTEST) * PROBED_RAYS as f64) as usize;
        let timed = evenly(rays, enough.clamp(PROBED_RAYS, TIMED_RAYS));
        for (name, timing) in measure(&intersectors, &timed, TIMED_ROUNDS) {
            found.mrays_per_s.set(&name, Timing::mrays_per_s(timed.len(), timing.median));
        }
        spinner.finish_and_clear();
    }
}

impl Contenders<'_> {
    /// Returns those whose answers are compared: octree, BVH and spline.
    pub(crate) fn compared(&self) -> GroupedIntersectors<'_> {
        GroupedIntersectors {
            groups: self.groups.clone(),
            instancing: self.instancing,
            octree: &*self.octree,
            bvh: &*self.cwbvh,
            exact: &*self.exact,
        }
    }
}

/// Returns at most so many of the rays, evenly over all of them, so that every kind is among them.
fn evenly(rays: &[Ray], most: usize) -> Cow<'_, [Ray]> {
    let step = rays.len().div_ceil(most).max(1);
    if step == 1 { Cow::from(rays) } else { rays.iter().copied().step_by(step).collect() }
}
