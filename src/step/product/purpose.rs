//! Purposes of representations.

use crate::step::part21::File;

/// Returns what a representation is for, for messages, when that is not the shape of a product; else `None`. Told by its names in the file.
pub(super) fn purpose_besides_shape(file: &File<'_>, id: u64) -> Option<&'static str> {
    let e = file.entity(id)?;
    let has = |word: &str| e.keywords().any(|k| k.contains(word));
    if has("CONSTRUCTIVE_GEOMETRY") {
        return Some("holds construction geometry");
    }
    if has("DRAUGHTING") {
        return Some("holds annotations of a drawing");
    }
    let shows = |k: &str| k.starts_with("PRESENTATION") || k.contains("_PRESENTATION_");
    e.keywords().any(shows).then_some("says how something is shown")
}

/// Whether a keyword names a shape representation of any kind (ADVANCED_BREP_…, …_WITH_PARAMETERS), but no …_RELATIONSHIP and nothing that
/// is CONTEXT_DEPENDENT_….
pub(super) fn is_shape_representation(keyword: &str) -> bool {
    keyword.contains("SHAPE_REPRESENTATION")
        && !keyword.starts_with("CONTEXT_DEPENDENT_")
        && !keyword.contains("_RELATIONSHIP")
}

/// Whether one of these items is a ready mesh, by its keyword.
pub(super) fn holds_mesh(file: &File<'_>, items: &[u64]) -> bool {
    let mesh = |k: &str| k.contains("TRIANGULATED") || k.starts_with("TESSELLATED");
    items.iter().any(|i| file.entity(*i).is_some_and(|e| e.keywords().any(mesh)))
}
