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
/// the project's to ship: tests that want them say so and pass where the folder is missing.
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

/// A context #1 of millimetres and radians, with its units #2 and #3, for the entities of a [`part21`] file.
pub(crate) const MILLIMETRES: &str = "#1=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#2,#3))REPRESENTATION_CONTEXT('',''));\n\
    #2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n#3=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\n";

/// The text of a Part 21 file of these entities.
pub(crate) fn part21(entities: &str) -> String {
    format!(
        "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n{entities}\nENDSEC;\nEND-ISO-10303-21;\n"
    )
}
