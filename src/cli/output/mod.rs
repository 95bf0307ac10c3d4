//! Results on the terminal and in files.

pub(super) mod appearance;
pub(super) mod closing;
pub(super) mod face_tables;
pub(super) mod json;
pub(super) mod octree_shape;
pub(super) mod receiver_files;
pub(super) mod rule_table;
pub(super) mod schema_page;
pub(super) mod sentences;
pub(super) mod sequence_tables;
pub(super) mod terminal_tables;
pub(super) mod verdict;
