//! The smaller studies: one picture of the comparison each, and the published figures beside ours where there are some.

use super::rows::{distinct, number, text};
use crate::report::{AxisStyle, Cell, Chart, Content, Section, Series, Table};
use crate::study::interpolation::{Ratios, Row};
use crate::text::grouped;
use serde::Deserialize;
use serde_json::Value;

/// Draws bars of the number under `value`: a category for every text under `by`, a layer for every text under `split`; the last row of a
/// pair counts, and a pair without a row has no bar.
fn bar_chart(
    name: &str,
    title: &str,
    caption: &str,
    rows: &[&Value],
    [by, split, value]: [&str; 3],
    unit: &str,
) -> Chart {
    let categories = distinct(rows, by);
    let layers = (distinct(rows, split).into_iter())
        .map(|layer| {
            let height = |category: &&str| {
                let fits = |r: &&&Value| text(r, by) == *category && text(r, split) == layer;
                // The last one counts, because a later row of the same names replaces the one before.
                rows.iter().filter(fits).filter_map(|r| number(r, value)).next_back()
            };
            (layer.to_owned(), categories.iter().map(height).collect())
        })
        .collect();
    let content =
        Content::Bars { categories: categories.iter().map(|c| (*c).to_owned()).collect(), layers, stacked: false };
    let axes = [AxisStyle::linear(by, ""), AxisStyle::linear(title, unit)];
    Chart { content, ..Chart::series(name, title, caption, axes, Vec::new()) }
}

/// Makes title and sections of the interpolation study: tables and charts of normal errors.
pub(super) fn interpolation(rows: &[&Value]) -> (String, Vec<Section>) {
    let columns = [
        ("model", ""),
        ("algorithm", ""),
        ("distance between unit normals, mean", ""),
        ("p99", ""),
        ("max", ""),
        ("time, median", "s"),
    ];
    let mut table = Table::new("interpolation", "Normals between corners", &columns).caption(
        "The distance is Euclidean and has no unit; 0.001 is about 0.06°. The paper's figures are of its own model and machine: \
         compare the order and the ratios, not the values.",
    );
    for row in rows {
        table.row([
            text(row, "model").into(),
            text(row, "algorithm").into(),
            number(row, "normal_error_mean").into(),
            number(row, "normal_error_p99").into(),
            number(row, "normal_error_max").into(),
            number(row, "seconds_median").into(),
        ]);
    }
    let keys = ["model", "algorithm", "normal_error_mean"];
    let caption = "Mean distance between the interpolated unit normal and the true one; 0.001 is about 0.06°. Shorter is better; the \
        axis is logarithmic.";
    let mut chart = bar_chart("error", "Mean error of the normal", caption, rows, keys, "");
    // Bilinear and cubic are tens to hundreds of times below nearest: nothing to see on a linear axis.
    chart.y.log = true;
    let keys = ["model", "algorithm", "seconds_median"];
    let own: Vec<&Value> = rows.iter().copied().filter(|r| text(r, "model") != "paper").collect();
    let caption = "Median time of all rays of a repetition on one thread; shorter is better. The paper's times are of its own machine.";
    let times = bar_chart("time", "Time", caption, &own, keys, "s");
    let title = "Normals between corners: nearest, bilinear, cubic, exact".into();
    let section = Section::new("Errors and times")
        .with_block(chart)
        .with_block(times)
        .with_block(ratio_table(rows))
        .with_block(table);
    (title, vec![section])
}

