//! A figure of the same rays on facets and on the spline, and the error of what replicates tell.

use serde::{Serialize, Serializer};

/// Standard errors beyond which a difference is one: by chance alone once in 370 times.
pub(super) const SIGNIFICANT: f64 = 3.0;

/// A figure on facets and on the spline.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Paired {
    /// The figure on facets.
    pub facets: f64,
    /// The figure on the spline.
    pub spline: f64,
    /// Standard error of the difference.
    pub error: f64,
}

impl Paired {
    /// Returns the geometric error of the figure on facets: its difference from the spline and the standard error of that, added in
    /// quadrature.
    pub fn geometric(&self) -> f64 {
        // An error that cannot be told from none is still no smaller than its own uncertainty.
        (self.facets - self.spline).hypot(self.error)
    }

    /// Returns the geometric error, at least `unseen`, the power of one ray, where facets changed less than that: it tells of no error at
    /// all.
    pub(in crate::study) fn geometric_or(&self, unseen: f64) -> f64 {
        let changed = (self.facets - self.spline).abs();
        if changed < unseen { self.geometric().max(unseen) } else { self.geometric() }
    }

    /// Adds what the difference may be by rays that are rarer than `share` of all that come, each of which takes all its light along.
    pub(super) fn add_unseen(&mut self, share: f64) {
        self.error = self.error.hypot(share * self.spline);
    }

    /// Whether rays can tell the difference from none: it is beyond three of its standard errors.
    pub fn is_significant(&self) -> bool {
        (self.facets - self.spline).abs() > SIGNIFICANT * self.error
    }
}

impl Serialize for Paired {
    /// As `[facets, spline, error of the difference]`.
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        [self.facets, self.spline, self.error].serialize(s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A difference of less than one ray is none that a ray told; one of more is known by itself.
    #[test]
    fn a_figure_that_no_ray_changed_is_as_uncertain_as_one() {
        let power = |facets: f64, error: f64| Paired { facets, spline: 3.0, error };
        assert_eq!(power(3.0, 0.0).geometric_or(0.5), 0.5);
        assert_eq!(power(3.0 + 1e-12, 1e-9).geometric_or(0.5), 0.5);
        assert_eq!(power(3.0, 2.0).geometric_or(0.5), 2.0);
        assert_eq!(power(7.0, 0.0).geometric_or(0.5), 4.0);
        // Facets that are the surface.
        assert_eq!(power(3.0, 0.0).geometric_or(0.0), 0.0);
    }
}
