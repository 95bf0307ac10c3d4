//! Right, flagged and wrong: per intersector, and per hard case.

use super::rows::{distinct, text};
use crate::report::{AxisStyle, Cell, Chart, Content, Section, Table};
use serde_json::Value;

/// Makes title and sections of the stability study: the right, flagged and wrong answers of its rows, by intersector and by case.
pub(super) fn report(rows: &[&Value]) -> (String, Vec<Section>) {
    let sum = |name: &str, key: &str| -> u64 {
        rows.iter().filter(|r| text(r, "intersector") == name).filter_map(|r| r[key].as_u64()).sum()
    };
    let names = distinct(rows, "intersector");
    let columns = [("intersector", ""), ("rays", ""), ("right", ""), ("flagged", ""), ("wrong", "")];
    let mut table = Table::new("stability", "Hard rays", &columns)
        .caption("Flagged: the answer itself says that it is not proved. Truths are by construction.");
    for name in &names {
        let counts = ["rays", "right", "flagged", "wrong"].map(|key| Cell::from(sum(name, key)));
        table.row(std::iter::once(Cell::from(*name)).chain(counts));
    }
    let layers =
        ["flagged", "wrong"].map(|key| (key.to_owned(), names.iter().map(|n| Some(sum(n, key) as f64)).collect()));
    let content = Content::Bars {
        categories: names.iter().map(|n| (*n).to_owned()).collect(),
        layers: layers.into(),
        stacked: true,
    };
    let axes = [AxisStyle::linear("intersector", ""), AxisStyle::linear("rays", "")];
    let caption = "Rays flagged as unproved, and rays answered wrongly.";
    let chart = Chart { content, ..Chart::series("verdicts", "Flagged and wrong", caption, axes, Vec::new()) };
    (
        "Numerical stability".into(),
        vec![Section::new("Verdicts").with_block(chart).with_block(table).with_block(case_table(rows))],
    )
}

/// Makes a table with one row per case, its variants added up: the numbers of right / flagged / wrong answers of every intersector. Not
/// every one is tested at extreme sizes.
fn case_table(rows: &[&Value]) -> Table {
    let names = distinct(rows, "intersector");
    let columns: Vec<(&str, &str)> =
        [("case", ""), ("rays a variant", "")].into_iter().chain(names.iter().map(|n| (*n, ""))).collect();
    let mut table = Table::new("stability-cases", "Right / flagged / wrong by case", &columns).caption(
        "The sum over the variants: at home, shifted by 10⁶ mm, scaled up and down by 1000, turned by an odd angle, and, where it is larger, \
         scaled up and down by 10⁶ too. Octree and BVH are asked for the facets' truth, exact and plain Newton for the spline's.",
    );
    for case in distinct(rows, "case") {
        let sum = |name: &str, key: &str| -> u64 {
            let own = rows.iter().filter(|r| text(r, "case") == case && text(r, "intersector") == name);
            own.filter_map(|r| r[key].as_u64()).sum()
        };
        // All variants have the same number of queries.
        let rays = rows.iter().find(|r| text(r, "case") == case).and_then(|r| r["rays"].as_u64()).unwrap_or(0);
        let verdict = |n: &&str| {
            let [right, flagged, wrong] = ["right", "flagged", "wrong"].map(|key| sum(n, key));
            Cell::from(format!("{right}/{flagged}/{wrong}"))
        };
        table.row([case.into(), rays.into()].into_iter().chain(names.iter().map(verdict)));
    }
    table
}
