//! What facets do to the light of a scene: a picture for each receiver, and the rows.

use super::rows::{distinct, number, text};
use crate::report::{AxisStyle, Cell, Chart, Section, Series, Table, file_stem};
use serde_json::Value;

/// Makes the section on receivers of a study's rows: a chart for each receiver, and a table of all.
pub(super) fn section(rows: &[&Value]) -> Section {
    let intro = "The same rays on facets and on the spline: what the facets change (geometric) beside the noise of the run \
        (statistical). Where geometry is the larger, finer facets or better normals help; else more rays.";
    let section = Section::new("Light on the receivers").with_block(intro);
    let section = distinct(rows, "receiver").into_iter().fold(section, |s, name| s.with_block(chart(rows, name)));
    section.with_block(table(rows))
}

/// Draws the change of a receiver's map over the tolerance, per cent, by kind of normals, beside the noise of the rays; zeros are left out.
fn chart(rows: &[&Value], receiver: &str) -> Chart {
    let own: Vec<&Value> = rows.iter().copied().filter(|r| text(r, "receiver") == receiver).collect();
    let along = |normals: &str, key: &str| {
        let of = own.iter().filter(|r| text(r, "normals") == normals);
        let percent = of.filter_map(|r| Some([number(r, "tolerance_mm")?, 100.0 * number(r, key)?]));
        // No difference at all has no place on a logarithmic axis.
        let mut points: Vec<[f64; 2]> = percent.filter(|p| p[0] > 0.0 && p[1] > 0.0).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        points
    };
    let kinds = distinct(&own, "normals");
    let mut series: Vec<Series> = (kinds.iter())
        .map(|n| Series { name: (*n).into(), points: along(n, "map_geometric"), ..Series::default() })
        .collect();
    // The noise is that of the rays, whatever they are traced on; that of the first kind stands for all.
    if let Some(first) = kinds.first() {
        let points = along(first, "map_statistical");
        series.push(Series { name: "noise of the rays".into(), points, ..Series::default() });
    }
    series.retain(|s| !s.points.is_empty());
    let caption = "Root mean square difference of the cells from the same rays on the spline, relative to the rms of the cells, by kind of \
        normals. Points below the noise cannot be told from the spline with these rays.";
    let axes = [AxisStyle::log("tolerance", "mm"), AxisStyle::log("change of the map", "%")];
    let name = format!("receiver-{}", file_stem(receiver));
    Chart::series(&name, &format!("{receiver}: what the facets change"), caption, axes, series)
}

/// Makes a table of all rows: each receiver's geometric and statistical errors, per cent, by tolerance and normals.
fn table(rows: &[&Value]) -> Table {
    // All are of one scene; what an earlier version kept does not say.
    let unit = rows.iter().map(|row| text(row, "unit")).find(|unit| !unit.is_empty()).unwrap_or("W or lm");
    let columns = [
        ("receiver", ""),
        ("tolerance", "mm"),
        ("normals", ""),
        ("power", unit),
        ("power, geometric", "%"),
        ("power, statistical", "%"),
        ("map, geometric", "%"),
        ("map, statistical", "%"),
        ("spot 1, geometric", "%"),
        ("spot 2, geometric", "%"),
        ("limited by", ""),
        ("trace", "s"),
        ("trace, spline", "s"),
        ("rays", ""),
    ];
    let mut table = Table::new("receivers", "Every receiver", &columns).caption(
        "Geometric: what facets change for the same rays. Statistical: one standard error. Spot: rms size along both sides.",
    );
    for row in rows {
        let percent = |x: Option<f64>| -> Cell { x.map_or(Cell::Empty, |x| Cell::Number(100.0 * x, 3)) };
        let spot = |k: usize| percent(row["spot_geometric"][k].as_f64());
        table.row([
            text(row, "receiver").into(),
            number(row, "tolerance_mm").into(),
            text(row, "normals").into(),
            number(row, "power").into(),
            percent(number(row, "power_geometric")),
            percent(number(row, "power_statistical")),
            percent(number(row, "map_geometric")),
            percent(number(row, "map_statistical")),
            spot(0),
            spot(1),
            text(row, "limited_by").into(),
            number(row, "seconds_trace").into(),
            number(row, "seconds_trace_exact").into(),
            row["rays"].as_u64().into(),
        ]);
    }
    table
}
