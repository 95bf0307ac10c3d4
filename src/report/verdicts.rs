//! What a regulation says of a far field: row by row, and as a picture of its test points over isocandela lines.

use super::chart::MapPoint;
use super::framing::lit_part;
use super::number::without_rounding;
use super::{Cell, Chart, Section, Table, road};
use crate::formats::{Grid, file_stem};
use crate::regulation::{Assessment, Bound, Reading, Row, RowVerdict, Traffic, Verdict};
use crate::text::{NARROW_SPACE, figures};

/// Significant digits of intensities: more than any photometer has.
const DIGITS: usize = 5;

/// Counts the rows of each verdict: pass, fail, unsure; rows that were not judged are in none.
pub fn verdict_counts(a: &Assessment) -> [usize; 3] {
    [Verdict::Pass, Verdict::Fail, Verdict::Unsure].map(|v| a.rows.iter().filter(|r| r.verdict == Some(v)).count())
}

/// Writes a sentence about the whole.
pub fn verdict_sentence(a: &Assessment) -> String {
    let [pass, fail, unsure] = verdict_counts(a);
    format!("**{}: {}** (rows: {pass} pass, {fail} fail, {unsure} unsure). ", a.regulation.id, a.verdict)
}

/// Writes which way the directions count, for left-hand traffic; empty for the other, for which the tables are written.
pub fn traffic_sentence(a: &Assessment) -> &'static str {
    match a.traffic {
        Traffic::Right => "",
        Traffic::Left => {
            "Left-hand traffic: the lamp is mirrored, and L and R, in the aim too, are those of the tables, written for right-hand traffic. "
        }
    }
}

/// Writes the requirement of a row, cd; in words, or a dash, where it has no limit.
fn requirement_text(row: &RowVerdict) -> String {
    let number = |x: f64| figures(x, DIGITS);
    match (row.row.min, row.row.max) {
        (Some(min), Some(max)) => format!("{} … {}", number(min), number(max)),
        (Some(min), None) => format!("≥{NARROW_SPACE}{}", number(min)),
        (None, Some(max)) => format!("≤{NARROW_SPACE}{}", number(max)),
        (None, None) => {
            let relative = || {
                let sign = if row.row.bound? == Bound::Min { '≥' } else { '≤' };
                Some(format!("{} {sign} 0", multiple_text(&row.row)?))
            };
            row.row.when.clone().or_else(relative).unwrap_or_else(|| "–".to_owned())
        }
    }
}

/// Writes what is taken from the reading of a relative row: `less 0.8 × Imax`; `None` for any other row.
pub(super) fn multiple_text(row: &Row) -> Option<String> {
    let (factor, of) = row.factor.zip(row.of.as_deref())?;
    Some(format!("less {} × {}", figures(factor, DIGITS), if of == "imax" { "Imax" } else { of }))
}

/// Writes a direction, degrees, as the tables do: `3.43L 0.57U`.
fn direction_text([h, v]: [f64; 2]) -> String {
    let side = |x: f64, positive: char, negative: char| match without_rounding(x) {
        x if x > 0.0 => format!("{}{positive}", figures(x, 3)),
        x if x < 0.0 => format!("{}{negative}", figures(-x, 3)),
        _ => "0".to_owned(),
    };
    format!("{} {}", side(h, 'R', 'L'), side(v, 'U', 'D'))
}

/// Writes what would settle an unsure row; nothing for any other.
fn settling_text(row: &RowVerdict) -> String {
    if row.verdict == Some(Verdict::Unsure) && row.unseen > 0 {
        return "a wider far field".into();
    }
    let Some(settles) = row.settles else { return String::new() };
    let rays = format!("{:.1e} rays in all", settles.rays as f64);
    match (settles.tolerance_mm, settles.tolerance_share) {
        (Some(tolerance), _) => format!("{rays}, {} mm", figures(tolerance, 2)),
        (None, Some(share)) => format!("{rays}, facets {} times as fine", figures(1.0 / share, 2)),
        (None, None) => rays,
    }
}

/// Returns what the table or its rules remark on a row that was judged; `None` where they remark nothing, or nothing was judged.
pub fn judged_note(row: &RowVerdict) -> Option<&str> {
    row.row.note.as_deref().filter(|_| row.verdict.is_some())
}

/// Makes a section of each verdict, given with the index of its receiver; left out where `grid_of` returns no far field for that. Further
/// verdicts on one far field are numbered from 2, so that no two sections, tables or charts have one name.
pub(super) fn sections(verdicts: &[(usize, Assessment)], grid_of: impl Fn(usize) -> Option<Grid>) -> Vec<Section> {
    let mut sections = Vec::new();
    for (k, (receiver, assessment)) in verdicts.iter().enumerate() {
        let before = verdicts[..k].iter().filter(|(other, _)| other == receiver).count();
        sections.extend(grid_of(*receiver).map(|grid| section(assessment, &grid, before + 1)));
    }
    sections
}

