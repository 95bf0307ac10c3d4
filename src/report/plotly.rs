//! Charts and views as plotly.js figures.

use super::chart::{Chart, Content, MapPoint, Marks, PALETTE, Series, SeriesStyle, colours, have_equal_units};
use super::legend::legend_name;
use super::map_labels::{LevelLabel, MapLabels, POINT_RADIUS, map_labels};
use super::plotly_axis::axis;
use super::plotly_data::{
    colour_scale, css, doubles, hover_place, indices, lighting, plain, singles, text_position,
};
use super::plotly_polar::polar_frame;
use super::polar::PolarFrame;
use super::raster::{EYE, common_range};
use super::view::{Shape, View};
use crate::formats::{Axis, Picture, base64};
use serde_json::{Value, json};
use std::io::Read;

/// plotly.js 3.0.1 as its authors publish it, compressed from 4.7 to 1.4 MB; its licence is in `plotly-licence.txt`.
static SCRIPT: &[u8] = include_bytes!("plotly-3.0.1.min.js.gz");

/// Unpacks the script of plotly.js, which a report holds once.
///
/// # Panics
/// When the script that the program holds is damaged, which a test rules out.
pub(super) fn script() -> String {
    let mut script = String::new();
    flate2::read::GzDecoder::new(SCRIPT).read_to_string(&mut script).expect("the script in the program is whole");
    // Strings of it hold signatures of picture formats: control characters, which the escapes stand for as well.
    script.replace('\u{1a}', r"\x1a").replace('\u{1}', r"\x01")
}

/// Returns a chart as plotly's figure: an object with `data` and `layout`.
pub(super) fn chart(chart: &Chart) -> Value {
    let (data, extra): (Vec<Value>, Value) = match &chart.content {
        Content::Series(series) => {
            let traces: Vec<Value> = series.iter().zip(colours(series)).map(|(s, c)| trace(c, s)).collect();
            (traces, json!({}))
        }
        Content::Bars { categories, layers, stacked } => {
            let names: Vec<String> = categories.iter().map(|name| plain(name)).collect();
            let bars = layers.iter().enumerate().map(|(k, (name, values))| {
                json!({"type": "bar", "name": plain(name), "x": names, "y": values,
                    "marker": {"color": PALETTE[k % PALETTE.len()]}})
            });
            let mode = if *stacked { "stack" } else { "group" };
            (bars.collect(), json!({"barmode": mode, "xaxis": {"type": "category", "automargin": true}}))
        }
        Content::Map { grid, map, marks } => {
            let [a, b] = &grid.axes;
            let bytes: Vec<u8> = grid.values.iter().flat_map(|v| (*v as f32).to_le_bytes()).collect();
            let z = json!({"dtype": "f4", "bdata": base64(&bytes), "shape": format!("{}, {}", b.cells, a.cells)});
            let hover = format!("{}<br><b>%{{z:.4g}} {}</b><extra></extra>", hover_place(&grid.axes), grid.unit);
            // As in the static picture: plotly's own scale begins at the darkest cell, black however bright that is.
            let [low, high] = grid.colour_range();
            let heat = json!({"type": "heatmap", "z": z, "x0": a.center(0), "dx": a.step(), "y0": b.center(0),
                "dy": b.step(), "colorscale": colour_scale(*map), "zmin": low, "zmax": high, "hovertemplate": hover,
                "colorbar": {"title": {"text": grid.unit, "side": "right"}, "thickness": 14, "outlinewidth": 0}});
            let same = have_equal_units(&grid.axes);
            let anchor = if same { json!({"scaleanchor": "x", "constrain": "domain"}) } else { json!({}) };
            let labels = labels(marks, &grid.axes, same);
            let mut data = vec![heat];
            data.extend(mark_traces(marks, &labels));
            (
                data,
                json!({"yaxis": anchor, "xaxis": {"constrain": "domain"}, "annotations": level_annotations(&labels),
                "showlegend": false, "meta": {"unit": grid.unit, "scales": "both"}}),
            )
        }
        Content::Polar { series, unit } => {
            let (mut data, layout) = polar_frame(&PolarFrame::new(series), unit);
            let curve = |(s, c): (&Series, &str)| {
                let mut trace = trace(c, s);
                // Its coordinates are no figures of the lamp.
                trace["hovertemplate"] = json!("%{text}<extra>%{fullData.name}</extra>");
                trace
            };
            data.extend(series.iter().zip(colours(series)).map(curve));
            (data, layout)
        }
        Content::Picture { axes, picture } => picture_trace(axes, picture),
    };
    let along = |k: usize| -> Vec<f64> {
        match &chart.content {
            Content::Series(series) => series.iter().flat_map(|s| s.points.iter().map(|p| p[k])).collect(),
            Content::Bars { layers, .. } if k == 1 => {
                layers.iter().flat_map(|l| l.1.iter().copied().flatten()).collect()
            }
            _ => Vec::new(),
        }
    };
    let [x, y] = [(&chart.x, 0), (&chart.y, 1)].map(|(style, k)| axis(style, along(k).into_iter()));
    let mut layout = json!({"xaxis": x, "yaxis": y,
        "margin": {"l": 60, "r": 14, "t": 10, "b": 48}, "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom"},
        "hoverlabel": {"align": "left"}});
    merge(&mut layout, extra);
    if chart.equal_scales {
        merge(&mut layout, json!({"yaxis": {"scaleanchor": "x", "constrain": "domain"}}));
    }
    json!({"data": data, "layout": layout})
}

