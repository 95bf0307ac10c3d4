//! What stands in the entities that relate representations, products and their properties.

use crate::step::part21::{Args, Entity};

/// What states where one of two related representations stands in the other; without it both stand in the same place.
pub(super) const WITH_TRANSFORMATION: &str = "REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION";

/// Returns the attributes of a property definition, the third of which is what it describes; subtypes add none.
pub(super) fn property_attributes<'f, 'a>(definition: Entity<'f, 'a>) -> Args<'f, 'a> {
    definition.attributes("PROPERTY_DEFINITION", 0).unwrap_or_else(|| definition.args())
}

/// Returns the two representations of a relationship; `None` where one is missing.
pub(super) fn related_representations(e: Entity<'_, '_>) -> Option<[u64; 2]> {
    let base = e.attributes("REPRESENTATION_RELATIONSHIP", 0).unwrap_or_else(|| e.args());
    Some([base.id(2)?, base.id(3)?])
}
