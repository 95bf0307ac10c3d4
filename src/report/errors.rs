//! Both errors of every figure, for people: what stands behind a ±, what limits the answer, what the next halving costs.

use super::geometric_cause::GeometricCause;
use super::number::{error_figures, known_figures, with_unit};
use super::seconds;
use crate::intersect::NormalMode;
use crate::simulate::{Absorbed, Results};
use crate::study::default_accuracy::TracingChoice;
use crate::study::figures::{ChannelFigure, Figure, Limit, ReceiverFigures, halving};
use crate::study::geometric_error::{GeometricError, Paired, ReceiverError};
use crate::study::model_figures::PowerFigures;
use crate::text::{figures, grouped};

/// Share of a value below which its error is that of rounding, and not worth reporting.
const ROUNDING_SHARE: f64 = 1e-9;

/// Whether an error is no more than what rounding leaves of a value.
fn is_rounding(value: f64, error: f64) -> bool {
    error <= ROUNDING_SHARE * value.abs()
}

/// Writes a figure of `digits` significant digits with its unit and one ± (1σ) for both errors. Both are named where the geometric one,
/// by its `cause`, exceeds a tenth of the rays', the rays' alone where the facets were not judged; none that is of rounding. A 0 that no
/// ray reached gets its limit of 95 % instead, no more than `most` where a most is known.
pub(super) fn with_errors(figure: &Figure, digits: usize, cause: GeometricCause, most: Option<f64>) -> String {
    let Figure { value, unit, statistical, geometric, .. } = figure;
    // One ray is stated as the error where none arrived: three of them are the limit of 95 %.
    if *value == 0.0 && *statistical > 0.0 {
        let limit = (3.0 * figure.combined()).min(most.unwrap_or(f64::INFINITY));
        let most = with_unit(&figures(limit, 2), unit);
        return format!("{} (no ray arrived: at most {most}, 95 %)", with_unit("0", unit));
    }
    let value = known_figures(*value, figure.combined(), digits);
    let is_rounded = is_rounding(figure.value, figure.combined());
    let Some(geometric) = geometric else {
        let of_rays = if is_rounded {
            String::new()
        } else {
            format!("± {} from the rays alone; ", error_figures(*statistical))
        };
        return format!("{} ({of_rays}the facets were not judged)", with_unit(&value, unit));
    };
    if is_rounded {
        return with_unit(&value, unit);
    }
    let told = with_unit(&format!("{value} ± {}", error_figures(figure.combined())), unit);
    // Below a tenth of the statistical error the facets change the sum by half a percent.
    if *geometric > 0.1 * statistical {
        let of_rays = if is_rounding(figure.value, *statistical) {
            String::new()
        } else {
            format!("± {} from the rays, ", error_figures(*statistical))
        };
        return format!("{told} ({of_rays}± {} from {})", error_figures(*geometric), cause.in_words());
    }
    told
}

/// Most channels whose totals a sentence states; more are left to the table.
const SPOKEN_CHANNELS: usize = 6;

/// Writes the totals of a receiver's further channels, in parentheses, six at most; nothing where there are none.
pub(super) fn channel_totals(all: &ReceiverFigures, cause: GeometricCause) -> String {
    if all.channels.is_empty() {
        return String::new();
    }
    let total = |c: &ChannelFigure| format!("{} {}", c.name, with_errors(&c.figure, 4, cause, None));
    let mut told: Vec<String> = all.channels.iter().take(SPOKEN_CHANNELS).map(total).collect();
    if let Some(more @ 1..) = all.channels.len().checked_sub(SPOKEN_CHANNELS) {
        told.push(format!("{more} more in the table"));
    }
    format!(" ({})", told.join(", "))
}

/// Writes a sentence in Markdown, a space behind it, on what the facets change: of figures whose difference from the true surfaces is
/// beyond three of its standard errors and whose error from the facets is the larger one. Where a receiver has none, its map may be named
/// instead. Empty where nothing is. `all` is in the order of `error.receivers`, `absorbed` in that of `results.absorbed`.
pub(super) fn facet_limits(
    error: &GeometricError,
    results: &Results,
    all: &[ReceiverFigures],
    absorbed: &[Figure],
) -> String {
    let of_receivers = error.receivers.iter().zip(all).map(|(r, f)| sentence(r, f));
    let of_bodies = results.absorbed.iter().zip(absorbed).map(|(a, figure)| absorbed_sentence(error, a, figure));
    let said: Vec<String> = of_receivers.chain(of_bodies).filter(|s| !s.is_empty()).collect();
    if said.is_empty() {
        return String::new();
    }
    format!(
        "**The facets limit this answer**: {} ({} rays traced on both). --intersector exact takes that away, a smaller --tolerance or \
         --accuracy lessens it. ",
        said.join("; "),
        grouped(error.rays)
    )
}