/// Returns lines of equal value, borders of zones and named points as traces over a map; a NaN lifts the pen between two lines.
fn mark_traces(marks: &Marks, labels: &MapLabels) -> Vec<Value> {
    let joined = |lines: &mut dyn Iterator<Item = &Vec<[f64; 2]>>| -> [Vec<f32>; 2] {
        let mut along = [Vec::new(), Vec::new()];
        for line in lines {
            for (k, numbers) in along.iter_mut().enumerate() {
                numbers.extend(line.iter().map(|p| p[k] as f32).chain([f32::NAN]));
            }
        }
        along
    };
    let lines = |[x, y]: [Vec<f32>; 2], style: Value| {
        json!({"type": "scatter", "mode": "lines", "hoverinfo": "skip", "line": style,
            "x": singles(x.into_iter()), "y": singles(y.into_iter())})
    };
    let mut traces = Vec::new();
    if !marks.lines.is_empty() {
        let all = joined(&mut marks.lines.iter().map(|l| &l.points));
        traces.push(lines(all, json!({"color": "rgba(255,255,255,0.75)", "width": 1})));
    }
    if !marks.outlines.is_empty() {
        let all = joined(&mut marks.outlines.iter());
        traces.push(lines(all, json!({"color": "#5eead4", "width": 1.2, "dash": "dash"})));
    }
    if !marks.points.is_empty() {
        let along = |k: usize| doubles(marks.points.iter().map(move |p| p.at[k]));
        let name = |(p, side): (&MapPoint, &Option<_>)| if side.is_some() { plain(&p.name) } else { String::new() };
        let names: Vec<String> = marks.points.iter().zip(&labels.sides).map(name).collect();
        let sides: Vec<String> = labels.sides.iter().map(|side| text_position(side.unwrap_or_default())).collect();
        // The script places them anew in windows of other widths.
        let all_names: Vec<String> = marks.points.iter().map(|p| plain(&p.name)).collect();
        let notes: Vec<String> = marks.points.iter().map(|p| plain(&format!("{}: {}", p.name, p.note))).collect();
        // Names lie on black and on the brightest light: the shadow sets them off from both.
        traces.push(json!({"type": "scatter", "mode": "markers+text", "x": along(0), "y": along(1), "text": names,
            "customdata": all_names, "hovertext": notes, "hoverinfo": "text", "textposition": sides,
            "textfont": {"color": "#5eead4", "size": 12, "shadow": HALO},
            "marker": {"color": "#5eead4", "size": 2.0 * POINT_RADIUS}}));
    }
    traces
}

