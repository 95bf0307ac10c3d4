//! The counted work by which ways to trace a run are compared: from numbers of facets and hits alone, so that every machine finds the same
//! one cheapest.
//!
//! Nanoseconds on one thread of an x86-64 of 2021 (AMD EPYC), measured on the three scenes of the fixtures.

/// Work of making one facet and sorting it into the octree.
pub(super) const FACET: f64 = 15_000.0;
/// Work of one nearest hit on facets with the rest of its path.
pub(super) const FACET_HIT: f64 = 350.0;
/// Work of the same hit on facets and moved to the spline: 0.5 to 0.6 of that on the spline on five scenes that query it for no more than
/// 1 % of them, 0.7 on a light guide that queries it for 14 %.
pub(super) const MOVED_HIT: f64 = 500.0;
/// Work of the same hit with cubic normals: a little less than with the spline's, on three models of the fixtures.
pub(super) const CUBIC_HIT: f64 = 480.0;
/// Work of the same hit on the spline; also that of a moved hit for which the spline is queried.
pub(super) const SPLINE_HIT: f64 = 850.0;

/// Returns how many times longer a hit takes on so many times the facets: about a tenth for each doubling.
pub(super) fn longer_on(times_the_facets: f64) -> f64 {
    1.0 + 0.1 * times_the_facets.log2()
}