/// Whether what facets change of a figure is more than what the rays leave open. Lost light is in its geometric error too, and no fault of
/// the facets.
fn is_limited_by_facets(figure: &Figure, paired: &Paired) -> bool {
    figure.limited_by == Limit::Geometry && paired.geometric() > figure.statistical
}

/// Writes what facets change of one receiver, as far as it is both beyond doubt and beyond the noise of the run; empty where nothing is.
fn sentence(r: &ReceiverError, f: &ReceiverFigures) -> String {
    let is_limit = |paired: &Paired, figure: Option<&Figure>| {
        paired.is_significant() && figure.is_some_and(|f| is_limited_by_facets(f, paired))
    };
    let mut parts = Vec::new();
    if is_limit(&r.power, Some(&f.power)) {
        let share = 100.0 * (r.power.facets / r.power.spline - 1.0);
        parts.push(if r.power.spline > 0.0 {
            format!("its power changes by {} %", figures(share, 2))
        } else {
            "light falls where none would".into()
        });
    }
    // Where no light would fall there is no place to compare with.
    if is_limit(&r.peak, f.max.as_ref()) && r.peak.spline > 0.0 {
        let share = 100.0 * (r.peak.facets / r.peak.spline - 1.0);
        parts.push(format!("its brightest place changes by {} %", figures(share, 2)));
    }
    // Along an angle that goes all around there is neither.
    let axes = || (0..2).filter(|&axis| [&f.rms_1, &f.rms_2][axis].is_some());
    let widths = |pick: fn(&Paired) -> f64| {
        let along: Vec<String> = axes().map(|axis| figures(pick(&r.width[axis]), 3)).collect();
        with_unit(&along.join(" × "), r.unit)
    };
    if is_limit(&r.rms[0], f.rms_1.as_ref()) || is_limit(&r.rms[1], f.rms_2.as_ref()) {
        let [on_facets, on_spline] = [widths(|p| p.facets), widths(|p| p.spline)];
        parts.push(format!("the light is {on_facets} wide (rms), {on_spline} on the true surfaces"));
    }
    let moved = is_limit(&r.centroid[0], f.centroid_1.as_ref()) || is_limit(&r.centroid[1], f.centroid_2.as_ref());
    // Where power or width changed, that the middle moved goes without saying.
    if moved && parts.is_empty() {
        let by: Vec<String> =
            axes().map(|axis| figures(r.centroid[axis].facets - r.centroid[axis].spline, 2)).collect();
        parts.push(format!("the light is moved by {}", with_unit(&by.join(" and "), r.unit)));
    }
    // Only where nothing else was found: it says least of what is wrong.
    if parts.is_empty() && r.map.geometric > 3.0 * r.map.noise && r.map.geometric > r.map.statistical {
        parts.push(format!("{} % of the light (rms) falls into other cells", figures(100.0 * r.map.geometric, 2)));
    }
    if parts.is_empty() { String::new() } else { format!("on {} {}", r.name, parts.join(", ")) }
}