/// Makes a table of the ratios of errors from nearest to bilinear to cubic normals, by model, the paper's beside them; a model without all
/// three is left out.
fn ratio_table(rows: &[&Value]) -> Table {
    let columns = [
        ("model", ""),
        ("facets", ""),
        ("nearest / bilinear", "×"),
        ("bilinear / cubic", "×"),
        ("nearest / bilinear, p99", "×"),
        ("bilinear / cubic, p99", "×"),
        ("time, cubic / bilinear", "×"),
        ("falls from nearest to cubic", ""),
    ];
    let mut table = Table::new("ratios", "How many times smaller the error becomes", &columns)
        .caption("Ratios of mean errors, and of their 99th percentiles. Above 1 the second of the two is better.");
    for model in distinct(rows, "model") {
        let of = |r: &&&Value| text(r, "model") == model;
        let own: Vec<Row> = rows.iter().filter(of).filter_map(|r| Row::deserialize(*r).ok()).collect();
        let Some(r) = Ratios::from_rows(&own) else { continue };
        let times = |x: f64| Cell::Number(x, 3);
        let p99 = |k: usize| r.at_p99.map_or(Cell::Empty, |p| times(p[k]));
        table.row([
            model.into(),
            own[0].facets.map(|n| n as u64).into(),
            times(r.nearest_to_bilinear),
            times(r.bilinear_to_cubic),
            p99(0),
            p99(1),
            times(r.cubic_time),
            r.why_not.map_or("yes".into(), |why| format!("no: {why}")).into(),
        ]);
    }
    table
}

/// The seed paper's table 1: share of time saved, percent.
const PAPER_COMPLEXITY: [f64; 3] = [18.75, 25.45, 46.65];

/// Makes title and sections of the complexity study, beside the paper's.
pub(super) fn complexity(rows: &[&Value]) -> (String, Vec<Section>) {
    let mut table = Table::new(
        "complexity",
        "Before and after",
        &[
            ("model", ""),
            ("method", ""),
            ("patches", ""),
            ("facets", ""),
            ("prepare", "s"),
            ("trace", "s"),
            ("ratio to traditional", "×"),
            ("paper: time saved", "%"),
        ],
    )
    .caption(
        "Traditional: every spline surface is intersected with every ray. Octree and bvh trace facets and are charged for making them; \
         exact is the certified spline tracer. The paper's percentages are of its own three lamps.",
    );
    let models = distinct(rows, "model");
    let count = |row: &Value, key: &str| -> Cell { row[key].as_u64().into() };
    for row in rows {
        let lamp = models.iter().position(|m| *m == text(row, "model"));
        // The paper saved time with its octree alone.
        let paper = lamp.filter(|_| text(row, "method") == "octree").and_then(|k| PAPER_COMPLEXITY.get(k));
        table.row([
            text(row, "model").into(),
            text(row, "method").into(),
            count(row, "patches"),
            count(row, "facets"),
            number(row, "seconds_prepare").into(),
            number(row, "seconds_trace_median").into(),
            number(row, "ratio_to_traditional").into(),
            paper.copied().into(),
        ]);
    }
    let keys = ["model", "method", "ratio_to_traditional"];
    let title = "How many times as fast as the traditional way";
    let caption = "Preparing and tracing together, against intersecting every spline surface with every ray (1 ×). Longer is better.";
    let mut chart = bar_chart("ratio", title, caption, rows, keys, "×");
    chart.y.label = "times as fast".into();
    let section =
        Section::new("Before and after").with_block(chart).with_block(growth_chart(rows)).with_block(table);
    ("Three lamps, before and after".into(), vec![section])
}

/// Draws the seconds of a million rays over the number of spline patches, a line for each method; rows without these are left out.
fn growth_chart(rows: &[&Value]) -> Chart {
    let line = |method: &&str| {
        let own = rows.iter().filter(|r| text(r, "method") == *method);
        let point = |r: &&Value| {
            // To a million rays, because the methods trace different numbers of them.
            let rays = number(r, "rays")? / 1_000_000.0;
            Some([number(r, "patches")?, number(r, "seconds_trace_median")? / rays])
        };
        Series { name: (*method).into(), points: own.filter_map(point).collect(), ..Series::default() }
    };
    let mut series: Vec<Series> = distinct(rows, "method").iter().map(line).collect();
    series.retain(|s| !s.points.is_empty());
    let axes = [AxisStyle::log("spline patches of the lamp", ""), AxisStyle::log("trace of a million rays", "s")];
    let caption = "Time to trace a million rays from the sources against the number of spline patches, preparing left out. Lower is better.";
    Chart::series("growth", "How the time grows with the lamp", caption, axes, series)
}

