//! One row of a regulation judged about a lamp as it is aimed.

use super::assessment::{Assumptions, RowVerdict};
use super::judgement::{Judgement, Verdict};
use super::photometer::Photometer;
use super::requirement::requirements;
use super::row::{Row, RowKind};
use super::table::Regulation;

/// Remark on rows whose readings have no geometric error.
const UNKNOWN_FACETS: &str = "it is not known what facets change here, as the cells are too many to be compared with the spline: trace \
    with fewer, or with --intersector exact";

/// Remark on rows that neither rays nor facets can decide.
const COARSE_CELLS: &str = "the width of the far field's cells alone leaves open more than lies between reading and limit: trace with \
    narrower ones";

/// Judges the rows of which `is_asked`, by their place in the table, as the map is aimed, points that the sum of their group may save with
/// that; `None` for the others. Whether another aim is open is not checked.
pub(super) fn judge_rows(
    photometer: &Photometer,
    regulation: &Regulation,
    assumptions: &Assumptions,
    is_asked: impl Fn(usize) -> bool,
) -> Vec<Option<RowVerdict>> {
    let judge = |row: &Row| judge_row(photometer, regulation, assumptions, row);
    let all = regulation.function.rows.iter().enumerate();
    let mut rows: Vec<Option<RowVerdict>> = all.map(|(k, row)| is_asked(k).then(|| judge(row))).collect();
    // The group is evaluated only where a point's own minimum is not met.
    if regulation.function.has_group_alternative() {
        let sums = rows.iter().flatten().filter(|r| r.row.kind == RowKind::GroupSum);
        let groups: Vec<(Option<u32>, Option<Verdict>)> = sums.map(|r| (r.row.group, r.verdict)).collect();
        let points = rows.iter_mut().flatten().filter(|r| r.row.kind == RowKind::Point && r.row.group.is_some());
        for point in points.filter(|r| r.verdict.is_some_and(|own| own != Verdict::Pass)) {
            let group = groups.iter().find(|g| g.0 == point.row.group).and_then(|g| g.1);
            *point = judge_with_group(&point.row, group, judge);
        }
    }
    rows
}

/// Judges a point whose minimum its group may save; its maximum holds whatever the group reaches. `judge` judges a row by itself.
fn judge_with_group(point: &Row, group: Option<Verdict>, judge: impl Fn(&Row) -> RowVerdict) -> RowVerdict {
    let mut least = judge(&Row { max: None, ..point.clone() });
    let own = least.verdict;
    least.verdict = least.verdict.map(|own| match (own, group) {
        (Verdict::Pass, _) | (_, Some(Verdict::Pass)) => Verdict::Pass,
        (Verdict::Fail, Some(Verdict::Fail) | None) => Verdict::Fail,
        // A group that is unsure may still save its point.
        _ => Verdict::Unsure,
    });
    let is_saved = least.verdict == Some(Verdict::Pass) && own != Some(Verdict::Pass);
    // What passes has nothing left to settle.
    least.settles = least.settles.filter(|_| least.verdict != Some(Verdict::Pass));
    let greatest = judge(&Row { min: None, ..point.clone() });
    let worst = if greatest.verdict > least.verdict { greatest } else { least };
    let mut row = point.clone();
    if is_saved {
        row.add_note("its own minimum is not met beyond doubt, the sum of its group is, which is enough");
    }
    RowVerdict { row, ..worst }
}

/// Judges a row by itself, by its worst requirement; rows with conditions on use, and those that require nothing measured, stay without a
/// verdict.
pub(super) fn judge_row(
    photometer: &Photometer,
    regulation: &Regulation,
    assumptions: &Assumptions,
    row: &Row,
) -> RowVerdict {
    let mut verdict =
        RowVerdict { row: row.clone(), reading: None, direction: None, verdict: None, settles: None, unseen: 0 };
    // Conditions are about the lamp's use, which the simulation does not know.
    if row.when.is_some() {
        return verdict;
    }
    // A share of the printed minimum; what is printed stays in the row that is reported.
    let mut asked = row.clone();
    if let Some(floor) = regulation.function.point_floor().filter(|_| row.group.is_some())
        && row.kind == RowKind::Point
        && let Some(min) = row.min
    {
        asked.min = Some(floor * min);
        // Else it would read as if less than required were enough.
        verdict.row.add_note(&format!("{:.3} cd are enough here beside its group's sum", floor * min));
    }
    let requirements = requirements(photometer, &regulation.rules, &asked, &regulation.function.rows);
    let judged: Vec<Judgement> = requirements.iter().map(|r| Judgement::of_requirement(photometer, r)).collect();
    let Some(worst) = Judgement::worst(&judged) else { return verdict };
    verdict.verdict = Some(worst.verdict);
    if !photometer.map.knows_facets() {
        verdict.row.add_note(UNKNOWN_FACETS);
    }
    verdict.unseen = worst.unseen;
    verdict.reading = worst.decisive.map(|decisive| decisive.reading);
    verdict.direction = worst.decisive.map(|decisive| decisive.direction);
    // What fails is not mended by rays.
    if worst.verdict == Verdict::Unsure {
        verdict.settles = Judgement::what_settles_all(&judged, assumptions.rays, assumptions.tolerance_mm);
        if worst.decisive.is_some_and(|decisive| decisive.cells_leave_open()) {
            verdict.row.add_note(COARSE_CELLS);
        }
    }
    verdict
}
