//! The polar diagram of a luminaire: intensities over γ in two planes C, over circles of equal intensity and spokes of γ, nadir below.

use super::chart::{AxisStyle, Chart, Content, Series, SeriesStyle};
use super::even_poles::is_all_around;
use super::number::with_unit;
use crate::formats::{Grid, file_stem};
use crate::text::figures;

/// Distance in cells from an edge between two within which a plane, or the direction ahead, lies on it.
pub(super) const ON_EDGE: f64 = 1e-9;
/// Circles that a diagram has at most.
const MOST_CIRCLES: f64 = 5.0;
/// Circles up to which each has room for its number beside that of the outermost with its unit.
const FEW_CIRCLES: usize = 3;
/// What a round intensity may be short of the largest, so that rounding asks for no further circle.
const LESS: f64 = 1.0 - 1e-9;
/// Distance of two spokes, degrees.
const SPOKES_DEG: i32 = 30;
/// Distance of two points of a circle, degrees.
const ARC_DEG: i32 = 3;
/// Share of the brightest intensity below which light above the horizon is not worth the upper half of the diagram.
const DARK: f64 = 0.02;
/// Where the numbers stand beside circles and spokes, and how far the picture goes beyond the outermost circle, in radii of that.
const ABOVE_HORIZON: f64 = 0.06;
const BESIDE_SPOKE: f64 = 1.05;
const PICTURE: [f64; 2] = [1.2, 1.12];

/// A number in a diagram.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FrameLabel {
    pub(super) text: String,
    /// Its place: intensities to the right and up.
    pub(super) at: [f64; 2],
    /// Which way it reaches from there: −1 left, 0 both, 1 right.
    pub(super) side: i8,
}

/// The circles and spokes of a diagram, in intensities to the right and up.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PolarFrame {
    /// Intensities of the circles, rising; the last one has all curves in it.
    circles: Vec<f64>,
    /// The largest γ, degrees: 90 where no light worth it goes above the horizon, else 180.
    end_deg: i32,
}

/// Returns the place of an intensity at γ, degrees, negative on the left: to the right and up.
fn place(intensity: f64, gamma_deg: i32) -> [f64; 2] {
    let (sin, cos) = f64::from(gamma_deg).to_radians().sin_cos();
    [intensity * sin, -intensity * cos]
}

impl PolarFrame {
    /// Makes circles at round intensities around these curves.
    pub(super) fn new(series: &[Series]) -> Self {
        let points = || series.iter().flat_map(|s| &s.points);
        let most = points().map(|[x, y]| x.hypot(*y)).fold(f64::MIN_POSITIVE, f64::max);
        let rough = most / MOST_CIRCLES;
        let power = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0].map(|m| m * power).into_iter().find(|step| *step >= LESS * rough);
        let step = step.unwrap_or(10.0 * power);
        let circles = (1..=(LESS * most / step).ceil() as usize).map(|k| k as f64 * step).collect();
        let end_deg = if points().any(|p| p[1] > DARK * most) { 180 } else { 90 };
        Self { circles, end_deg }
    }

    /// Returns the intensity of the outermost circle.
    fn radius(&self) -> f64 {
        self.circles.last().copied().unwrap_or(1.0)
    }

    /// Returns the angles of the spokes, degrees, from left to right.
    fn spokes(&self) -> impl Iterator<Item = i32> {
        let steps = self.end_deg / SPOKES_DEG;
        // That at 180° is one.
        let first = if self.end_deg == 180 { 1 - steps } else { -steps };
        (first..=steps).map(|k| k * SPOKES_DEG)
    }

    /// Returns circles and spokes as lines.
    pub(super) fn lines(&self) -> Vec<Vec<[f64; 2]>> {
        let steps = self.end_deg / ARC_DEG;
        let circle = |&intensity: &f64| -> Vec<[f64; 2]> {
            (-steps..=steps).map(|k| place(intensity, k * ARC_DEG)).collect()
        };
        let spoke = |gamma: i32| vec![[0.0; 2], place(self.radius(), gamma)];
        self.circles.iter().map(circle).chain(self.spokes().map(spoke)).collect()
    }

    /// Returns the numbers of circles, the last with its unit, and of spokes. Of many circles the one before the last has none: the unit
    /// stands there.
    pub(super) fn labels(&self, unit: &str) -> Vec<FrameLabel> {
        let last = self.radius();
        let circle = |&intensity: &f64| {
            let number = figures(intensity, 3);
            let text = if intensity < last { number } else { with_unit(&number, unit) };
            FrameLabel { text, at: [intensity, ABOVE_HORIZON * last], side: -1 }
        };
        let spoke = |gamma: i32| {
            let at = place(BESIDE_SPOKE * last, gamma);
            let side = if gamma % 180 == 0 { 0 } else { gamma.signum() as i8 };
            FrameLabel { text: format!("{}°", gamma.abs()), at, side }
        };
        let count = self.circles.len();
        let bare = if count > FEW_CIRCLES { Some(count - 2) } else { None };
        let numbered = self.circles.iter().enumerate().filter(|(k, _)| Some(*k) != bare);
        numbered.map(|(_, intensity)| circle(intensity)).chain(self.spokes().map(spoke)).collect()
    }

    /// Returns what the picture shows along both axes.
    pub(super) fn ranges(&self) -> [[f64; 2]; 2] {
        let [right, down] = PICTURE.map(|share| share * self.radius());
        let up = if self.end_deg == 180 { down } else { 2.0 * ABOVE_HORIZON * self.radius() };
        [[-right, right], [-down, up]]
    }
}

