//! The static picture of a map: its cells beside their colour bar, with lines, zones and named points over them.

use super::chart::{Chart, Content, Marks, have_equal_units};
use super::drawing::{Anchor, Element, Ink, Place, TYPE_SIZE};
use super::map_labels::{NAME_GAP, POINT_RADIUS, map_labels};
use super::static_axes::{AREA, Scale, axes, label, linear_scale, tick_label};
use crate::formats::{Axis, ColourMap, Grid, Picture};
use crate::text::figures;

/// Room for the colour bar beside a map.
const BAR_ROOM: f64 = 74.0;

/// Returns the part of the plot area that a map fills, in its middle, beside the room for a colour bar: all of it, or as much as gives a
/// unit the same length along both axes.
fn map_area(axes: &[Axis; 2]) -> [f64; 4] {
    let [left, top, right, bottom] = AREA;
    let room = [right - BAR_ROOM - left, bottom - top];
    if !have_equal_units(axes) {
        return [left, top, left + room[0], bottom];
    }
    let spans = axes.each_ref().map(|axis| axis.range[1] - axis.range[0]);
    let unit = (room[0] / spans[0]).min(room[1] / spans[1]);
    let left = left + 0.5 * (room[0] - unit * spans[0]);
    [left, top, left + unit * spans[0], top + unit * spans[1]]
}

/// Returns the height, units of the drawing, that a map needs below the plot area: less than none where it leaves some; 0 for other charts.
pub(super) fn extra_height(chart: &Chart) -> f64 {
    match &chart.content {
        Content::Map { grid, .. } => map_area(&grid.axes)[3] - AREA[3],
        Content::Picture { axes, .. } => map_area(axes)[3] - AREA[3],
        _ => 0.0,
    }
}

/// Draws the cells of a map or a picture over its axes; returns the scales on which they stand.
pub(super) fn pixels(elements: &mut Vec<Element>, chart: &Chart, ab: &[Axis; 2], picture: Picture) -> [Scale; 2] {
    let area = map_area(ab);
    let [left, top, right, bottom] = area;
    let (x, y) = (linear_scale(ab[0].range, [left, right]), linear_scale(ab[1].range, [bottom, top]));
    elements.push(Element::Pixels { corner: [left, top], size: [right - left, bottom - top], picture });
    axes(elements, chart, (Some(&x), &y), area, 0.0);
    [x, y]
}

/// Draws a map in colours beside their bar; returns the scales on which it stands.
pub(super) fn map_chart(elements: &mut Vec<Element>, chart: &Chart, grid: &Grid, map: ColourMap) -> [Scale; 2] {
    let [_, top, right, bottom] = map_area(&grid.axes);
    let scales = pixels(elements, chart, &grid.axes, Picture::of_grid(grid, map, 1, 1.0));
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

/// Where the dark copies of a word lie.
const HALO: [Place; 4] = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]];

/// Width of a digit, which most fonts have at about half of the height of the type, with room to either side.
const LETTER_WIDTH: f64 = 0.6 * TYPE_SIZE;

/// How far below its middle a line of text has its baseline, as a share of the height of the type.
const BASELINE: f64 = 0.35;

/// Opacity of the isolines over the map.
const LINE_OPACITY: f64 = 0.75;

/// Draws lines of equal value with their levels, borders of zones, and named points.
pub(super) fn draw_marks(elements: &mut Vec<Element>, marks: &Marks, unit: &str, [x, y]: [Scale; 2]) {
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
    // Words lie on black and on the brightest light: dark copies around them set them off from both.
    let write = |elements: &mut Vec<Element>, text: String, place: Place, ink: Ink, anchor: Anchor| {
        for [right, down] in HALO {
            let place = [place[0] + right, place[1] + down];
            elements.push(word(text.clone(), place, Ink::Colour([0; 3]), anchor));
        }
        elements.push(word(text, place, ink, anchor));
    };
    let frame = [[x.from, y.from], [x.to, y.to]];
    let labels = map_labels(marks, |at| place(&at), frame, [LETTER_WIDTH, TYPE_SIZE]);
    for label in labels.levels {
        write(elements, label.text, place(&label.at), MARK, Anchor::Middle);
    }
    for (point, side) in marks.points.iter().zip(labels.sides) {
        let at = place(&point.at);
        elements.push(Element::Disc { centre: at, radius: POINT_RADIUS, ink: ZONE, opacity: 1.0 });
        let Some(side) = side else { continue };
        let anchor = [Anchor::End, Anchor::Middle, Anchor::Start][(side[0] + 1) as usize];
        let [right, down] = side.map(f64::from);
        let base = at[1] + down * (NAME_GAP[1] + 0.5 * TYPE_SIZE) + BASELINE * TYPE_SIZE;
        write(elements, point.name.clone(), [at[0] + right * NAME_GAP[0], base], ZONE, anchor);
    }
    // A map without lines has no level to name.
    if let Some(line) = marks.lines.first().filter(|_| marks.points.is_empty()) {
        let corner = [x.from + 8.0, y.from - 8.0];
        let text = format!("lines: {unit}, from {}", figures(line.level, 3));
        // On a narrow map, as of a road, it would lie over the light and beyond; the caption has the levels too.
        if LETTER_WIDTH * text.chars().count() as f64 > 0.5 * (x.to - x.from) {
            return;
        }
        write(elements, text, corner, MARK, Anchor::Start);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Over 4 mm × 2 mm a millimetre is as long along both axes, and a disc is round; over mm and degrees, and in a stripe, the map fills
    /// its place.
    #[test]
    fn a_disc_is_drawn_round() {
        let axis =
            |unit: &str, high: f64| Axis { label: "x".into(), unit: unit.into(), range: [0.0, high], cells: 2 };
        let units = |axes: [Axis; 2]| {
            let [left, top, right, bottom] = map_area(&axes);
            [(right - left) / axes[0].range[1], (bottom - top) / axes[1].range[1]]
        };
        for [a, b] in [[4.0, 2.0], [2.0, 4.0], [3.0, 3.0]] {
            let [x, y] = units([axis("mm", a), axis("mm", b)]);
            assert!((x - y).abs() < 1e-9, "{a} × {b}: {x} {y}");
        }
        for axes in [[axis("mm", 4.0), axis("deg", 2.0)], [axis("mm", 40.0), axis("mm", 2.0)]] {
            let [left, top, right, bottom] = AREA;
            assert_eq!(map_area(&axes), [left, top, right - BAR_ROOM, bottom]);
        }
    }
}
