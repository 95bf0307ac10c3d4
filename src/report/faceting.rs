//! What the facets changed of a receiver's light, for people: a sentence where it matters, a table always.

use super::maps::spoken;
use super::{Cell, Table, figures, grouped};
use crate::study::faceting::{Faceting, OnBoth};

/// Change of a width that is worth a sentence; below it is what people do not see in a spot.
const WIDER: f64 = 0.03;

/// Change of power that is worth a sentence.
const STRONGER: f64 = 0.005;

/// Where the facets, not the model, decide the light.
pub(super) fn limits(faceting: &Faceting) -> String {
    let said: Vec<String> = faceting.receivers.iter().filter_map(sentence).collect();
    if said.is_empty() {
        return String::new();
    }
    format!(
        "**The facets show in the light**: {} ({} rays traced on both). --normals exact or a tighter --tolerance takes that away. ",
        said.join("; "),
        grouped(faceting.rays)
    )
}

fn sentence(r: &OnBoth) -> Option<String> {
    let widths = |i: usize| format!("{} × {} {}", figures(r.width[0][i], 3), figures(r.width[1][i], 3), r.unit);
    let wider = r
        .widened(WIDER)
        .map(|_| format!("the light is {} wide (rms), {} on the true surfaces", widths(0), widths(1)));
    let stronger = r.changed(STRONGER).map(|share| format!("its power changes by {} %", figures(100.0 * share, 2)));
    let both: Vec<String> = wider.into_iter().chain(stronger).collect();
    (!both.is_empty()).then(|| format!("on {} {}", spoken(&r.name), both.join(" and ")))
}

/// Every receiver on both.
pub(super) fn changes(faceting: &Faceting) -> Table {
    let columns = [
        ("receiver", ""),
        ("power, facets", ""),
        ("power, spline", ""),
        ("power, ± of the difference", ""),
        ("width 1, facets", ""),
        ("width 1, spline", ""),
        ("width 1, ± of the difference", ""),
        ("width 2, facets", ""),
        ("width 2, spline", ""),
        ("width 2, ± of the difference", ""),
        ("unit of widths", ""),
    ];
    let caption = format!(
        "{} rays of the run, traced on the facets and on the true surfaces with the same random numbers. A width is the root mean square \
         distance from the mean position.",
        grouped(faceting.rays)
    );
    let mut table = Table::new("faceting", "What the facets change", &columns).caption(caption);
    for r in &faceting.receivers {
        let three =
            |of: [f64; 2], error: f64| [Cell::Number(of[0], 5), Cell::Number(of[1], 5), Cell::Number(error, 2)];
        let cells = [
            three(r.power, r.power_error),
            three(r.width[0], r.width_error[0]),
            three(r.width[1], r.width_error[1]),
        ];
        let cells = cells.into_iter().flatten();
        table.row(std::iter::once(r.name.as_str().into()).chain(cells).chain([r.unit.into()]));
    }
    table
}
