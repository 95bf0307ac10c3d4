//! The product's own mesher and intersectors, as the studies want them.

use crate::intersect::bvh::{self, Bvh};
use crate::intersect::exact::Exact;
use crate::intersect::octree::{self, Octree};
use crate::intersect::polish::Polished;
use crate::intersect::{Cost, Footprint, Hit, Intersector, NormalMode};
use crate::math::Ray;
use crate::mesh::FacetMesh;
use crate::model::Model;
use crate::study::{Meshed, Tree, Workshop};
use crate::tessellate::{self, tessellate};

/// Meshes and traces one model.
pub(super) struct Product<'a> {
    model: &'a Model,
    exact: Exact,
}

impl<'a> Product<'a> {
    pub(super) fn new(model: &'a Model) -> Self {
        Self { model, exact: Exact::build(model, &Default::default()) }
    }
}

impl Workshop for Product<'_> {
    fn mesh(&self, tolerance: [f64; 2]) -> Meshed {
        // The time that the report gives is without the sampling.
        let made = tessellate(self.model, &tessellate::Settings { tolerance, measure: true, ..Default::default() });
        let (sag, seconds) = (made.report.sag_mm, made.report.seconds.tessellate);
        Meshed {
            mesh: made.mesh,
            seconds,
            sag_mean: sag.sampled_mean.unwrap_or(sag.bound_max),
            sag_max: sag.sampled_max.unwrap_or(sag.bound_max),
        }
    }

    fn build<'m>(&'m self, mesh: &'m FacetMesh, tree: Tree, normals: NormalMode) -> Box<dyn Intersector + 'm> {
        let own = if normals == NormalMode::Exact { NormalMode::Bilinear } else { normals };
        let facets: Box<dyn Intersector + 'm> = match tree {
            Tree::Octree => Box::new(Octree::build(mesh, &octree::Settings { normals: own, ..Default::default() })),
            Tree::CwBvh => Box::new(Bvh::build(mesh, &bvh::Settings { normals: own, ..Default::default() })),
        };
        if normals == NormalMode::Exact { Box::new(OnSpline { facets, mesh, exact: &self.exact }) } else { facets }
    }

    fn exact(&self) -> &dyn Intersector {
        &self.exact
    }
}

/// Polished hits over a structure that it owns.
struct OnSpline<'m> {
    facets: Box<dyn Intersector + 'm>,
    mesh: &'m FacetMesh,
    exact: &'m Exact,
}

impl Intersector for OnSpline<'_> {
    fn intersect(&self, ray: &Ray, cost: &mut Cost) -> Option<Hit> {
        Polished::new(&*self.facets, self.mesh, self.exact).intersect(ray, cost)
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], cost: &mut Cost) {
        Polished::new(&*self.facets, self.mesh, self.exact).intersect_batch(rays, hits, cost);
    }

    fn footprint(&self) -> Footprint {
        self.facets.footprint()
    }
}
