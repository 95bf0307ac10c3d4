//! What `lampyris study` is given, and which options each study takes.

use crate::cli::arguments::command::{ReportOption, StudyKind};
use crate::cli::failure::Failure;
use crate::pipeline::{MeshingSettings, TracingSettings};
use std::path::{Path, PathBuf};

/// Arguments of `study`.
pub(crate) struct StudyCommand<'a> {
    pub(crate) kind: StudyKind,
    pub(crate) file: Option<&'a Path>,
    pub(crate) output: Option<&'a PathBuf>,
    /// Rays to trace in place of those of the study; `None` for its own.
    pub(crate) rays_in: Option<&'a Path>,
    /// The library of Embree to compare with; `None` leaves Embree out.
    pub(crate) embree: Option<&'a Path>,
    pub(crate) report: ReportOption,
    pub(crate) meshing: MeshingSettings,
    pub(crate) tracing: TracingSettings,
}

/// Refuses options that a study would ignore: a user who gives one expects it to change the rows.
pub(super) fn refuse_unused_options(command: &StudyCommand) -> Result<(), Failure> {
    use StudyKind::{Accuracy, Bvh, Complexity, Effects, Stability};
    let kind = command.kind;
    if let Some(file) = command.file.filter(|_| matches!(kind, Complexity | Stability)) {
        let reason = if kind == Stability { "its cases are built in" } else { "its three lamps are built in" };
        let failure =
            Failure::arguments(format!("study {} does not take {}: {reason}", kind.name(), file.display()));
        return Err(
            failure.with_help("leave it out; `lampyris study accuracy FILE` and `study bvh FILE` take a file")
        );
    }
    let m = &command.meshing;
    let t = &command.tracing;
    let traces_scene = kind == Effects;
    // Studies of their own facets take a tolerance at most, the same on all faces.
    let given = [
        ("--intersector", t.intersector.is_some(), traces_scene, "it goes through all that it compares"),
        ("--normals", t.normals.is_some(), traces_scene, "it goes through all that it compares"),
        ("--rays", t.ray_range.is_some(), kind != Stability, "its rays are fixed"),
        ("--seed", t.seed.is_some(), kind != Stability, "its rays are fixed"),
        (
            "--tolerance",
            m.tolerance.is_some(),
            matches!(kind, Effects | Accuracy | Bvh | Complexity),
            "it goes through tolerances of its own",
        ),
        ("--angle", m.angle_deg.is_some(), traces_scene, "it makes facets of its own"),
        ("--embree", command.embree.is_some(), kind == Bvh, "`study bvh` alone compares with Embree"),
        ("--rays-in", command.rays_in.is_some(), kind == Bvh, "it traces rays of its own"),
        (
            "--rays",
            t.ray_range.is_some() && command.rays_in.is_some(),
            false,
            "the file of --rays-in has all of them",
        ),
        ("--part", !m.part.is_empty(), traces_scene, "it makes facets of its own"),
        ("--face", !m.face.is_empty(), traces_scene, "it makes facets of its own"),
        ("--role", !m.role.is_empty(), traces_scene, "it makes facets of its own"),
    ];
    // Only the first is reported; the others would fail too.
    let idle = given.iter().find(|(_, given, used, _)| *given && !used);
    let Some((option, _, _, why)) = idle else { return Ok(()) };
    let failure = Failure::arguments(format!("study {} does not take {option}: {why}", kind.name()));
    Err(failure.with_help("leave it out"))
}