/// The angles γ, radians, and the intensities in the half-plane of this angle C of a grid that is all around.
fn half_plane(grid: &Grid, angle_deg: f64) -> Vec<(f64, f64)> {
    let [c, gamma] = &grid.axes;
    let column = ((angle_deg - c.range[0]) / c.step()).rem_euclid(c.cells as f64);
    // A plane between two cells takes their mean.
    let edge = column.round();
    let column = if (column - edge).abs() < ON_EDGE { edge } else { column };
    let (after, before) = (column.floor() as usize % c.cells, (column.ceil() as usize + c.cells - 1) % c.cells);
    let value = |j: usize| 0.5 * (grid.values[j * c.cells + after] + grid.values[j * c.cells + before]);
    (0..gamma.cells).map(|j| (gamma.center(j).to_radians(), value(j))).collect()
}

/// Draws the polar diagram of a luminaire: intensities over γ in the planes C 0–180 and C 90–270; `None` for a grid that is not over
/// C-planes all around, and one that is dark in these planes.
pub(super) fn polar(receiver: &str, grid: &Grid) -> Option<Chart> {
    // The diagram needs the whole turn.
    if !is_all_around(grid) {
        return None;
    }
    let plane = |name: &str, right_deg: f64| {
        // The opposite half-plane, drawn to the left.
        let left =
            half_plane(grid, right_deg + 180.0).into_iter().rev().map(|(gamma, i)| (-gamma, i, right_deg + 180.0));
        let right = half_plane(grid, right_deg).into_iter().map(|(gamma, i)| (gamma, i, right_deg));
        let (points, labels) = left
            .chain(right)
            .map(|(gamma, i, c)| {
                let angle = figures(gamma.to_degrees().abs(), 3);
                let label = format!("C {c}°, γ {angle}°: {}", with_unit(&figures(i, 4), &grid.unit));
                ([i * gamma.sin(), -i * gamma.cos()], label)
            })
            .unzip();
        Series { name: name.into(), points, labels, style: SeriesStyle::Line, ..Series::default() }
    };
    let series = vec![plane("C 0–180", 0.0), plane("C 90–270", 90.0)];
    // Circles need light, which may all lie in other planes.
    let is_lit = series.iter().flat_map(|s| &s.points).any(|[x, y]| x.hypot(*y) > 0.0);
    is_lit.then(|| Chart {
        name: format!("{}-polar", file_stem(receiver)),
        title: format!("{receiver}: polar diagram"),
        caption: "The distance of the curve from the centre is the intensity in its direction, by the circles; the spokes are γ, of which \
            0° points down. C 0° and C 90° are on the right."
            .into(),
        x: AxisStyle::default(),
        y: AxisStyle::default(),
        equal_scales: true,
        content: Content::Polar { series, unit: grid.unit.clone() },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Axis;
    use std::f64::consts::PI;

    fn grid(columns: usize, rows: usize, value: impl Fn(usize, f64) -> f64) -> Grid {
        let axis =
            |label: &str, end: f64, cells| Axis {
                label: label.into(), unit: "°".into(), range: [0.0, end], cells
            };
        let axes = [axis("C", 360.0, columns), axis("γ", 180.0, rows)];
        let all = 0..columns * rows;
        let values = all.map(|k| value(k % columns, axes[1].center(k / columns).to_radians())).collect();
        let (name, quantity, unit) = ("l".to_owned(), String::new(), "cd".to_owned());
        Grid { name, quantity, unit, axes, values, error: None, geometric: None, layers: Vec::new() }
    }

    /// 270° over 76 cells is cell 57 and a rounding: between two cells all the same.
    #[test]
    fn planes_between_two_cells_take_their_mean() {
        let grid = grid(76, 1, |c, _| if c == 56 { 2.0 } else { 0.0 });
        assert_eq!(half_plane(&grid, 270.0), [(PI / 2.0, 1.0)]);
        assert_eq!(half_plane(&grid, 268.0), [(PI / 2.0, 2.0)]);
    }

    /// Lambert's law is a circle that hangs from the centre; its brightest cell of 3° has 165 · cos 1.5° = 164.9 cd.
    #[test]
    fn circles_are_round_intensities_and_none_is_negative() {
        let content =
            |value: fn(f64) -> f64| polar("lamp", &grid(120, 60, |_, gamma| value(gamma))).unwrap().content;
        let frame = |value: fn(f64) -> f64| {
            let Content::Polar { series, unit } = content(value) else { panic!("a diagram") };
            assert!(series.iter().flat_map(|s| &s.labels).all(|label| !label.contains('−')), "{series:?}");
            (PolarFrame::new(&series), unit)
        };
        let (half, unit) = frame(|gamma| 165.0 * gamma.cos().max(0.0));
        let names: Vec<String> = half.labels(&unit).into_iter().map(|label| label.text).collect();
        assert_eq!(names[..3], ["50", "100", "200 cd"]);
        assert_eq!(names[3..], ["90°", "60°", "30°", "0°", "30°", "60°", "90°"]);
        assert!(half.lines().iter().flatten().all(|p| p[1] < 1e-9), "the upper half is dark");
        let (whole, unit) = frame(|_| 1.0);
        assert_eq!(whole.labels(&unit).len(), 4 + 12);
        assert!(polar("dark", &grid(120, 60, |_, _| 0.0)).is_none());
        let aside = grid(72, 36, |c, gamma| if c == 9 && (0.7..0.8).contains(&gamma) { 500.0 } else { 0.0 });
        assert!(polar("aside", &aside).is_none(), "all light is in C 47.5°");
    }
}
