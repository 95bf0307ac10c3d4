//! What decides the bits of a run, as one hash: parts with the same one belong together.

use super::cache::PROGRAM;
use super::error::Error;
use super::intersectors::IntersectorChoice;
use super::loading::LoadedModel;
use crate::formats::{lower_extension, open_file};
use crate::simulate::scene::Origin;
use crate::simulate::{BoundScene, Fingerprint, FingerprintHasher, RunSettings, Scene, grows};
use crate::tessellate;
use std::collections::HashMap;
use std::fmt::{self, Write};
use std::path::Path;

/// Hashes all that decides the bits of a run of these settings: program, scene, its model and other files, facets, intersector, settings;
/// of a run that grows not the number of rays. A model from files counts by their bytes as they were read, one from memory by its values;
/// other files by their bytes, and none by its path.
///
/// # Errors
/// When a file of the scene cannot be read.
pub(super) fn run_fingerprint(
    (scene, bound, loaded): (&Scene, &BoundScene, &LoadedModel),
    asked: &RunSettings,
    (mesher, choice): (&tessellate::Settings, &IntersectorChoice),
) -> Result<Fingerprint, Error> {
    let defaults = RunSettings::default();
    // How far a run has grown decides the bits of no ray.
    let grows = grows(bound, asked);
    let settings = RunSettings {
        rays: if grows { 0 } else { asked.rays },
        first_ray: 0,
        grows,
        // Threads, batches, kernel and shard leave every bit as it is.
        threads: 0,
        batch: 0,
        kernel: defaults.kernel,
        shard: [0, 1],
        path_samples: 0,
        ..asked.clone()
    };
    let words = format!("{PROGRAM} {mesher:?} {choice:?} {settings:?}");
    let mut hasher = FingerprintHasher::default();
    hasher.add(words.as_bytes());
    // Every value, not the text: a scene that was made or changed by a program has none, or that of another.
    hasher.add(format!("{:?}", without_paths(scene)).as_bytes());
    if loaded.is_from_files(scene) {
        loaded.reports.iter().for_each(|report| hasher.add(&report.hash.to_le_bytes()));
    } else {
        // Piece by piece: the whole would be many times the model.
        write!(Pieces(&mut hasher), "{:?}", loaded.model).map_err(|e| Error::input(e.to_string()))?;
    }
    // By their bytes: a file that changed changes the run. Those of the model come first.
    for file in scene.files().skip(scene.models.len()) {
        let path = scene.resolve(file);
        let mut read = || {
            let mut file = open_file(&path)?;
            hasher.add_read(file.metadata()?.len(), &mut file)
        };
        read().map_err(|e| Error::input(format!("{}: {e}", path.display())))?;
    }
    Ok(hasher.finish())
}

/// The scene with nothing of the paths of its files but what decides how they are read: which of them are one file, and of sources the
/// extension. A copy of it in another folder, or on another machine, is the same scene.
fn without_paths(scene: &Scene) -> Scene {
    let mut bare = Scene { origin: Origin::default(), ..Scene::clone(scene) };
    let mut numbers = HashMap::new();
    let mut number = |path: &str| {
        let next = numbers.len();
        *numbers.entry(path.to_owned()).or_insert(next)
    };
    bare.models.iter_mut().for_each(|model| model.file = number(&model.file).to_string());
    for file in bare.sources.iter_mut().filter_map(|source| source.file.as_mut()) {
        *file = format!("{}.{}", number(file), lower_extension(Path::new(file)));
    }
    for file in bare.media.iter_mut().filter_map(|medium| medium.file.as_mut()) {
        *file = number(file).to_string();
    }
    bare
}

/// Hashes what is written to it, each piece by itself.
struct Pieces<'a>(&'a mut FingerprintHasher);

impl Write for Pieces<'_> {
    fn write_str(&mut self, piece: &str) -> fmt::Result {
        self.0.add(piece.as_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two builds of changed sources draw other random numbers: what one of them traced is no part of a run of the other.
    #[test]
    fn a_build_without_a_commit_is_told_by_its_sources() {
        let build = PROGRAM.split_once(' ').map_or("", |(_, build)| build);
        let (commit, sources) = build.split_once("(sources ").unwrap_or((build, ""));
        let commit = commit.trim_end();
        let tells_sources = !["", "unknown"].contains(&commit) && !commit.ends_with("+changes");
        let hash = sources.strip_suffix(')').unwrap_or("");
        let is_hash = hash.len() == 16 && hash.chars().all(|c| c.is_ascii_hexdigit());
        assert!(commit != "unknown" && tells_sources != is_hash, "{PROGRAM}");
    }
}
