//! What each effect costs on a scene: the smallest kernel, each effect added alone, everything.

use super::rows::{number, text};
use crate::report::{AxisStyle, Cell, Chart, Content, Section, Table};
use serde_json::Value;

/// Writes what the kernel of a row can do: the effect added, or all that it was asked for.
fn label(row: &Value) -> String {
    let words = row["effects"].as_array().map(|a| a.iter().filter_map(Value::as_str).collect::<Vec<_>>());
    let effects = words.filter(|w| !w.is_empty()).map_or("none".into(), |w| w.join(" + ").replace('_', " "));
    match (row["added"].as_str(), text(row, "choice")) {
        (Some(added), _) => format!("+ {}", added.replace('_', " ")),
        (None, "pruned") => format!("as called for: {effects}"),
        (None, "full") => "everything".into(),
        _ => format!("{}: {effects}", text(row, "kernel")),
    }
}

/// Makes title and sections of the effects study.
pub(super) fn report(rows: &[&Value]) -> (String, Vec<Section>) {
    let categories: Vec<String> = rows.iter().map(|r| label(r)).collect();
    let times: Vec<Option<f64>> = rows.iter().map(|r| number(r, "seconds_trace_median")).collect();
    let columns = [
        ("what the kernel can do", ""),
        ("kernel", ""),
        ("trace, median", "s"),
        ("rate", "Mrays/s"),
        ("time", "×"),
        ("same bits", ""),
    ];
    let mut table = Table::new("effects", "Time by effect", &columns).caption(
        "Every kernel can do what the ones before it can: mirror (mirrors and absorbers), opaque (power alone), clear \
         (a body), nested (a stack of bodies), coloured (a wavelength), full (polarisation). Effects that ask for the same kernel cost the same: they are the same code.",
    );
    let three = |x: f64| Cell::Number(x, 3);
    for (row, name) in rows.iter().zip(&categories) {
        let same = row["identical"].as_bool().map(|b| if b { "yes" } else { "NO" });
        table.row([
            name.as_str().into(),
            text(row, "kernel").into(),
            number(row, "seconds_trace_median").map_or(Cell::Empty, three),
            number(row, "mrays_per_s_median").map_or(Cell::Empty, three),
            number(row, "ratio_to_pruned").map_or(Cell::Empty, three),
            same.into(),
        ]);
    }
    let content = Content::Bars { categories, layers: vec![("trace".into(), times)], stacked: true };
    let axes = [AxisStyle::linear("effects", ""), AxisStyle::linear("time", "s")];
    let caption =
        "Median time of the trace by what the kernel can do; what the scene does not call for changes no result.";
    let chart = Chart { content, ..Chart::series("effects", "Time by effect", caption, axes, Vec::new()) };
    ("What each effect costs".into(), vec![Section::new("Time").with_block(chart).with_block(table)])
}