/// Makes the section of one verdict: text, table, the test points on the map, and the road; `grid` is the far field judged, as placed,
/// and `number` counts the verdicts on it from 1.
fn section(a: &Assessment, grid: &Grid, number: usize) -> Section {
    let aim = a.placed_aim();
    let text = format!(
        "{}{}Aim: {}. Photometer: {} from side to side. {}. An engineer's answer about a simulated lamp, not a statement of conformity.",
        verdict_sentence(a),
        traffic_sentence(a),
        a.aim.how,
        format_args!("{:.3}°", a.sensor_deg),
        a.regulation.checked()
    );
    let stem = file_stem(&grid.name);
    // One far field may be judged by several regulations, or by one in several ways, and several by one.
    let (verdict, name) = match number {
        1 => ("Verdict".to_owned(), stem),
        n => (format!("Verdict {n}"), format!("{stem}-verdict-{n}")),
    };
    let title = format!("{verdict} by {}: {}", a.regulation.id, grid.name);
    Section::new(&title)
        .with_block(text.as_str())
        // Above the table, in a row of its own: names of points need its width.
        .with_block(picture(a, grid, &name))
        .with_block(table(a, &name))
        .with_block(road::from_above(&name, grid, aim))
        .with_block(road::from_driver(&name, grid, aim))
}

/// Makes the cells of a row: its name, verdict and limit, what is read and its errors by rays, facets and cells, where, and what settles
/// it; a dash where nothing was read.
pub fn verdict_cells(row: &RowVerdict) -> [Cell; 9] {
    let reading = |cell: fn(&Reading) -> Cell| row.reading.as_ref().map_or(Cell::Empty, cell);
    [
        row.row.id.as_str().into(),
        row.verdict.map_or("not judged".to_owned(), |v| v.to_string()).into(),
        requirement_text(row).into(),
        reading(|r| Cell::Known(r.value, r.known_error().hypot(r.cells), DIGITS)),
        reading(|r| Cell::Error(r.statistical)),
        reading(|r| r.geometric.map_or(Cell::Empty, Cell::Error)),
        reading(|r| Cell::Error(r.cells)),
        row.direction.map_or(String::new(), direction_text).into(),
        settling_text(row).into(),
    ]
}

/// Makes a table of the rows of an assessment: requirement and reading, both errors, and the verdict. `name` begins the name of its file.
fn table(a: &Assessment, name: &str) -> Table {
    let columns = [
        ("row", ""),
        // Where narrow windows show it.
        ("verdict", ""),
        ("limit", "cd"),
        ("reading", "cd"),
        ("± rays", "cd"),
        ("± facets", "cd"),
        ("± cells", "cd"),
        ("direction", ""),
        ("settled by", ""),
        ("note", ""),
    ];
    let caption = "Pass and fail only where the value is more than three combined standard errors from its limit; H right, V up, degrees \
        of the table after aiming.";
    let mut table = Table::new(&format!("{name}-verdict"), &a.regulation.function.name, &columns).caption(caption);
    for row in &a.rows {
        table.row(verdict_cells(row).into_iter().chain([judged_note(row).unwrap_or("").into()]));
    }
    table
}