/// Makes title and sections of the benchmark against obvhs: rates by kind of rays and number of facets.
pub(super) fn bvh(rows: &[&Value]) -> (String, Vec<Section>) {
    let mut section = Section::new("Rates");
    for kind in distinct(rows, "rays_kind") {
        let of: Vec<&Value> = rows.iter().copied().filter(|r| text(r, "rays_kind") == kind).collect();
        let facets = |r: &Value| r["facets"].as_u64().map_or("?".into(), grouped);
        // Categories are texts; sizes are made ones.
        let sized: Vec<Value> = (of.iter())
            .map(|r| {
                let mut row = (*r).clone();
                if row.is_object() {
                    let threads = r["threads"].as_u64().unwrap_or(1);
                    let call = if threads > 1 { format!("{threads} threads") } else { text(r, "call").to_owned() };
                    row["size"] = Value::from(format!("{} facets, {call}", facets(r)));
                    // Of one name twice in the race each bar says which it is.
                    let twin = match text(r, "build") {
                        "very slow" => Some("slowest build"),
                        build @ ("slowest build" | "triangles" | "quads") => Some(build),
                        _ => None,
                    };
                    if let Some(build) = twin {
                        row["intersector"] = Value::from(format!("{}, {build}", text(r, "intersector")));
                    }
                }
                row
            })
            .collect();
        let sized: Vec<&Value> = sized.iter().collect();
        let mut chart = bar_chart(
            &format!("rates-{kind}"),
            &format!("{kind} rays"),
            "Median of alternating rounds; longer is better.",
            &sized,
            ["size", "intersector", "mrays_per_s_median"],
            "Mrays/s",
        );
        chart.x = AxisStyle::linear("facets and call", "");
        section = section.with_block(chart);
    }
    section = section.with_block(rate_table(rows));
    ("Octree against bounding-volume hierarchies".into(), vec![section])
}

/// Makes a table of every rate beside the octree's on the same model, rays, facets, call and threads; no ratio where the octree was not
/// timed.
fn rate_table(rows: &[&Value]) -> Table {
    let columns = [
        ("rays", ""),
        ("facets", ""),
        ("call", ""),
        ("threads", ""),
        ("intersector", ""),
        ("rate", "Mrays/s"),
        ("octree is faster", "×"),
        ("build", "s"),
        ("memory", "B/facet"),
    ];
    let mut table = Table::new("rates", "Rates side by side", &columns)
        .caption("Medians of alternating rounds; the ratio is that of the octree's median to this one.");
    let same = ["model", "facets", "rays_kind", "call", "threads"];
    for row in rows.iter().filter(|r| r.is_object()) {
        let twin = |r: &&&Value| text(r, "intersector") == "octree" && same.iter().all(|k| r[*k] == row[*k]);
        let octree = rows.iter().find(twin).and_then(|r| number(r, "mrays_per_s_median"));
        let rate = number(row, "mrays_per_s_median");
        let ratio = octree.zip(rate).map(|(o, r)| Cell::Number(o / r, 3));
        let build = Some(text(row, "build")).filter(|b| !b.is_empty()).map_or(String::new(), |b| format!(" ({b})"));
        table.row([
            text(row, "rays_kind").into(),
            row["facets"].as_u64().into(),
            text(row, "call").into(),
            row["threads"].as_u64().into(),
            format!("{}{build}", text(row, "intersector")).into(),
            rate.map_or(Cell::Empty, |r| Cell::Number(r, 3)),
            ratio.unwrap_or(Cell::Empty),
            number(row, "build_seconds").map_or(Cell::Empty, |b| Cell::Number(b, 3)),
            number(row, "bytes_per_facet").map_or(Cell::Empty, |b| Cell::Number(b, 3)),
        ]);
    }
    table
}
