//! Records of products, of their usages, and of what relates their representations, for the files of tests.

/// The usage that means one occurrence of its component.
pub(crate) const NEXT: &str = "NEXT_ASSEMBLY_USAGE_OCCURRENCE";

/// A product without a shape whose definition is #`id`; takes the ids up to `id` + 2.
pub(crate) fn definition(id: u32, name: &str) -> String {
    let [formation, product] = [id + 1, id + 2];
    format!(
        "#{id}=PRODUCT_DEFINITION('','',#{formation},$);\n#{formation}=PRODUCT_DEFINITION_FORMATION('','',#{product});\n\
         #{product}=PRODUCT('{name}','{name}','',());\n"
    )
}

/// A product whose definition is #`id` and whose representation is #`representation`; takes the ids up to `id` + 4.
pub(crate) fn product(id: u32, name: &str, representation: u32) -> String {
    let [shape, shown] = [id + 3, id + 4];
    definition(id, name)
        + &format!(
            "#{shape}=PRODUCT_DEFINITION_SHAPE('','',#{id});\n\
             #{shown}=SHAPE_DEFINITION_REPRESENTATION(#{shape},#{representation});\n"
        )
}

/// A usage #`id` of this kind and these attributes, and its shape, #`id` + 1.
pub(crate) fn usage(id: u32, kind: &str, ends: &str) -> String {
    format!("#{id}={kind}('{id}','','',{ends});\n#{}=PRODUCT_DEFINITION_SHAPE('','',#{id});\n", id + 1)
}

/// A relationship #`id` of two representations that puts the placement `from` on `to`; takes `id` + 1 as well.
pub(crate) fn relation(id: u32, [first, second]: [u32; 2], [from, to]: [u32; 2]) -> String {
    format!(
        "#{}=ITEM_DEFINED_TRANSFORMATION('','',#{from},#{to});\n\
         #{id}=(REPRESENTATION_RELATIONSHIP('','',#{first},#{second})REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{})\
         SHAPE_REPRESENTATION_RELATIONSHIP());\n",
        id + 1,
        id + 1
    )
}

/// The place of usage #`usage` by the relationship #`relation`.
pub(crate) fn contextual(id: u32, relation: u32, usage: u32) -> String {
    format!("#{id}=CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#{relation},#{});\n", usage + 1)
}

/// A usage #`id` of a child in a parent, whose place a relationship of their representations gives, the child's first, as [`relation`] has
/// it; takes the ids up to `id` + 4.
pub(crate) fn placed_usage(
    id: u32,
    [parent, child]: [u32; 2],
    representations: [u32; 2],
    placements: [u32; 2],
) -> String {
    usage(id, NEXT, &format!("#{parent},#{child},$"))
        + &relation(id + 2, representations, placements)
        + &contextual(id + 4, id + 2, id)
}
