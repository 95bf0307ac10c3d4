//! A lamp measured by a regulation: aimed, read row by row, realigned where the regulation allows it.

use super::aim::Aim;
use super::assessment::{Assessment, Assumptions};
use super::error::{Error, ErrorKind};
use super::judgement::Verdict;
use super::map::IntensityMap;
use super::open_aims::judge_by_open_aims;
use super::opening::Sensor;
use super::photometer::Photometer;
use super::row::{Row, RowKind};
use super::row_verdict::judge_row;
use super::table::{Realignment, Regulation, Rules, Traffic};

/// Step in which turns of a lamp are tried, degrees.
const REALIGN_STEP_DEG: f64 = 0.125;

/// The rounding of edges whose centres were written to 6 decimals of a degree and read again, as a share of a cell of 0.1°.
const ROUNDED_EDGES: f64 = 1e-5;

/// What rounding may take of an angle that is a whole number of steps, in steps.
const ROUNDED_STEPS: f64 = 1e-9;

impl Regulation {
    /// Returns the opening that a far field of such cells, degrees, is measured with: that of the regulation, as wide as the cells need and
    /// the text allows.
    ///
    /// # Errors
    /// When the cells are coarser than that; the message says how fine they must be.
    fn sensor_for(&self, coarsest_deg: f64) -> Result<Sensor, Error> {
        let Rules { sensor_half_deg, sensor_widest_half_deg, sensor_round, .. } = self.rules;
        let half_deg = sensor_widest_half_deg
            .map_or(sensor_half_deg, |widest| sensor_half_deg.max(0.5 * coarsest_deg).min(widest));
        // A photometer finer than the cells would read a precision that is not there.
        if coarsest_deg > 2.0 * half_deg * (1.0 + ROUNDED_EDGES) {
            let message = format!(
                "the cells of the far field are {coarsest_deg:.4}° wide, the photometer of {} {:.4}°; trace with cells of at most that",
                self.id,
                2.0 * half_deg
            );
            return Err(Error::new(ErrorKind::CoarseCells, message));
        }
        Ok(Sensor { half_deg, round: sensor_round })
    }

    /// Returns the width, degrees, of the coarsest cells that a far field may be judged by: that of the widest photometer of the text.
    pub fn coarsest_cells_deg(&self) -> f64 {
        2.0 * self.rules.sensor_widest_half_deg.unwrap_or(self.rules.sensor_half_deg)
    }

    /// Checks that a far field of such cells, degrees, can be judged.
    ///
    /// # Errors
    /// When the cells are coarser than the regulation's photometer; the message says how fine they must be.
    pub fn check_cells(&self, coarsest_deg: f64) -> Result<(), Error> {
        self.sensor_for(coarsest_deg).map(|_| ())
    }
}

/// Measures a far field by a regulation: aims it, judges every row, and where one fails looks for a realignment that the regulation allows
/// and with which none surely does.
///
/// # Errors
/// When the cells of the map are coarser than the regulation's photometer; the message says how fine they must be.
pub fn assess(map: &IntensityMap, regulation: &Regulation, assumptions: &Assumptions) -> Result<Assessment, Error> {
    let rules = &regulation.rules;
    // The tables are written for right-hand traffic: the lamp is mirrored, not the tables.
    let mirrored = (assumptions.traffic == Traffic::Left).then(|| map.mirrored());
    let map = mirrored.as_ref().unwrap_or(map);
    let sensor = regulation.sensor_for(map.coarsest_deg())?;
    let cut_off = regulation.function.cut_off;
    let aim = match (cut_off, assumptions.as_placed) {
        (Some(rule), false) => Aim::by_cut_off(map, rule),
        (_, true) => Aim::unchanged("as placed, as asked"),
        (None, _) => Aim::unchanged(&format!(
            "as placed: the tables hold no rule for aiming {}, place the lamp as its text says",
            regulation.id
        )),
    };
    let photometer = Photometer { map, aim: &aim, turns: 1, sensor, tolerance_deg: rules.tolerance_deg };
    let first = assess_aimed(&photometer, regulation, assumptions);
    // Realigning is for beams with a cut-off, and for those that fail by more than doubt.
    let limits = cut_off.map(|rule| rule.realignment);
    match limits.filter(|_| first.verdict == Verdict::Fail && !assumptions.as_placed) {
        Some(limits) => Ok(realign(&photometer, regulation, assumptions, &first, limits).unwrap_or(first)),
        None => Ok(first),
    }
}

