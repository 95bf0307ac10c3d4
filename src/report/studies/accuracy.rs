//! Tolerance × normals × intersector: the cost–accuracy front, the slopes beside their theory, where the time goes.

use super::rows::{distinct, number, text};
use crate::report::{AxisStyle, Cell, Chart, Content, Section, Series, SeriesStyle, Table};
use crate::study::slope;
use crate::text::{figures, grouped};
use serde_json::Value;

/// Direction errors below it are rounding of unit vectors in double precision, degrees.
const ROUNDING_DEG: f64 = 1e-7;

/// A row as a point of cost against error, seconds and degrees.
struct Point<'a> {
    row: &'a Value,
    /// Seconds of the whole job.
    seconds: f64,
    /// Seconds of it for the rays alone.
    trace_seconds: f64,
    /// 99th percentile of the direction error, degrees.
    error: f64,
}

impl<'a> Point<'a> {
    /// Reads a row; `None` without a time or an error.
    fn from_row(row: &'a Value) -> Option<Self> {
        // The spline has no facets to make.
        let build = number(row, "seconds_build")?;
        let prepare = number(row, "seconds_tessellate").map_or(build, |tessellate| tessellate + build);
        let trace_seconds = number(row, "seconds_trace_median")?;
        let seconds = prepare + trace_seconds;
        Some(Self { row, seconds, trace_seconds, error: number(row, "direction_error_deg_p99")? })
    }

    /// Returns the tolerance of its facets, mm; empty for the spline.
    fn tolerance(&self) -> Cell {
        match (text(self.row, "intersector"), self.row["adaptive"].as_bool()) {
            ("exact", _) => Cell::Empty,
            (_, Some(true)) => "adaptive".into(),
            _ => number(self.row, "tolerance_mm").into(),
        }
    }

    /// Writes what a point stands for.
    fn label(&self) -> String {
        let intersector = text(self.row, "intersector");
        if intersector == "exact" {
            return "the exact spline".into();
        }
        let tolerance = if self.row["adaptive"].as_bool() == Some(true) {
            "the adaptive tolerance".into()
        } else {
            format!("{} mm", number(self.row, "tolerance_mm").map_or("?".into(), |t| figures(t, 3)))
        };
        format!("{tolerance} with {} normals on {intersector}", text(self.row, "normals"))
    }
}

/// Makes title and sections of the accuracy study, from the rows of the most threads.
pub(super) fn report(rows: &[&Value]) -> (String, Vec<Section>) {
    let model = distinct(rows, "model").join(", ");
    // Facts at the largest number of threads: that is what a user waits for.
    let threads = rows.iter().filter_map(|r| r["threads"].as_u64()).max().unwrap_or(1);
    // Rows that do not say their threads count as of the largest number.
    let chosen: Vec<&Value> =
        rows.iter().copied().filter(|r| r["threads"].as_u64().unwrap_or(threads) == threads).collect();
    let points: Vec<Point> = chosen.iter().filter_map(|r| Point::from_row(r)).collect();
    let title = format!("What accuracy costs in time: {model}");
    let section = Section::new("Cost against accuracy")
        .with_block(front_chart(&points))
        .with_block(slope_chart(&chosen))
        .with_block(front_table(&points));
    let time = Section::new("Where the time goes").with_block(time_chart(&chosen));
    (title, vec![section, time])
}

/// Whether another combination is at least as good in both time and error, and better in one.
fn is_dominated(p: &Point, points: &[Point]) -> bool {
    // As good in both and better in one: of two equal ones neither is dominated.
    let better = |q: &Point| q.seconds < p.seconds || q.error < p.error;
    points.iter().any(|q| q.seconds <= p.seconds && q.error <= p.error && better(q))
}