/// Writes what facets change of the power that a body or medium took, as far as it is beyond doubt and limits that figure; else nothing.
fn absorbed_sentence(error: &GeometricError, absorbed: &Absorbed, figure: &Figure) -> String {
    let measured = error.absorbed.iter().find(|e| e.index == absorbed.index);
    match measured.filter(|e| e.power.is_significant() && is_limited_by_facets(figure, &e.power)) {
        Some(e) if e.power.spline > 0.0 => {
            let change = 100.0 * (e.power.facets / e.power.spline - 1.0);
            let (by, how) = (figures(change.abs(), 2), if change < 0.0 { "less" } else { "more" });
            format!("{} absorbs {by} % {how} power in {}", e.name, e.r#in)
        }
        Some(e) => format!("{} absorbs power in {} where it would none", e.name, e.r#in),
        None => String::new(),
    }
}

/// Whether rays leave nothing open of the powers, the channels and the brightest places: their errors are those of rounding.
fn are_all_rounded(results: &Results, all: &[ReceiverFigures], power: &PowerFigures) -> bool {
    let sums = [&power.received, &power.escaped, &power.cut_off].into_iter().chain(&power.by_body);
    let mut powers = sums.chain(all.iter().map(|f| &f.power));
    let channels = all.iter().flat_map(|f| &f.channels).map(|channel| &channel.figure);
    let mut others = all.iter().filter_map(|f| f.max.as_ref()).chain(channels);
    let rounding = results.rounding();
    powers.all(|f| f.statistical <= rounding || is_rounding(f.value, f.statistical))
        && others.all(|f| is_rounding(f.value, f.statistical))
}

/// Writes the seconds that halving the statistical error takes at most, unless that is all rounding, and where `error` tells, a run at half
/// the tolerance or on the spline; empty where nothing is to be halved. `all` is of the receivers, `power` of where the power went.
pub(super) fn halving_cost(
    results: &Results,
    error: Option<&GeometricError>,
    all: &[ReceiverFigures],
    power: &PowerFigures,
) -> String {
    let cost = halving(results, error);
    let mut text = String::new();
    if !are_all_rounded(results, all, power) {
        let more = seconds(cost.statistical_seconds);
        text += &format!("To halve the statistical errors takes at most {more} more. ");
    }
    if let (Some(finer), Some(spline)) = (cost.geometric_seconds, cost.spline_seconds) {
        text += &format!(
            "A run at half the tolerance, which halves the errors from the facets, takes about {}; one on the spline, which has none, about {}. ",
            seconds(finer),
            seconds(spline)
        );
    }
    text
}

/// Writes what the run was traced on, the facets' tolerance in mm, and why it was chosen.
pub(super) fn choice_sentence(chosen: &TracingChoice) -> String {
    if chosen.has_no_surface {
        return format!("Nothing was met, because {}. ", chosen.because);
    }
    let [low, high] = chosen.tolerance_mm.map(|t| figures(t, 2));
    let how = match (chosen.intersector, chosen.normals) {
        ("exact", _) => "**on the true surfaces**".to_owned(),
        (_, NormalMode::Exact) => {
            format!("**on facets** of {low} to {high} mm with hits **moved to the true surfaces**")
        }
        _ => format!("**on facets** of {low} to {high} mm"),
    };
    format!("Traced {how}, because {}. ", chosen.because)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// CIE X and Z have no unit, and none is written.
    #[test]
    fn a_figure_without_a_unit_has_none() {
        let told = |unit: &str, value: f64, geometric: Option<f64>| {
            with_errors(&Figure::new(value, unit, 0.3, geometric), 4, GeometricCause::Facets, None)
        };
        assert_eq!(told("", 135.1, Some(0.0)), "135.1 ± 0.3");
        assert_eq!(told("lm", 135.1, Some(0.4)), "135.1 ± 0.5 lm (± 0.3 from the rays, ± 0.4 from the facets)");
        let lossy = with_errors(&Figure::new(135.1, "lm", 0.3, Some(0.4)), 4, GeometricCause::Loss, None);
        assert!(lossy.ends_with("± 0.4 from lost light)"), "{lossy}");
        assert_eq!(told("", 0.0, None), "0 (no ray arrived: at most 0.9, 95 %)");
        assert_eq!(told("", 135.1, None), "135.1 (± 0.3 from the rays alone; the facets were not judged)");
    }

    /// What whole quanta leave open of a power that all light brings is nothing that a reader could use.
    #[test]
    fn an_error_of_rounding_is_not_told() {
        let told = |value: f64, statistical: f64, geometric: Option<f64>| {
            with_errors(&Figure::new(value, "W", statistical, geometric), 4, GeometricCause::Facets, None)
        };
        assert_eq!(told(1.0, 2.1e-12, Some(0.0)), "1 W");
        assert_eq!(told(1.0, 2.1e-12, None), "1 W (the facets were not judged)");
        assert_eq!(told(0.0, 0.0, Some(0.0)), "0 W");
        assert_eq!(told(1.0, 2.1e-12, Some(0.1)), "1 ± 0.1 W (± 0.1 from the facets)");
    }

    /// Where all light was lost, an error of all that was emitted, three times that is no bound: no more than all can arrive.
    #[test]
    fn a_bound_is_no_more_than_what_is_emitted() {
        let told = |emitted: f64| {
            with_errors(&Figure::new(0.0, "W", 0.001, Some(1.0)), 4, GeometricCause::Loss, Some(emitted))
        };
        assert_eq!(told(1.0), "0 W (no ray arrived: at most 1 W, 95 %)");
        assert_eq!(told(5.0), "0 W (no ray arrived: at most 3 W, 95 %)");
    }
}
