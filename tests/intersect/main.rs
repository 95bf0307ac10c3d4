//! The contract of intersectors on facets, and the shortcuts of the octree that must change no answer.

#[cfg(feature = "contenders")]
mod contenders;
mod deep;
mod departures;
mod facets;
mod horizon;
mod instanced;
mod light;
mod normals;
mod support;
mod surface;