/// Makes a table of the combinations that no other dominates in time and p99 direction error, the cheapest first.
fn front_table(points: &[Point]) -> Table {
    let columns = [
        ("tolerance", "mm"),
        ("normals", ""),
        ("on", ""),
        ("facets", ""),
        ("direction error, p99", "°"),
        ("distance, p99", "mm"),
        ("prepare", "s"),
        ("trace", "s"),
        ("in all", "s"),
    ];
    let rays = points.iter().find_map(|p| p.row["rays"].as_u64());
    let title = rays.map_or_else(
        || "The combinations that none beats".to_owned(),
        |rays| format!("The combinations that none beats for {} rays", grouped(rays)),
    );
    let mut table = Table::new("front", &title, &columns).caption(
        "Each is the cheapest for its error with so many rays; of more rays others are. Prepare: tessellate and build.",
    );
    let mut front: Vec<&Point> = points.iter().filter(|p| !is_dominated(p, points)).collect();
    front.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    let three = |x: f64| Cell::Number(x, 3);
    for p in front {
        table.row([
            p.tolerance(),
            text(p.row, "normals").into(),
            text(p.row, "intersector").into(),
            p.row["facets"].as_u64().filter(|_| text(p.row, "intersector") != "exact").into(),
            three(p.error),
            number(p.row, "hit_error_mm_p99").map_or(Cell::Empty, three),
            three(p.seconds - p.trace_seconds),
            three(p.trace_seconds),
            three(p.seconds),
        ]);
    }
    table
}

/// Draws every combination as time against p99 direction error; dominated ones are faint.
fn front_chart(points: &[Point]) -> Chart {
    // None has no place on a logarithmic axis, and rounding one far below all others; it is shown at a tenth of the smallest of these.
    let is_error = |error: &f64| *error > ROUNDING_DEG;
    let smallest = points.iter().map(|p| p.error).filter(is_error).min_by(f64::total_cmp).unwrap_or(ROUNDING_DEG);
    let shown = |p: &&Point| [p.seconds, if is_error(&p.error) { p.error } else { smallest / 10.0 }];
    let of = |name: String, style, wanted: &dyn Fn(&Point) -> bool| {
        let mut list: Vec<&Point> = points.iter().filter(|p| wanted(p)).collect();
        list.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
        Series {
            name,
            points: list.iter().map(shown).collect(),
            labels: list.iter().map(|p| p.label()).collect(),
            style,
            ..Series::default()
        }
    };
    let mut series = vec![of("the front".into(), SeriesStyle::Line, &|p| !is_dominated(p, points))];
    let rows: Vec<&Value> = points.iter().map(|p| p.row).collect();
    for normals in distinct(&rows, "normals") {
        series.push(of(normals.into(), SeriesStyle::Points, &|p| {
            text(p.row, "normals") == normals && !is_dominated(p, points)
        }));
    }
    series.push(of("dominated".into(), SeriesStyle::Faint, &|p| is_dominated(p, points)));
    series.retain(|s| !s.points.is_empty());
    let caption = "Each point is one combination of tolerance, normals and intersector; lower left is better. Faint: another \
        combination is no worse in either and better in one. Time is tessellation, build and the median of the traces; no error, or one \
        that is rounding, is drawn at a tenth of the smallest other.";
    let axes = [AxisStyle::log("time", "s"), AxisStyle::log("direction error, p99", "°")];
    Chart::series("front", "Cost–accuracy front", caption, axes, series)
}

