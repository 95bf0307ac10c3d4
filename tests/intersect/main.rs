//! The contract of intersectors on facets, and the shortcuts of the octree that must change no answer.

mod departures;
mod facets;
mod horizon;
mod instanced;
mod light;
mod normals;
mod support;
mod surface;
