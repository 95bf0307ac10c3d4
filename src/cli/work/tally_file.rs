//! What stands at the head of a tally file: enough to know the run that it is a part of, and to write its results.

use super::output_place::folder_of;
use super::run_commands::RunCommands;
use super::shards::is_tally;
use super::usage::Usage;
use crate::cli::failure::Failure;
use crate::formats::read_bytes;
use crate::intersect::NormalMode;
use crate::math::FaceId;
use crate::pipeline::{
    IntersectorChoice, IntersectorKind, MeshingSettings, PROGRAM, PartChoice, PreparedScene, RayRange,
    TracingSettings,
};
use crate::simulate::{Fingerprint, GROWING_REPLICATE, PartialRun};
use crate::study::accuracy_target::{RelativeTolerance, TolerancePlan};
use crate::study::default_accuracy::TracingChoice;
use crate::text::grouped;
use clap::ValueEnum;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The head of a tally file. Lengths and angles as bits of `f64`.
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
    /// Local tolerances that an accuracy came to, so that they need not be searched for again.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    plan: Option<StoredPlan>,
    rays: Option<u64>,
    /// Rays of the run, or past the last of its range, whether they were asked for or are the scene's own.
    #[serde(default)]
    run_rays: u64,
    /// The first ray, where the run was asked for as a range of rays.
    #[serde(default)]
    pub(crate) first_ray: Option<u64>,
    /// The options that ask for what was chosen, where the command line did not.
    #[serde(default)]
    pub(crate) accuracy: String,
    /// What was chosen and why, where it was open, with all that the pilot found; a choice of another form costs a pilot and not the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    choice: Option<Vec<u64>>,
    seed: Option<u64>,
    intersector: Option<String>,
    normals: Option<String>,
    pub(crate) shard: Option<[u32; 2]>,
    /// Sequences that are listed for each receiver; 0 where light is not grouped.
    #[serde(default)]
    pub(crate) sequences: u32,
    /// Faces that are listed with what they absorb and let through; 0 where that is not counted.
    #[serde(default)]
    pub(crate) faces: u32,
    /// The commands that traced it.
    #[serde(flatten)]
    pub(crate) commands: RunCommands,
    /// The program that traced it; empty in files of earlier versions.
    #[serde(default)]
    program: String,
    /// Time and machines that it took.
    #[serde(default)]
    pub(crate) usage: Usage,
}

impl TallyHeader {
    /// Returns the header of a run of the scene file `scene`, or of a shard (index from 0, count) of it, that is about to be traced by
    /// `commands`. No usage yet.
    pub(crate) fn new(
        prepared: &PreparedScene,
        scene: &Path,
        shard: Option<[u32; 2]>,
        commands: RunCommands,
    ) -> Result<Self, Failure> {
        let m = &prepared.job.meshing;
        let t = &prepared.job.tracing;
        // Absolute: parts are merged from elsewhere.
        let scene = std::path::absolute(scene).unwrap_or_else(|_| scene.to_path_buf());
        // As bits: text would have to be read back exactly.
        let bits = |x: [f64; 2]| x.map(f64::to_bits);
        Ok(Self {
            fingerprint: prepared.fingerprint()?.0,
            scene_bytes: scene.to_str().is_none().then(|| scene.as_os_str().as_encoded_bytes().to_vec()),
            scene: scene.to_string_lossy().into_owned(),
            tolerance: m.tolerance.map(bits),
            angle: m.angle_deg.map(f64::to_bits),
            part: m.part.iter().map(|(n, t)| (n.clone(), bits(*t))).collect(),
            face: m.face.iter().map(|(n, t)| (n.clone(), bits(*t))).collect(),
            role: m.role.iter().map(|(n, t)| (n.clone(), bits(*t))).collect(),
            plan: m.plan.as_ref().map(StoredPlan::new),
            // As many as were traced, whichever way they were asked for.
            rays: prepared.rays.or(t.rays()),
            run_rays: prepared.run_settings().rays,
            first_ray: t.ray_range.and_then(|range| range.first),
            accuracy: accuracy_options(prepared),
            choice: prepared.chosen.as_ref().map(TracingChoice::to_words),
            seed: t.seed,
            intersector: t.intersector.map(|i| i.to_string()),
            normals: t.normals.map(|n| n.to_string()),
            shard,
            sequences: prepared.job.scene.run.sequences,
            faces: prepared.job.scene.run.faces,
            commands,
            program: PROGRAM.into(),
            usage: Usage::default(),
        })
    }

