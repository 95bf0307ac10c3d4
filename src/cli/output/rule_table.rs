//! Rules of a scene and the faces that each decides, as a table and as JSON.

use crate::model::{Model, PlacedFace};
use crate::report::Table;
use crate::simulate::scene::FaceSelector;
use crate::simulate::{BoundScene, LeftOut, face_selectors};
use serde_json::{Value, json};

/// Faces of a rule that are named; `info --faces` lists all.
const NAMED_FACES: usize = 3;

/// Instances of a selector that are named where it leaves them out.
const NAMED_INSTANCES: usize = 12;

/// Most faces of a model whose selectors stand in a report: a megabyte of them.
const MOST_LABELLED: usize = 20_000;

/// Returns the selector of every placed face, in their order; empty where there are more than [`MOST_LABELLED`], too many for a report.
pub(crate) fn face_labels(model: &Model) -> Vec<String> {
    // None rather than some: a report whose faces answer here and there would puzzle.
    if model.placed_face_count() > MOST_LABELLED {
        return Vec::new();
    }
    let faces: Vec<PlacedFace<'_>> = model.placed_faces().collect();
    face_selectors(model, &faces).iter().map(FaceSelector::as_key).collect()
}

/// Returns, for each rule, the selectors of its first [`NAMED_FACES`] faces; empty for large models.
fn example_selectors(bound: &BoundScene, model: &Model) -> Vec<Vec<String>> {
    let labels = face_labels(model);
    let label = |face: &u32| labels.get(*face as usize).cloned();
    bound.rules().iter().map(|r| r.faces.iter().take(NAMED_FACES).filter_map(label).collect()).collect()
}

/// Returns the rules of a scene as a table: a row for each, in their order, and one for the faces that none names.
pub(crate) fn rule_table(bound: &BoundScene, model: &Model) -> Table {
    let columns = [("[[material]]", ""), ("selects", ""), ("gives", ""), ("faces", ""), ("which", "")];
    let caption = "Of several rules that select a face the last one decides, for its medium and its surface apart. A row without faces is \
        a rule that later ones replace everywhere.";
    let mut table = Table::new("rules", "Rules and their faces", &columns).caption(caption);
    for (rule, named) in bound.rules().iter().zip(example_selectors(bound, model)) {
        let more = rule.faces.len() - named.len();
        let which = named.join(" | ");
        let which = if more > 0 && !which.is_empty() { format!("{which} and {more} more") } else { which };
        let selects = if rule.selects.is_empty() { "all faces" } else { &rule.selects };
        table.row([
            rule.rule.map_or_else(|| "none".into(), Into::into),
            selects.into(),
            rule.gives.as_str().into(),
            rule.faces.len().into(),
            which.into(),
        ]);
    }
    table
}

/// Returns what the scene leaves out of its models as a table: a row for each selector; `None` where it leaves out nothing.
pub(crate) fn left_out_table(left_out: &[LeftOut]) -> Option<Table> {
    let columns = [("[[model]]", ""), ("selects", ""), ("faces", ""), ("of", "")];
    let caption = "Faces of the files that are no part of the scene: `without` of their [[model]] leaves them out.";
    let mut table = Table::new("left_out", "Left out", &columns).caption(caption);
    for entry in left_out {
        let named = &entry.instances[..entry.instances.len().min(NAMED_INSTANCES)];
        let more = entry.instances.len() - named.len();
        let of = named.join(", ");
        let of = if more > 0 { format!("{of} and {more} more") } else { of };
        table.row([entry.model.into(), entry.selects.as_str().into(), entry.faces.len().into(), of.into()]);
    }
    (!left_out.is_empty()).then_some(table)
}

/// Returns what the scene leaves out as JSON, with the same rows as [`left_out_table`].
pub(crate) fn left_out_document(left_out: &[LeftOut]) -> Value {
    let row = |entry: &LeftOut| json!({"model": entry.model, "selects": entry.selects, "faces": entry.faces.len(), "instances": entry.instances});
    left_out.iter().map(row).collect()
}

/// Returns the rules of a scene as JSON, with the same rows as [`rule_table`].
pub(crate) fn rule_document(bound: &BoundScene, model: &Model) -> Value {
    let rows = bound.rules().iter().zip(example_selectors(bound, model)).map(|(rule, named)| {
        json!({"rule": rule.rule, "selects": rule.selects, "gives": rule.gives, "faces": rule.faces.len(), "first": named})
    });
    rows.collect()
}
