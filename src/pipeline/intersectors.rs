//! From settings to the intersector of a run.

use super::error::Error;
use super::monitor::{Monitor, Stage};
use super::settings::{IntersectorKind, TracingSettings, normal_mode};
use crate::intersect::bvh::{self, Bvh};
use crate::intersect::exact::{self, Exact};
use crate::intersect::instanced::Instanced;
use crate::intersect::octree::{self, Octree};
use crate::intersect::polish::Polished;
use crate::intersect::spline_with_meshes::SplineWithMeshes;
use crate::intersect::{Footprint, Intersector, NormalMode};
use crate::mesh::FacetMesh;
use crate::model::{Instancing, Model};
use crate::simulate::Scene;
use crate::tessellate::GroupedFacets;
use std::sync::Arc;

/// The intersector, and how normals at hits are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IntersectorChoice {
    /// The intersector.
    pub intersector: IntersectorKind,
    /// How normals at hits are computed.
    pub normals: NormalMode,
}

impl IntersectorChoice {
    /// Takes the settings, else the scene, else octree and bilinear.
    ///
    /// # Errors
    /// When the scene names an intersector or normals that are not known.
    pub fn new(tracing: &TracingSettings, scene: Option<&Scene>) -> Result<Self, Error> {
        // The command line overrides the scene.
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

/// Refuses facet normals that are asked for, by the settings or by the scene, where the spline is traced, which has normals of its own.
///
/// # Errors
/// When such normals are asked for, and when the scene names an intersector or normals that are not known.
pub fn refuse_facet_normals(tracing: &TracingSettings, scene: Option<&Scene>) -> Result<(), Error> {
    let IntersectorChoice { intersector, normals } = IntersectorChoice::new(tracing, scene)?;
    // Settings that override the scene may make its normals meaningless.
    let is_asked = tracing.normals.is_some()
        || tracing.intersector.is_none() && scene.is_some_and(|scene| scene.accuracy.normals.is_some());
    if intersector != IntersectorKind::Exact || !is_asked || normals == NormalMode::Exact {
        return Ok(());
    }
    let why = "the spline has normals of its own";
    let error = match (tracing.normals.is_some(), tracing.intersector.is_some()) {
        // All of it comes from the scene, so its keys are named.
        (false, _) => Error::request(format!(
            "[accuracy] in the scene has `normals = \"{normals}\"` with `intersector = \"exact\"`: {why}"
        )),
        (true, true) => Error::setting("normals", format!("{normals} with the intersector exact: {why}")),
        (true, false) => Error::setting(
            "normals",
            format!("{normals} with `intersector = \"exact\"` in [accuracy] of the scene: {why}"),
        ),
    };
    Err(error.help("leave the normals out, or choose an intersector on facets, as octree"))
}

/// What stands for a group itself: the spline, and the facets of faces that have none, as ready meshes have none.
#[derive(Debug)]
pub(super) struct TrueSurface {
    exact: Exact,
    meshes: FacetMesh,
}

impl TrueSurface {
    /// Builds the spline of a group; `mesh` has its facets, of any tolerance.
    pub(super) fn new(model: &Model, mesh: &FacetMesh, settings: &exact::Settings) -> Self {
        let exact = Exact::build(model, settings);
        let meshes = match exact.skipped() {
            [] => FacetMesh::default(),
            skipped => mesh.of_faces(|face| skipped.binary_search(&face).is_ok()),
        };
        Self { exact, meshes }
    }

    /// Whether it is coarser than one for any number of rays.
    pub(super) fn is_shallow(&self) -> bool {
        self.exact.is_shallow()
    }

    /// Returns what answers rays on it; `farthest_start`, mm, is that of [`farthest_start`] for its group.
    fn intersector(&self, farthest_start: f64) -> Box<dyn Intersector + '_> {
        if self.meshes.facets.is_empty() {
            return Box::new(&self.exact);
        }
        let settings = octree::Settings { farthest_start, ..Default::default() };
        Box::new(SplineWithMeshes::new(&self.exact, &self.meshes, &settings))
    }
}

/// Joins the true surfaces of all groups to one intersector in the scene's coordinates; without `instancing` there must be one.
pub(super) fn true_intersector<'a>(
    instancing: Option<&'a Instancing>,
    surfaces: &'a [Arc<TrueSurface>],
) -> Box<dyn Intersector + 'a> {
    let group = |(k, surface): (usize, &'a Arc<TrueSurface>)| surface.intersector(farthest_start(instancing, k));
    in_one_scene(instancing, surfaces.iter().enumerate().map(group).collect())
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
        surfaces: &|| vec![Arc::new(TrueSurface::new(model, mesh, &exact::Settings::default()))],
    };
    with_built_intersector(choice, builders, (&[mesh], None), monitor, work)
}