    /// Returns the number of rays of the run, where the scene's own was not taken.
    pub(crate) fn rays(&self) -> Option<u64> {
        self.rays
    }

    /// Returns the rays that the run traces, the scene's own number too.
    pub(crate) fn ray_range(&self) -> RayRange {
        RayRange { first: self.first_ray, end: self.run_rays }
    }

    /// Returns the same header with what the run took.
    pub(crate) fn with_usage(&self, usage: Usage) -> Self {
        Self { usage, ..self.clone() }
    }

    /// Returns the same header for a run that other commands traced.
    pub(crate) fn with_commands(self, commands: RunCommands) -> Self {
        Self { commands, ..self }
    }

    /// Returns the commands that traced this run where its process goes on from a file with the `earlier` header: with the very run, or
    /// by a search that has come to a longer one since.
    pub(crate) fn commands_after(&self, earlier: &Self) -> RunCommands {
        let own = self.commands.clone();
        if earlier.run_rays == self.run_rays {
            own.continue_from(&earlier.commands)
        } else {
            own.search_on_from(&earlier.commands)
        }
    }

    /// Returns by which program the part was traced, and which one this is, in words; `None` where both are the same.
    pub(crate) fn other_program(&self) -> Option<String> {
        (self.program != PROGRAM).then(|| {
            let version = if self.program.is_empty() { "of an earlier version" } else { self.program.as_str() };
            format!("by lampyris {version}, and this is lampyris {PROGRAM}")
        })
    }

    /// Returns in words what a part of another run differs in from the `first` one: the seed, the rays, options of the facets and of the
    /// tracing; where these are alike, the place of the scene, of which there may be copies; `None` where that is the same, too.
    pub(crate) fn difference(&self, first: &Self) -> Option<String> {
        // The length of a run that grows does not identify it.
        let grow = [self, first].iter().all(|h| h.run_rays.is_multiple_of(GROWING_REPLICATE));
        let words = |h: &Self| {
            let seed = h.seed.map_or_else(|| "the seed of its scene".to_owned(), |seed| format!("seed {seed}"));
            let rays = if grow { String::new() } else { format!("{} rays", grouped(h.run_rays)) };
            let named =
                |key: &str, value: Option<&str>| format!("{key} {}", value.unwrap_or("of its scene or pilot"));
            let tolerance =
                h.tolerance.map(|t| t.map(f64::from_bits)).map(|[low, high]| format!("{low}..{high} mm"));
            let [intersector, normals] = [&h.intersector, &h.normals].map(Option::as_deref);
            vec![
                seed,
                rays,
                named("the tolerance", tolerance.as_deref()),
                named("the intersector", intersector),
                named("the normals", normals),
            ]
        };
        let place = |h: &Self| vec![format!("the scene {}", h.scene().display())];
        let differing = |words: &dyn Fn(&Self) -> Vec<String>| {
            let (own, of_first): (Vec<String>, Vec<String>) =
                words(self).into_iter().zip(words(first)).filter(|(own, of_first)| own != of_first).unzip();
            (!own.is_empty())
                .then(|| format!("with {}, the first part with {}", own.join(", "), of_first.join(", ")))
        };
        differing(&words).or_else(|| differing(&place))
    }

    /// Returns where the scene was when the part was traced.
    pub(crate) fn scene(&self) -> PathBuf {
        #[cfg(unix)]
        if let Some(bytes) = &self.scene_bytes {
            use std::os::unix::ffi::OsStrExt;
            return PathBuf::from(std::ffi::OsStr::from_bytes(bytes));
        }
        PathBuf::from(&self.scene)
    }

