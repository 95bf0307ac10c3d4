//! Pictures in two dimensions as plain data: series, bars and maps with their axes.

use super::contour::{Isoline, isolines, round_levels};
use super::number::unit_in_words;
use crate::formats::{Axis, ColourMap, Grid, Picture};
use crate::text::figures;

/// A picture in two dimensions: interactive in the report, static beside it.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Stem of its files.
    pub name: String,
    /// What it shows.
    pub title: String,
    /// How to read it, one or two sentences.
    pub caption: String,
    /// The horizontal axis.
    pub x: AxisStyle,
    /// The vertical axis.
    pub y: AxisStyle,
    /// Whether a length is the same along both axes.
    pub equal_scales: bool,
    /// What is drawn.
    pub content: Content,
}

/// One axis of a chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AxisStyle {
    /// Quantity along it.
    pub label: String,
    /// Its unit, empty for pure numbers.
    pub unit: String,
    /// Whether it is logarithmic.
    pub log: bool,
}

/// What a chart draws.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Content {
    /// Points and lines.
    Series(Vec<Series>),
    /// Bars: for each category, a height of every named layer.
    Bars {
        /// Names under the bars.
        categories: Vec<String>,
        /// Name of each layer, from the bottom up or the left, and its heights; where there is none, no bar is drawn.
        layers: Vec<(String, Vec<Option<f64>>)>,
        /// Whether layers stand on one another (parts of a whole) or side by side (rivals).
        stacked: bool,
    },
    /// A coloured map.
    Map {
        /// Values and axes.
        grid: Box<Grid>,
        /// Colours.
        map: ColourMap,
        /// Lines and points over it.
        marks: Box<Marks>,
    },
    /// A polar diagram of intensities, drawn over circles and spokes in place of axes.
    Polar {
        /// Curves of intensities to the right and up, with what the pointer shows at each point.
        series: Vec<Series>,
        /// Unit of the intensities.
        unit: String,
    },
    /// A picture over two axes, a pixel a cell.
    Picture {
        /// The axes; the second points up.
        axes: [Axis; 2],
        /// The pixels.
        picture: Picture,
    },
}

/// An overlay of a map, in its coordinates.
#[derive(Clone, Debug, Default)]
pub struct Marks {
    /// Lines of equal value.
    pub lines: Vec<Isoline>,
    /// Named places.
    pub points: Vec<MapPoint>,
    /// Borders of zones.
    pub outlines: Vec<Vec<[f64; 2]>>,
}

/// A named place on a map.
#[derive(Clone, Debug, PartialEq)]
pub struct MapPoint {
    /// What it is called.
    pub name: String,
    /// What the pointer shows beside the name.
    pub note: String,
    /// Where it is.
    pub at: [f64; 2],
}

/// A line or a cloud of points.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Where the points are.
    pub points: Vec<[f64; 2]>,
    /// What the pointer shows at each point; may be empty.
    pub labels: Vec<String>,
    /// Half-lengths of vertical error bars; empty for none.
    pub errors: Vec<f64>,
    /// How it is drawn.
    pub style: SeriesStyle,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SeriesStyle {
    /// Points joined by a line.
    #[default]
    LineAndPoints,
    /// A line alone.
    Line,
    /// A dashed line: theory and references.
    Dashed,
    /// Points alone.
    Points,
    /// Points in the background: dominated combinations.
    Faint,
}

/// Colours of series, apart in print and with colour blindness, readable on white and on black.
pub(super) const PALETTE: [&str; 10] =
    ["#d97706", "#3b82f6", "#10a37f", "#e0529c", "#8b5cf6", "#0ea5b7", "#b45309", "#84a30d", "#64748b", "#dc2626"];

/// Returns the colour of each series; a dashed one has that of the series before it, whose reference it is. Colours repeat after ten.
pub(super) fn colours(series: &[Series]) -> Vec<&'static str> {
    let mut used = 0usize;
    let colour = |s: &Series| {
        // A reference stands beside its series and takes its colour; one that is first has a colour of its own.
        if s.style != SeriesStyle::Dashed || used == 0 {
            used += 1;
        }
        PALETTE[(used - 1) % PALETTE.len()]
    };
    series.iter().map(colour).collect()
}

/// Whether a unit has one length along both axes of a map: degrees against degrees and mm against mm look as they are, unless that makes a
/// thin stripe. A degree of C, which turns about the axis, is no length beside one of γ.
pub(super) fn have_equal_units([a, b]: &[Axis; 2]) -> bool {
    let ratio = (a.range[1] - a.range[0]) / (b.range[1] - b.range[0]);
    a.unit == b.unit && a.label != "C" && (0.3..3.4).contains(&ratio)
}

impl AxisStyle {
    /// Makes a linear axis.
    pub fn linear(label: &str, unit: &str) -> Self {
        Self { label: label.into(), unit: unit.into(), log: false }
    }

    /// Makes a logarithmic axis, on which only positive values have a place.
    pub fn log(label: &str, unit: &str) -> Self {
        Self { label: label.into(), unit: unit.into(), log: true }
    }

    /// Returns label and unit as written at the axis; the label alone for pure numbers.
    pub fn title(&self) -> String {
        if self.unit.is_empty() {
            self.label.clone()
        } else {
            format!("{} ({})", self.label, unit_in_words(&self.unit))
        }
    }
}

