//! The limits that several steps of polishing keep.

/// A ray of no more than so many sags is traced on the spline: where it meets a face flat, the facet there lies farther
/// away than the ray is long. Of light that grazes a rod glued in a hole the hole's face was not seen.
pub(super) const SHORT_OF_SAGS: f64 = 4.0;
/// A facet of less sag lies on the spline, mm: no root hides between them. See [`no_sag`].
const NO_SAG: f64 = 1e-9;
/// The same as a share of the facet's length, for facets below a micrometre.
const NO_SAG_SHARE: f64 = 1e-6;
/// A root is sought this many sags from its facet across the ray: facet and spline lie a sag apart, and either may be met beside
/// the other's place.
pub(super) const WINDOW_OF_SAGS: f64 = 16.0;
/// The least sine by which that window is lengthened along the ray.
pub(super) const LEAST_WINDOW_SINE: f64 = 1e-3;
/// The shortest window, mm. See [`least_window`].
const LEAST_WINDOW: f64 = 1e-6;
/// The same in sags of at least [`no_sag`].
const LEAST_WINDOW_OF_SAGS: f64 = 1e3;
/// The least sine by which a search begins before the facets.
pub(super) const LEAST_SLACK_SINE: f64 = 0.05;
/// A facet lies within so many of its sags of each place of its piece, across the spline: its proof is of the nearest places.
pub(super) const PLACE_OF_SAGS: f64 = 2.0;
/// The bend of a facet is by how much the spline's normals on its piece stray from one another, as a sine: where the curvature does not
/// change, so many sags over the facet's length.
pub(super) const BEND_OF_SAGS: f64 = 4.0;
/// A ray that leaves at a sine below so many bends may have its next root between the surface it leaves and the facets: by `sin²θ / 2κ` and
/// `κL²/8` that is at one, and the rest is room for a curvature that changes.
pub(super) const HIDDEN_BENDS: f64 = 3.0;
/// A root within this distance along the ray may be the one that it leaves, mm: a thousand times what starts are off. On patches below a
/// millimetre it is as many times their size.
pub(super) const OWN_POINT: f64 = 1e-6;

/// Returns the sag, mm, below which a facet of so many mm lies on the spline.
pub(super) fn no_sag(length: f64) -> f64 {
    NO_SAG.min(NO_SAG_SHARE * length)
}

/// Returns the shortest window, mm, of a facet of this sag, which is [`no_sag`] or more.
#[inline(always)]
pub(super) fn least_window(sag: f64) -> f64 {
    LEAST_WINDOW.min(LEAST_WINDOW_OF_SAGS * sag)
}
