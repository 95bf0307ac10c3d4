//! What a reader of results must know of the files that a model comes from.

use lampyris::pipeline::PreparedScene;
use lampyris::step::ImportReport;
use std::collections::HashSet;

/// Problems that are told in full, as the command does; the account of a model has all of them.
const NAMED_PROBLEMS: usize = 3;

/// Sentences on what could not be read of files, each once: which were cut off, their first problems, and what they hide.
pub(crate) fn reading_notes(reports: &[ImportReport]) -> Vec<String> {
    // A file that stands in many places has as many reports.
    let mut told = HashSet::new();
    let reports: Vec<&ImportReport> =
        reports.iter().filter(|report| told.insert((&report.file, report.hash))).collect();
    let cut_off = reports.iter().filter(|report| report.cut_off);
    let mut notes: Vec<String> = cut_off
        .map(|report| format!("{} ends before its end section: what is missing is unknown", report.file))
        .collect();
    let problems: Vec<&String> = reports.iter().flat_map(|report| &report.problems).collect();
    notes.extend(problems.iter().take(NAMED_PROBLEMS).map(|problem| (*problem).clone()));
    let further = problems.len().saturating_sub(NAMED_PROBLEMS);
    if further > 0 {
        let noun = if further == 1 { "problem" } else { "problems" };
        notes.push(format!("{further} more {noun}: read_step(FILE).account()[\"problems\"] has them all"));
    }
    let hidden: usize = reports.iter().map(|report| report.hidden.len()).sum();
    if hidden > 0 {
        let noun = if hidden == 1 { "item" } else { "items" };
        notes.push(format!(
            "light meets {hidden} {noun} that the model hides: read_step(FILE).account()[\"hidden\"] lists them"
        ));
    }
    notes
}

/// Sentences on what the models of a scene lack, faces that are not traced first; none where all is well.
pub(crate) fn model_notes(scene: &PreparedScene) -> Vec<String> {
    let loaded = &scene.job.loaded;
    let mut notes = Vec::new();
    let [refused, found] = loaded.refused_faces();
    if refused > 0 {
        notes.push(format!(
            "{refused} of {found} faces were refused, and light passes where they are: read_step(FILE).account() lists them with the reasons"
        ));
    }
    let [bare, all] = scene.bare_faces();
    if bare > 0 {
        notes.push(format!("{bare} of {all} faces have no facets, and light passes where they are"));
    }
    notes.extend(loaded.empty_files().map(|file| format!("nothing of {file} is traced: it holds no face")));
    notes.extend(reading_notes(&loaded.reports));
    notes
}