/// Draws the test points where they were read, over the far field as placed; those beyond the picture are left out.
fn picture(a: &Assessment, grid: &Grid, name: &str) -> Chart {
    // As placed: the map is the one that the user knows; the points are moved to where they were read.
    let shown = lit_part(grid).unwrap_or_else(|| grid.clone());
    let placed = |direction| a.placed_direction(direction);
    let within =
        |p: &[f64; 2]| shown.axes.iter().zip(p).all(|(axis, x)| (axis.range[0]..=axis.range[1]).contains(x));
    let mut points = Vec::new();
    for row in &a.rows {
        let verdict = row.verdict.map_or("not judged".to_owned(), |v| v.to_string());
        let at = row.direction.map(placed).filter(within);
        points.extend(at.map(|at| MapPoint { name: row.row.id.clone(), note: verdict, at }));
    }
    let outlines = a.rows.iter().filter_map(|r| r.row.polygon.as_ref());
    // Closed: the first corner once more.
    let outlines = outlines.map(|p| p.iter().chain(p.first()).map(|q| placed(*q)).collect::<Vec<_>>());
    let outlines = outlines.filter(|p| p.iter().all(within)).collect();
    let title = format!("{}: test points over isocandela lines", a.regulation.id);
    let caption = "Points and zones lie where the aimed photometer read them.";
    Chart::map(&format!("{name}-points"), &title, caption, shown).with_marks(points, outlines)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Axis;
    use crate::regulation::{Aim, Regulation, RowKind};
    use crate::report::{Block, Content};

    #[test]
    fn an_angle_that_rounding_left_of_nothing_is_nothing() {
        assert_eq!(direction_text([1e-15, -3e-17]), "0 0");
        assert_eq!(direction_text([-2.5, 0.57]), "2.5L 0.57U");
    }

    /// UN R149 requires 0.8 of the brightest at HV: the reading is the excess of HV over that.
    #[test]
    fn a_relative_row_says_what_was_taken_from_its_reading() {
        let regulation = Regulation::find("UN R112 B driving").unwrap();
        let mut rows = regulation.function.rows.into_iter().filter(|r| r.kind == RowKind::Relative);
        let row = rows.next().unwrap();
        let verdict = RowVerdict { row, reading: None, direction: None, verdict: None, settles: None, unseen: 0 };
        assert_eq!(requirement_text(&verdict), "less 0.8 × Imax ≥ 0");
    }

    /// Of a lamp for left-hand traffic, which is judged in a mirror, a point lies on the other side of the far field as placed, and so
    /// does the aim.
    #[test]
    fn points_of_left_hand_traffic_stand_where_they_were_read() {
        let mut regulation = Regulation::find("UN R112 B passing").unwrap();
        let row = regulation.function.rows.drain(..).next().unwrap();
        let direction = Some([3.5, 0.5]);
        let rows = vec![RowVerdict { row, reading: None, direction, verdict: None, settles: None, unseen: 0 }];
        let aim = Aim { h_deg: 0.5, v_deg: 0.25, ..Aim::default() };
        let (traffic, verdict) = (Traffic::Left, Verdict::Pass);
        let a = Assessment { regulation, traffic, aim, sensor_deg: 0.1, rows, verdict };
        let axis = |half: f64| Axis { label: "H".into(), unit: "deg".into(), range: [-half, half], cells: 40 };
        let grid = Grid {
            name: "road".into(),
            quantity: "luminous intensity".into(),
            unit: "cd".into(),
            axes: [axis(10.0), axis(10.0)],
            values: vec![1.0; 1600],
            error: None,
            geometric: None,
            layers: Vec::new(),
        };
        let Content::Map { marks, .. } = picture(&a, &grid, "road").content else { panic!() };
        assert_eq!(marks.points[0].at, [-4.0, 0.75]);
        assert!(
            section(&a, &grid, 1)
                .blocks
                .iter()
                .any(|b| matches!(b, Block::Text(t) if t.contains("Left-hand traffic")))
        );
    }

    #[test]
    fn verdicts_on_one_far_field_have_names_of_their_own() {
        let aim = Aim { how: "as placed".into(), ..Aim::default() };
        let by = |id: &str| {
            let regulation = Regulation::find(id).unwrap();
            let (traffic, verdict) = (Traffic::Right, Verdict::Pass);
            Assessment { regulation, traffic, aim: aim.clone(), sensor_deg: 0.1, rows: Vec::new(), verdict }
        };
        let (low, high) = ("UN R112 B passing", "UN R112 B driving");
        let axis = |label: &str| Axis { label: label.into(), unit: "deg".into(), range: [-1.0, 1.0], cells: 2 };
        let grid_of = |receiver: usize| {
            Some(Grid {
                name: format!("road {receiver}"),
                quantity: "luminous intensity".into(),
                unit: "cd".into(),
                axes: [axis("H"), axis("V")],
                values: vec![1.0; 4],
                error: None,
                geometric: None,
                layers: Vec::new(),
            })
        };
        let all = sections(&[(0, by(low)), (0, by(high)), (0, by(low)), (1, by(low))], grid_of);
        // Neighbouring pictures share a row, but for that of the test points.
        let is_picture = |b: &Block| matches!(b, Block::Chart(_));
        let kinds: Vec<bool> = all[0].blocks.iter().map(is_picture).collect();
        assert_eq!(kinds, [false, true, false, true, true]);
        let mut names: Vec<&str> = all.iter().map(|s| s.title.as_str()).collect();
        for block in all.iter().flat_map(|s| &s.blocks) {
            match block {
                Block::Chart(chart) => names.push(&chart.name),
                Block::Table(table) => names.push(&table.name),
                _ => {}
            }
        }
        // A title, a table and three pictures each.
        assert_eq!(names.len(), 4 * 5);
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), 4 * 5, "{names:?}");
    }
}
