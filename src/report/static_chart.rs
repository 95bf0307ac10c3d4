//! The static picture of a chart: its scales, axes, lines, bars, legend or map as elements.

use super::chart::{AxisStyle, Chart, Content, Marks, PALETTE, Series, SeriesStyle, colours};
use super::drawing::{Anchor, Drawing, Element, Ink, Place, TYPE_SIZE};
use super::level_labels::level_labels;
use super::number::figures;
use crate::formats::{Axis, ColourMap, Grid, Picture};

/// Width of a chart in the drawing's units.
const WIDTH: f64 = 760.0;
/// Height of a chart in the drawing's units.
const HEIGHT: f64 = 470.0;
/// Plot area: left, top, right, bottom.
const AREA: [f64; 4] = [78.0, 16.0, 740.0, 410.0];

/// A data range mapped to a stretch of the picture.
struct Scale {
    low: f64,
    high: f64,
    log: bool,
    from: f64,
    to: f64,
}

impl Scale {
    /// Makes the scale of an axis from `from` to `to` in the drawing, around these values and, where `zero` is asked, from zero. Values
    /// that have no place on it are left out; without any it goes from 0 to 1, or 1 to 10.
    fn new(values: impl Iterator<Item = f64>, axis: &AxisStyle, [from, to]: [f64; 2], zero: bool) -> Self {
        let usable = values.filter(|v| v.is_finite() && (!axis.log || *v > 0.0));
        let range =
            usable.fold(None, |r: Option<[f64; 2]>, v| Some(r.map_or([v, v], |[lo, hi]| [lo.min(v), hi.max(v)])));
        let [mut low, mut high] = range.unwrap_or(if axis.log { [1.0, 10.0] } else { [0.0, 1.0] });
        // Room beside the outermost points, by a factor where the axis is logarithmic.
        if axis.log {
            (low, high) = (low / 1.3, high * 1.3);
        } else {
            if zero {
                low = low.min(0.0);
            }
            // All values alike leave no range; half of the value on both sides makes one.
            let pad = if high > low { 0.04 * (high - low) } else { 0.5 * high.abs().max(1.0) };
            (low, high) = (if zero && low == 0.0 { 0.0 } else { low - pad }, high + pad);
        }
        Self { low, high, log: axis.log, from, to }
    }

    /// Returns where a value stands in the drawing.
    fn position(&self, value: f64) -> f64 {
        let part = if self.log {
            (value.max(f64::MIN_POSITIVE).ln() - self.low.ln()) / (self.high.ln() - self.low.ln())
        } else {
            (value - self.low) / (self.high - self.low)
        };
        self.from + part * (self.to - self.from)
    }

    /// Whether a value has a place: on a logarithmic scale, positive ones alone.
    fn shows(&self, value: f64) -> bool {
        value.is_finite() && (!self.log || value > 0.0)
    }

    /// Returns the values to be marked: decades, or steps of 1, 2 or 5 times a power of ten, at most twenty.
    fn ticks(&self) -> Vec<f64> {
        if self.log {
            let decades: Vec<f64> = (self.low.log10().ceil() as i32..=self.high.log10().floor() as i32)
                .map(|e| 10f64.powi(e))
                .collect();
            // Fewer than three decades say too little: 1, 2 and 5 of each are marked then.
            if decades.len() >= 3 {
                return decades;
            }
            let fine = (self.low.log10().floor() as i32..=self.high.log10().ceil() as i32)
                .flat_map(|e| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(e)));
            return fine.filter(|t| (self.low..=self.high).contains(t)).collect();
        }
        let rough = (self.high - self.low) / 6.0;
        let power = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= rough).unwrap_or(rough);
        let first = (self.low / step).ceil() as i64;
        // Twenty at most, for rounding may make a step that never ends.
        (first..).map(|k| k as f64 * step).take_while(|t| *t <= self.high).take(20).collect()
    }
}

/// How strongly the lines of the grid stand against the data.
const GRID_OPACITY: f64 = 0.13;
/// How strongly the numbers beside the axes stand against the data.
const NUMBER_OPACITY: f64 = 0.75;