impl Chart {
    /// Makes a map of a grid in inferno colours, with lines through its smoothed values at up to seven round levels above 0, which the
    /// caption names. The axes are the grid's; `name` is the stem of its files.
    pub fn map(name: &str, title: &str, caption: &str, grid: Grid) -> Self {
        let axis = |k: usize| AxisStyle::linear(&grid.axes[k].label, &grid.axes[k].unit);
        // From zero up: a map of negative values alone has no lines.
        let levels = round_levels(grid.values.iter().copied().fold(0.0, f64::max));
        let lines = isolines(&grid, &levels);
        // A level that the smoothed values do not reach has no line.
        let drawn = levels.iter().filter(|level| lines.iter().any(|line| line.level == **level));
        let named: Vec<String> = drawn.map(|level| figures(*level, 3)).collect();
        let word = match grid.unit.as_str() {
            "cd" => "Isocandela lines",
            "lx" => "Isolux lines",
            _ => "Lines of equal value",
        };
        let lines_caption = if lines.is_empty() {
            String::new()
        } else {
            format!(" {word} at {} {}, through values averaged with their neighbours.", named.join(", "), grid.unit)
        };
        Self {
            name: name.into(),
            title: title.into(),
            caption: format!("{caption}{lines_caption}"),
            x: axis(0),
            y: axis(1),
            equal_scales: false,
            content: Content::Map {
                grid: Box::new(grid),
                map: ColourMap::Inferno,
                marks: Box::new(Marks { lines, ..Marks::default() }),
            },
        }
    }

    /// Makes a picture in colours over two axes; `name` is the stem of its files.
    pub fn picture(name: &str, title: &str, caption: &str, axes: [Axis; 2], picture: Picture) -> Self {
        let [x, y] = [0, 1].map(|k| AxisStyle::linear(&axes[k].label, &axes[k].unit));
        let content = Content::Picture { axes, picture };
        Self { name: name.into(), title: title.into(), caption: caption.into(), x, y, equal_scales: false, content }
    }

    /// Returns the map with these named places and borders of zones in place of any it had; any other chart as it is.
    pub fn with_marks(mut self, points: Vec<MapPoint>, outlines: Vec<Vec<[f64; 2]>>) -> Self {
        if let Content::Map { marks, .. } = &mut self.content {
            (marks.points, marks.outlines) = (points, outlines);
        }
        self
    }

    /// Returns the chart with the same length for a unit of both axes.
    pub fn with_equal_scales(self) -> Self {
        Self { equal_scales: true, ..self }
    }

    /// Makes a chart of points and lines; `name` is the stem of its files.
    pub fn series(name: &str, title: &str, caption: &str, axes: [AxisStyle; 2], series: Vec<Series>) -> Self {
        let [x, y] = axes;
        let content = Content::Series(series);
        let equal_scales = false;
        Self { name: name.into(), title: title.into(), caption: caption.into(), x, y, equal_scales, content }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Axis;
    use crate::report::drawing::Element;

    /// Bars reach to the ends that they stand for, and on a logarithmic axis down to its end where they reach to nothing.
    #[test]
    fn bars_of_errors_stay_in_the_plot() {
        let linear = AxisStyle::linear("value", "");
        for (y, error) in [(linear.clone(), 30.0), (AxisStyle::log("value", ""), 30.0), (linear, f64::INFINITY)] {
            let series =
                Series { points: vec![[0.0, 10.0], [1.0, 12.0]], errors: vec![error, 1.0], ..Series::default() };
            let chart = Chart::series("bars", "", "", [AxisStyle::linear("x", ""), y.clone()], vec![series]);
            let drawing = super::super::static_chart::draw(&chart);
            for element in &drawing.elements {
                let Element::Line { points, .. } = element else { continue };
                // The axis of x and its numbers stand below 410 of 470.
                assert!(points.iter().all(|p| (0.0..=410.0).contains(&p[1])), "{y:?} ± {error}: {points:?}");
            }
        }
    }

    #[test]
    fn a_map_names_the_levels_that_it_draws() {
        // A square of 1000 on a plain of 100: nothing is below 100, so that the levels from 5 to 50 have no line.
        let axis = || Axis { label: "x".into(), unit: "mm".into(), range: [-1.0, 1.0], cells: 100 };
        let is_inside = |k: usize| (40..60).contains(&(k % 100)) && (40..60).contains(&(k / 100));
        let values = (0..10_000).map(|k| if is_inside(k) { 1000.0 } else { 100.0 }).collect();
        let (name, quantity, unit) = (String::new(), String::new(), "lx".to_owned());
        let grid = Grid {
            name,
            quantity,
            unit,
            axes: [axis(), axis()],
            values,
            error: None,
            geometric: None,
            layers: Vec::new(),
        };
        let caption = Chart::map("map", "", "", grid).caption;
        assert!(caption.contains("Isolux lines at 200, 500 lx,"), "{caption}");
    }

    /// Half a sphere in C and γ, cut to a narrow beam of 120 degrees, has the same ratio of sides as a screen in H and V.
    #[test]
    fn degrees_of_c_planes_are_no_lengths() {
        let axis =
            |label: &str, high: f64| Axis { label: label.into(), unit: "deg".into(), range: [0.0, high], cells: 2 };
        assert!(have_equal_units(&[axis("H", 360.0), axis("V", 120.0)]));
        assert!(!have_equal_units(&[axis("C", 360.0), axis("gamma", 120.0)]));
    }
}
