//! Scene, sources, receivers, the path kernel, random streams and tallies.