/// The shadows around a name, dark on every side.
const HALO: &str =
    "1px 1px 1px #000, -1px 1px 1px #000, 1px -1px 1px #000, -1px -1px 1px #000, 0 0 4px #000, 0 0 4px #000";

/// Pixels of the longer side of a map in the report, about: reports have two columns, which windows make wider or narrower.
const MAP_PIXELS: f64 = 260.0;

/// Pixels of the longer side of a map with named points, which has both columns.
const WIDE_MAP_PIXELS: f64 = 600.0;

/// Width of a digit and height of a line of the labels in the report, pixels.
const LETTER: [f64; 2] = [6.5, 15.0];

/// Returns where names and levels are written on a map; `same` where a unit has one length along both axes.
fn labels(marks: &Marks, axes: &[Axis; 2], same: bool) -> MapLabels {
    let spans = [0, 1].map(|k| axes[k].range[1] - axes[k].range[0]);
    let pixels = if marks.points.is_empty() { MAP_PIXELS } else { WIDE_MAP_PIXELS };
    let pixel = |at: [f64; 2]| {
        let span = |k: usize| if same { spans[0].max(spans[1]) } else { spans[k] };
        // Down from the top, as words are written.
        [pixels * at[0] / span(0), -pixels * at[1] / span(1)]
    };
    let frame = [0, 1].map(|end| pixel([axes[0].range[end], axes[1].range[end]]));
    map_labels(marks, pixel, frame, LETTER)
}

/// Returns plotly's annotations with the levels of lines.
fn level_annotations(labels: &MapLabels) -> Vec<Value> {
    let annotation = |label: &LevelLabel| {
        json!({"x": label.at[0], "y": label.at[1], "text": label.text, "showarrow": false,
            "font": {"color": "#ffffff", "size": 11}, "bgcolor": "rgba(0,0,0,0.35)"})
    };
    labels.levels.iter().map(annotation).collect()
}

/// Returns a picture with its bottom row first.
fn upside_down(picture: &Picture) -> Picture {
    let rows = picture.rgb.chunks(3 * picture.width.max(1) as usize).rev();
    Picture { rgb: rows.flatten().copied().collect(), ..*picture }
}

/// Returns the trace of a picture over its axes, and the layout; one that has no pixels leaves the axes empty.
fn picture_trace(axes: &[Axis; 2], picture: &Picture) -> (Vec<Value>, Value) {
    let [a, b] = axes;
    // Row after row along the axis, which points up: the other way, with steps downward, plotly draws it upside down.
    let source = upside_down(picture).to_png().map(|bytes| format!("data:image/png;base64,{}", base64(&bytes)));
    let image = json!({"type": "image", "source": source.ok(), "x0": a.center(0), "dx": a.step(),
        "y0": b.center(0), "dy": b.step(),
        "hovertemplate": format!("{}<extra></extra>", hover_place(axes))});
    let anchor = if have_equal_units(axes) { json!("x") } else { json!(false) };
    let layout = json!({"yaxis": {"autorange": true, "scaleanchor": anchor, "constrain": "domain"},
        "xaxis": {"constrain": "domain"}, "showlegend": false});
    (vec![image], layout)
}

