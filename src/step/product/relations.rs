//! What stands in the entities that relate representations, products and their properties.

use super::places::is_one_place;
use crate::math::Frame;
use crate::step::part21::{Args, Entity};

/// The entities that relate products, representations and their shapes.
pub(super) const RELATIONS: [&str; 10] = [
    "SHAPE_DEFINITION_REPRESENTATION",
    INDIVIDUAL_USAGE,
    "QUANTIFIED_ASSEMBLY_COMPONENT_USAGE",
    PROMISE,
    "ASSEMBLY_COMPONENT_USAGE",
    "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION",
    "SHAPE_REPRESENTATION_RELATIONSHIP",
    "REPRESENTATION_RELATIONSHIP",
    WITH_TRANSFORMATION,
    SHAPES_WITH_TRANSFORMATION,
];

/// The usages of ISO 10303-44 that put a component into an assembly.
const USAGES: [&str; 4] =
    [INDIVIDUAL_USAGE, "QUANTIFIED_ASSEMBLY_COMPONENT_USAGE", PROMISE, "ASSEMBLY_COMPONENT_USAGE"];

/// The usage that means one occurrence of its component; the others may mean what such ones place.
pub(super) const INDIVIDUAL_USAGE: &str = "NEXT_ASSEMBLY_USAGE_OCCURRENCE";

/// The usage of a component in an assembly whose subassemblies are yet to be defined.
pub(super) const PROMISE: &str = "PROMISSORY_USAGE_OCCURRENCE";

/// What names once more, as a higher assembly sees it, what usages below put there.
pub(super) const HIGHER_USAGE: &str = "SPECIFIED_HIGHER_USAGE_OCCURRENCE";

/// What states where one of two related representations stands in the other; without it both stand in the same place.
const WITH_TRANSFORMATION: &str = "REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION";
/// The same as one entity, as some writers have it; the schemas have it as a complex instance alone.
const SHAPES_WITH_TRANSFORMATION: &str = "SHAPE_REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION";

/// A directed relationship, or what a mapped item shows: the representation it leads to, and how that is placed; `None` where that cannot
/// be read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    pub(super) to: u64,
    pub(super) placement: Option<Frame>,
    /// Whether a transformation states the placement, be it one that moves nothing; without one both ends are shapes of the same thing.
    pub(super) has_transformation: bool,
}

impl Link {
    /// Makes the link to another shape of the same thing.
    pub(super) fn plain(to: u64) -> Self {
        Self { to, placement: Some(Frame::IDENTITY), has_transformation: false }
    }

    /// Makes the link of a transformation; `None` where that cannot be read.
    pub(super) fn transformed(to: u64, placement: Option<Frame>) -> Self {
        Self { to, placement, has_transformation: true }
    }

    /// Whether it leads to another place, or to one that cannot be read.
    pub(super) fn is_moved(&self) -> bool {
        // A placement taken onto itself leaves rounding.
        self.placement.is_none_or(|p| !is_one_place(&p, &Frame::IDENTITY))
    }
}

/// A representation that shows a usage of a product.
pub(super) struct OccurrenceShape {
    pub(super) usage: u64,
    pub(super) representation: u64,
}

/// Returns the attributes of a property definition, the third of which is what it describes; subtypes add none.
pub(super) fn property_attributes<'f, 'a>(definition: Entity<'f, 'a>) -> Args<'f, 'a> {
    definition.attributes("PROPERTY_DEFINITION", 0).unwrap_or_else(|| definition.args())
}

/// Returns the attributes of an entity `name`; those of a complex instance, whose own record has none, from its supertype's.
fn own_or_inherited<'f, 'a>(e: Entity<'f, 'a>, name: &str, supertype: &str) -> Option<Args<'f, 'a>> {
    let own = e.attributes(name, 0)?;
    Some(e.attributes(supertype, 0).unwrap_or(own))
}

/// Returns the attributes of a usage that puts a component into an assembly: id, name, description, parent and child; `None` of any other
/// entity, as of a higher usage.
pub(super) fn usage_attributes<'f, 'a>(e: Entity<'f, 'a>) -> Option<Args<'f, 'a>> {
    if is_higher_usage(e) {
        return None;
    }
    USAGES.iter().find_map(|name| own_or_inherited(e, name, "PRODUCT_DEFINITION_RELATIONSHIP"))
}

/// Whether a usage describes once more, as a higher assembly sees it, what usages below put there: it adds no component.
pub(super) fn is_higher_usage(e: Entity<'_, '_>) -> bool {
    e.is_a(HIGHER_USAGE)
}

/// Whether a usage puts a component into an assembly whose subassemblies are yet to be defined.
pub(super) fn is_promise(e: Entity<'_, '_>) -> bool {
    e.is_a(PROMISE)
}

/// Returns the attributes of a SHAPE_DEFINITION_REPRESENTATION: definition and representation; `None` of any other entity.
pub(super) fn shape_definition_attributes<'f, 'a>(e: Entity<'f, 'a>) -> Option<Args<'f, 'a>> {
    own_or_inherited(e, "SHAPE_DEFINITION_REPRESENTATION", "PROPERTY_DEFINITION_REPRESENTATION")
}

/// Whether a relationship states by a transformation where one of two related representations stands in the other.
pub(super) fn has_transformation(e: Entity<'_, '_>) -> bool {
    e.is_one_of(&[WITH_TRANSFORMATION, SHAPES_WITH_TRANSFORMATION])
}

/// Returns the transformation of a relationship; `None` where it has none or that is missing.
pub(super) fn stated_transformation<'f, 'a>(e: Entity<'f, 'a>) -> Option<Entity<'f, 'a>> {
    let names = [WITH_TRANSFORMATION, SHAPES_WITH_TRANSFORMATION];
    names.iter().find_map(|name| e.attributes(name, 4))?.entity(0)
}

/// Returns the two representations of a relationship; `None` where one is missing.
pub(super) fn related_representations(e: Entity<'_, '_>) -> Option<[u64; 2]> {
    let base = e.attributes("REPRESENTATION_RELATIONSHIP", 0).unwrap_or_else(|| e.args());
    Some([base.id(2)?, base.id(3)?])
}