/// The assessment with another aim, the nearest to that of `first` within the `limits` of the regulation, with which no row fails for
/// sure; `None` where there is none. It is looked for among many, so that its rows pass at the confidence of as many looks.
fn realign(
    photometer: &Photometer,
    regulation: &Regulation,
    assumptions: &Assumptions,
    first: &Assessment,
    limits: Realignment,
) -> Option<Assessment> {
    // No farther than is allowed.
    let steps = |degrees: f64| (degrees / REALIGN_STEP_DEG + ROUNDED_STEPS).floor() as i32;
    let Realignment { left_deg, right_deg, vertical_deg } = limits;
    let vertical = steps(vertical_deg);
    // To read the map farther right is to turn the lamp to the left.
    let mut turns: Vec<(i32, i32)> = (-steps(right_deg)..=steps(left_deg))
        .flat_map(|h| (-vertical..=vertical).map(move |v| (h, v)))
        .filter(|t| *t != (0, 0))
        .collect();
    // The least turn first: what mends by little is nearer to the lamp as aimed.
    turns.sort_by_key(|(h, v)| h * h + v * v);
    // Failed rows are checked first: most turns do not mend them.
    let mut failed: Vec<&Row> =
        first.rows.iter().filter(|r| r.verdict == Some(Verdict::Fail)).map(|r| &r.row).collect();
    // Points and sums take least time.
    failed.sort_by_key(|row| row.is_extended());
    let count = turns.len();
    turns.into_iter().find_map(|(h, v)| {
        let aim = first.aim.realigned(REALIGN_STEP_DEG * f64::from(h), REALIGN_STEP_DEG * f64::from(v));
        let photometer = Photometer { aim: &aim, turns: count, ..*photometer };
        let mended =
            |row: &&Row| judge_row(&photometer, regulation, assumptions, row).verdict != Some(Verdict::Fail);
        // Then all of them, because a turn that mends one row may break another.
        if !failed.iter().all(mended) {
            return None;
        }
        let again = assess_aimed(&photometer, regulation, assumptions);
        (again.verdict != Verdict::Fail).then_some(again)
    })
}

