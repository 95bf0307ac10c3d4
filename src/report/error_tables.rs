//! Tables of where the light went and how well that is known: sums, receivers, figures with both errors, what was tried first.

use super::even_poles::symbol;
use super::geometric_cause::GeometricCause;
use super::maps::axis_labels;
use super::number::unit_in_words;
use super::{Cell, Table};
use crate::simulate::{ReceiverResult, Results};
use crate::study::default_accuracy::TracingChoice;
use crate::study::figures::{Figure, Limit, ReceiverFigures, figure_in_words};
use crate::study::geometric_error::{GeometricError, Paired};
use crate::study::model_figures::PowerFigures;
use crate::text::{figures, grouped};

/// Makes the cells of both errors of a figure, that of facets a dash where it is not known.
fn error_cells(figure: &Figure) -> [Cell; 2] {
    [Cell::Error(figure.statistical), figure.geometric.map_or_else(|| "–".into(), Cell::Error)]
}

/// Share of what was emitted by which a sum of a few numbers may be off for their rounding.
const ROUNDED_SUM: f64 = 1e-12;

/// Makes a table of where the power went, each sum with both its errors, the geometric one by its `cause`; what was lost is itself an error
/// of the others.
pub(super) fn power_table(results: &Results, power: &PowerFigures, unit: &str, cause: GeometricCause) -> Table {
    let columns = [("", ""), ("power", unit), ("share", "%"), ("± rays (1σ)", unit), (cause.column(), unit)];
    let p = &results.power;
    let mut table = Table::new("power", "Where the power went", &columns).caption(format!(
        "Emitted is the sum of the others{}. Received counts receivers that end light: what passes one that lets it through is counted where it ends.",
        // Quanta add up exactly; what is left is the rounding of these sums.
        if p.imbalance() < ROUNDED_SUM {
            String::new()
        } else {
            format!(", but for {} of it", figures(p.imbalance(), 1))
        }
    ));
    let cells = |name: &str, power: f64, error: f64| {
        let share = 100.0 / p.emitted;
        [name.into(), Cell::Known(power, error, 6), Cell::Known(share * power, share * error, 5)].into_iter()
    };
    let with_errors =
        |name: &str, power: f64, figure: &Figure| cells(name, power, figure.combined()).chain(error_cells(figure));
    table.row(cells("emitted", p.emitted, 0.0));
    table.row(with_errors("received", p.received, &power.received));
    for (a, figure) in results.absorbed.iter().zip(&power.by_body) {
        table.row(with_errors(&format!("absorbed in {} ({})", a.name, a.r#in), a.power, figure));
    }
    table.row(with_errors("escaped", p.escaped, &power.escaped));
    table.row(with_errors("cut off by limits", p.cut_off, &power.cut_off));
    let lost_error = results.power_errors.lost;
    table.row(cells("lost", p.lost, lost_error).chain([Cell::Error(lost_error)]));
    table
}

/// Writes what the mean positions and widths in the table of receivers are, and where there are none.
fn places_caption(results: &Results) -> String {
    let mut caption =
        "1 and 2 are the axes named, with the unit of positions and widths; errors are those of rays and facets together.".to_owned();
    if results.receivers.iter().any(|r| r.is_cyclic(0) || r.is_cyclic(1)) {
        caption += " Along an angle that goes all around there is no mean position and no rms: both ends of its range are one.";
    }
    caption
}

/// Makes a table of the receivers, a row each: power, brightest cell, place and width of the light with both errors together; `unit` is
/// that of powers.
pub(super) fn receiver_table(results: &Results, all: &[ReceiverFigures], unit: &str) -> Table {
    let columns = [
        ("receiver", ""),
        ("power", unit),
        ("± of the power (1σ)", unit),
        ("largest", ""),
        ("unit", ""),
        ("axes 1, 2", ""),
        ("mean position 1", ""),
        ("mean position 2", ""),
        ("rms 1", ""),
        ("± of rms 1 (1σ)", ""),
        ("rms 2", ""),
        ("± of rms 2 (1σ)", ""),
    ];
    let mut table = Table::new("receivers", "Receivers", &columns).caption(places_caption(results));
    for (r, f) in results.receivers.iter().zip(all) {
        let known = |value: f64, figure: &Option<Figure>| {
            figure.as_ref().map_or_else(|| value.into(), |f| Cell::Known(value, f.combined(), 4))
        };
        let place = |axis: usize, values: [f64; 2], figure: &Option<Figure>| {
            if r.has_place(axis) { known(values[axis], figure) } else { Cell::Empty }
        };
        let error = |figure: &Option<Figure>| figure.as_ref().map_or(Cell::Empty, |f| Cell::Error(f.combined()));
        let axes = f.rms_2.as_ref().or(f.rms_1.as_ref()).map(|figure| {
            let [first, second] = axis_labels(r).map(symbol);
            format!("{first}, {second} ({})", unit_in_words(&figure.unit))
        });
        table.row([
            r.name.as_str().into(),
            Cell::Known(r.power, f.power.combined(), 6),
            Cell::Error(f.power.combined()),
            known(r.max, &f.max),
            unit_in_words(r.unit).into(),
            axes.into(),
            place(0, r.centroid, &f.centroid_1),
            place(1, r.centroid, &f.centroid_2),
            place(0, r.rms, &f.rms_1),
            error(&f.rms_1),
            place(1, r.rms, &f.rms_2),
            error(&f.rms_2),
        ]);
    }
    table
}

/// Writes the name of a figure of a receiver, of places and widths with the axis: `rms x` for `rms_1`.
fn figure_name(r: &ReceiverResult, name: &str) -> String {
    let known = |stem: &str| match name.strip_prefix(stem)? {
        "1" => Some(0),
        "2" => Some(1),
        _ => None,
    };
    let along = |axis: usize| symbol(axis_labels(r)[axis]);
    match (known("rms_"), known("centroid_")) {
        (Some(axis), _) => format!("rms {}", along(axis)),
        (_, Some(axis)) => format!("mean position {}", along(axis)),
        _ => figure_in_words(name),
    }
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
                figure_name(r, name).into(),
                Cell::Known(figure.value, figure.combined(), 6),
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
                Cell::Known(c.total, told.figure.combined(), 6),
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

/// Writes a figure that has its receiver before it, with the axis of places and widths: `focus: rms x` for `focus: rms_1`.
fn figure_of_receiver(results: &Results, named: &str) -> String {
    let of_receiver = named.rsplit_once(": ").and_then(|(receiver, name)| {
        let r = results.receivers.iter().find(|r| r.name == receiver)?;
        Some(format!("{receiver}: {}", figure_name(r, name)))
    });
    of_receiver.unwrap_or_else(|| figure_in_words(named))
}

/// Makes a table of the ways that a pilot tried before the run was chosen to be traced so, each with the figure it gets most wrong.
pub(super) fn alternative_table(chosen: &TracingChoice, results: &Results) -> Table {
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
        // The true surfaces have no tolerance; that of the facets which find where rays meet them changes no figure.
        let tolerance =
            |end: usize| if a.intersector == "exact" { Cell::Empty } else { Cell::Number(a.tolerance_mm[end], 2) };
        table.row([
            a.intersector.into(),
            a.normals.name().into(),
            tolerance(0),
            tolerance(1),
            Cell::Number(a.seconds, 3),
            figure_of_receiver(results, &a.figure).into(),
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
            let numbers = [Cell::Number(p.facets, 5), Cell::Number(p.spline, 5), Cell::Error(p.error)];
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
                row(format!("width {}", symbol(axis_labels(result)[axis])), &r.width[axis], &unit_in_words(r.unit));
            }
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::octree::{self, Octree};
    use crate::mesh::FacetMesh;
    use crate::model::Model;
    use crate::simulate::{RunSettings, Scene, simulate};
    use std::path::Path;

    #[test]
    fn a_figure_of_a_receiver_has_its_axis() {
        let text = "[run]\nrays = 64\n[[source]]\nkind = 'point'\n[[receiver]]\nname = 'wall'\nat = [0, 0, 5]\nsize = [4, 4]\n\
            [[receiver]]\nname = 'far'\nkind = 'far_field'\nangles = 'C'\n";
        let scene = Scene::parse(text, "wall.toml", Path::new(".")).unwrap();
        let bound = scene.bind(&Model::default()).unwrap();
        let mesh = FacetMesh::default();
        let nothing = Octree::build(&mesh, &octree::Settings::default());
        let results = simulate(&bound, &nothing, &RunSettings::from(&scene.run), &|_| true);
        for (named, told) in [
            ("wall: rms_1", "wall: rms x"),
            ("far: centroid_2", "far: mean position γ"),
            ("wall: max", "wall: max"),
            ("all light: received", "all light: received"),
            ("", ""),
        ] {
            assert_eq!(figure_of_receiver(&results, named), told);
        }
    }
}