/// Draws the chart: its axes, data, legend or map, as elements of a picture of 760 units by 470 or more.
pub(super) fn draw(chart: &Chart) -> Drawing {
    let size = [WIDTH, HEIGHT + extra_height(chart)];
    let mut drawing = Drawing { title: chart.title.clone(), size, elements: Vec::new() };
    let elements = &mut drawing.elements;
    match &chart.content {
        Content::Series(series) => series_chart(elements, chart, series),
        Content::Bars { categories, layers, stacked } => bar_chart(elements, chart, categories, layers, *stacked),
        Content::Map { grid, map, marks } => {
            let scales = map_chart(elements, chart, grid, *map);
            draw_marks(elements, marks, &grid.unit, scales);
        }
        Content::Picture { axes, picture } => {
            pixels(elements, chart, axes, picture.clone());
        }
    }
    drawing
}

/// Returns a line of the grid.
fn grid_line(from: Place, to: Place) -> Element {
    Element::Line { points: vec![from, to], ink: Ink::Text, width: 1.0, opacity: GRID_OPACITY, dashed: false }
}

/// Returns a number at an axis or a name below a bar.
fn tick_label(text: String, place: Place, anchor: Anchor) -> Element {
    Element::Text { text, place, anchor, opacity: NUMBER_OPACITY, turned: false, ink: Ink::Text }
}

/// Returns a line of text in full strength.
fn label(text: String, place: Place, anchor: Anchor) -> Element {
    Element::Text { text, place, anchor, opacity: 1.0, turned: false, ink: Ink::Text }
}

/// Draws grid lines, marks and titles of both axes, across to `right`; bars have no scale along x.
fn axes(elements: &mut Vec<Element>, chart: &Chart, x: Option<&Scale>, y: &Scale, right: f64) {
    let [left, top, _, bottom] = AREA;
    for t in y.ticks() {
        let at = y.position(t);
        elements.push(grid_line([left, at], [right, at]));
        elements.push(tick_label(figures(t, 3), [left - 7.0, at + 4.0], Anchor::End));
    }
    for (t, at) in x.iter().flat_map(|x| x.ticks().into_iter().map(|t| (t, x.position(t)))) {
        elements.push(grid_line([at, top], [at, bottom]));
        elements.push(tick_label(figures(t, 3), [at, bottom + 19.0], Anchor::Middle));
    }
    let [middle_x, middle_y] = [0.5 * (left + right), 0.5 * (top + bottom)];
    elements.push(label(chart.x.title(), [middle_x, HEIGHT - 16.0 + extra_height(chart)], Anchor::Middle));
    let place = [17.0, middle_y];
    elements.push(Element::Text {
        text: chart.y.title(),
        place,
        anchor: Anchor::Middle,
        opacity: 1.0,
        turned: true,
        ink: Ink::Text,
    });
}

/// Draws the names of series in their colours; nothing for a single one, which the title names.
fn legend(elements: &mut Vec<Element>, names: &[(&str, &str)]) {
    let [_, top, right, _] = AREA;
    // A single series is named by the title.
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
    axes(elements, chart, Some(&x), &y, right);
    let mut names = Vec::new();
    for (s, colour) in series.iter().zip(colours(series)) {
        if s.style != SeriesStyle::Faint && !s.name.is_empty() {
            names.push((s.name.as_str(), colour));
        }
        one_series(elements, s, Ink::hex(colour), [&x, &y]);
    }
    legend(elements, &names);
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
    axes(elements, chart, None, &y, right);
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
    legend(elements, &names);
}

/// Room for the colour bar beside a map.
const BAR_ROOM: f64 = 74.0;

/// Makes a linear scale of exactly this range of values, from `from` to `to` in the drawing.
fn linear_scale([low, high]: [f64; 2], [from, to]: [f64; 2]) -> Scale {
    Scale { low, high, log: false, from, to }
}

