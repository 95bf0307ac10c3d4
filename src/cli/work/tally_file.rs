//! What stands at the head of a tally file: enough to know the run that it is a part of, and to write its results.

use super::usage::Usage;
use crate::cli::console::Console;
use crate::cli::failure::Failure;
use crate::intersect::NormalMode;
use crate::pipeline::{
    IntersectorChoice, IntersectorKind, MeshingSettings, PreparedScene, RayRange, TracingSettings, fingerprint,
};
use clap::ValueEnum;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// What stands at the head of a tally file: enough to write the results of the whole run. Lengths and angles as bits of `f64`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct TallyHeader {
    pub(crate) fingerprint: String,
    scene: String,
    /// The path of the scene as the system has it, where it is no UTF-8.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    scene_bytes: Option<Vec<u8>>,
    tolerance: Option<[u64; 2]>,
    angle: Option<u64>,
    part: Vec<(String, [u64; 2])>,
    #[serde(default)]
    face: Vec<(String, [u64; 2])>,
    #[serde(default)]
    role: Vec<(String, [u64; 2])>,
    rays: Option<u64>,
    /// The first ray, where the run was asked for as a range of rays.
    #[serde(default)]
    pub(crate) first_ray: Option<u64>,
    /// The options that ask for what was chosen, where the command line did not.
    #[serde(default)]
    pub(crate) accuracy: String,
    seed: Option<u64>,
    intersector: Option<String>,
    normals: Option<String>,
    pub(crate) shard: Option<[u32; 2]>,
    /// Sequences that are listed for each receiver; 0 where light is not grouped.
    #[serde(default)]
    pub(crate) sequences: u32,
    pub(crate) command: String,
    /// What it took.
    #[serde(default)]
    pub(crate) usage: Usage,
}

impl TallyHeader {
    /// Of a run that is about to be traced.
    pub(crate) fn new(
        prepared: &PreparedScene,
        scene: &Path,
        shard: Option<[u32; 2]>,
        console: &Console,
    ) -> Result<Self, Failure> {
        let m = &prepared.job.meshing;
        let t = &prepared.job.tracing;
        // Absolute: parts are merged from elsewhere.
        let scene = std::path::absolute(scene).unwrap_or_else(|_| scene.to_path_buf());
        // As bits: text would have to be read back exactly.
        let bits = |x: [f64; 2]| x.map(f64::to_bits);
        Ok(Self {
            fingerprint: fingerprint(prepared)?.0,
            scene_bytes: scene.to_str().is_none().then(|| scene.as_os_str().as_encoded_bytes().to_vec()),
            scene: scene.to_string_lossy().into_owned(),
            tolerance: m.tolerance.map(bits),
            angle: m.angle_deg.map(f64::to_bits),
            part: m.part.iter().map(|(n, t)| (n.clone(), bits(*t))).collect(),
            face: m.face.iter().map(|(n, t)| (n.clone(), bits(*t))).collect(),
            role: m.role.iter().map(|(n, t)| (n.clone(), bits(*t))).collect(),
            // As many as were traced, whichever way they were asked for.
            rays: prepared.rays.or(t.rays()),
            first_ray: t.ray_range.and_then(|range| range.first),
            accuracy: accuracy_options(prepared),
            seed: t.seed,
            intersector: t.intersector.map(|i| i.to_string()),
            normals: t.normals.map(|n| n.to_string()),
            shard,
            sequences: prepared.job.scene.run.sequences,
            command: console.command.clone(),
            usage: Usage::default(),
        })
    }

    /// The same with what it took.
    pub(crate) fn with_usage(&self, usage: Usage) -> Self {
        Self { usage, ..self.clone() }
    }

    /// Where the scene was when the part was traced.
    pub(crate) fn scene(&self) -> PathBuf {
        #[cfg(unix)]
        if let Some(bytes) = &self.scene_bytes {
            use std::os::unix::ffi::OsStrExt;
            return PathBuf::from(std::ffi::OsStr::from_bytes(bytes));
        }
        PathBuf::from(&self.scene)
    }

    /// The options that decided the facets.
    pub(crate) fn meshing(&self) -> MeshingSettings {
        let back = |x: [u64; 2]| x.map(f64::from_bits);
        MeshingSettings {
            tolerance: self.tolerance.map(back),
            angle_deg: self.angle.map(f64::from_bits),
            part: self.part.iter().map(|(n, t)| (n.clone(), back(*t))).collect(),
            face: self.face.iter().map(|(n, t)| (n.clone(), back(*t))).collect(),
            role: self.role.iter().map(|(n, t)| (n.clone(), back(*t))).collect(),
            // Parts are not traced with an accuracy asked for.
            plan: None,
        }
    }

    /// The options that decided the rays.
    pub(crate) fn tracing(&self) -> TracingSettings {
        TracingSettings {
            ray_range: self.rays.map(|end| RayRange { first: self.first_ray, end }),
            seed: self.seed,
            threads: None,
            intersector: self.intersector.as_ref().and_then(|n| IntersectorKind::from_str(n, true).ok()),
            normals: self.normals.as_ref().and_then(|n| NormalMode::from_str(n, true).ok()),
        }
    }
}
/// The options that ask for the facets, normals and intersector of a run.
fn accuracy_options(prepared: &PreparedScene) -> String {
    let [low, high] = prepared.mesh_settings.tolerance;
    let IntersectorChoice { intersector, normals } = prepared.choice;
    format!("--tolerance {low}..{high} --normals {normals} --intersector {intersector}")
}
