//! Files of models: the fixtures of the project and, where it is present, a corpus of real STEP files.
// Every test binary includes this file and uses some of it.
#![allow(dead_code)]

use lampyris::model::Model;
use lampyris::step;
use std::path::{Path, PathBuf};

/// A file or folder of `fixtures/`.
pub(crate) fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

/// The folder of real STEP files: `LAMPYRIS_CORPUS`, by default `../shared/step-corpus` beside the project. The files are not
/// the project's to ship, so tests that want them are ignored by default and pass where the folder is missing.
pub(crate) fn corpus() -> PathBuf {
    std::env::var_os("LAMPYRIS_CORPUS")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/step-corpus"), PathBuf::from)
}

/// The STEP files of a folder by name, none where it cannot be read.
pub(crate) fn step_files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    let is_step = |extension: &std::ffi::OsStr| ["stp", "step"].iter().any(|e| extension.eq_ignore_ascii_case(e));
    files.retain(|path| path.extension().is_some_and(is_step));
    files.sort();
    files
}

/// The model of a STEP file, `None` where it cannot be read.
pub(crate) fn read_model(path: &Path) -> Option<Model> {
    step::read(path, &step::Settings::default()).ok().map(|import| import.model)
}
