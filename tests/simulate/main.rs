//! Light through scenes: laws of physics, closed forms, and the scenes of the fixtures.

mod caught;
mod closed;
mod contacts;
mod discs;
mod doubled_solids;
mod effects;
mod face_power;
mod facets;
mod far_sources;
#[path = "../support/files.rs"]
mod files;
mod fixture_scenes;
mod flush_solids;
mod flush_sources;
mod frames;
mod glass_catalogues;
mod growing;
mod hard;
mod imaging;
mod instanced;
mod laid;
mod laws;
mod listed_rays;
mod pipeline;
mod polished;
#[path = "../support/random.rs"]
mod random;
mod ready_meshes;
mod refusals;
mod repairs;
mod scenes;
#[cfg(feature = "schema")]
mod schema_ranges;
mod selectors;
mod sequences;
mod sources;
mod support;
mod thin_edges;
mod touching;
#[path = "../support/turned.rs"]
mod turned;
mod verdicts;
