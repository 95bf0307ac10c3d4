//! Figures of a lamp in the words of the trade: Imax, HV, widths at half, flux and efficiency; where the light of a spot lies.

use super::even_poles::{brightest_direction, direction_text, is_all_around, plane_rings};
use super::half_width::half_width;
use super::maps::peak_error;
use super::peak_lines::{Line, lines_through_peak};
use super::polar::ON_EDGE;
use super::verdicts::multiple_text;
use super::{AxisStyle, Cell, Chart, Series, SeriesStyle, Table};
use crate::formats::Grid;
use crate::math::error_of_mean;
use crate::regulation::Assessment;
use crate::simulate::{ReceiverResult, Results};
use crate::study::figures::ReceiverFigures;
use crate::text::figures;

/// Share of the power at which the curve of encircled power ends, per cent.
const FRAMED_PERCENT: f64 = 99.5;
/// Steps of the cells below which a radius says more of the cells than of the light: with the light in two cells beside each other it is
/// half a step, in three in a row one.
const FEW_CELLS: f64 = 2.0;
/// Radii at which the encircled power is drawn.
const RADII: usize = 200;

/// Returns the width at half along a line and its error, both in degrees.
fn width_along(grid: &Grid, line: &Line) -> [Cell; 2] {
    let places = 0..line.cells.len();
    let values: Vec<f64> = places.clone().map(|k| line.value(grid, k)).collect();
    let errors: Option<Vec<f64>> = places.map(|k| line.error(grid, k)).collect();
    let Some(width) = half_width(&values, errors.as_deref()) else { return [Cell::Empty, Cell::Empty] };
    Cell::with_error(width.cells * line.step, width.error.map(|error| error * line.step), 3)
}

/// What a receiver counted.
#[derive(Clone, Copy)]
pub(super) struct Counted<'a> {
    /// Its results.
    pub receiver: &'a ReceiverResult,
    /// Its figures, with both errors.
    pub figures: &'a ReceiverFigures,
    /// Its cells.
    pub grid: &'a Grid,
}

/// Makes a table of the figures of a far field in candela, with the points of a regulation where it was judged by one.
pub(super) fn lamp_table(counted: &Counted<'_>, results: &Results, assessment: Option<&Assessment>) -> Table {
    let Counted { receiver, figures: of_receiver, grid } = *counted;
    let title = format!("{}: figures of the lamp", receiver.name);
    let name = format!("{}-lamp", crate::formats::file_stem(&receiver.name));
    let mut table = Table::new(
        &name,
        &title,
        &[("", ""), ("value", ""), ("± rays and facets (1σ)", ""), ("unit", ""), ("where", "")],
    );
    let rings = receiver.pole_rings();
    if let Some((place, value)) = brightest_direction(grid, &rings) {
        // Nothing is brightest in the dark.
        let place = if value > 0.0 { place } else { String::new() };
        let [value, error] = Cell::with_error(value, peak_error(grid, &rings, of_receiver.max.as_ref()), 5);
        table.row(["Imax".into(), value, error, "cd".into(), place.into()]);
    }
    let power = &of_receiver.power;
    let seen = receiver.photometric().and_then(|seen| of_receiver.channels.iter().find(|c| c.name == seen.name));
    let lumens = seen.map_or(power, |channel| &channel.figure);
    let [value, error] = Cell::with_error(lumens.value, Some(lumens.combined()), 5);
    table.row(["flux".into(), value, error, "lm".into(), "into the far field".into()]);
    let [share, error] = [power.value, power.combined()].map(|p| 100.0 * p / results.power.emitted);
    let [value, error] = Cell::with_error(share, Some(error), 4);
    let whole = if seen.is_some() { "of the watts that the sources emit" } else { "of what the sources emit" };
    table.row(["efficiency".into(), value, error, "%".into(), whole.into()]);
    for line in lines_through_peak(grid).iter().flatten().filter(|line| line.has_peak) {
        let [width, error] = width_along(grid, line);
        if width == Cell::Empty {
            continue;
        }
        table.row([
            format!("width at half, {}", line.name).into(),
            width,
            error,
            "°".into(),
            "through Imax".into(),
        ]);
    }
    if let Some([value, error]) = value_ahead(grid) {
        // Luminaires know no HV.
        let [name, place] =
            if is_all_around(grid) { ["ahead", "γ 0°"] } else { ["HV", "H 0°, V 0° as placed"] };
        table.row([name.into(), value, error, "cd".into(), place.into()]);
    }
    if let Some(assessment) = assessment {
        add_assessment(&mut table, assessment, |at| direction_text(grid, at));
    }
    table
}

