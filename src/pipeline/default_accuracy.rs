//! A run that asks for no tolerance, normals or intersector is given them: what a pilot of its own rays finds sufficient.

use super::facets::tessellate_groups;
use super::intersectors::{
    Builders, IntersectorChoice, TrueSurface, octrees_in_one_scene, true_intersector, with_built_intersector,
};
use super::monitor::{Monitor, Silent, Stage, in_stage};
use super::settings::{IntersectorKind, MeshingSettings, TracingSettings};
use crate::intersect::octree::{self, Octree};
use crate::intersect::{Intersector, NormalMode};
use crate::model::Model;
use crate::simulate::{BoundScene, RunSettings, Scene};
use crate::study::default_accuracy::{self, PilotSource, TimedFacets, TracingChoice, UndecidedRun};
use crate::tessellate::{self, GroupedFacets};
use std::cell::OnceCell;
use std::slice;
use std::sync::Arc;

/// Whether settings or scene say how fine the facets are, what normals they carry or what finds the hits.
pub fn is_accuracy_asked(meshing: &MeshingSettings, tracing: &TracingSettings, scene: &Scene) -> bool {
    let accuracy = &scene.accuracy;
    let in_scene = accuracy.tolerance_mm.is_some()
        || accuracy.angle_deg.is_some()
        || accuracy.normals.is_some()
        || accuracy.intersector.is_some();
    // Tolerances of single places are a choice too.
    let places = !(meshing.part.is_empty() && meshing.face.is_empty() && meshing.role.is_empty());
    let facets = meshing.tolerance.is_some() || meshing.angle_deg.is_some() || meshing.plan.is_some() || places;
    in_scene || facets || tracing.normals.is_some() || tracing.intersector.is_some()
}

/// A run that is to be given tolerance, normals and intersector, and the facets that are made for it already.
#[derive(Clone, Copy)]
pub(super) struct OpenRun<'a> {
    pub(super) model: &'a Model,
    pub(super) bound: &'a BoundScene,
    pub(super) run: &'a RunSettings,
    pub(super) facets: &'a GroupedFacets,
    /// What these facets were made with.
    pub(super) mesher: &'a tessellate::Settings,
}

/// Makes what a pilot compares, for a model in one piece or in groups.
struct ModelPilotSource<'a> {
    model: &'a Model,
    /// The facets of the default tolerance, which say how the model is grouped.
    made: &'a GroupedFacets,
    /// All of the mesher but the tolerance.
    mesher: &'a tessellate::Settings,
    /// The true surface of each group, built when first asked for.
    surfaces: &'a dyn Fn() -> &'a [Arc<TrueSurface>],
    exact: OnceCell<Box<dyn Intersector + 'a>>,
}

impl PilotSource for ModelPilotSource<'_> {
    fn facets(&self, tolerance: [f64; 2]) -> TimedFacets {
        let settings = tessellate::Settings { tolerance, ..self.mesher.clone() };
        let (facets, seconds) = tessellate_groups(self.model, self.made.instancing.as_ref(), &settings);
        TimedFacets { facets, seconds }
    }

    fn octree<'f>(&'f self, facets: &'f GroupedFacets) -> Box<dyn Intersector + 'f> {
        octrees_in_one_scene(facets, octree::Settings::default().normals)
    }

    fn with_moved_hits(&self, facets: &GroupedFacets, work: &mut dyn FnMut(&dyn Intersector)) {
        let meshes: Vec<_> = facets.meshes().collect();
        let builders = Builders {
            octree: &|group, settings| Octree::build(meshes[group], settings),
            surfaces: &|| (self.surfaces)().to_vec(),
        };
        let choice = IntersectorChoice { intersector: IntersectorKind::Octree, normals: NormalMode::Exact };
        let groups = (&meshes[..], facets.instancing.as_deref());
        // Part of the choice, and the monitor sees only the choice.
        with_built_intersector(choice, builders, groups, &Silent, |moved, _| work(moved));
    }

    fn exact(&self) -> &dyn Intersector {
        // Flat faces and short runs are judged without a ray, and need no spline.
        &**self.exact.get_or_init(|| true_intersector(self.made.instancing.as_deref(), (self.surfaces)()))
    }
}

/// Chooses facets or spline for a run; returns finer facets than it has too, where these are chosen. `surfaces` builds the true surface of
/// each group, and is called only where a pilot is traced.
pub(super) fn choose<'a>(
    open: OpenRun<'a>,
    surfaces: &'a dyn Fn() -> &'a [Arc<TrueSurface>],
    monitor: &dyn Monitor,
) -> (TracingChoice, Option<TimedFacets>) {
    let OpenRun { model, bound, run, facets, mesher } = open;
    let instancing = facets.instancing.as_deref();
    let models = instancing.map_or(slice::from_ref(model), |i| &i.groups);
    let source = ModelPilotSource { model, made: facets, mesher, surfaces, exact: OnceCell::new() };
    in_stage(monitor, Stage::Choosing, || {
        let tolerance = mesher.tolerance;
        default_accuracy::choose(&UndecidedRun { models, bound, run, source: &source, facets, tolerance })
    })
}

/// Whether a pilot is needed to choose: not for flat faces and short runs.
pub(super) fn needs_pilot(open: OpenRun<'_>) -> bool {
    let OpenRun { model, bound, run, facets, mesher } = open;
    let models = facets.instancing.as_deref().map_or(slice::from_ref(model), |i| &i.groups);
    let source = ModelPilotSource { model, made: facets, mesher, surfaces: &|| &[], exact: OnceCell::new() };
    let tolerance = mesher.tolerance;
    UndecidedRun { models, bound, run, source: &source, facets, tolerance }.needs_pilot()
}

/// Returns what finds the hits of a run whose accuracy was chosen, and its normals: the exact spline by that name, else the octree.
pub(super) fn intersector_choice(chosen: &TracingChoice) -> IntersectorChoice {
    let intersector = match chosen.intersector {
        "exact" => IntersectorKind::Exact,
        _ => IntersectorKind::Octree,
    };
    IntersectorChoice { intersector, normals: chosen.normals }
}
