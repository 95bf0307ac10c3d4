//! Facets and what is promised of them, judged by sampling that shares nothing with the proof.

mod borders;
mod budgets;
mod closed;
mod contacts;
mod creases;
mod eights;
mod field;
#[path = "../support/files.rs"]
mod files;
mod fixtures;
mod folder;
mod helices;
mod holes_alone;
mod limits;
mod poles;
mod promises;
mod proof;
mod repairs;
mod shapes;
mod shared_edges;
mod spherical_triangles;
mod strips;
mod support;
#[path = "../support/turned.rs"]
mod turned;
mod turned_facets;
