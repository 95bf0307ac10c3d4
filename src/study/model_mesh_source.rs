//! The [`MeshSource`] of a model: the tessellator, octree, BVH, polishing and exact spline that `trace` itself uses.

use super::mesh_source::{FacetTree, MeasuredMesh, MeshSource};
use super::tolerance_plan::TolerancePlan;
use crate::intersect::bvh::{self, Bvh};
use crate::intersect::exact::{self, Exact};
use crate::intersect::octree::{self, Octree};
use crate::intersect::polish::Polished;
use crate::intersect::{Intersector, NormalMode};
use crate::mesh::FacetMesh;
use crate::model::Model;
use crate::tessellate::{self, tessellate};
use std::sync::Arc;

/// The product's own mesher, trees and spline, for studies of a model.
pub struct ModelMeshSource<'a> {
    model: &'a Model,
    exact: Arc<Exact>,
    /// Everything of the mesher but the tolerance.
    pub mesher: tessellate::Settings,
}

impl<'a> ModelMeshSource<'a> {
    /// Builds the exact spline of the model.
    pub fn new(model: &'a Model) -> Self {
        Self::with_spline(model, Arc::new(Exact::build(model, &exact::Settings::default())))
    }

    /// Takes the exact spline of the model, which was built before.
    pub fn with_spline(model: &'a Model, exact: Arc<Exact>) -> Self {
        Self { model, exact, mesher: tessellate::Settings::default() }
    }

    /// Builds the exact spline of the model; every mesh then has its sag sampled, which takes about twice as long as meshing.
    pub fn measuring(model: &'a Model) -> Self {
        let product = Self::new(model);
        Self { mesher: tessellate::Settings { measure: true, ..product.mesher }, ..product }
    }

    /// Makes the mesh with its sag, mm: sampled where it was measured, else the proved bound for mean and largest alike.
    fn tessellate_with(&self, settings: &tessellate::Settings) -> MeasuredMesh {
        let made = tessellate(self.model, settings);
        let sag = made.report.sag_mm;
        MeasuredMesh {
            mesh: made.mesh,
            seconds: made.report.seconds.tessellate,
            // Where nothing was sampled the certified bound stands in, which is never too small.
            sag_mean: sag.sampled_mean.unwrap_or(sag.bound_max),
            sag_max: sag.sampled_max.unwrap_or(sag.bound_max),
        }
    }

    /// Returns the model.
    pub fn model(&self) -> &'a Model {
        self.model
    }

    /// Returns the exact spline as its own type.
    pub fn spline(&self) -> &Exact {
        &self.exact
    }
}

impl MeshSource for ModelMeshSource<'_> {
    fn mesh(&self, tolerance: [f64; 2]) -> MeasuredMesh {
        self.tessellate_with(&tessellate::Settings { tolerance, ..self.mesher.clone() })
    }

    fn mesh_plan(&self, plan: &TolerancePlan) -> MeasuredMesh {
        let mut settings = self.mesher.clone();
        plan.apply(&mut settings);
        self.tessellate_with(&settings)
    }
    fn build<'m>(&'m self, mesh: &'m FacetMesh, tree: FacetTree, normals: NormalMode) -> Box<dyn Intersector + 'm> {
        match tree {
            FacetTree::Octree => Box::new(Octree::build(mesh, &octree::Settings { normals, ..Default::default() })),
            FacetTree::CwBvh => Box::new(Bvh::build(mesh, &bvh::Settings { normals, ..Default::default() })),
        }
    }

    fn polish<'m>(&'m self, facets: &'m dyn Intersector, mesh: &'m FacetMesh) -> Box<dyn Intersector + 'm> {
        Box::new(Polished::new(facets, mesh, &self.exact))
    }

    fn exact(&self) -> &dyn Intersector {
        &*self.exact
    }
}