/// Returns a series as plotly's trace.
fn trace(colour: &str, s: &Series) -> Value {
    let mode = match s.style {
        SeriesStyle::LineAndPoints => "lines+markers",
        SeriesStyle::Line | SeriesStyle::Dashed => "lines",
        SeriesStyle::Points | SeriesStyle::Faint => "markers",
    };
    let faint = s.style == SeriesStyle::Faint;
    let mut trace = json!({"type": "scatter", "mode": mode, "name": plain(&s.name),
        "x": doubles(s.points.iter().map(|p| p[0])), "y": doubles(s.points.iter().map(|p| p[1])),
        "opacity": if faint { 0.55 } else { 1.0 }, "marker": {"size": if faint { 6 } else { 8 }},
        "line": {"width": 2, "dash": if s.style == SeriesStyle::Dashed { "dash" } else { "solid" }}});
    trace["marker"]["color"] = colour.into();
    trace["line"]["color"] = colour.into();
    if !s.labels.is_empty() {
        trace["text"] = s.labels.iter().map(|label| plain(label)).collect();
        trace["hovertemplate"] = json!("%{text}<br>%{x:.4g}, %{y:.4g}<extra>%{fullData.name}</extra>");
    }
    if !s.errors.is_empty() {
        trace["error_y"] = json!({"type": "data", "array": doubles(s.errors.iter().copied()), "width": 2});
    }
    trace
}

/// Least side of the box of a view over its diagonal: a flat one still has an axis across it.
const LEAST_SIDE: f64 = 0.01;
/// Margin on either side of the box, over its side.
const BOX_MARGIN: f64 = 1.0 / 32.0;

/// Returns the range of each axis of a 3-D view, mm, and the side of its box on the screen: of one scale along all three, its diagonal that
/// of a unit cube. Plotly's own rule makes the volume that of a unit cube, so that a thin plate grows beyond the picture.
fn box_in_view(view: &View) -> ([[f64; 2]; 3], [f64; 3]) {
    let [low, high] = view.bounds().unwrap_or([[-1.0; 3], [1.0; 3]]).map(|corner| corner.map(f64::from));
    let diagonal = |sides: [f64; 3]| sides.iter().map(|s| s * s).sum::<f64>().sqrt();
    let extent = diagonal([0, 1, 2].map(|k| high[k] - low[k]));
    // A single point gets a box of 1 mm.
    let whole = if extent > 0.0 { extent } else { 1.0 / LEAST_SIDE };
    let sides = [0, 1, 2].map(|k| (high[k] - low[k]).max(LEAST_SIDE * whole) * (1.0 + 2.0 * BOX_MARGIN));
    let ranges = [0, 1, 2].map(|k| {
        let middle = 0.5 * (low[k] + high[k]);
        [middle - 0.5 * sides[k], middle + 0.5 * sides[k]]
    });
    (ranges, sides.map(|side| side * 3f64.sqrt() / diagonal(sides)))
}

/// Returns a 3-D view as plotly's figure: an object with `data` and `layout`.
pub(super) fn view(view: &View) -> Value {
    let range = common_range(&view.shapes);
    let mut data: Vec<Value> = view.shapes.iter().map(|s| shape(s, range)).collect();
    // One colour bar for all that is coloured by values.
    data.iter_mut().filter(|s| !s["colorbar"].is_null()).skip(1).for_each(|s| s["showscale"] = json!(false));
    let quiet = |range: [f64; 2]| {
        json!({"showbackground": false, "showspikes": false, "zeroline": false, "title": {"text": ""},
            "ticksuffix": " mm", "nticks": 4, "tickfont": {"size": 11}, "range": range})
    };
    let (ranges, ratios) = box_in_view(view);
    // Nearer than plotly's default, which leaves half of the picture empty.
    let [x, y, z] = EYE.map(|c| 0.78 * c);
    json!({"data": data, "layout": {
        "scene": {"aspectmode": "manual", "aspectratio": {"x": ratios[0], "y": ratios[1], "z": ratios[2]},
            "xaxis": quiet(ranges[0]), "yaxis": quiet(ranges[1]), "zaxis": quiet(ranges[2]),
            "camera": {"eye": {"x": x, "y": y, "z": z}, "projection": {"type": "orthographic"}}},
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0}, "showlegend": view.shapes.len() > 1,
        "legend": {"orientation": "h", "y": -0.01, "yanchor": "top"}}})
}

