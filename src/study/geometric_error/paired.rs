//! A figure of the same rays on facets and on the spline, and the error of both by replicates.

use crate::math::variance_of_sum;
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
        // An error that cannot be distinguished from none is still no smaller than its own uncertainty.
        (self.facets - self.spline).hypot(self.error)
    }

    /// Returns the geometric error, at least `unseen`, the power of one ray, where facets changed less than that: it shows no error at
    /// all.
    pub(in crate::study) fn geometric_or(&self, unseen: f64) -> f64 {
        let changed = (self.facets - self.spline).abs();
        if changed < unseen { self.geometric().max(unseen) } else { self.geometric() }
    }

    /// Adds what the difference may be by rays that are rarer than `share` of all that come, each of which takes all its light along.
    pub(super) fn add_unseen(&mut self, share: f64) {
        self.error = self.error.hypot(share * self.spline);
    }

    /// Whether the difference is significant: it is beyond three of its standard errors.
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

/// Sums over replicates of one power, quanta.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PairedSums {
    /// On facets and on the spline.
    totals: [f64; 2],
    /// Of the squares of the replicates' differences.
    squares: f64,
    /// Of the squares of the spline's replicates.
    spline_squares: f64,
}

impl PairedSums {
    /// Adds what one replicate brought on facets and on the spline, quanta.
    pub(super) fn add(&mut self, facets: u64, spline: u64) {
        let [facets, spline] = [facets as f64, spline as f64];
        self.totals[0] += facets;
        self.totals[1] += spline;
        self.squares += (facets - spline).powi(2);
        self.spline_squares += spline * spline;
    }

    /// Returns both powers, and the standard error of their difference over so many replicates; `quantum` is the power of one.
    pub(super) fn paired(&self, replicates: usize, quantum: f64) -> Paired {
        let error = variance_of_sum(self.squares, self.totals[0] - self.totals[1], replicates).sqrt() * quantum;
        let [facets, spline] = self.totals.map(|total| total * quantum);
        Paired { facets, spline, error }
    }

    /// Returns the standard error of the power on the spline.
    pub(super) fn statistical(&self, replicates: usize, quantum: f64) -> f64 {
        variance_of_sum(self.spline_squares, self.totals[1], replicates).sqrt() * quantum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::error_of_sum;

    /// A difference of less than one ray comes from no ray; one of more is known by itself.
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

    /// The error from sums is that of the replicates' differences.
    #[test]
    fn the_error_of_a_difference_is_that_of_its_replicates() {
        let brought: [[u32; 2]; 5] = [[5, 3], [0, 4], [7, 7], [0, 0], [12, 1]];
        let mut sums = PairedSums::default();
        brought.iter().for_each(|[a, b]| sums.add((*a).into(), (*b).into()));
        let found = sums.paired(brought.len(), 0.5);
        let expected = 0.5 * error_of_sum(&brought.map(|[a, b]| f64::from(a) - f64::from(b)));
        assert_eq!((found.facets, found.spline), (12.0, 7.5));
        assert!((found.error / expected - 1.0).abs() < 1e-12, "{} {expected}", found.error);
        let on_spline = 0.5 * error_of_sum(&brought.map(|[_, b]| f64::from(b)));
        assert!((sums.statistical(brought.len(), 0.5) / on_spline - 1.0).abs() < 1e-12);
    }
}
