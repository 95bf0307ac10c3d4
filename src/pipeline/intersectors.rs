//! From settings to the intersector of a run.

use super::error::Error;
use super::monitor::{Monitor, Stage};
use super::settings::{IntersectorKind, TracingSettings, normal_mode};
use crate::intersect::bvh::{self, Bvh};
use crate::intersect::exact::{self, Exact};
use crate::intersect::octree::{self, Octree};
use crate::intersect::polish::Polished;
use crate::intersect::{Footprint, Intersector, NormalMode};
use crate::mesh::FacetMesh;
use crate::model::Model;
use crate::simulate::Scene;
use std::sync::Arc;

/// What finds the hits, and how the normal there is got.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IntersectorChoice {
    /// What finds the hits.
    pub intersector: IntersectorKind,
    /// How the normal there is got.
    pub normals: NormalMode,
}

impl IntersectorChoice {
    /// The settings, else the scene, else octree and bilinear.
    ///
    /// # Errors
    /// When the scene names an intersector or normals that are not known.
    pub fn new(tracing: &TracingSettings, scene: Option<&Scene>) -> Result<Self, Error> {
        // What is asked on the command line stands above the scene.
        let accuracy = scene.map(|s| &s.accuracy);
        let intersector = match (tracing.intersector, accuracy.and_then(|a| a.intersector.as_deref())) {
            (Some(intersector), _) => intersector,
            (None, Some(name)) => name.parse()?,
            (None, None) => IntersectorKind::default(),
        };
        let normals = match (tracing.normals, accuracy.and_then(|a| a.normals.as_deref())) {
            (Some(normals), _) => normals,
            (None, Some(name)) => normal_mode(name)?,
            (None, None) => NormalMode::default(),
        };
        Ok(Self { intersector, normals })
    }
}

/// Builds the chosen intersector and hands it to `work`, with what it took to build.
pub fn with_intersector<T>(
    choice: IntersectorChoice,
    model: &Model,
    mesh: &FacetMesh,
    monitor: &dyn Monitor,
    work: impl FnOnce(&dyn Intersector, Footprint) -> T,
) -> T {
    let builders = Builders {
        octree: &|settings| Octree::build(mesh, settings),
        spline: &|| Arc::new(Exact::build(model, &exact::Settings::default())),
    };
    with_built_intersector(choice, builders, mesh, monitor, work)
}

/// How the caller makes octree and spline: anew, or from what was built before.
pub(super) struct Builders<'a, 'm> {
    pub(super) octree: &'a dyn Fn(&octree::Settings) -> Octree<'m>,
    pub(super) spline: &'a dyn Fn() -> Arc<Exact>,
}

/// The same with octree and spline of the caller's making.
pub(super) fn with_built_intersector<'m, T>(
    choice: IntersectorChoice,
    Builders { octree, spline }: Builders<'_, 'm>,
    mesh: &'m FacetMesh,
    monitor: &dyn Monitor,
    work: impl FnOnce(&dyn Intersector, Footprint) -> T,
) -> T {
    monitor.begin(Stage::Building(choice.intersector));
    // On the spline facets are not needed at all.
    if choice.intersector == IntersectorKind::Exact {
        let exact = spline();
        monitor.end();
        return work(&*exact, exact.footprint());
    }
    let normals = choice.normals.on_facets();
    let facets: Box<dyn Intersector + '_> = match choice.intersector {
        IntersectorKind::Bvh2 => {
            Box::new(Bvh::build(mesh, &bvh::Settings { kind: bvh::Kind::Bvh2, normals, ..Default::default() }))
        }
        IntersectorKind::Cwbvh => Box::new(Bvh::build(mesh, &bvh::Settings { normals, ..Default::default() })),
        IntersectorKind::Octree | IntersectorKind::Exact => {
            Box::new(octree(&octree::Settings { normals, ..Default::default() }))
        }
    };
    // Only exact normals need the spline beside the facets.
    if choice.normals != NormalMode::Exact {
        monitor.end();
        return work(&*facets, facets.footprint());
    }
    let exact = spline();
    let polished = Polished::new(&*facets, mesh, &exact);
    monitor.end();
    work(&polished, polished.footprint())
}
