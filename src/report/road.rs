//! A headlamp on its road: illuminance seen from above, and as the driver sees it.

use super::Chart;
use crate::formats::{Axis, Grid};

/// Height of the lamp above the road, m: of a passenger car (UN R48 allows lamps from 0.5 to 1.2 m).
const LAMP_HEIGHT_M: f64 = 0.65;
/// Height of the driver's eye above the road, m.
const EYE_HEIGHT_M: f64 = 1.2;

/// What the picture from above shows ahead of the lamp, from and to, m.
const AHEAD_M: [f64; 2] = [5.0, 100.0];
/// How far the picture from above goes to both sides, m.
const ASIDE_M: f64 = 15.0;
/// Side of a cell of the picture from above, m.
const SQUARE_M: f64 = 0.5;

/// How far the driver's picture goes to both sides, degrees.
const VIEW_H_DEG: f64 = 20.0;
/// What the driver's picture shows below and above the horizon, degrees.
const VIEW_V_DEG: [f64; 2] = [-8.0, 1.0];
/// Side of a cell of the driver's picture, degrees.
const VIEW_CELL_DEG: f64 = 0.1;

/// Returns the intensity of the cell in a direction, cd; `None` outside the far field.
fn intensity(grid: &Grid, h_deg: f64, v_deg: f64) -> Option<f64> {
    let place = |axis: &Axis, at: f64| {
        let k = ((at - axis.range[0]) / axis.step()).floor();
        (k >= 0.0 && k < axis.cells as f64).then_some(k as usize)
    };
    let (i, j) = (place(&grid.axes[0], h_deg)?, place(&grid.axes[1], v_deg)?);
    grid.values.get(j * grid.axes[0].cells + i).copied()
}

/// Returns the illuminance of the road, lx, at a place to the right and ahead of the lamp, m: the light falls on a horizontal plane. `aim`
/// is added to H and V, degrees; 0 where the far field does not reach.
fn road_illuminance(grid: &Grid, aim: [f64; 2], aside: f64, ahead: f64) -> f64 {
    let distance = (aside * aside + ahead * ahead + LAMP_HEIGHT_M * LAMP_HEIGHT_M).sqrt();
    let h = aside.atan2(ahead).to_degrees();
    // By the true elevation, which is what V of type A angles means.
    let v = -(LAMP_HEIGHT_M / distance).asin().to_degrees();
    // Outside the far field nothing is known; it is drawn dark.
    let candela = intensity(grid, h + aim[0], v + aim[1]).unwrap_or(0.0);
    // E = I cos/d², with the cosine to the vertical h/d.
    candela * LAMP_HEIGHT_M / distance.powi(3)
}

/// Makes an axis over exactly `range`, divided into the whole number of equal cells whose size is nearest to `step`.
fn axis(label: &str, unit: &str, range: [f64; 2], step: f64) -> Axis {
    Axis { label: label.into(), unit: unit.into(), range, cells: ((range[1] - range[0]) / step).round() as usize }
}

/// Makes a map of lux over the cells of two axes: `value` is sampled at the middle of each.
fn chart(name: &str, title: &str, caption: &str, axes: [Axis; 2], value: impl Fn(f64, f64) -> f64) -> Chart {
    let values = (0..axes[1].cells)
        .flat_map(|j| (0..axes[0].cells).map(move |i| (i, j)))
        .map(|(i, j)| value(axes[0].center(i), axes[1].center(j)))
        .collect();
    let grid = Grid {
        name: name.into(),
        quantity: "illuminance of the road".into(),
        unit: "lx".into(),
        axes,
        values,
        error: None,
        geometric: None,
        layers: Vec::new(),
    };
    Chart::map(name, title, caption, grid)
}

/// Draws the road from above, lx, with isolux lines; `name` begins the names of its files, `aim` is added to H and V, degrees.
pub(super) fn from_above(name: &str, grid: &Grid, aim: [f64; 2]) -> Chart {
    let axes =
        [axis("lateral", "m", [-ASIDE_M, ASIDE_M], SQUARE_M), axis("distance ahead", "m", AHEAD_M, SQUARE_M)];
    let caption = format!(
        "One lamp {LAMP_HEIGHT_M} m above a level road, aimed as measured; illuminance of the road's plane. Where the far field ends the \
         road is drawn dark."
    );
    let value = |aside: f64, ahead: f64| road_illuminance(grid, aim, aside, ahead);
    chart(&format!("{name}-road"), "The road from above: isolux lines", &caption, axes, value)
}

/// Draws the road as the driver sees it, lx, with the eye straight above the lamp; `name` begins the names of its files, `aim` is added to
/// H and V, degrees.
pub(super) fn from_driver(name: &str, grid: &Grid, aim: [f64; 2]) -> Chart {
    let axes =
        [axis("H", "deg", [-VIEW_H_DEG, VIEW_H_DEG], VIEW_CELL_DEG), axis("V", "deg", VIEW_V_DEG, VIEW_CELL_DEG)];
    let caption = format!(
        "Illuminance of a level road where the driver's line of sight meets it, the eye {EYE_HEIGHT_M} m above the road straight above \
         the lamp; the horizon is at 0°."
    );
    let value = |h: f64, v: f64| {
        let drop = (-v).to_radians().tan();
        // At the horizon and above the line of sight meets no road.
        if drop <= 0.0 {
            return 0.0;
        }
        // The line of sight falls by `drop` for each metre on the ground.
        let ground = EYE_HEIGHT_M / drop;
        road_illuminance(grid, aim, ground * h.to_radians().sin(), ground * h.to_radians().cos())
    };
    chart(&format!("{name}-driver"), "The road as the driver sees it", &caption, axes, value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Content;

    /// A lamp of the same intensity everywhere: E = I h / d³.
    #[test]
    fn an_even_lamp_lights_the_road_by_the_cube_of_the_distance() {
        let axes = [axis("H", "deg", [-90.0, 90.0], 1.0), axis("V", "deg", [-45.0, 45.0], 1.0)];
        let values = vec![1000.0; axes[0].cells * axes[1].cells];
        let (name, quantity, unit) = (String::new(), String::new(), "cd".into());
        let grid = Grid { name, quantity, unit, axes, values, error: None, geometric: None, layers: Vec::new() };
        let Content::Map { grid: road, .. } = from_above("a", &grid, [0.0, 0.0]).content else { panic!() };
        let [a, b] = &road.axes;
        for (i, j) in [(0, 0), (30, 50), (59, 189)] {
            let (x, z): (f64, f64) = (a.center(i), b.center(j));
            let expected = 1000.0 * 0.65 / (x * x + z * z + 0.65 * 0.65).powf(1.5);
            assert!((road.values[j * a.cells + i] / expected - 1.0).abs() < 1e-12);
        }
        // The line of sight at 2° down meets the road 34.36 m ahead.
        let Content::Map { grid: view, .. } = from_driver("a", &grid, [0.0, 0.0]).content else { panic!() };
        let [a, b] = &view.axes;
        let j = (0..b.cells).find(|&j| (b.center(j) + 2.05).abs() < 1e-9).unwrap();
        let i = (0..a.cells).find(|&i| (a.center(i) - 0.05).abs() < 1e-9).unwrap();
        let ground = 1.2 / 2.05f64.to_radians().tan();
        let expected = 1000.0 * 0.65 / (ground * ground + 0.65 * 0.65).powf(1.5);
        assert!((view.values[j * a.cells + i] / expected - 1.0).abs() < 1e-9);
        assert_eq!(view.values[(b.cells - 1) * a.cells], 0.0, "nothing above the horizon");
    }
}
