//! From settings to the intersector of a run.

use super::error::Error;
use super::monitor::{Monitor, Stage};
use super::settings::{IntersectorKind, TracingSettings, normal_mode};
use crate::intersect::bvh::{self, Bvh};
use crate::intersect::exact::{self, Exact};
use crate::intersect::instanced::Instanced;
use crate::intersect::octree::{self, Octree};
use crate::intersect::polish::Polished;
use crate::intersect::{Footprint, Intersector, NormalMode};
use crate::mesh::FacetMesh;
use crate::model::{Instancing, Model};
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
    /// Takes the settings, else the scene, else octree and bilinear.
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

/// Builds the chosen intersector of a model in one piece and calls `work` with it and what it took to build.
pub fn with_intersector<T>(
    choice: IntersectorChoice,
    model: &Model,
    mesh: &FacetMesh,
    monitor: &dyn Monitor,
    work: impl FnOnce(&dyn Intersector, Footprint) -> T,
) -> T {
    let builders = Builders {
        octree: &|_, settings| Octree::build(mesh, settings),
        splines: &|| vec![Arc::new(Exact::build(model, &exact::Settings::default()))],
    };
    with_built_intersector(choice, builders, (&[mesh], None), monitor, work)
}

/// How the caller makes the octree of each group, and the splines of all: anew, or from what was built before.
pub(super) struct Builders<'a, 'm> {
    pub(super) octree: &'a dyn Fn(usize, &octree::Settings) -> Octree<'m>,
    pub(super) splines: &'a dyn Fn() -> Vec<Arc<Exact>>,
}

/// Joins the octrees and splines of the caller's making to the chosen intersector over the meshes of all groups, and calls `work` with it
/// and what it took to build; a BVH is built here. Without `instancing` there is one group.
pub(super) fn with_built_intersector<'m, T>(
    choice: IntersectorChoice,
    Builders { octree, splines }: Builders<'_, 'm>,
    (meshes, instancing): (&[&'m FacetMesh], Option<&Instancing>),
    monitor: &dyn Monitor,
    work: impl FnOnce(&dyn Intersector, Footprint) -> T,
) -> T {
    monitor.begin(Stage::Building(choice.intersector));
    // On the spline facets are not needed at all.
    if choice.intersector == IntersectorKind::Exact {
        let splines = splines();
        let groups = splines.iter().map(|s| Box::new(&**s) as Box<dyn Intersector>).collect();
        let exact = in_one_scene(instancing, groups);
        monitor.end();
        return work(&*exact, exact.footprint());
    }
    let normals = choice.normals.on_facets();
    let on_facets = |(group, mesh): (usize, &&'m FacetMesh)| -> Box<dyn Intersector + '_> {
        let farthest_start = farthest_start(instancing, group);
        let bvh = bvh::Settings { normals, farthest_start, ..Default::default() };
        match choice.intersector {
            IntersectorKind::Bvh2 => Box::new(Bvh::build(mesh, &bvh::Settings { kind: bvh::Kind::Bvh2, ..bvh })),
            IntersectorKind::Cwbvh => Box::new(Bvh::build(mesh, &bvh)),
            IntersectorKind::Octree | IntersectorKind::Exact => {
                Box::new(octree(group, &octree::Settings { normals, farthest_start, ..Default::default() }))
            }
        }
    };
    let facets: Vec<_> = meshes.iter().enumerate().map(on_facets).collect();
    // Only exact normals need the spline beside the facets.
    if choice.normals != NormalMode::Exact {
        let facets = in_one_scene(instancing, facets);
        monitor.end();
        return work(&*facets, facets.footprint());
    }
    let splines = splines();
    let polished = (facets.iter().zip(meshes).zip(&splines))
        .map(|((facets, mesh), exact)| Box::new(Polished::new(&**facets, mesh, exact)) as Box<dyn Intersector>);
    let polished = in_one_scene(instancing, polished.collect());
    monitor.end();
    work(&*polished, polished.footprint())
}

/// Joins the structures of all groups to one that answers in the scene's coordinates; without `instancing` there must be one.
pub(super) fn in_one_scene<'a>(
    instancing: Option<&'a Instancing>,
    mut groups: Vec<Box<dyn Intersector + 'a>>,
) -> Box<dyn Intersector + 'a> {
    match instancing {
        Some(instancing) => Box::new(Instanced::new(instancing, groups)),
        // A model in one piece has one group.
        None => groups.swap_remove(0),
    }
}

/// Returns how far, mm, the farthest place of a group is; 0 for what has the scene's coordinates.
pub(super) fn farthest_start(instancing: Option<&Instancing>, group: usize) -> f64 {
    instancing.map_or(0.0, |i| i.reach(group))
}
