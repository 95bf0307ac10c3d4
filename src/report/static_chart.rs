//! The static picture of a chart: its axes, lines, bars, legend or map as elements.

use super::chart::{AxisStyle, Chart, Content, PALETTE, Series, SeriesStyle, colours};
use super::drawing::{Anchor, Drawing, Element, Ink, Place};
use super::polar::PolarFrame;
use super::static_axes::{AREA, GRID_OPACITY, Scale, axes, label, linear_scale, tick_label};
use super::static_map;

/// Width of a chart in the drawing's units.
const WIDTH: f64 = 760.0;
/// Height of a chart in the drawing's units.
const HEIGHT: f64 = 470.0;
/// Draws the chart: its axes, data, legend or map, as elements of a picture of 760 units by 470 or more.
pub(super) fn draw(chart: &Chart) -> Drawing {
    let size = [WIDTH, HEIGHT + extra_height(chart) + static_map::extra_height(chart)];
    let mut drawing = Drawing { title: chart.title.clone(), size, elements: Vec::new() };
    let elements = &mut drawing.elements;
    match &chart.content {
        Content::Series(series) => series_chart(elements, chart, series),
        Content::Bars { categories, layers, stacked } => bar_chart(elements, chart, categories, layers, *stacked),
        Content::Map { grid, map, marks } => {
            let scales = static_map::map_chart(elements, chart, grid, *map);
            static_map::draw_marks(elements, marks, &grid.unit, scales);
        }
        Content::Polar { series, unit } => polar_chart(elements, series, unit),
        Content::Picture { axes, picture } => {
            static_map::pixels(elements, chart, axes, picture.clone());
        }
    }
    drawing
}

/// Draws the names of series in their colours, at the right from `top` on; nothing for a single one, which the title names.
fn legend(elements: &mut Vec<Element>, names: &[(&str, &str)], top: f64) {
    let [_, _, right, _] = AREA;
    if names.len() < 2 {
        return;
    }
    for (k, (name, colour)) in names.iter().enumerate() {
        let y = top + 16.0 + 18.0 * k as f64;
        let corner = [right - 14.0, y - 9.0];
        elements.push(Element::Rectangle { corner, size: [10.0, 10.0], radius: 2.0, ink: Ink::hex(colour) });
        elements.push(label((*name).to_owned(), [right - 20.0, y], Anchor::End));
    }
}

/// Draws lines and points with axes and legend; faint and nameless series are not in the legend.
fn series_chart(elements: &mut Vec<Element>, chart: &Chart, series: &[Series]) {
    let [left, top, right, bottom] = AREA;
    let all = |k: usize| series.iter().flat_map(|s| &s.points).map(move |p| p[k]);
    let mut x = Scale::new(all(0), &chart.x, [left, right], false);
    let bars = series.iter().flat_map(|s| s.points.iter().zip(&s.errors)).flat_map(|(p, e)| [p[1] - e, p[1] + e]);
    let mut y = Scale::new(all(1).chain(bars), &chart.y, [bottom, top], false);
    if chart.equal_scales {
        equalise_units(&mut x, &mut y);
    }
    axes(elements, chart, (Some(&x), &y), AREA, 0.0);
    let mut names = Vec::new();
    for (s, colour) in series.iter().zip(colours(series)) {
        if s.style != SeriesStyle::Faint && !s.name.is_empty() {
            names.push((s.name.as_str(), colour));
        }
        one_series(elements, s, Ink::hex(colour), [&x, &y]);
    }
    legend(elements, &names, top);
}

/// Draws curves over circles and spokes with their numbers; `unit` is that of the circles.
fn polar_chart(elements: &mut Vec<Element>, series: &[Series], unit: &str) {
    let [left, top, right, bottom] = AREA;
    let frame = PolarFrame::new(series);
    let [across, up] = frame.ranges();
    let (mut x, mut y) = (linear_scale(across, [left, right]), linear_scale(up, [bottom, top]));
    equalise_units(&mut x, &mut y);
    let place = |p: &[f64; 2]| [x.position(p[0]), y.position(p[1])];
    for line in frame.lines() {
        let points = line.iter().map(place).collect();
        let (ink, opacity) = (Ink::Text, 2.0 * GRID_OPACITY);
        elements.push(Element::Line { points, ink, width: 1.0, opacity, dashed: false });
    }
    for label in frame.labels(unit) {
        let anchor = [Anchor::End, Anchor::Middle, Anchor::Start][(label.side + 1) as usize];
        let [x, y] = place(&label.at);
        elements.push(tick_label(label.text, [x, y + 4.0], anchor));
    }
    let mut names = Vec::new();
    for (s, colour) in series.iter().zip(colours(series)) {
        names.push((s.name.as_str(), colour));
        one_series(elements, s, Ink::hex(colour), [&x, &y]);
    }
    // Below the outermost circle the corners are free.
    legend(elements, &names, bottom - 40.0);
}

/// Widens the range of the finer of two linear scales, so that a unit is as long on both.
fn equalise_units(x: &mut Scale, y: &mut Scale) {
    // The coarser unit of the two: the other scale is widened to it, and nothing is cut off.
    let unit = |s: &Scale| (s.high - s.low) / (s.to - s.from).abs();
    let most = unit(x).max(unit(y));
    for scale in [x, y] {
        let (middle, half) = (0.5 * (scale.low + scale.high), 0.5 * most * (scale.to - scale.from).abs());
        (scale.low, scale.high) = (middle - half, middle + half);
    }
}

