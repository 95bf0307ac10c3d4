//! Both errors of every figure, for people: what stands behind a ±, what limits the answer, what the next halving costs.

use super::geometric_cause::GeometricCause;
use super::number::{unit_in_words, with_unit};
use super::{Cell, Table, seconds};
use crate::intersect::NormalMode;
use crate::simulate::{Absorbed, Results};
use crate::study::default_accuracy::Chosen;
use crate::study::figures::{ChannelFigure, Figure, Limit, ReceiverFigures, figure_in_words, halving};
use crate::study::geometric_error::{GeometricError, Paired, ReceiverError};
use crate::study::model_figures::PowerFigures;
use crate::text::{figures, grouped};

/// Writes a figure of `digits` significant digits with its unit and one ± (1σ) for both errors. Both are named where the geometric one,
/// by its `cause`, exceeds a tenth of the rays', the rays' alone where the facets were not judged. A 0 that no ray reached gets its limit
/// of 95 % instead, no more than `most` where a most is known.
pub(super) fn with_errors(figure: &Figure, digits: usize, cause: GeometricCause, most: Option<f64>) -> String {
    let Figure { value, unit, statistical, geometric, .. } = figure;
    // One ray is stated as the error where none arrived: three of them are the limit of 95 %.
    if *value == 0.0 && *statistical > 0.0 {
        let limit = (3.0 * figure.combined()).min(most.unwrap_or(f64::INFINITY));
        let most = with_unit(&figures(limit, 2), unit);
        return format!("{} (no ray arrived: at most {most}, 95 %)", with_unit("0", unit));
    }
    let value = figures(*value, digits);
    let Some(geometric) = geometric else {
        let of_rays = figures(*statistical, 2);
        return format!(
            "{} (± {of_rays} from the rays alone; the facets were not judged)",
            with_unit(&value, unit)
        );
    };
    let told = with_unit(&format!("{value} ± {}", figures(figure.combined(), 2)), unit);
    // Below a tenth of the statistical error the facets change the sum by half a percent.
    if *geometric > 0.1 * statistical {
        let [of_rays, others] = [*statistical, *geometric].map(|error| figures(error, 2));
        return format!("{told} (± {of_rays} from the rays, ± {others} from {})", cause.in_words());
    }
    told
}

/// Channels whose totals a sentence tells; of more the table tells.
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

/// Makes the cells of both errors of a figure, that of facets a dash where it is not known.
pub(super) fn error_cells(figure: &Figure) -> [Cell; 2] {
    [Cell::Number(figure.statistical, 2), figure.geometric.map_or_else(|| "–".into(), |g| Cell::Number(g, 2))]
}

/// Writes the seconds that halving the statistical error takes at most, and where `error` tells, a run at half the tolerance or on the
/// spline.
pub(super) fn halving_cost(results: &Results, error: Option<&GeometricError>) -> String {
    let cost = halving(results, error);
    let mut text =
        format!("To halve the statistical errors takes at most {} more", seconds(cost.statistical_seconds));
    if let (Some(finer), Some(spline)) = (cost.geometric_seconds, cost.spline_seconds) {
        text += &format!(
            ". A run at half the tolerance, which halves the errors from the facets, takes about {}; one on the spline, which has none, about {}",
            seconds(finer),
            seconds(spline)
        );
    }
    text + ". "
}

