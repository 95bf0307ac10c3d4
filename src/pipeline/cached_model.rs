//! Models of STEP files, from the cache where they are kept there.

use super::cache::{Cache, MODEL, PROGRAM};
use super::monitor::Monitor;
use crate::mesh::arrays::ArrayReader;
use crate::simulate::Fingerprint;
use crate::step::{self, Import, StepText};
use std::path::Path;

/// Reads a STEP file, or takes the model of a file of the same name and bytes from the cache, as it was read with these settings, and else
/// keeps it there.
///
/// # Errors
/// Those of [`step::read`].
pub(super) fn read_step(
    path: &Path,
    settings: &step::Settings,
    cache: Option<&Cache>,
    monitor: &dyn Monitor,
) -> Result<Import, step::Error> {
    let Some(cache) = cache else { return step::read(path, settings) };
    let (name, bytes) = step::read_file(path)?;
    let source = StepText::new(&name, &bytes, settings);
    let entry = format!("{}{MODEL}", Fingerprint::new(&[PROGRAM.as_bytes(), source.key().as_bytes()]).0);
    let fetch = || cache.fetch(&entry, monitor, |from: &mut ArrayReader| source.read(from));
    let _turn = match cache.fetch_or_turn(&entry, fetch) {
        Ok(import) => return Ok(import),
        Err(turn) => turn,
    };
    let import = source.import()?;
    cache.keep(&entry, monitor, |to| source.write(&import, to));
    Ok(import)
}
