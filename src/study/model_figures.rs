//! The powers that bodies and media took, each with both its errors.

use super::figures::{Figure, Surface};
use super::geometric_error::GeometricError;
use crate::simulate::{Absorbed, Results};

/// Returns the figures of [`Results::absorbed`], in its order; `unit` is that of powers, `W` or `lm`.
pub fn absorbed_figures(results: &Results, surface: Surface<'_>, unit: &str) -> Vec<Figure> {
    let figure = |a: &Absorbed| Figure::new(a.power, unit, a.error, geometric(results, surface, a));
    results.absorbed.iter().map(figure).collect()
}

/// Returns the geometric error of a power; `None` where facets were not compared, or by rays of which none was absorbed there.
fn geometric(results: &Results, surface: Surface<'_>, absorbed: &Absorbed) -> Option<f64> {
    // Light that was lost might have ended anywhere.
    let lost = results.power.lost;
    let measured = |error: &GeometricError| {
        let found = error.absorbed.binary_search_by_key(&absorbed.index, |e| e.index).ok()?;
        let of_facets = error.absorbed[found].power.geometric_or(error.unseen_power(results.power.emitted));
        Some(of_facets.hypot(lost))
    };
    match surface {
        Surface::Spline => Some(lost),
        // Facets that are the surface itself change nothing.
        Surface::Facets(error) if error.rays == 0 => Some(lost),
        Surface::Facets(error) => measured(error),
        Surface::Unmeasured => None,
    }
}