/// Adds the aim and the readings of a regulation to a table of figures; `degrees` writes a direction of the far field as placed.
fn add_assessment(table: &mut Table, assessment: &Assessment, degrees: impl Fn([f64; 2]) -> String) {
    let gradient = assessment.aim.gradient.map_or(Cell::Empty, |g| Cell::Number(g, 3));
    let how = assessment.aim.how.as_str();
    table.row(["cut-off and gradient G".into(), gradient, Cell::Empty, "".into(), how.into()]);
    for row in &assessment.rows {
        let Some(reading) = row.reading else { continue };
        let error = reading.known_error().hypot(reading.cells);
        let [value, error] = Cell::with_error(reading.value, Some(error), 5);
        // Those of the table are before aiming: beside Imax and HV they would be other places.
        let place = row.direction.map_or(String::new(), |at| degrees(assessment.placed_direction(at)));
        // A relative row's reading is a difference of two.
        let name = multiple_text(&row.row).map_or(row.row.id.clone(), |less| format!("{}, {less}", row.row.id));
        table.row([name.into(), value, error, "cd".into(), place.into()]);
    }
}

/// Returns the intensity straight ahead and its error: of the cell there, or the mean of those that meet there; `None` where the grid does
/// not reach there, or not all around a pole that is there.
fn value_ahead(grid: &Grid) -> Option<[Cell; 2]> {
    if grid.axes[0].label == "C" && !is_all_around(grid) {
        return None;
    }
    let cells = |axis: &crate::formats::Axis| -> Vec<usize> {
        // An even number of cells has none in the middle: two or four meet there, to rounding.
        (0..axis.cells).filter(|&k| axis.center(k).abs() <= (0.5 + ON_EDGE) * axis.step()).collect()
    };
    let (columns, rows) = (cells(&grid.axes[0]), cells(&grid.axes[1]));
    let mut meeting: Vec<usize> =
        rows.iter().flat_map(|j| columns.iter().map(move |i| j * grid.axes[0].cells + i)).collect();
    if is_all_around(grid) {
        // All cells about γ 0 meet there; those of a pole are one.
        let distinct = if plane_rings(grid).poles()[0].is_some() { 1 } else { grid.axes[0].cells };
        meeting = (0..distinct).collect();
    }
    let mean = |values: &[f64]| meeting.iter().map(|&k| values[k]).sum::<f64>() / meeting.len() as f64;
    let error = grid.error.as_ref().map(|errors| {
        let rays = error_of_mean(meeting.iter().map(|&k| [grid.values[k], errors[k]]));
        // What facets change they change alike in neighbouring cells.
        rays.hypot(grid.geometric.as_deref().map_or(0.0, mean))
    });
    (!meeting.is_empty()).then(|| Cell::with_error(mean(&grid.values), error, 5))
}