/// How the caller makes the octree of each group, and the true surfaces of all: anew, or from what was built before.
pub(super) struct Builders<'a, 'm> {
    pub(super) octree: &'a dyn Fn(usize, &octree::Settings) -> Octree<'m>,
    pub(super) surfaces: &'a dyn Fn() -> Vec<Arc<TrueSurface>>,
}

/// Joins the octrees and true surfaces of the caller's making to the chosen intersector over the meshes of all groups, and calls `work`
/// with it and what it took to build; a BVH is built here. Without `instancing` there is one group.
pub(super) fn with_built_intersector<'m, T>(
    choice: IntersectorChoice,
    Builders { octree, surfaces }: Builders<'_, 'm>,
    (meshes, instancing): (&[&'m FacetMesh], Option<&Instancing>),
    monitor: &dyn Monitor,
    work: impl FnOnce(&dyn Intersector, Footprint) -> T,
) -> T {
    monitor.begin(Stage::Building(choice.intersector));
    // On the spline no facets are needed but those of ready meshes.
    if choice.intersector == IntersectorKind::Exact {
        let surfaces = surfaces();
        let exact = true_intersector(instancing, &surfaces);
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
    let surfaces = surfaces();
    let polished = (facets.iter().zip(meshes).zip(&surfaces)).map(|((facets, mesh), surface)| {
        Box::new(Polished::new(&**facets, mesh, &surface.exact)) as Box<dyn Intersector>
    });
    let polished = in_one_scene(instancing, polished.collect());
    monitor.end();
    work(&*polished, polished.footprint())
}

/// Joins the structures of all groups to one that answers in the scene's coordinates; without `instancing` there must be one.
pub fn in_one_scene<'a>(
    instancing: Option<&'a Instancing>,
    mut groups: Vec<Box<dyn Intersector + 'a>>,
) -> Box<dyn Intersector + 'a> {
    match instancing {
        Some(instancing) => Box::new(Instanced::new(instancing, groups)),
        // A model in one piece has one group.
        None => groups.swap_remove(0),
    }
}

/// Builds a structure over the facets of each group with `build`, which is given the largest coordinate that starts were rounded at, mm,
/// and joins them to one that answers in the scene's coordinates.
pub(super) fn groups_in_one_scene<'f>(
    facets: &'f GroupedFacets,
    build: impl Fn(&'f FacetMesh, f64) -> Box<dyn Intersector + 'f>,
) -> Box<dyn Intersector + 'f> {
    let instancing = facets.instancing.as_deref();
    let groups = facets.meshes().enumerate().map(|(group, mesh)| build(mesh, farthest_start(instancing, group)));
    in_one_scene(instancing, groups.collect())
}

/// Builds an octree with these normals over the facets of each group, joined to one.
pub(super) fn octrees_in_one_scene(facets: &GroupedFacets, normals: NormalMode) -> Box<dyn Intersector + '_> {
    groups_in_one_scene(facets, |mesh, farthest_start| {
        Box::new(Octree::build(mesh, &octree::Settings { normals, farthest_start, ..Default::default() }))
    })
}

/// Returns the largest coordinate, in size, of what is placed from a group, mm; 0 for what has the scene's coordinates.
pub(super) fn farthest_start(instancing: Option<&Instancing>, group: usize) -> f64 {
    instancing.map_or(0.0, |i| i.reach(group))
}
