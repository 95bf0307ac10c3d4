//! The powers by where light ended, and those that bodies and media took, each with both its errors.

use super::figures::{Figure, TracedGeometry};
use super::geometric_error::{GeometricError, Paired};
use crate::simulate::{Absorbed, Results};
use serde::Serialize;

/// The figures of [`Results::power`] but for what was emitted, which is known, and lost, which is an error of all others.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PowerFigures {
    /// Ended on receivers.
    pub received: Figure,
    /// Absorbed in faces and media.
    pub absorbed: Figure,
    /// Escaped out of the scene.
    pub escaped: Figure,
    /// Left on paths that a limit cut off.
    pub cut_off: Figure,
    /// What bodies and media took, in the order of [`Results::absorbed`].
    #[serde(skip)]
    pub by_body: Vec<Figure>,
}

/// Returns the figures of [`Results::power`] and [`Results::absorbed`]; `unit` is that of powers, `W` or `lm`.
pub fn power_figures(results: &Results, geometry: TracedGeometry<'_>, unit: &str) -> PowerFigures {
    let (power, errors) = (&results.power, &results.power_errors);
    let figure = |value: f64, statistical: f64, of: fn(&GeometricError) -> Paired| {
        Figure::new(value, unit, statistical, geometric(results, geometry, |error| Some(of(error))))
    };
    PowerFigures {
        received: figure(power.received, errors.received, |e| e.power.received),
        absorbed: figure(power.absorbed, errors.absorbed, |e| e.power.absorbed),
        escaped: figure(power.escaped, errors.escaped, |e| e.power.escaped),
        cut_off: figure(power.cut_off, errors.cut_off, |e| e.power.cut_off),
        by_body: absorbed_figures(results, geometry, unit),
    }
}

/// Returns the figures of [`Results::absorbed`], in its order.
fn absorbed_figures(results: &Results, geometry: TracedGeometry<'_>, unit: &str) -> Vec<Figure> {
    let figure = |a: &Absorbed| {
        let measured = |error: &GeometricError| {
            let found = error.absorbed.binary_search_by_key(&a.index, |e| e.index).ok()?;
            Some(error.absorbed[found].power)
        };
        Figure::new(a.power, unit, a.error, geometric(results, geometry, measured))
    };
    results.absorbed.iter().map(figure).collect()
}

/// Returns the geometric error of a power that `measured` finds among those that were compared; `None` where facets were not compared, or
/// by rays of which none came to it.
fn geometric(
    results: &Results,
    geometry: TracedGeometry<'_>,
    measured: impl Fn(&GeometricError) -> Option<Paired>,
) -> Option<f64> {
    // Light that was lost might have ended anywhere.
    let lost = results.power.lost;
    match geometry {
        TracedGeometry::Spline => Some(lost),
        // Facets that are the surface itself change nothing.
        TracedGeometry::Facets(error) if error.rays == 0 => Some(lost),
        TracedGeometry::Facets(error) => {
            let of_facets = measured(error)?.geometric_or(error.unseen_power(results.power.emitted));
            Some(of_facets.hypot(lost))
        }
        TracedGeometry::Unmeasured => None,
    }
}