/// Draws direction error over sag of the octree's rows, by kind of normals, with the slopes that theory expects; rows without sag or error
/// are left out.
fn slope_chart(rows: &[&Value]) -> Chart {
    // The median: an rms follows the few most grazing rays, whose error goes with the tangent of incidence. Where more than half of
    // the hits are on planes their median is rounding, and the 99th percentile stands in for it.
    let octree = |r: &&&Value| text(r, "intersector") == "octree" && text(r, "normals") != "exact";
    let medians = || rows.iter().filter(octree).filter_map(|r| number(r, "direction_error_deg_p50"));
    let (key, word) = if medians().next().is_some() && medians().all(|e| e > ROUNDING_DEG) {
        // Rounding follows no law: its slope would mean nothing.
        ("direction_error_deg_p50", "median")
    } else {
        ("direction_error_deg_p99", "p99")
    };
    let mut series = Vec::new();
    for normals in distinct(rows, "normals").into_iter().filter(|n| *n != "exact") {
        let mut points: Vec<[f64; 2]> = (rows.iter())
            .filter(|r| text(r, "normals") == normals && text(r, "intersector") == "octree")
            .filter(|r| r["adaptive"].as_bool() != Some(true))
            .filter_map(|r| {
                let sag = number(r, "sag_mean_mm").or(number(r, "tolerance_mm"))?;
                Some([sag, number(r, key)?])
            })
            .filter(|p| p[0] > 0.0 && p[1] > 0.0)
            .collect();
        // From coarse to fine, because the theory starts at the coarsest.
        points.sort_by(|a, b| b[0].total_cmp(&a[0]));
        let Some(&start) = points.first() else { continue };
        // The order of a cubic patch depends on how evenly its corners stand: no single slope to expect.
        let theory = match normals {
            "flat" | "nearest" => Some(0.5),
            "bilinear" => Some(1.0),
            _ => None,
        };
        let line = |theory: f64| points.iter().map(|p| [p[0], start[1] * (p[0] / start[0]).powf(theory)]).collect();
        let dashed = theory.map(|t| Series {
            name: format!("{normals}, theory {t}"),
            points: line(t),
            style: SeriesStyle::Dashed,
            ..Series::default()
        });
        // Through two points any slope is exact.
        let slope = if points.len() > 2 { slope(&points) } else { None };
        let name = match slope {
            Some(s) => format!("{normals}, slope {}", figures(s, 3)),
            None => normals.to_owned(),
        };
        series.push(Series { name, points, ..Series::default() });
        series.extend(dashed);
    }
    let caption = "Error of reflected and refracted directions against the mean sag reached, octree. Dashed: the slope theory expects \
        (½ for flat and nearest normals, 1 for bilinear ones; none is drawn for cubic), through the coarsest measurement.";
    let axes = [AxisStyle::log("mean sag", "mm"), AxisStyle::log(&format!("direction error, {word}"), "°")];
    Chart::series("slopes", "Convergence", caption, axes, series)
}

/// Draws the times that meshing, building and tracing take, of the first 14 rows at most: the spline's and those of bilinear normals in the
/// octree.
fn time_chart(rows: &[&Value]) -> Chart {
    let shown: Vec<&&Value> = (rows.iter())
        .filter(|r| {
            text(r, "intersector") == "exact"
                || text(r, "intersector") == "octree" && text(r, "normals") == "bilinear"
        })
        // More bars than that cannot be distinguished.
        .take(14)
        .collect();
    let name = |r: &&&Value| match (text(r, "intersector"), r["adaptive"].as_bool()) {
        ("exact", _) => "exact".to_owned(),
        (_, Some(true)) => "adaptive".to_owned(),
        _ => number(r, "tolerance_mm").map_or("?".into(), |t| format!("{} mm", figures(t, 3))),
    };
    let layer = |title: &str, key: &str| (title.to_owned(), shown.iter().map(|r| number(r, key)).collect());
    let layers = vec![
        layer("tessellate", "seconds_tessellate"),
        layer("build", "seconds_build"),
        layer("trace", "seconds_trace_median"),
    ];
    let content = Content::Bars { categories: shown.iter().map(name).collect(), layers, stacked: true };
    let axes = [AxisStyle::linear("tolerance", ""), AxisStyle::linear("time", "s")];
    let caption = "Octree with bilinear normals by tolerance, and the exact spline. Median of alternating rounds.";
    Chart { content, ..Chart::series("time", "Tessellate, build, trace", caption, axes, Vec::new()) }
}
