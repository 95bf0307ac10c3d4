//! From instances of the file to parts, and to where they stand.
//!
//! Source: ISO 10303-43/44. An assembly places representations (`assembly` with its `relations`, `links`, `usages`, `usage_names`,
//! `usage_ends`, `open_usages`, `lost_usages` and `subassemblies`; `walk` with `places`, `placed_children`, `orphans` and `placed_count`;
//! `shared_items` and `pictures` say which of their items, `asides` what a viewer would not show); a representation is shells of faces
//! (`topology`, with loops put in order by `swapped_vertices`, `face_edges` and `loop_order`, what has no extent left out by `zero_width`
//! and `spikes`, what is there twice by `repeated_faces`; `shells` are turned by `orientation` and separated by `shell_pieces`), surfaces
//! without a face and ready meshes (`free_surfaces`, `tessellated`), solids given as recipes (`solid_recipes`, `recipe_parts`); all of it
//! with its colours and layers (`styles`) becomes one part (`numbering`, `conversion`).

pub(super) mod asides;
pub(super) mod assembly;
pub(super) mod conversion;
mod face_edges;
mod free_surfaces;
mod links;
mod loop_order;
mod lost_usages;
pub(super) mod numbering;
mod open_usages;
mod orientation;
mod orphans;
mod pictures;
mod placed_children;
mod placed_count;
mod places;
mod purpose;
mod recipe_parts;
mod relations;
mod repeated_faces;
mod rims;
pub(super) mod shared_items;
mod shell_pieces;
mod shells;
mod solid_recipes;
mod spikes;
pub(super) mod styles;
mod subassemblies;
mod swapped_vertices;
mod tessellated;
pub(super) mod topology;
mod usage_ends;
mod usage_names;
mod usages;
mod walk;
mod zero_width;
