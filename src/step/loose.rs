//! Surfaces without a face, and ready meshes.

use super::geometry::{Geometry, Refusal};
use super::part::Converted;
use super::settings::Settings;
use super::styles::Styles;
use super::topology::Items;
use crate::model::Part;

/// Converts what is not a face of a shell.
pub(super) fn convert(
    geometry: &Geometry<'_, '_>,
    items: &Items,
    _styles: &Styles,
    _settings: &Settings,
    _part: &mut Part,
    out: &mut Converted,
) {
    for &id in items.surfaces.iter().chain(&items.tessellated) {
        out.found += 1;
        if let Ok(e) = geometry.entity(id) {
            out.refused.push(Refusal::of(e, "surfaces without a face are not converted yet"));
        }
    }
}
