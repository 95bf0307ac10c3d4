//! A job: a scene with the settings requested for it, and its facets, from the cache or made.

use super::cache::{Cache, CachedFacets, facets_key, group_keys};
use super::facets::tessellate_groups;
use super::loading::LoadedModel;
use super::monitor::{Monitor, Stage, in_stage};
use super::settings::{MeshingSettings, TracingSettings};
use crate::mesh::FacetMesh;
use crate::model::Instancing;
use crate::simulate::{Fingerprint, Scene};
use crate::study::accuracy_target::AccuracyResult;
use crate::study::default_accuracy::TracingChoice;
use crate::tessellate::{self, GroupedFacets, Tessellation};
use std::slice;
use std::sync::Arc;
use std::time::Instant;

/// A scene with its model, and the settings requested for it.
#[derive(Clone, Debug)]
pub struct SceneJob {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Its models.
    pub loaded: Arc<LoadedModel>,
    /// How its facets are made.
    pub meshing: MeshingSettings,
    /// How it is traced.
    pub tracing: TracingSettings,
    /// How a requested accuracy was reached.
    pub accuracy: Option<AccuracyResult>,
    /// What another part chose, which is taken in place of a pilot where that part is of the same run.
    pub chosen: Option<PartChoice>,
    /// Where facets and octree are kept for other runs; built anew where there is none.
    pub cache: Option<Cache>,
}

/// The choice of a part of a run.
#[derive(Clone, Debug)]
pub struct PartChoice {
    /// The choice, with what its pilot found.
    pub chosen: TracingChoice,
    /// The fingerprint of that run.
    pub fingerprint: Fingerprint,
}

impl SceneJob {
    /// Makes the job of a scene as it stands, with all that it does not say left to choose, and without a cache.
    pub fn new(scene: impl Into<Arc<Scene>>, loaded: impl Into<Arc<LoadedModel>>) -> Self {
        Self {
            scene: scene.into(),
            loaded: loaded.into(),
            meshing: MeshingSettings::default(),
            tracing: TracingSettings::default(),
            accuracy: None,
            chosen: None,
            cache: None,
        }
    }

    /// Reads the facets of the model or of its groups from the cache, or makes and keeps them; returns them with the seconds that took.
    /// Those from the cache have no report.
    pub(super) fn facets(
        &self,
        instancing: Option<&Arc<Instancing>>,
        settings: &tessellate::Settings,
        monitor: &dyn Monitor,
    ) -> (GroupedFacets, f64) {
        let (start, model) = (Instant::now(), &self.loaded.model);
        let make = || in_stage(monitor, Stage::Tessellating, || tessellate_groups(model, instancing, settings));
        let Some((cache, key)) = self.cached(settings) else { return make() };
        let groups = instancing.map_or(slice::from_ref(model), |i| &i.groups);
        let keys = group_keys(&key, groups.len());
        let kept = |key| CachedFacets { cache, key, monitor };
        let fetch = || -> Option<Vec<FacetMesh>> {
            groups.iter().zip(&keys).map(|(group, key)| kept(key).mesh(group.placed_face_count())).collect()
        };
        // The last group is kept last: a process that has waited for it finds them all.
        let kept_or_turn = keys.last().map(|last| kept(last).mesh_or_turn(fetch));
        let _turn = match kept_or_turn {
            Some(Ok(meshes)) => {
                let group = |mesh| Tessellation { mesh, ..Tessellation::default() };
                let groups = meshes.into_iter().map(group).collect();
                let facets = GroupedFacets { groups, instancing: instancing.cloned() };
                return (facets, start.elapsed().as_secs_f64());
            }
            Some(Err(turn)) => Some(turn),
            None => None,
        };
        let (made, seconds) = make();
        made.meshes().zip(&keys).for_each(|(mesh, key)| kept(key).keep_mesh(mesh));
        (made, seconds)
    }

    /// Returns the cache, and the name that facets of these settings have in it; `None` without a cache or for a model from no file.
    pub(super) fn cached(&self, settings: &tessellate::Settings) -> Option<(&Cache, Fingerprint)> {
        let cache = self.cache.as_ref().filter(|_| self.loaded.is_from_files(&self.scene))?;
        Some((cache, facets_key(&self.scene, &self.loaded.reports, settings)))
    }
}
