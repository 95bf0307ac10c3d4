//! Rows judged by every aim that the errors of a map leave open.

use super::aim::Aim;
use super::assessment::{Assumptions, RowVerdict};
use super::few_rays::SIGMAS;
use super::judgement::Verdict;
use super::photometer::Photometer;
use super::row_verdict::judge_rows;
use super::table::Regulation;
use rayon::prelude::*;

/// Most open aims by which rows of many directions are judged, each of which takes as long as a hundred points: of more, so many that lie
/// among all of them.
const MOST_FOR_EXTENDED: usize = 30;

/// Aims by which rows of many directions are judged side by side: zones take memory, on a far field of millions of cells hundreds of MB.
const AIMS_AT_ONCE: usize = 4;

/// Remarks on rows that another open aim makes unsure: by a verdict of its own, and by none as it sees them outside.
const OTHER_BY_AIM: &str =
    "by an aim that the errors of the map leave open its verdict is another; more rays decide which aim holds";
const OUTSIDE_BY_AIM: &str = "by an aim that the errors of the map leave open it lies outside the far field";

/// Judges all rows as the map is aimed, and then by the other aims that its errors leave open. A lamp that is aimed by noise fails and
/// passes where it should not: a verdict stands where every open aim has it, and what these read is an error of the reading.
pub(super) fn judge_by_open_aims(
    photometer: &Photometer,
    regulation: &Regulation,
    assumptions: &Assumptions,
) -> Vec<RowVerdict> {
    let as_aimed = judge_rows(photometer, regulation, assumptions, |_| true);
    let mut rows: Vec<RowVerdict> = as_aimed.into_iter().flatten().collect();
    // A standard error of which three reach as far as any other aim reads, with three errors of that.
    let mut spread = vec![0.0; rows.len()];
    // All of them are evaluated: a row's error must not depend on their order.
    let every = photometer.aim.rivals.len().div_ceil(MOST_FOR_EXTENDED).max(1);
    let judge = |(k, open): (usize, &Aim)| {
        let is_asked = |row: usize| k % every == 0 || !regulation.function.rows[row].is_extended();
        judge_rows(&Photometer { aim: open, ..*photometer }, regulation, assumptions, is_asked)
    };
    let open: Vec<Aim> = photometer.aim.open_aims().collect();
    let at_once = AIMS_AT_ONCE * every;
    let judged = open.chunks(at_once).enumerate().flat_map(|(chunk, aims)| {
        let aims: Vec<(usize, &Aim)> = (chunk * at_once..).zip(aims).collect();
        aims.into_par_iter().map(judge).collect::<Vec<_>>()
    });
    for others in judged {
        for ((row, other), spread) in rows.iter_mut().zip(others).zip(&mut spread) {
            let Some(other) = other else { continue };
            // What settles it by one aim does not where it is open which one holds.
            if row.verdict != other.verdict {
                // Once: then it is unsure, and nothing is said to settle it.
                if row.verdict != Some(Verdict::Unsure) || row.settles.is_some() {
                    let is_outside = other.unseen > 0 && row.unseen == 0;
                    row.row.add_note(if is_outside { OUTSIDE_BY_AIM } else { OTHER_BY_AIM });
                }
                (row.verdict, row.settles) = (Some(Verdict::Unsure), None);
            }
            if let (Some(here), Some(there)) = (row.reading, other.reading) {
                let error = there.known_error().hypot(there.cells);
                *spread = f64::max(*spread, (there.value - here.value).abs() / SIGMAS + error);
            }
        }
    }
    for (reading, spread) in
        rows.iter_mut().zip(spread).filter_map(|(row, spread)| Some((row.reading.as_mut()?, spread)))
    {
        // What facets and cells change is part of both readings; where the change by facets is unknown, it is in neither.
        let others = reading.geometric.map_or(0.0, |geometric| geometric.powi(2)) + reading.cells.powi(2);
        let apart = (spread.powi(2) - others).max(0.0).sqrt();
        reading.statistical = reading.statistical.max(apart);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::super::opening::Sensor;
    use super::super::test_lamps::{map, normal, passing, uniform};
    use super::super::verdict::assess;
    use super::*;

    /// Light that falls by 1500 cd a degree reads 10,275 cd where 10,100 cd are the least, and 10,100 cd by an aim that is 7/60° beside.
    #[test]
    fn a_verdict_stands_by_every_open_aim_whatever_their_order() {
        let mut regulation = Regulation::find("UN R112 B passing").unwrap();
        regulation.function.rows.retain(|row| row.id == "75R");
        let h = regulation.function.rows[0].h.unwrap();
        let lamp = map(|at, _| 10_275.0 - 1500.0 * (at - h), 1e-3, 0.0);
        let sensor = Sensor { half_deg: 0.0745, round: false };
        let judged = |rivals: &[f64]| {
            let aim = Aim { rivals: rivals.iter().map(|h| [*h, 0.0]).collect(), ..Aim::default() };
            let tolerance_deg = regulation.rules.tolerance_deg;
            let photometer = Photometer { map: &lamp, aim: &aim, turns: 1, sensor, tolerance_deg };
            let row = judge_by_open_aims(&photometer, &regulation, &Assumptions::default()).remove(0);
            (row.verdict.unwrap(), row.reading.unwrap())
        };
        assert_eq!(judged(&[-1.0]).0, Verdict::Pass);
        let (verdict, reading) = judged(&[7.0 / 60.0]);
        assert_eq!(verdict, Verdict::Unsure);
        // What makes it unsure is an error of the reading, three of which reach the limit.
        assert!((reading.value - 10_275.0).abs() < 1.0 && 3.0 * reading.known_error() >= 175.0, "{reading:?}");
        assert_eq!(judged(&[7.0 / 60.0, 2.0]).1, judged(&[2.0, 7.0 / 60.0]).1);
        assert!(judged(&[2.0]).1.known_error() >= 1000.0);
    }

    /// Whether a row is unsure although three of its combined errors do not reach its limits, and nothing says why.
    fn is_unexplained(judged: &RowVerdict) -> bool {
        let (Some(reading), RowVerdict { row, verdict: Some(Verdict::Unsure), unseen: 0, .. }) =
            (judged.reading, judged)
        else {
            return false;
        };
        let reach = SIGMAS * reading.known_error().hypot(reading.cells);
        let is_outside = row.note.as_ref().is_some_and(|note| note.contains(OUTSIDE_BY_AIM));
        !is_outside && [row.min, row.max].iter().flatten().all(|limit| (reading.value - limit).abs() > reach)
    }

    /// Noise of the dark side looks like elbows: a row that fails or passes by one of these alone is unsure.
    #[test]
    fn no_verdict_is_sure_by_an_aim_that_may_be_noise() {
        let regulation = Regulation::find("UN R112 B passing").unwrap();
        let beam = passing(1.8, 0.0);
        // The same with too little light to the right of the elbow, and to the left.
        let right_dim = |h: f64, v: f64| beam(h, v) * if h > 2.5 { 0.05 } else { 1.0 };
        let left_dim = |h: f64, v: f64| beam(h, v) * if h < 0.5 { 0.05 } else { 1.0 };
        let mut uniform = uniform(20_261_123);
        // Rays of 200 cd in a cell.
        let mut noise = |value: f64| {
            let error = (200.0 * value).sqrt();
            [(value + error * normal(&mut uniform)).max(0.0), error]
        };
        let (mut led_astray, mut passed, mut truly_failed) = (0, 0, 0);
        for beam in [&beam as &dyn Fn(f64, f64) -> f64, &right_dim, &left_dim] {
            let truth = assess(&map(beam, 1e-6, 0.0), &regulation, &Assumptions::default()).unwrap();
            assert!(truth.aim.rivals.iter().all(|[h, _]| (h - truth.aim.h_deg).abs() < 0.01), "{:?}", truth.aim);
            truly_failed += truth.rows.iter().filter(|r| r.verdict == Some(Verdict::Fail)).count();
            for _ in 0..3 {
                let noisy = map(beam, 0.0, 0.0).with_noise(&mut noise);
                let found = assess(&noisy, &regulation, &Assumptions::default()).unwrap();
                led_astray += usize::from((found.aim.h_deg - truth.aim.h_deg).abs() > 0.5);
                for (found, truth) in found.rows.iter().zip(&truth.rows) {
                    passed += usize::from(found.verdict == Some(Verdict::Pass));
                    let is_sure = matches!(found.verdict, Some(Verdict::Pass | Verdict::Fail));
                    let what = (&found.row.id, found.verdict, found.reading.map(|r| r.value));
                    assert!(!is_sure || truth.verdict == found.verdict, "{what:?}, truly {:?}", truth.verdict);
                    assert!(!is_unexplained(found), "{what:?}, {:?}", found.reading);
                }
            }
        }
        assert!(led_astray > 0 && passed > 9 && truly_failed > 1, "{led_astray} {passed} {truly_failed}");
        // What fails however the lamp is aimed still does: it has a tenth of the light.
        let dim = map(|h, v| 0.1 * beam(h, v), 0.0, 0.0).with_noise(&mut noise);
        assert_eq!(assess(&dim, &regulation, &Assumptions::default()).unwrap().verdict, Verdict::Fail);
    }
}
