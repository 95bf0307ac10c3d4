//! What decides the bits of a run, as one hash: parts with the same one belong together.

use super::error::Error;
use super::intersectors::IntersectorChoice;
use crate::formats::open_file;
use crate::simulate::{BoundScene, Fingerprint, FingerprintHasher, RunSettings, Scene, grows};
use crate::tessellate;

/// Hashes all that decides the bits of a run of these settings: program, text of the scene, its files, facets, intersector, settings; of a
/// run that grows not the number of rays.
///
/// # Errors
/// When a file of the scene cannot be read.
pub(super) fn run_fingerprint(
    (scene, bound): (&Scene, &BoundScene),
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
    let program = concat!(env!("CARGO_PKG_VERSION"), " ", env!("LAMPYRIS_COMMIT"));
    let words = format!("{program} {mesher:?} {choice:?} {settings:?}");
    let mut hasher = FingerprintHasher::default();
    hasher.add(words.as_bytes());
    hasher.add(scene.origin.text.as_deref().unwrap_or("").as_bytes());
    // By their bytes: a file that changed changes the run.
    let files = scene.models.iter().map(|m| &m.file).chain(scene.sources.iter().filter_map(|s| s.file.as_ref()));
    let files = files.chain(scene.media.iter().filter_map(|m| m.file.as_ref()));
    for file in files {
        let path = scene.resolve(file);
        let mut read = || {
            let mut file = open_file(&path)?;
            hasher.add_read(file.metadata()?.len(), &mut file)
        };
        read().map_err(|e| Error::input(format!("{}: {e}", path.display())))?;
    }
    Ok(hasher.finish())
}
