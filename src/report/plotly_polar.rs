//! Circles and spokes of a polar diagram as plotly's traces and layout; its own polar axes know no diagram that is half a circle.

use super::plotly_data::{plain, singles};
use super::polar::{FrameLabel, PolarFrame};
use serde_json::{Value, json};

/// Returns circles and spokes as a trace below all curves, and the layout with their numbers in place of axes.
pub(super) fn polar_frame(frame: &PolarFrame, unit: &str) -> (Vec<Value>, Value) {
    let lines = frame.lines();
    // A NaN lifts the pen between two lines.
    let along =
        |k: usize| singles(lines.iter().flat_map(move |l| l.iter().map(move |p| p[k] as f32).chain([f32::NAN])));
    let trace = json!({"type": "scatter", "mode": "lines", "x": along(0), "y": along(1), "hoverinfo": "skip", "showlegend": false,
        "line": {"color": "rgba(128,128,128,0.4)", "width": 1}});
    let number = |label: FrameLabel| {
        let anchor = ["right", "center", "left"][(label.side + 1) as usize];
        json!({"x": label.at[0], "y": label.at[1], "text": plain(&label.text), "showarrow": false, "xanchor": anchor,
            "font": {"size": 11}})
    };
    let numbers: Vec<Value> = frame.labels(unit).into_iter().map(number).collect();
    let [across, up] = frame.ranges();
    let layout = json!({"annotations": numbers, "margin": {"l": 14, "b": 14},
        "xaxis": {"visible": false, "range": across},
        "yaxis": {"visible": false, "range": up, "scaleanchor": "x"}});
    (vec![trace], layout)
}