/// Returns a shape of a view as plotly's trace; `low` and `high` bound its colours.
fn shape(shape: &Shape, [low, high]: [f32; 2]) -> Value {
    match shape {
        Shape::Surface { name, points, triangles, colour, opacity, values, labels } => {
            let mut mesh = json!({"type": "mesh3d", "name": plain(&legend_name(name)), "showlegend": values.is_none(),
                "x": singles(points.iter().map(|p| p[0])), "y": singles(points.iter().map(|p| p[1])),
                "z": singles(points.iter().map(|p| p[2])), "i": indices(triangles.iter().map(|t| t[0])),
                "j": indices(triangles.iter().map(|t| t[1])), "k": indices(triangles.iter().map(|t| t[2])),
                "opacity": opacity, "flatshading": true, "hoverinfo": "name",
                "lighting": lighting(0.35, 0.65, 0.15),
                // Above and to the right of the viewer: under an orthographic camera plotly turns normals away from the viewer, and a light
                // before the part left all that is seen in the shade.
                "lightposition": {"x": -600, "y": 1500, "z": -2500}});
            if !labels.is_empty() {
                // Where each face begins among the points: the script finds a face by the point under the pointer.
                let (first, selectors): (Vec<u32>, Vec<&str>) =
                    labels.iter().map(|(k, s)| (*k, s.as_str())).unzip();
                mesh["meta"] = json!({"points": points.len(), "first": first, "selectors": selectors});
            }
            match values {
                Some(v) => {
                    mesh["intensity"] = singles(v.values.iter().copied());
                    mesh["intensitymode"] = json!("cell");
                    (mesh["cmin"], mesh["cmax"]) = (json!(low), json!(high));
                    // Colours that are to be read keep their brightness on every side.
                    mesh["lighting"] = lighting(0.85, 0.25, 0.0);
                    mesh["colorscale"] = colour_scale(v.map);
                    mesh["colorbar"] =
                        json!({"title": {"text": v.label, "side": "right"}, "thickness": 14, "outlinewidth": 0});
                    mesh["hovertemplate"] = json!(format!("{} %{{intensity:.4g}}<extra></extra>", v.label));
                }
                None => mesh["color"] = json!(css(*colour)),
            }
            mesh
        }
        Shape::Lines { name, lines, colour, width } => {
            // A NaN lifts the pen between two lines.
            let along =
                |k: usize| singles(lines.iter().flat_map(move |l| l.iter().map(move |p| p[k]).chain([f32::NAN])));
            // Before the parts: of a long legend the end is hidden.
            json!({"type": "scatter3d", "mode": "lines", "name": plain(&legend_name(name)), "hoverinfo": "name", "connectgaps": false,
                "x": along(0), "y": along(1), "z": along(2), "opacity": 0.8, "legendrank": 1,
                "line": {"color": css(*colour), "width": width}})
        }
        Shape::Points { name, points, colour } => {
            let along = |k: usize| singles(points.iter().map(move |p| p[k]));
            json!({"type": "scatter3d", "mode": "markers", "name": plain(&legend_name(name)), "hoverinfo": "name",
                "x": along(0), "y": along(1), "z": along(2), "marker": {"size": 4, "color": css(*colour)}})
        }
    }
}

