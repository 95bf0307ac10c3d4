//! The plot area of a static picture: scales, grid lines, numbers and titles of its axes.

use super::chart::{AxisStyle, Chart};
use super::drawing::{Anchor, Element, Ink, Place};
use crate::text::figures;

/// Plot area: left, top, right, bottom.
pub(super) const AREA: [f64; 4] = [78.0, 16.0, 740.0, 410.0];

/// Marks that an axis has, about, where there is room.
const TICKS: f64 = 6.0;
/// Room that a number beside an axis needs along it, units of the drawing: a sign, two digits and a gap.
const TICK_ROOM: f64 = 36.0;

/// A data range mapped to a stretch of the picture.
pub(super) struct Scale {
    pub(super) low: f64,
    pub(super) high: f64,
    log: bool,
    pub(super) from: f64,
    pub(super) to: f64,
}

impl Scale {
    /// Makes the scale of an axis from `from` to `to` in the drawing, around these values and, where `zero` is set, from zero. Values
    /// that have no place on it are left out; without any it goes from 0 to 1, or 1 to 10.
    pub(super) fn new(
        values: impl Iterator<Item = f64>,
        axis: &AxisStyle,
        [from, to]: [f64; 2],
        zero: bool,
    ) -> Self {
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
            let pad = match high.abs() {
                _ if high > low => 0.04 * (high - low),
                0.0 => 0.5,
                value => 0.5 * value,
            };
            (low, high) = (if zero && low == 0.0 { 0.0 } else { low - pad }, high + pad);
        }
        Self { low, high, log: axis.log, from, to }
    }

    /// Returns where a value stands in the drawing.
    pub(super) fn position(&self, value: f64) -> f64 {
        let part = if self.log {
            (value.max(f64::MIN_POSITIVE).ln() - self.low.ln()) / (self.high.ln() - self.low.ln())
        } else {
            (value - self.low) / (self.high - self.low)
        };
        self.from + part * (self.to - self.from)
    }

    /// Whether a value has a place: on a logarithmic scale, positive ones alone.
    pub(super) fn shows(&self, value: f64) -> bool {
        value.is_finite() && (!self.log || value > 0.0)
    }

    /// Returns the values to be marked: decades, or steps of 1, 2 or 5 times a power of ten, at most twenty.
    pub(super) fn ticks(&self) -> Vec<f64> {
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
        let rough = (self.high - self.low) / TICKS.min((self.to - self.from).abs() / TICK_ROOM);
        let power = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= rough).unwrap_or(rough);
        let first = (self.low / step).ceil() as i64;
        // Twenty at most, for rounding may make a step that never ends.
        (first..).map(|k| k as f64 * step).take_while(|t| *t <= self.high).take(20).collect()
    }
}

/// Makes a linear scale of exactly this range of values, from `from` to `to` in the drawing.
pub(super) fn linear_scale([low, high]: [f64; 2], [from, to]: [f64; 2]) -> Scale {
    Scale { low, high, log: false, from, to }
}

/// Opacity of the grid lines.
pub(super) const GRID_OPACITY: f64 = 0.13;
/// Opacity of the numbers beside the axes.
const NUMBER_OPACITY: f64 = 0.75;

/// Returns a line of the grid.
fn grid_line(from: Place, to: Place) -> Element {
    Element::Line { points: vec![from, to], ink: Ink::Text, width: 1.0, opacity: GRID_OPACITY, dashed: false }
}

/// Returns a number at an axis or a name below a bar.
pub(super) fn tick_label(text: String, place: Place, anchor: Anchor) -> Element {
    Element::Text { text, place, anchor, opacity: NUMBER_OPACITY, turned: false, ink: Ink::Text }
}

/// Returns a line of text in full strength.
pub(super) fn label(text: String, place: Place, anchor: Anchor) -> Element {
    Element::Text { text, place, anchor, opacity: 1.0, turned: false, ink: Ink::Text }
}

/// Draws grid lines, marks and titles of both axes of a plot `area`; bars have no scale along x. `names_height` is what
/// the names below them need beside one line.
pub(super) fn axes(
    elements: &mut Vec<Element>,
    chart: &Chart,
    (x, y): (Option<&Scale>, &Scale),
    area: [f64; 4],
    names_height: f64,
) {
    let [left, top, right, bottom] = area;
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
    elements.push(label(chart.x.title(), [middle_x, bottom + 44.0 + names_height], Anchor::Middle));
    let place = [left - 61.0, middle_y];
    elements.push(Element::Text {
        text: chart.y.title(),
        place,
        anchor: Anchor::Middle,
        opacity: 1.0,
        turned: true,
        ink: Ink::Text,
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of two digits with a sign need some 30 units: on 115 there is room for three.
    #[test]
    fn a_short_axis_has_few_numbers() {
        assert_eq!(linear_scale([-15.0, 15.0], [0.0, 115.0]).ticks(), [-10.0, 0.0, 10.0]);
        assert_eq!(linear_scale([-15.0, 15.0], [660.0, 0.0]).ticks().len(), 7);
    }

    /// Values that are all the same stand in the middle, whatever their unit.
    #[test]
    fn one_value_has_room_on_both_sides() {
        for value in [1e-6, -3.0, 0.0, 1e9] {
            let axis = AxisStyle::linear("power", "W");
            let scale = Scale::new([value, value].into_iter(), &axis, [0.0, 100.0], false);
            let half = if value == 0.0 { 0.5 } else { 0.5 * f64::abs(value) };
            for (at, place) in [(value, 50.0), (value + half, 100.0), (value - half, 0.0)] {
                assert!((scale.position(at) - place).abs() < 1e-9, "{value}: {}", scale.position(at));
            }
        }
    }
}