/// Draws the share of the power of a plane or disc within a radius around the mean position of its light; `None` for other receivers, and
/// dark ones.
pub(super) fn encircled_power(receiver: &ReceiverResult, grid: &Grid) -> Option<Chart> {
    let [a, b] = &grid.axes;
    if !matches!(receiver.kind, "plane" | "disc") {
        return None;
    }
    // Cells at the rim of a disc have other areas than those within.
    let lit = (0..grid.values.len()).filter(|&k| grid.values[k] > 0.0);
    let powers: Vec<(usize, f64)> = lit.map(|k| (k, grid.values[k] * receiver.lit_measure(k))).collect();
    let total: f64 = powers.iter().map(|(_, power)| power).sum();
    if total <= 0.0 {
        return None;
    }
    // The mean position of the light, not the place of the plane's middle.
    let centre = receiver.centroid;
    let mut cells: Vec<(f64, f64)> = (powers.into_iter())
        .map(|(k, power)| {
            let (x, y) = (a.center(k % a.cells), b.center(k / a.cells));
            ((x - centre[0]).hypot(y - centre[1]), power / total)
        })
        .collect();
    cells.sort_by(|p, q| p.0.total_cmp(&q.0));
    let mut sum = 0.0;
    let summed: Vec<[f64; 2]> = cells
        .iter()
        .map(|(radius, share)| {
            sum += share;
            [*radius, 100.0 * sum]
        })
        .collect();
    let radius_of = |percent: f64| summed.iter().find(|p| p[1] >= percent).map_or(0.0, |p| p[0]);
    // A few stray rays far away would press the curve of all others against its axis.
    let lit = summed.partition_point(|p| p[1] < FRAMED_PERCENT) + 1;
    let (framed, beyond) = summed.split_at(lit.min(summed.len()));
    let step = f64::max(a.step(), b.step());
    let coarse = if radius_of(95.0) < FEW_CELLS * step {
        " These are few cells: smaller ones, by `cells` or `size` of the receiver, show more."
    } else {
        ""
    };
    let rest = beyond.last().map_or(String::new(), |last| format!(", all within {} mm", figures(last[0], 3)));
    let caption = format!(
        "Around the mean position of the light, cell by cell ({} × {} mm): 50 % within {} mm, 80 % within {} mm, 95 % within {} mm{rest}.{coarse}",
        figures(a.step(), 2),
        figures(b.step(), 2),
        figures(radius_of(50.0), 3),
        figures(radius_of(80.0), 3),
        figures(radius_of(95.0), 3)
    );
    // From nothing at the middle: of light in a few cells the curve would show their distances alone, as if it had a shape.
    let mut points = vec![[0.0; 2]];
    points.extend(framed.iter().step_by(framed.len().div_ceil(RADII)));
    // The last point, so that the curve ends where its caption says.
    points.extend(framed.last());
    let series = vec![Series { points, style: SeriesStyle::Line, ..Series::default() }];
    let name = format!("{}-encircled", crate::formats::file_stem(&receiver.name));
    let title = format!("{}: encircled power", receiver.name);
    let axes = [AxisStyle::linear("radius", "mm"), AxisStyle::linear("power within", "%")];
    Some(Chart::series(&name, &title, &caption, axes, series))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Axis;
    use crate::intersect::octree::{self, Octree};
    use crate::mesh::FacetMesh;
    use crate::model::Model;
    use crate::regulation::{Aim, Reading, Regulation, RowKind, RowVerdict, Traffic, Verdict};
    use crate::report::chart::Content;
    use crate::report::even_poles::with_even_poles;
    use crate::simulate::{RunSettings, Scene, simulate};
    use std::f64::consts::PI;
    use std::path::Path;

    /// Of 16 cells around an evenly lit disc of radius R the middle four make the square of the side R, 1/π of the disc; the eight others
    /// share the rest, so that they are larger.
    #[test]
    fn encircled_power_counts_cells_by_their_area() {
        let text = "[run]\nrays = 400_000\n[[source]]\nkind = 'collimated'\nat = [0, 0, 5]\ndirection = [0, 0, -1]\nradius = 3\n\
            [[receiver]]\nname = 'eye'\nkind = 'disc'\nradius = 2\ncells = [4, 4]\n";
        let scene = Scene::parse(text, "disc.toml", Path::new(".")).unwrap();
        let bound = scene.bind(&Model::default()).unwrap();
        let mesh = FacetMesh::default();
        let nothing = Octree::build(&mesh, &octree::Settings::default());
        let results = simulate(&bound, &nothing, &RunSettings::from(&scene.run), &|_| true);
        let receiver = &results.receivers[0];
        let grid = super::super::receiver_grid(receiver).unwrap();
        let chart = encircled_power(receiver, &grid).unwrap();
        // Half of the light lies nearer than a cell is long, as coarse as these few are.
        assert!(chart.caption.contains("few cells"), "{}", chart.caption);
        let Content::Series(series) = chart.content else { panic!("a curve") };
        assert_eq!(series[0].points[0], [0.0; 2]);
        let within: Vec<f64> = series[0].points.iter().filter(|p| p[0] < 1.0).map(|p| p[1]).collect();
        // Of 178,000 rays on the disc a third falls there: 0.11 % if they came by chance, and they are spread more evenly.
        let share = within.iter().copied().fold(0.0, f64::max);
        assert!((share - 100.0 / PI).abs() < 0.4, "{share} {within:?}");
    }

    /// Planes C that do not go all around have no pole where they meet, and what lies at C 0°, γ 0° in them is not straight ahead alone.
    #[test]
    fn a_part_of_the_planes_c_has_no_value_ahead() {
        let grid = |label: &str, last: f64| {
            let axis = |label: &str, range| Axis { label: label.into(), unit: "deg".into(), range, cells: 4 };
            Grid {
                name: "far".into(),
                quantity: "luminous intensity".into(),
                unit: "cd".into(),
                axes: [axis(label, [0.0, last]), axis("gamma", [0.0, 90.0])],
                values: vec![1.0; 16],
                error: None,
                geometric: None,
                layers: Vec::new(),
            }
        };
        assert!(value_ahead(&grid("C", 90.0)).is_none());
        assert!(value_ahead(&grid("C", 360.0)).is_some() && value_ahead(&grid("H", 90.0)).is_some());
        // Of cells too tall for one direction the mean of all that meet ahead.
        let mut tall = grid("C", 360.0);
        tall.values[2] = 9.0;
        let Some([Cell::Number(ahead, _), _]) = value_ahead(&tall) else { panic!("a value ahead") };
        assert_eq!(ahead, 3.0);
    }

    /// For left-hand traffic the tables are read in a mirror, and here the lamp was aimed 0.5° aside and 0.25° up.
    #[test]
    fn readings_of_a_regulation_stand_where_the_far_field_has_them() {
        let mut regulation = Regulation::find("UN R112 B driving").unwrap();
        let row = regulation.function.rows.drain(..).find(|r| r.kind == RowKind::Relative).unwrap();
        let reading = Some(Reading { value: 120.0, statistical: 3.0, geometric: None, cells: 4.0 });
        let rows = vec![RowVerdict {
            row,
            reading,
            direction: Some([3.5, -0.25]),
            verdict: None,
            settles: None,
            unseen: 0,
        }];
        let aim = Aim { h_deg: 0.5, v_deg: 0.25, ..Aim::default() };
        let (traffic, verdict) = (Traffic::Left, Verdict::Pass);
        let assessment = Assessment { regulation, traffic, aim, sensor_deg: 0.1, rows, verdict };
        let mut table = Table::new(
            "lamp",
            "",
            &[("", ""), ("value", ""), ("± rays and facets (1σ)", ""), ("unit", ""), ("where", "")],
        );
        add_assessment(&mut table, &assessment, |[h, v]| format!("{h} {v}"));
        let [_, row] = &table.rows[..] else { panic!() };
        assert_eq!(row[0].shown(), "HV inside the 80 % isocandela, less 0.8 × Imax");
        assert_eq!((row[2].shown(), row[4].shown()), ("5".into(), "-4 0".into()));
    }

    /// A grid over C and γ of 3° cells.
    fn luminaire(value: impl Fn(usize, f64) -> f64) -> Grid {
        let axis = |label: &str, end: f64, cells| crate::formats::Axis {
            label: label.into(),
            unit: "°".into(),
            range: [0.0, end],
            cells,
        };
        let axes = [axis("C", 360.0, 120), axis("γ", 180.0, 60)];
        let values: Vec<f64> = (0..7200).map(|k| value(k % 120, axes[1].center(k / 120).to_radians())).collect();
        let (name, quantity, unit) = ("l".to_owned(), String::new(), "cd".to_owned());
        // Only the cells at the pole are uncertain, by a tenth.
        let error = Some((0..7200).map(|k| if k < 120 { 0.1 * values[k] } else { 0.0 }).collect());
        Grid { name, quantity, unit, axes, values, error, geometric: None, layers: Vec::new() }
    }

    #[test]
    fn figures_of_a_luminaire_are_not_those_of_one_sliver_at_its_pole() {
        // Lambert's law, of which every other cell at the pole got twice its light and its neighbour none.
        let grid = luminaire(|i, gamma| {
            let noise = if gamma < 0.03 { 2.0 * (i % 2) as f64 } else { 1.0 };
            noise * 100.0 * gamma.cos().max(0.0)
        });
        let rings = plane_rings(&grid);
        let even = with_even_poles(&grid, &rings);
        let at_pole = 100.0 * 1.5f64.to_radians().cos();
        assert!((even.peak().unwrap().1 / at_pole - 1.0).abs() < 1e-12);
        let Some([Cell::Known(ahead, ..), Cell::Error(ahead_error)]) = value_ahead(&even) else { panic!("HV") };
        assert!((ahead / at_pole - 1.0).abs() < 1e-12);
        // 60 cells of ±10 % of twice the value, and 60 without light: √60 · 0.2 / 120 of it.
        let error = peak_error(&even, &rings, None).unwrap();
        for error in [error, ahead_error] {
            assert!((error / at_pole - 0.2 * 60f64.sqrt() / 120.0).abs() < 1e-12, "{error}");
        }
        for line in lines_through_peak(&even).unwrap() {
            let [Cell::Known(width, ..), Cell::Error(error)] = width_along(&even, &line) else { panic!("a width") };
            assert!(
                (width - 120.0).abs() < 0.1 && line.name.starts_with("in the plane C"),
                "{}: {width}",
                line.name
            );
            // Beside the pole nothing is uncertain, at it the mean by 1.3 %: I = cos γ is half of that much more at γ 60° ∓ 0.43°, and
            // both ends move.
            let known = (0.2 * 60f64.sqrt() / 120.0 / 3f64.sqrt()).to_degrees() * 2.0;
            assert!((error / known - 1.0).abs() < 0.05, "{error} {known}");
        }
    }

    #[test]
    fn the_peak_in_the_last_row_of_a_part_of_the_angles_keeps_its_error() {
        let mut grid = luminaire(|i, gamma| if i == 5 { 1.0 + gamma } else { 1.0 });
        grid.axes[1].range[1] = 60.0;
        let own = 0.3;
        grid.error =
            Some(grid.values.iter().map(|v| if *v == grid.values[59 * 120 + 5] { own } else { 0.0 }).collect());
        let rings = plane_rings(&grid);
        let even = with_even_poles(&grid, &rings);
        assert_eq!(even.peak_cell(), Some((5, 59)));
        let error = peak_error(&even, &rings, None).unwrap();
        assert!((error - own).abs() < 1e-12, "{error}");
    }
}