/// Writes what the run was traced on, the facets' tolerance in mm, and why it was chosen.
pub(super) fn choice_sentence(chosen: &Chosen) -> String {
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

/// Makes a table of where the power went, each sum with both its errors, the geometric one by its `cause`; what was lost is itself an error
/// of the others.
pub(super) fn power_table(results: &Results, power: &PowerFigures, unit: &str, cause: GeometricCause) -> Table {
    let columns = [("", ""), ("power", unit), ("share", "%"), ("± rays (1σ)", unit), (cause.column(), unit)];
    let p = &results.power;
    let mut table = Table::new("power", "Where the power went", &columns).caption(format!(
        "Emitted is the sum of the others{}. Received counts receivers that end light: what passes one that lets it through is counted where it ends.",
        if p.imbalance() == 0.0 { String::new() } else { format!(", but for {} of it", figures(p.imbalance(), 1)) }
    ));
    let cells = |name: &str, power: f64| {
        [name.into(), Cell::Number(power, 6), Cell::Number(100.0 * power / p.emitted, 5)].into_iter()
    };
    table.row(cells("emitted", p.emitted));
    table.row(cells("received", p.received).chain(error_cells(&power.received)));
    for (a, figure) in results.absorbed.iter().zip(&power.by_body) {
        table.row(cells(&format!("absorbed in {} ({})", a.name, a.r#in), a.power).chain(error_cells(figure)));
    }
    table.row(cells("escaped", p.escaped).chain(error_cells(&power.escaped)));
    table.row(cells("cut off by limits", p.cut_off).chain(error_cells(&power.cut_off)));
    table.row(cells("lost", p.lost).chain([Cell::Number(results.power_errors.lost, 2)]));
    table
}

/// Writes what the mean positions and widths in the table of receivers are, and where there are none.
pub(super) fn places_caption(results: &Results) -> String {
    let mut caption =
        "Positions and widths in mm, of far fields and spheres in degrees; errors are those of rays and facets together.".to_owned();
    if results.receivers.iter().any(|r| r.is_cyclic(0) || r.is_cyclic(1)) {
        caption += " Along an angle that goes all around there is no mean position and no rms: both ends of its range are one.";
    }
    caption
}

/// Makes a table of every figure with both its errors, the geometric one by its `cause`.
pub(super) fn figure_table(results: &Results, all: &[ReceiverFigures], cause: GeometricCause) -> Table {
    let columns = [
        ("receiver", ""),
        ("figure", ""),
        ("value", ""),
        ("unit", ""),
        ("± rays (1σ)", ""),
        (cause.column(), ""),
        ("limited by", ""),
    ];
    let caption = format!(
        "Each figure with the standard error from the number of rays and that from {}; a dash where the facets were not compared with the \
         true surfaces.",
        cause.in_words()
    );
    let mut table = Table::new("figures", "Figures with both errors", &columns).caption(caption);
    for (r, f) in results.receivers.iter().zip(all) {
        for (name, figure) in f.named() {
            let limit = match figure.limited_by {
                Limit::Statistics => "rays",
                Limit::Geometry => cause.limit(),
            };
            let [statistical, geometric] = error_cells(figure);
            table.row([
                r.name.as_str().into(),
                figure_in_words(name).into(),
                Cell::Number(figure.value, 6),
                unit_in_words(&figure.unit).into(),
                statistical,
                geometric,
                limit.into(),
            ]);
        }
    }
    table
}

/// Makes a table of colours and bands of wavelengths, receiver by receiver; `unit` is that of powers.
pub(super) fn channel_table(
    results: &Results,
    all: &[ReceiverFigures],
    unit: &str,
    cause: GeometricCause,
) -> Table {
    let columns = [
        ("receiver", ""),
        ("channel", ""),
        ("total", ""),
        ("± rays (1σ)", ""),
        (cause.column(), ""),
        ("unit", ""),
        ("x", ""),
        ("y", ""),
    ];
    let caption = "X, Y and Z are the CIE's of 1931, Y in lumens; x and y are the chromaticity. Every cell of each channel is in the \
        receiver's CSV, NPZ and VTI files.";
    let mut table = Table::new("channels", "Channels", &columns).caption(caption);
    for (r, f) in results.receivers.iter().zip(all) {
        let sum: f64 = r.channels.iter().map(|c| c.total).sum();
        for (c, told) in r.channels.iter().zip(&f.channels) {
            let [statistical, geometric] = error_cells(&told.figure);
            let shown = |name: &str| c.name == name && sum > 0.0;
            // x and y stand at the row of X; a dark receiver has no chromaticity.
            let chromaticity = |k: usize| Cell::from(r.channels[k].total / sum);
            let [x, y] = if shown("X") { [0, 1].map(chromaticity) } else { ["".into(), "".into()] };
            table.row([
                r.name.as_str().into(),
                c.name.as_str().into(),
                Cell::Number(c.total, 6),
                statistical,
                geometric,
                c.total_unit(unit).into(),
                x,
                y,
            ]);
        }
    }
    table
}

/// Makes a table of the ways that a pilot tried before the run was chosen to be traced so, each with the figure it gets most wrong.
pub(super) fn alternative_table(chosen: &Chosen) -> Table {
    let columns = [
        ("intersector", ""),
        ("normals", ""),
        ("tolerance from", "mm"),
        ("to", "mm"),
        ("trace", "s"),
        ("worst figure", ""),
        ("wrong by", "%"),
        ("in its standard errors", ""),
    ];
    let caption = format!(
        "{} rays of the scene, traced so before the run; a run is given the cheapest way whose geometric error stays below the \
         statistical one on every figure.",
        grouped(chosen.pilot_rays)
    );
    let mut table = Table::new("alternatives", "What was tried first", &columns).caption(caption);
    for a in &chosen.alternatives {
        table.row([
            a.intersector.into(),
            a.normals.name().into(),
            Cell::Number(a.tolerance_mm[0], 2),
            Cell::Number(a.tolerance_mm[1], 2),
            Cell::Number(a.seconds, 3),
            figure_in_words(&a.figure).into(),
            a.geometric_share.map_or_else(|| "–".into(), |share| Cell::Number(100.0 * share, 2)),
            Cell::Number(a.geometric_to_statistical, 2),
        ]);
    }
    table
}

/// Makes a table of what facets change of each receiver's power, brightest place and widths, a row each: as many columns would not fit on
/// paper. `unit` is that of power; `error` has the receivers of `results`.
pub(super) fn change_table(error: &GeometricError, results: &Results, unit: &str) -> Table {
    let columns = [
        ("receiver", ""),
        ("figure", ""),
        ("on facets", ""),
        ("on the spline", ""),
        ("± of the difference (1σ)", ""),
        ("unit", ""),
    ];
    let caption = format!(
        "{0} rays of the run, traced on the facets and on the true surfaces with the same random numbers; max is the largest value of these \
         {0} rays alone, not of the run. A width is the root mean square distance from the mean position; cells that few rays reach are \
         judged with their neighbours.",
        grouped(error.rays)
    );
    let mut table = Table::new("faceting", "What the facets change", &columns).caption(caption);
    for (r, result) in error.receivers.iter().zip(&results.receivers) {
        let mut row = |figure: String, p: &Paired, unit: &str| {
            let numbers = [Cell::Number(p.facets, 5), Cell::Number(p.spline, 5), Cell::Number(p.error, 2)];
            let [name, figure, unit] = [r.name.as_str(), &figure, unit].map(Cell::from);
            table.row([name, figure].into_iter().chain(numbers).chain([unit]));
        };
        row("power".into(), &r.power, unit);
        // A receiver that counts power alone has no cells, and no place for a width.
        if r.peak_cells > 0 {
            let over =
                if r.peak_cells == 1 { String::new() } else { format!(" over {0} × {0} cells", r.peak_cells) };
            row(format!("max{over}"), &r.peak, &unit_in_words(result.unit));
        }
        if !r.unit.is_empty() {
            for axis in (0..2).filter(|&axis| !result.is_cyclic(axis)) {
                row(format!("width {}", axis + 1), &r.width[axis], &unit_in_words(r.unit));
            }
        }
    }
    table
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