/// Puts the keys of one object into another, table by table; anything else is replaced.
fn merge(into: &mut Value, from: Value) {
    match (into, from) {
        (Value::Object(into), Value::Object(from)) => {
            from.into_iter().for_each(|(k, v)| merge(into.entry(k).or_insert(Value::Null), v));
        }
        (into, from) => *into = from,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plate of 106 × 106 × 1.5 mm had a box 4.1 wide, of which the middle filled the picture.
    #[test]
    fn the_box_of_a_view_has_the_diagonal_of_a_cube_and_one_scale() {
        let surface = |corner: [f32; 3]| Shape::Surface {
            name: "plate".into(),
            points: vec![[0.0; 3], corner, [corner[0], 0.0, 0.0]],
            triangles: vec![[0, 1, 2]],
            colour: [0.5; 3],
            opacity: 1.0,
            values: None,
            labels: Vec::new(),
        };
        let view_of = |shapes| View { name: String::new(), title: String::new(), caption: String::new(), shapes };
        for corner in [[106.0, 106.0, 1.5], [106.0, 106.0, 0.0], [1e-3, 2e-3, 3e-3], [7.0, 0.0, 0.0], [0.0; 3]] {
            let (ranges, ratios) = box_in_view(&view_of(vec![surface(corner)]));
            let diagonal = ratios.iter().map(|r| r * r).sum::<f64>().sqrt();
            assert!((diagonal - 3f64.sqrt()).abs() < 1e-12, "{ratios:?}");
            for k in 0..3 {
                let [low, high] = ranges[k];
                assert!(low < 0.0 && high > f64::from(corner[k]) && ratios[k] > 0.0, "{corner:?}: {ranges:?}");
                let scales = ratios[k] / (high - low) * (ranges[0][1] - ranges[0][0]) / ratios[0];
                assert!((scales - 1.0).abs() < 1e-12, "{corner:?}: {ranges:?} {ratios:?}");
            }
        }
    }

    /// Where a low beam was read on ±10.5°: 75L lies 0.29° above 50L, and its name above that of 50L, not below; none is left out.
    #[test]
    fn test_points_of_a_low_beam_all_have_their_names() {
        let read = [
            ("B50L", [-3.16, 0.555]),
            ("75R", [1.42, -0.585]),
            ("75L", [-3.16, -0.585]),
            ("50L", [-3.16, -0.875]),
            ("50R", [1.99, -0.875]),
            ("50V", [0.27, -0.875]),
            ("25R", [9.27, -1.73]),
            ("Zone IV", [-4.06, -0.875]),
            ("B8", [-3.73, -0.015]),
        ];
        let points = read.map(|(name, at)| MapPoint { name: name.into(), note: String::new(), at }).to_vec();
        let axis = |half: f64| Axis { label: "H".into(), unit: "deg".into(), range: [-half, half], cells: 2 };
        let labels = labels(&Marks { points, ..Marks::default() }, &[axis(10.5), axis(5.25)], true);
        let side = |name: &str| labels.sides[read.iter().position(|(n, _)| *n == name).unwrap()].map(text_position);
        assert_eq!(["75L", "50L"].map(side), ["top right", "bottom right"].map(|side| Some(side.to_owned())));
        assert!(labels.sides.iter().all(Option::is_some), "{:?}", labels.sides);
    }

    /// As a browser shows it: the first row that plotly gets stands at the lower end of the axis.
    #[test]
    fn pictures_begin_at_the_bottom() {
        let picture = Picture { width: 1, height: 2, rgb: vec![1, 2, 3, 4, 5, 6] };
        assert_eq!(upside_down(&picture).rgb, [4, 5, 6, 1, 2, 3]);
        let axis = |range, cells| Axis { label: "x".into(), unit: "mm".into(), range, cells };
        let (data, _) = picture_trace(&[axis([0.0, 1.0], 1), axis([-2.0, 2.0], 2)], &picture);
        assert_eq!([data[0]["y0"].as_f64(), data[0]["dy"].as_f64()], [Some(-1.0), Some(2.0)]);
    }

    #[test]
    fn the_script_is_whole_and_can_stand_in_a_page() {
        let script = script();
        assert_eq!(script.len(), 4_653_932 + 2 * 3);
        assert!(script.chars().all(|c| !c.is_control() || matches!(c, '\n' | '\r' | '\t')));
        assert!(script.contains("plotly.js v3.0.1") && !script.contains("</script"));
    }
}