/// Judges every row for the map as it is aimed, without realigning; the map is mirrored already for left-hand traffic.
fn assess_aimed(photometer: &Photometer, regulation: &Regulation, assumptions: &Assumptions) -> Assessment {
    let rows = judge_by_open_aims(photometer, regulation, assumptions);
    // A group of points counts through its points.
    let has_alternative = regulation.function.has_group_alternative();
    let counted = rows.iter().filter(|r| !(has_alternative && r.row.kind == RowKind::GroupSum));
    let verdict = Verdict::worst(counted.filter_map(|r| r.verdict));
    Assessment {
        regulation: regulation.clone(),
        traffic: assumptions.traffic,
        sensor_deg: 2.0 * photometer.sensor.half_deg,
        aim: photometer.aim.clone(),
        rows,
        verdict,
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_lamps::{edges, map, normal, passing, uniform};
    use super::*;
    use crate::regulation::assessment::RowVerdict;

    fn row(assessment: &Assessment, id: &str) -> RowVerdict {
        assessment.rows.iter().find(|r| r.row.id == id).unwrap().clone()
    }

    #[test]
    fn the_cut_off_goes_to_its_line_wherever_the_lamp_looks() {
        let regulation = Regulation::find("UN R112 B passing").unwrap();
        let home = assess(&map(passing(0.0, 0.0), 1e-3, 0.0), &regulation, &Assumptions::default()).unwrap();
        for (h, v) in [(0.0, 0.5), (0.8, -0.4), (-1.1, 0.3)] {
            let moved = assess(&map(passing(h, v), 1e-3, 0.0), &regulation, &Assumptions::default()).unwrap();
            let turned = [moved.aim.h_deg - home.aim.h_deg, moved.aim.v_deg - home.aim.v_deg];
            assert!((turned[0] - h).abs() < 0.06 && (turned[1] - v).abs() < 0.03, "{turned:?}: {}", moved.aim.how);
        }
        // Without an edge there is nothing to aim by, and the answer says so.
        let flat = assess(&map(|_, _| 1000.0, 1e-3, 0.0), &regulation, &Assumptions::default()).unwrap();
        assert!(flat.aim.how.contains("no cut-off"), "{}", flat.aim.how);
    }

    /// UN R112: G = lg E(b) − lg E(b + 0.1°) is largest where the cut-off is, on the scan at 2.5° left, whose place goes to 0.57° down; so
    /// 0.2° down from right to left for the elbow, which goes to 0.5° right. Light below 1 % of the scan's brightest is darkness.
    #[test]
    fn the_aim_is_where_the_beam_itself_is_steepest() {
        let beam = passing(0.3, -0.2);
        let steepest = |light: &dyn Fn(f64) -> f64, range: f64, sign: f64| {
            let places = || (0..20_000).map(|k| range * (f64::from(k) / 10_000.0 - 1.0));
            let dark = 0.01 * places().map(light).fold(0.0, f64::max);
            let fall = |a: f64| ((light(a - sign * 0.05) + dark) / (light(a + sign * 0.05) + dark)).log10();
            places().max_by(|a, b| fall(*a).total_cmp(&fall(*b))).unwrap()
        };
        let rule = Regulation::find("UN R112 B passing").unwrap().function.cut_off.unwrap();
        let aim = Aim::by_cut_off(&map(&beam, 1e-3, 0.0), rule);
        let v_deg = steepest(&|v| beam(-2.5, v), 3.0, 1.0) + 0.57;
        let h_deg = steepest(&|h| beam(h, v_deg - 0.2), 5.0, -1.0) - 0.5;
        // Within the photometer's half opening, which blurs the edge, and that over the slope of the elbow's shoulder.
        let [off_h, off_v] = [aim.h_deg - h_deg, aim.v_deg - v_deg];
        assert!(off_v.abs() < 0.0745 && off_h.abs() < 0.0745 / 15f64.to_radians().tan(), "{off_h} {off_v} {aim:?}");
    }

    #[test]
    fn left_hand_traffic_is_the_mirror() {
        let regulation = Regulation::find("UN R112 B passing").unwrap();
        let right = assess(&map(passing(0.2, 0.1), 1e-3, 0.0), &regulation, &Assumptions::default()).unwrap();
        let beam = passing(0.2, 0.1);
        let mirrored = map(|h, v| beam(-h, v), 1e-3, 0.0);
        let left = Assumptions { traffic: Traffic::Left, ..Assumptions::default() };
        let left = assess(&mirrored, &regulation, &left).unwrap();
        for (a, b) in right.rows.iter().zip(&left.rows) {
            assert_eq!(a.verdict, b.verdict, "{}", a.row.id);
            if let (Some(a), Some(b)) = (a.reading, b.reading) {
                assert!((a.value - b.value).abs() <= 1e-9 * a.value.abs().max(1.0));
            }
        }
        // Where a point is said to lie in the far field as placed, its value is.
        let sensor = Sensor { half_deg: 0.5 * left.sensor_deg, round: regulation.rules.sensor_round };
        let points = left.rows.iter().filter(|r| r.row.kind == RowKind::Point);
        let read: Vec<_> = points.filter_map(|r| Some((r.reading?, r.direction?))).collect();
        assert!(read.len() > 3 && left.aim.h_deg.abs() > 0.1);
        for (reading, direction) in read {
            let [h, v] = left.placed_direction(direction);
            let there = mirrored.read(&mirrored.measure(sensor, h, v).unwrap()).value;
            assert!((there / reading.value - 1.0).abs() < 1e-6, "{there} at {h} {v}, {reading:?}");
        }
        assert_eq!(left.placed_aim(), [-left.aim.h_deg, left.aim.v_deg]);
    }

    #[test]
    fn a_lamp_is_realigned_to_either_side_as_far_as_its_regulation_allows() {
        // Too bright in H = 0 unless the lamp turns by 0.75° to a side: its edge of light lies 0.6° from there.
        let realigned_h_deg = |id: &str, to_the_right: bool| {
            let mut regulation = Regulation::find(id).unwrap();
            regulation.function.rows.retain(|r| r.kind == RowKind::Point);
            regulation.function.rows.truncate(1);
            let point = &mut regulation.function.rows[0];
            (point.h, point.v, point.min, point.max, point.when) = (Some(0.0), Some(0.0), None, Some(100.0), None);
            let side = if to_the_right { 1.0 } else { -1.0 };
            let lamp = map(|h, _| if side * h > -0.6 { 1000.0 } else { 1.0 }, 1e-3, 0.0);
            let assessment = assess(&lamp, &regulation, &Assumptions::default()).unwrap();
            (assessment.verdict == Verdict::Pass).then_some(assessment.aim.h_deg)
        };
        // A lamp turned right is read farther left. UN R112 and R149 00: 0.5° left, 0.75° right; R149 01: 0.75° both.
        assert_eq!(realigned_h_deg("UN R112 B passing", true), Some(-0.75));
        assert_eq!(realigned_h_deg("UN R112 B passing", false), None);
        assert_eq!(realigned_h_deg("UN R149-01 C passing", true), Some(-0.75));
        assert_eq!(realigned_h_deg("UN R149-01 C passing", false), Some(0.75));
    }

    #[test]
    fn both_errors_make_a_row_unsure_and_say_what_settles_it() {
        let regulation = Regulation::find("UN R112 B driving").unwrap();
        // HV of a driving beam must be at least 40,500 cd; 41,000 cd are 1.2 % above.
        let beam = |h: f64, v: f64| 41_000.0 * (-(h / 8.0).powi(2) - (v / 4.0).powi(2)).exp();
        let known = Assumptions { rays: 1_000_000, tolerance_mm: Some(0.1), ..Assumptions::default() };
        let verdict = |statistical: f64, geometric: f64| {
            row(&assess(&map(beam, statistical, geometric), &regulation, &known).unwrap(), "IM")
        };
        assert_eq!(verdict(1e-4, 0.0).verdict, Some(Verdict::Pass));
        let unsure = verdict(0.05, 0.0);
        assert_eq!(unsure.verdict, Some(Verdict::Unsure));
        let settles = unsure.settles.unwrap();
        assert!(settles.rays > 1_000_000 && settles.tolerance_mm.is_none(), "{settles:?}");
        let coarse = verdict(1e-4, 0.05);
        assert_eq!(coarse.verdict, Some(Verdict::Unsure));
        assert!(coarse.settles.unwrap().tolerance_mm.unwrap() < 0.1);
        let dim = map(|h, v| 0.5 * beam(h, v), 1e-3, 1e-3);
        assert_eq!(row(&assess(&dim, &regulation, &known).unwrap(), "IM").verdict, Some(Verdict::Fail));
    }

    #[test]
    fn what_the_far_field_does_not_hold_is_unsure() {
        let regulation = Regulation::find("UN R112 B passing").unwrap();
        let (h, v) = (edges(3.0, 0.1), edges(3.0, 0.1));
        let small = IntensityMap::new(h, v, vec![[1e4, 1.0, 0.0]; 3600]).unwrap();
        let assessment = assess(&small, &regulation, &Assumptions::default()).unwrap();
        let outside = row(&assessment, "25L");
        assert_eq!((outside.verdict, outside.reading.is_some()), (Some(Verdict::Unsure), false));
        assert_eq!((outside.unseen, row(&assessment, "75R").unseen), (1, 0));
        let coarse = IntensityMap::new(edges(10.0, 0.5), edges(10.0, 0.5), vec![[1.0, 0.0, 0.0]; 1600]).unwrap();
        let error = assess(&coarse, &regulation, &Assumptions::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::CoarseCells);
        let message = error.to_string();
        assert!(message.contains("0.5000°") && message.contains("0.1490°"), "{message}");
    }

    #[test]
    fn a_row_that_does_not_say_where_is_not_met() {
        let regulation = Regulation::find("UN R112 B passing").unwrap();
        let bright = map(|_, _| 1e6, 1e-3, 0.0);
        let aim = Aim::unchanged("test");
        let sensor = Sensor { half_deg: 0.0745, round: false };
        let photometer = Photometer { map: &bright, aim: &aim, turns: 1, sensor, tolerance_deg: 0.0 };
        let table = row(&assess(&bright, &regulation, &Assumptions::default()).unwrap(), "75R").row;
        for kind in [RowKind::Point, RowKind::Line, RowKind::Zone] {
            let nowhere = Row { kind, h: None, v: None, min: Some(1.0), max: None, ..table.clone() };
            let judged = judge_row(&photometer, &regulation, &Assumptions::default(), &nowhere);
            assert_eq!(judged.verdict, Some(Verdict::Unsure), "{kind:?}");
        }
    }

    /// A tail lamp's group may stand for the least value of a point (2 cd at H-V), never for its greatest (18 cd).
    #[test]
    fn a_group_saves_a_minimum_and_no_maximum() {
        let regulation = Regulation::find("FMVSS 108 tail-1").unwrap();
        let assessed = |intensity: &dyn Fn(f64, f64) -> f64| {
            let (h, v) = (edges(22.0, 0.1), edges(12.0, 0.1));
            let middle = |e: &[f64], k: usize| 0.5 * (e[k] + e[k + 1]);
            let cells = (0..240 * 440).map(|k| intensity(middle(&h, k % 440), middle(&v, k / 440)));
            let cells = cells.map(|i| [i, 1e-3 * i, 0.0]).collect();
            let lamp = IntensityMap::new(h.clone(), v.clone(), cells).unwrap();
            assess(&lamp, &regulation, &Assumptions::default()).unwrap()
        };
        let verdicts = |assessment: Assessment| (row(&assessment, "H-V").verdict.unwrap(), assessment.verdict);
        // What passes below its own minimum says why.
        let saved = assessed(&|h, v| if h.hypot(v) < 2.0 { 1.0 } else { 5.0 });
        assert!(row(&saved, "H-V").row.note.as_ref().unwrap().contains("sum of its group"));
        assert_eq!(verdicts(saved), (Verdict::Pass, Verdict::Pass));
        assert_eq!(verdicts(assessed(&|_, _| 5.0)), (Verdict::Pass, Verdict::Pass));
        let glaring = assessed(&|h, v| if h.hypot(v) < 2.0 { 100.0 } else { 5.0 });
        assert_eq!(verdicts(glaring), (Verdict::Fail, Verdict::Fail));
        assert_eq!(verdicts(assessed(&|_, _| 100.0)), (Verdict::Fail, Verdict::Fail));
    }

    /// A field that ends where light is brighter than half of its brightest may miss the brightest: what that would turn round is unsure.
    #[test]
    fn a_beam_that_the_field_cuts_has_no_sure_maximum() {
        let regulation = Regulation::find("UN R112 B driving").unwrap();
        let verdict = |peak: f64, [half_h, half_v]: [f64; 2]| {
            let (h, v) = (edges(half_h, 0.1), edges(half_v, 0.1));
            let middle = |e: &[f64], k: usize| 0.5 * (e[k] + e[k + 1]);
            let light = |h: f64, v: f64| peak * (-(h / 8.0).powi(2) - (v / 4.0).powi(2)).exp();
            let columns = h.len() - 1;
            let cells =
                (0..columns * (v.len() - 1)).map(|k| light(middle(&h, k % columns), middle(&v, k / columns)));
            let cells = cells.map(|i| [i, 1e-4 * i, 0.0]).collect();
            let lamp = IntensityMap::new(h.clone(), v.clone(), cells).unwrap();
            row(&assess(&lamp, &regulation, &Assumptions::default()).unwrap(), "IM").verdict.unwrap()
        };
        // At least 40,500 cd and at most 215,000: 78 % of the brightest stand on the rim of ±2°, 21 % on that of ±10° by ±6°.
        for (peak, whole, cut) in [
            (45_000.0, Verdict::Pass, Verdict::Unsure),
            (30_000.0, Verdict::Fail, Verdict::Unsure),
            (230_000.0, Verdict::Fail, Verdict::Fail),
        ] {
            assert_eq!(verdict(peak, [10.0, 6.0]), whole, "{peak}");
            assert_eq!(verdict(peak, [6.0, 2.0]), cut, "{peak}");
        }
    }

    /// UN R113: the level cut-off goes to 0.57° down, and the lamp stays sideways as placed.
    #[test]
    fn a_level_cut_off_is_brought_to_its_line() {
        let regulation = Regulation::find("UN R113 CS passing").unwrap();
        let aim = |at: f64| {
            let beam = map(|_, v| 10.0 + 8000.0 / (1.0 + ((v - at) / 0.05).exp()), 1e-3, 0.0);
            assess(&beam, &regulation, &Assumptions::default()).unwrap().aim
        };
        for at in [-0.2, 0.35] {
            let aim = aim(at);
            // Light of 1 % is darkness: G is largest where that begins, less than 0.3° above the middle of the edge.
            assert!(aim.v_deg > at + 0.57 && aim.v_deg < at + 0.87 && aim.h_deg == 0.0, "{aim:?}");
            assert!(aim.how.contains("sideways as placed"), "{}", aim.how);
        }
        assert!((aim(0.35).v_deg - aim(-0.2).v_deg - 0.55).abs() < 0.01);
        let federal = Regulation::find("FMVSS 108 LB1V").unwrap();
        let as_placed = assess(&map(|_, _| 1000.0, 1e-3, 0.0), &federal, &Assumptions::default()).unwrap();
        assert!(as_placed.aim.how.contains("no rule for aiming FMVSS 108 LB1V"), "{}", as_placed.aim.how);
    }

    /// Ten thousand lamps whose true intensity lies within a few errors of a limit, read with a normal error: wrong verdicts stay
    /// below 0.3 %, and none is unsure farther than three errors from the limit of its reading.
    #[test]
    fn verdicts_near_a_limit_are_seldom_wrong() {
        let regulation = Regulation::find("UN R112 B passing").unwrap();
        let table =
            row(&assess(&map(passing(0.0, 0.0), 1e-3, 0.0), &regulation, &Assumptions::default()).unwrap(), "75R");
        let limit = table.row.min.unwrap();
        let mut uniform = uniform(20_261_122);
        let aim = Aim::unchanged("test");
        let error = 0.02 * limit;
        let mut wrong = 0;
        for _ in 0..10_000 {
            let truth = limit + error * (12.0 * uniform() - 6.0);
            let read = truth + error * normal(&mut uniform);
            // One cell as large as the sensor holds the reading and its error.
            let cells = vec![[read, error, 0.0]; 1];
            let map = IntensityMap::new(vec![1.0, 1.3], vec![-0.72, -0.42], cells).unwrap();
            let sensor = Sensor { half_deg: 0.0745, round: false };
            let photometer = Photometer { map: &map, aim: &aim, turns: 1, sensor, tolerance_deg: 0.0 };
            let judged = judge_row(&photometer, &regulation, &Assumptions::default(), &table.row);
            match judged.verdict.unwrap() {
                Verdict::Pass => wrong += usize::from(truth < limit),
                Verdict::Fail => wrong += usize::from(truth >= limit),
                Verdict::Unsure => assert!((read - limit).abs() < 3.0 * error),
            }
        }
        assert!(wrong <= 30, "{wrong} of 10,000");
    }
}