/// Draws the cells of a map or a picture over its axes; returns the scales on which they stand.
fn pixels(elements: &mut Vec<Element>, chart: &Chart, [a, b]: &[Axis; 2], picture: Picture) -> [Scale; 2] {
    let [left, top, right, bottom] = AREA;
    let right = right - BAR_ROOM;
    let (x, y) = (linear_scale(a.range, [left, right]), linear_scale(b.range, [bottom, top]));
    elements.push(Element::Pixels { corner: [left, top], size: [right - left, bottom - top], picture });
    axes(elements, chart, Some(&x), &y, right);
    [x, y]
}

/// Draws a map in colours beside their bar; returns the scales on which it stands.
fn map_chart(elements: &mut Vec<Element>, chart: &Chart, grid: &Grid, map: ColourMap) -> [Scale; 2] {
    let [_, top, right, bottom] = AREA;
    let scales = pixels(elements, chart, &grid.axes, Picture::of_grid(grid, map, 1, 1.0));
    let right = right - BAR_ROOM;
    let steps = 64;
    for k in 0..steps {
        let ink = Ink::Colour(map.colour((f64::from(k) + 0.5) / f64::from(steps)));
        let h = (bottom - top) / f64::from(steps);
        let corner = [right + 12.0, bottom - (f64::from(k) + 1.0) * h];
        // A little taller than its step: no seam shows between two.
        elements.push(Element::Rectangle { corner, size: [14.0, h + 0.3], radius: 0.0, ink });
    }
    let bar = linear_scale(grid.colour_range(), [bottom, top]);
    for t in bar.ticks() {
        elements.push(tick_label(figures(t, 3), [right + 30.0, bar.position(t) + 4.0], Anchor::Start));
    }
    elements.push(label(grid.unit.clone(), [right + 30.0, bottom + 19.0], Anchor::Middle));
    scales
}

/// The colour of lines and words on a map: it stands against every colour of it.
const MARK: Ink = Ink::Colour([255, 255, 255]);
/// The colour of the borders of zones: it stands against every colour of a map.
const ZONE: Ink = Ink::Colour([0x5e, 0xea, 0xd4]);

/// Width of a digit, which most fonts have at about half of the height of the type, with room to either side.
const LETTER_WIDTH: f64 = 0.6 * TYPE_SIZE;

/// How strongly the lines of equal value stand against the map.
const LINE_OPACITY: f64 = 0.75;

/// Draws lines of equal value with their levels, borders of zones, and named points.
fn draw_marks(elements: &mut Vec<Element>, marks: &Marks, unit: &str, [x, y]: [Scale; 2]) {
    let place = |p: &[f64; 2]| [x.position(p[0]), y.position(p[1])];
    let word = |text: String, place: Place, ink: Ink, anchor: Anchor| Element::Text {
        text,
        place,
        anchor,
        opacity: 1.0,
        turned: false,
        ink,
    };
    for line in &marks.lines {
        let points: Vec<Place> = line.points.iter().map(place).collect();
        elements.push(Element::Line { points, ink: MARK, width: 1.0, opacity: LINE_OPACITY, dashed: false });
    }
    for outline in &marks.outlines {
        let points: Vec<Place> = outline.iter().map(place).collect();
        elements.push(Element::Line { points, ink: ZONE, width: 1.2, opacity: 1.0, dashed: true });
    }
    for label in level_labels(marks, |at| place(&at), [LETTER_WIDTH, TYPE_SIZE]) {
        elements.push(word(label.text, place(&label.at), MARK, Anchor::Middle));
    }
    for point in &marks.points {
        let at = place(&point.at);
        elements.push(Element::Disc { centre: at, radius: 3.5, ink: ZONE, opacity: 1.0 });
        elements.push(word(point.name.clone(), [at[0] + 6.0, at[1] - 5.0], ZONE, Anchor::Start));
    }
    // A map without lines has no level to name.
    if let Some(line) = marks.lines.first().filter(|_| marks.points.is_empty()) {
        let corner = [AREA[0] + 8.0, AREA[3] - 8.0];
        let text = format!("lines: {unit}, from {}", figures(line.level, 3));
        elements.push(word(text, corner, MARK, Anchor::Start));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
