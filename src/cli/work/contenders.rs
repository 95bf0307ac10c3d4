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
use crate::study::cross_check::{Competitor, CrossCheck, GroupedIntersectors, measure};
use crate::tessellate::GroupedFacets;

/// Rays of a timed round: enough for a tenth of a second on the slowest.
const TIMED_RAYS: usize = 20_000;
/// Timed rounds of every intersector, alternating.
const TIMED_ROUNDS: usize = 3;
/// Shortest time of a round that a rate is made of, s: below it a clock tells nothing.
const SHORTEST_ROUND: f64 = 1e-12;
/// Rays of a million rays per second.
const MILLION: f64 = 1e6;

/// The structures of all intersectors over the facets and the model of each group.
pub(crate) struct Structures<'a> {
    groups: Vec<GroupStructures<'a>>,
    instancing: Option<&'a Instancing>,
}

struct GroupStructures<'a> {
    model: &'a Model,
    mesh: &'a FacetMesh,
    octree: Octree<'a>,
    bvh2: Bvh<'a>,
    cwbvh: Bvh<'a>,
    cwbvh_as_shipped: Bvh<'a>,
    exact: Exact,
}

/// The intersectors, which answer in the scene's coordinates.
pub(crate) struct Contenders<'s> {
    groups: Vec<(&'s Model, &'s FacetMesh)>,
    instancing: Option<&'s Instancing>,
    pub(crate) octree: Box<dyn Intersector + 's>,
    bvh2: Box<dyn Intersector + 's>,
    cwbvh: Box<dyn Intersector + 's>,
    cwbvh_as_shipped: Box<dyn Intersector + 's>,
    /// The octree with hits moved to the spline.
    pub(crate) polish: Box<dyn Intersector + 's>,
    pub(crate) exact: Box<dyn Intersector + 's>,
}

impl<'a> Structures<'a> {
    /// Builds them all, of a part that is placed often once; the spline's patches are cut for as many rays as are asked. Shows a spinner.
    pub(crate) fn build(
        model: &'a Model,
        facets: &'a GroupedFacets,
        normals: NormalMode,
        rays: u64,
        console: &Console,
    ) -> Self {
        let spinner = console.spinner("building octree, BVHs and spline");
        let instancing = facets.instancing.as_deref();
        let models: Vec<&Model> = instancing.map_or_else(|| vec![model], |i| i.groups.iter().collect());
        let groups = facets.meshes().zip(models).enumerate().map(|(k, (mesh, model))| {
            // A start that is far away comes to the part with the rounding that it has there.
            let farthest_start = instancing.map_or(0.0, |i| i.reach(k));
            let cwbvh = bvh::Settings { normals, farthest_start, ..Default::default() };
            GroupStructures {
                model,
                mesh,
                octree: Octree::build(mesh, &octree::Settings { normals, farthest_start, ..Default::default() }),
                bvh2: Bvh::build(mesh, &bvh::Settings { kind: bvh::Kind::Bvh2, ..cwbvh }),
                cwbvh: Bvh::build(mesh, &cwbvh),
                cwbvh_as_shipped: Bvh::build(mesh, &bvh::Settings { cured: false, ..cwbvh }),
                exact: Exact::build(model, &exact::Settings { farthest_start, ..exact::Settings::for_rays(rays) }),
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

    /// Returns the intersectors, each of which stands for the whole model.
    pub(crate) fn contenders(&self) -> Contenders<'_> {
        Contenders {
            groups: self.groups.iter().map(|g| (g.model, g.mesh)).collect(),
            instancing: self.instancing,
            octree: self.joined(|g| Box::new(&g.octree)),
            bvh2: self.joined(|g| Box::new(&g.bvh2)),
            cwbvh: self.joined(|g| Box::new(&g.cwbvh)),
            cwbvh_as_shipped: self.joined(|g| Box::new(&g.cwbvh_as_shipped)),
            polish: self.joined(|g| Box::new(Polished::new(&g.octree, g.mesh, &g.exact))),
            exact: self.joined(|g| Box::new(&g.exact)),
        }
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

    /// Returns all of them under the names of the document; `octree_single` is asked ray by ray.
    pub(crate) fn competitors(&self) -> [Competitor<'_>; 7] {
        let competitor = |name, who, batch| Competitor { name, who, batch };
        [
            competitor("octree", &*self.octree, true),
            competitor("octree_single", &*self.octree, false),
            competitor("bvh2", &*self.bvh2, true),
            competitor("cwbvh", &*self.cwbvh, true),
            competitor("cwbvh_as_shipped", &*self.cwbvh_as_shipped, true),
            competitor("polish", &*self.polish, true),
            competitor("exact", &*self.exact, true),
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