    /// Returns what the part chose where that was open; `None` if it was not, or the choice is of a form that is no longer known.
    pub(crate) fn choice(&self) -> Option<PartChoice> {
        let chosen = TracingChoice::from_words(self.choice.as_ref()?)?;
        Some(PartChoice { chosen, fingerprint: Fingerprint(self.fingerprint.clone()) })
    }

    /// Returns the options that decided the facets, to the bit.
    pub(crate) fn meshing(&self) -> MeshingSettings {
        let back = |x: [u64; 2]| x.map(f64::from_bits);
        MeshingSettings {
            tolerance: self.tolerance.map(back),
            angle_deg: self.angle.map(f64::from_bits),
            part: self.part.iter().map(|(n, t)| (n.clone(), back(*t))).collect(),
            face: self.face.iter().map(|(n, t)| (n.clone(), back(*t))).collect(),
            role: self.role.iter().map(|(n, t)| (n.clone(), back(*t))).collect(),
            plan: self.plan.as_ref().map(StoredPlan::restore),
        }
    }

    /// Returns the options that decided the rays; threads are left open.
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

/// Returns what the parts that lie where `output` is to go chose by a pilot, from the smallest file that says; `None` where none does.
pub(crate) fn choice_of_parts(output: &Path) -> Option<PartChoice> {
    let folder = if is_tally(output) { folder_of(output) } else { output.to_path_buf() };
    let files = std::fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path());
    let tallies = files.filter(|path| is_tally(path));
    let mut tallies: Vec<(u64, PathBuf)> =
        tallies.filter_map(|path| Some((std::fs::metadata(&path).ok()?.len(), path))).collect();
    // Any of them will do, and all of a file is read to know that it is whole.
    tallies.sort();
    let choice = |(_, path): &(u64, PathBuf)| {
        let header: TallyHeader = PartialRun::header(&read_bytes(path).ok()?).ok()?;
        header.choice().filter(|choice| choice.chosen.pilot_rays > 0)
    };
    tallies.iter().find_map(choice)
}

/// A [`TolerancePlan`] in a file.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct StoredPlan {
    places: Vec<StoredTolerance>,
    other: StoredTolerance,
    coarsest: u64,
    finest: u64,
}

/// A [`RelativeTolerance`] in a file.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct StoredTolerance {
    faces: Vec<u32>,
    of_radius: u64,
    radii: [u64; 2],
}

impl StoredPlan {
    /// Keeps a plan to the bit.
    fn new(plan: &TolerancePlan) -> Self {
        Self {
            places: plan.places.iter().map(StoredTolerance::new).collect(),
            other: StoredTolerance::new(&plan.other),
            coarsest: plan.coarsest_mm.to_bits(),
            finest: plan.finest_mm.to_bits(),
        }
    }

    /// Returns the plan that was kept, to the bit.
    fn restore(&self) -> TolerancePlan {
        TolerancePlan {
            places: self.places.iter().map(StoredTolerance::restore).collect(),
            other: self.other.restore(),
            coarsest_mm: f64::from_bits(self.coarsest),
            finest_mm: f64::from_bits(self.finest),
        }
    }
}

impl StoredTolerance {
    /// Keeps a tolerance to the bit.
    fn new(tolerance: &RelativeTolerance) -> Self {
        Self {
            faces: tolerance.faces.iter().map(|f| f.0).collect(),
            of_radius: tolerance.of_radius.to_bits(),
            radii: tolerance.radii_mm.map(f64::to_bits),
        }
    }

    /// Returns the tolerance that was kept, to the bit.
    fn restore(&self) -> RelativeTolerance {
        RelativeTolerance {
            faces: self.faces.iter().map(|f| FaceId(*f)).collect(),
            of_radius: f64::from_bits(self.of_radius),
            radii_mm: self.radii.map(f64::from_bits),
        }
    }
}

/// Returns the options that ask for the facets, normals and intersector of a run, as they are typed.
fn accuracy_options(prepared: &PreparedScene) -> String {
    let [low, high] = prepared.mesh_settings.tolerance;
    let IntersectorChoice { intersector, normals } = prepared.choice;
    format!("--tolerance {low}..{high} --normals {normals} --intersector {intersector}")
}