/// Draws the line of a series, its error bars as far as the plot goes, and its points on top; points without a place are left out.
fn one_series(elements: &mut Vec<Element>, s: &Series, ink: Ink, [x, y]: [&Scale; 2]) {
    let place = |p: &[f64; 2]| (x.shows(p[0]) && y.shows(p[1])).then(|| [x.position(p[0]), y.position(p[1])]);
    let points: Vec<Place> = s.points.iter().filter_map(place).collect();
    if matches!(s.style, SeriesStyle::LineAndPoints | SeriesStyle::Line | SeriesStyle::Dashed) {
        let dashed = s.style == SeriesStyle::Dashed;
        elements.push(Element::Line { points: points.clone(), ink, width: 2.0, opacity: 1.0, dashed });
    }
    for (p, e) in s.points.iter().zip(&s.errors).filter(|(p, _)| place(p).is_some()) {
        let end = |value: f64| [x.position(p[0]), y.position(value.clamp(y.low, y.high))];
        let points = vec![end(p[1] - e), end(p[1] + e)];
        elements.push(Element::Line { points, ink, width: 1.0, opacity: 1.0, dashed: false });
    }
    if matches!(s.style, SeriesStyle::LineAndPoints | SeriesStyle::Points | SeriesStyle::Faint) {
        let opacity = if s.style == SeriesStyle::Faint { 0.3 } else { 1.0 };
        elements.extend(points.iter().map(|&centre| Element::Disc { centre, radius: 4.0, ink, opacity }));
    }
}

/// Distance of lines of text.
const LINE: f64 = 15.0;

/// Breaks a name at spaces into lines that fit `width`; a letter takes about half the size of the type, and a long word a line of its own.
fn wrapped_lines(name: &str, width: f64) -> Vec<String> {
    // Three letters at least: a bar of a pixel still needs lines that end.
    let most = ((width - 4.0) / 6.8).max(3.0) as usize;
    let mut lines: Vec<String> = Vec::new();
    for word in name.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= most => *line += &format!(" {word}"),
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Returns the height, units of the drawing, that names of several lines need below it; 0 but for bars.
fn extra_height(chart: &Chart) -> f64 {
    let Content::Bars { categories, .. } = &chart.content else { return 0.0 };
    let slot = (AREA[2] - AREA[0]) / categories.len().max(1) as f64;
    let lines = categories.iter().map(|c| wrapped_lines(c, slot).len()).max().unwrap_or(1);
    LINE * lines.saturating_sub(1) as f64
}

/// Draws bars, their layers one on the other or side by side.
fn bar_chart(
    elements: &mut Vec<Element>,
    chart: &Chart,
    categories: &[String],
    layers: &[(String, Vec<Option<f64>>)],
    stacked: bool,
) {
    let [left, top, right, bottom] = AREA;
    // What has no value gets a bar of no height, so that the others keep their places and colours.
    let heights =
        |c: usize| layers.iter().map(move |(_, v)| v.get(c).copied().flatten().map_or(0.0, |h| h.max(0.0)));
    let tallest = |c: usize| if stacked { heights(c).sum::<f64>() } else { heights(c).fold(0.0, f64::max) };
    // Parts of a whole add up on a linear axis only; rivals may stand on a logarithmic one.
    let log = chart.y.log && !stacked;
    let axis = AxisStyle { log, ..chart.y.clone() };
    let y = if log {
        Scale::new((0..categories.len()).flat_map(heights), &axis, [bottom, top], false)
    } else {
        Scale::new((0..categories.len()).map(tallest), &axis, [bottom, top], true)
    };
    axes(elements, chart, (None, &y), AREA, extra_height(chart));
    let slot = (right - left) / categories.len().max(1) as f64;
    let width = slot * 0.7 / if stacked { 1.0 } else { layers.len().max(1) as f64 };
    for (c, category) in categories.iter().enumerate() {
        let mut base = 0.0;
        for (k, value) in heights(c).enumerate() {
            let (low, high) = if log {
                (bottom, if value > 0.0 { y.position(value) } else { bottom })
            } else {
                (y.position(base), y.position(base + value))
            };
            let shift = if stacked { 0.0 } else { k as f64 * width };
            let corner = [left + slot * (c as f64 + 0.15) + shift, high];
            let size = [width * 0.96, (low - high).max(0.0)];
            elements.push(Element::Rectangle {
                corner,
                size,
                radius: 0.0,
                ink: Ink::hex(PALETTE[k % PALETTE.len()]),
            });
            base += if stacked { value } else { 0.0 };
        }
        for (k, line) in wrapped_lines(category, slot).into_iter().enumerate() {
            let place = [left + slot * (c as f64 + 0.5), bottom + 19.0 + LINE * k as f64];
            elements.push(tick_label(line, place, Anchor::Middle));
        }
    }
    let names: Vec<(&str, &str)> =
        layers.iter().enumerate().map(|(k, (n, _))| (n.as_str(), PALETTE[k % PALETTE.len()])).collect();
    legend(elements, &names, top);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Axis, Grid};

    #[test]
    fn a_map_of_equal_values_has_a_scale() {
        let axis = |label: &str| Axis { label: label.into(), unit: "mm".into(), range: [0.0, 2.0], cells: 2 };
        for value in [0.0, -3.0, 7.0] {
            let grid = Grid {
                name: "wall".into(),
                quantity: "illuminance".into(),
                unit: "lx".into(),
                axes: [axis("x"), axis("y")],
                values: vec![value; 4],
                error: None,
                geometric: None,
                layers: Vec::new(),
            };
            let svg = draw(&Chart::map("wall", "", "", grid)).svg();
            assert!(!svg.contains("NaN"), "{value}");
        }
    }
}
