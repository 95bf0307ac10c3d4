//! [`crate::model::Model`] to [`crate::mesh::FacetMesh`] inside a proved tolerance.
