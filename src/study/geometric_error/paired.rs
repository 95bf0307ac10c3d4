//! A figure of the same rays on facets and on the spline, and the error of what replicates tell.

use serde::{Serialize, Serializer};

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
    /// Returns what the facets change, with how well that is known: one standard error of the figure on facets.
    pub fn geometric(&self) -> f64 {
        // An error that cannot be told from none is still no smaller than its own uncertainty.
        (self.facets - self.spline).hypot(self.error)
    }

    /// Whether rays can tell the difference from none: it is beyond three of its standard errors.
    pub fn is_significant(&self) -> bool {
        (self.facets - self.spline).abs() > 3.0 * self.error
    }
}

impl Serialize for Paired {
    /// As `[facets, spline, error of the difference]`.
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        [self.facets, self.spline, self.error].serialize(s)
    }
}

/// Returns the standard error of a sum over replicates, from what each adds to it; 0 for fewer than two equal parts.
pub(super) fn standard_error(parts: impl Iterator<Item = f64>) -> f64 {
    let parts: Vec<f64> = parts.collect();
    let n = parts.len().max(2) as f64;
    let mean = parts.iter().sum::<f64>() / n;
    (parts.iter().map(|d| (d - mean).powi(2)).sum::<f64>() * n / (n - 1.0)).sqrt()
}
