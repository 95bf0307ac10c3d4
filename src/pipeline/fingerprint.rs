//! What decides the bits of a run, as one hash: parts with the same one belong together.

use super::error::Error;
use super::prepared_scene::PreparedScene;
use crate::formats::open_file;
use crate::simulate::{Fingerprint, FingerprintHasher, RunSettings, grows};

/// Hashes all that decides the bits of a run: program, text of the scene, its files, facets, intersector, settings; of a run that grows not
/// the number of rays.
///
/// # Errors
/// When a file of the scene cannot be read.
pub fn fingerprint(prepared: &PreparedScene) -> Result<Fingerprint, Error> {
    let scene = &prepared.job.scene;
    let defaults = RunSettings::default();
    let asked = prepared.run_settings();
    // How far a run has grown decides the bits of no ray.
    let grows = grows(&prepared.bound, &asked);
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
        ..asked
    };
    let words = format!(
        "{} {} {:?} {:?} {settings:?}",
        env!("CARGO_PKG_VERSION"),
        env!("LAMPYRIS_COMMIT"),
        prepared.mesh_settings,
        prepared.choice
    );
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
