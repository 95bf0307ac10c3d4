//! Rows of a table as comparisons of photometer readings with limits.

use super::aim::Aim;
use super::few_rays::SIGMAS;
use super::opening::CellWeights;
use super::photometer::{Photometer, Sighting};
use super::row::{Bound, Row, RowKind};
use super::spots::outside_spots;
use super::table::Rules;
use std::rc::Rc;

/// One reading compared with one limit.
#[derive(Clone, Debug)]
pub(super) struct Comparison {
    pub(super) weights: Rc<CellWeights>,
    /// Standard error of its reading by how far noise may have moved the aim, cd: to either side, and towards the limit.
    pub(super) by_aim: [f64; 2],
    /// The same by how far the width of the cells may have.
    pub(super) by_cells: [f64; 2],
    /// Candela.
    pub(super) limit: f64,
    /// Whether the limit is a least value.
    pub(super) at_least: bool,
    /// Direction of the table, degrees.
    pub(super) direction: [f64; 2],
}

impl Comparison {
    /// Makes a comparison whose reading has no errors of the aim.
    fn as_aimed(weights: Rc<CellWeights>, limit: f64, at_least: bool, direction: [f64; 2]) -> Self {
        Self { weights, by_aim: [0.0; 2], by_cells: [0.0; 2], limit, at_least, direction }
    }
}

/// Comparisons of which all, or any one, decide a row.
#[derive(Clone, Debug)]
pub(super) struct Requirement {
    pub(super) comparisons: Vec<Comparison>,
    /// Directions among which that of a reading that all are compared with was chosen, as that of most light; 1 where it is given.
    pub(super) choices: usize,
    /// Whether one that holds is enough.
    pub(super) any: bool,
    /// Directions of the row that the far field does not hold; 1 for a zone of which it does not hold a part, and for a beam whose
    /// brightest direction may lie beyond.
    pub(super) unseen: usize,
}

/// Turns a row into requirements that must all be met, with the change of their readings by the errors of the aim; empty where it
/// requires nothing that can be measured. `rows` are those of its function, to which a relative row refers.
pub(super) fn requirements(photometer: &Photometer, rules: &Rules, row: &Row, rows: &[Row]) -> Vec<Requirement> {
    let mut requirements = requirements_as_aimed(photometer, rules, row, rows);
    let read = |c: &Comparison| photometer.map.read(&c.weights).value;
    let causes = photometer.aim.moved.iter().map(|ends| (ends, false));
    for (ends, is_of_cells) in causes.chain(photometer.aim.blurred.iter().map(|ends| (ends, true))) {
        let ends = ends.map(|end| {
            let aim = &Aim::turned_by(end);
            requirements_as_aimed(&Photometer { aim, ..*photometer }, rules, row, rows)
        });
        for (k, requirement) in requirements.iter_mut().enumerate() {
            let count = requirement.comparisons.len();
            for (j, here) in requirement.comparisons.iter_mut().enumerate() {
                // Where a direction leaves the field by the turn, or a spot has another size, there is nothing to compare with.
                let there = ends.iter().filter_map(|end| end.get(k)).map(|there| &there.comparisons);
                let there = there.filter(|there| there.len() == count);
                let there: Vec<f64> = there.map(|there| read(&there[j]) - read(here)).collect();
                let [least, most] =
                    [there.iter().copied().fold(0.0, f64::min), there.iter().copied().fold(0.0, f64::max)];
                let towards = if read(here) < here.limit { most } else { -least };
                let by_cause = if is_of_cells { &mut here.by_cells } else { &mut here.by_aim };
                let [own, own_towards] = *by_cause;
                *by_cause = [own.hypot(0.5 * (most - least) / SIGMAS), own_towards.hypot(towards / SIGMAS)];
            }
        }
    }
    requirements
}

/// The same for the aim as it is, without its errors. How many comparisons there are depends on the aim where spots may be brighter.
fn requirements_as_aimed(photometer: &Photometer, rules: &Rules, row: &Row, rows: &[Row]) -> Vec<Requirement> {
    let point = row.h.zip(row.v).map(|(h, v)| [h, v]);
    let ends = (row.h0.zip(row.v0)).zip(row.h1.zip(row.v1));
    let lenient = rules.tolerance_deg > 0.0;
    match row.kind {
        RowKind::Point | RowKind::DistributionPoint => match point {
            Some(p) => limits_at(row, &photometer.measure_each(photometer.near_directions(p)), [lenient; 2]),
            None => limits_over(row, None),
        },
        RowKind::Line => {
            let directions = ends.map(|((h0, v0), (h1, v1))| photometer.line_directions([h0, v0], [h1, v1]));
            limits_over(row, directions.map(|directions| (photometer.measure_each(directions), true)))
        }
        RowKind::Zone => {
            let zone = row.polygon.as_deref().map(|polygon| photometer.measure_zone(polygon));
            limits_over(row, zone.map(|(sightings, complete)| (beside_spots(photometer, row, sightings), complete)))
        }
        // Some direction must reach the least maximum, and none may pass the greatest.
        RowKind::Imax => {
            let (sightings, is_within) = photometer.measure_all();
            counting_unseen(limits_at(row, &sightings, [true, false]), is_within)
        }
        RowKind::Sum | RowKind::GroupSum => sum_requirement(photometer, row).into_iter().collect(),
        RowKind::Relative => relative_requirement(photometer, row, rows).into_iter().collect(),
        RowKind::Note => Vec::new(),
    }
}

/// A requirement each for a row's least and its greatest value at directions, none for a limit that it has not; `any` says for each
/// whether one direction is enough.
fn limits_at(row: &Row, sightings: &[Sighting], any: [bool; 2]) -> Vec<Requirement> {
    let limits = [(row.min, true, any[0]), (row.max, false, any[1])];
    let requirement = |(limit, at_least, any): (Option<f64>, bool, bool)| {
        // A limit that is not given asks for nothing.
        let limit = limit?;
        let seen = sightings.iter().filter_map(|(direction, m)| Some((*direction, m.clone()?)));
        let comparisons: Vec<Comparison> =
            seen.map(|(direction, weights)| Comparison::as_aimed(weights, limit, at_least, direction)).collect();
        let unseen = sightings.len() - comparisons.len();
        Some(Requirement { comparisons, choices: 1, any, unseen })
    };
    limits.into_iter().filter_map(requirement).collect()
}

/// Returns the sightings of a zone that a row's greatest value holds for: those outside of the spots that it lets be brighter.
fn beside_spots(photometer: &Photometer, row: &Row, sightings: Vec<Sighting>) -> Vec<Sighting> {
    match row.spot_radius_deg.zip(row.max) {
        Some((radius_deg, greatest)) => outside_spots(photometer, sightings, greatest, radius_deg),
        None => sightings,
    }
}

/// The requirements of a row's least and greatest value over all directions of a line or zone, given with whether the far field holds them
/// all. A row that does not say where counts as not seen: nothing that was read can meet it.
fn limits_over(row: &Row, place: Option<(Vec<Sighting>, bool)>) -> Vec<Requirement> {
    let (sightings, complete) = place.unwrap_or((Vec::new(), false));
    counting_unseen(limits_at(row, &sightings, [false; 2]), complete)
}

/// The same requirements with one direction more that is not seen, where the far field does not hold them all.
fn counting_unseen(mut requirements: Vec<Requirement>, complete: bool) -> Vec<Requirement> {
    requirements.iter_mut().for_each(|r| r.unseen += usize::from(!complete));
    requirements
}

/// The requirement of a sum of readings at several points; `None` where the row has no points or no minimum.
fn sum_requirement(photometer: &Photometer, row: &Row) -> Option<Requirement> {
    let points = row.points.as_deref()?;
    let limit = row.min?;
    let seen: Vec<Rc<CellWeights>> = points.iter().filter_map(|point| photometer.measure(*point)).collect();
    let unseen = points.len() - seen.len();
    // A sum of which a part is unseen is unknown: no part of it may count for the whole.
    if unseen > 0 {
        return Some(Requirement { comparisons: Vec::new(), choices: 1, any: false, unseen });
    }
    let weights = Rc::new(seen.iter().fold(CellWeights::default(), |sum, point| sum.plus(1.0, point)));
    let comparison = Comparison::as_aimed(weights, limit, true, points[0]);
    Some(Requirement { comparisons: vec![comparison], choices: 1, any: false, unseen: 0 })
}

/// The requirement of a reading compared with a multiple of another: the difference is one measurement, so that what both have in common
/// cancels. `None` where the row names no factor, bound, place or reference that is found.
fn relative_requirement(photometer: &Photometer, row: &Row, rows: &[Row]) -> Option<Requirement> {
    // Without a factor the row is text.
    let (factor, bound) = row.factor.zip(row.bound)?;
    let (reference, choices, is_within) = match row.of.as_deref()? {
        "imax" => {
            let (brightest, choices, is_within) = photometer.measure_brightest()?;
            (Some(brightest), choices, is_within)
        }
        name => {
            let place = rows.iter().find(|r| r.id == name).and_then(|r| Some([r.h?, r.v?]))?;
            (photometer.measure(place), 1, true)
        }
    };
    let (sightings, complete) = match (&row.polygon, row.h.zip(row.v)) {
        (Some(polygon), _) => photometer.measure_zone(polygon),
        (None, Some((h, v))) => (photometer.measure_each(photometer.near_directions([h, v])), true),
        (None, None) => return None,
    };
    // For a point near its place any direction will do, in a zone all of them must hold.
    let any = row.polygon.is_none() && photometer.tolerance_deg > 0.0;
    let mut requirement =
        Requirement { comparisons: Vec::new(), choices, any, unseen: usize::from(!complete || !is_within) };
    for (direction, weights) in sightings {
        match (weights, &reference) {
            (Some(weights), Some(reference)) => {
                // Errors of cells that both readings share would count twice if the two were judged apart.
                let difference = Rc::new(CellWeights::clone(&weights).plus(-factor, reference));
                let at_least = bound == Bound::Min;
                requirement.comparisons.push(Comparison::as_aimed(difference, 0.0, at_least, direction));
            }
            _ => requirement.unseen += 1,
        }
    }
    Some(requirement)
}

#[cfg(test)]
mod tests {
    use super::super::map::IntensityMap;
    use super::super::opening::Sensor;
    use super::*;

    /// A sum of three directions of which one lies beside the far field is not known, for one direction.
    #[test]
    fn a_sum_counts_the_directions_that_it_does_not_see() {
        let edges = |half: f64| (0..=100).map(|k| half * (f64::from(k) / 50.0 - 1.0)).collect::<Vec<f64>>();
        let map = IntensityMap::new(edges(5.0), edges(5.0), vec![[1.0, 0.0, 0.0]; 10_000]).unwrap();
        let aim = Aim::unchanged("test");
        let sensor = Sensor { half_deg: 0.0745, round: false };
        let photometer = Photometer { map: &map, aim: &aim, turns: 1, sensor, tolerance_deg: 0.0 };
        let regulation = crate::regulation::Regulation::find("FMVSS 108 stop-1").unwrap();
        let sum = regulation.function.rows.iter().find(|row| row.kind == RowKind::GroupSum).unwrap();
        let row = Row { points: Some(vec![[0.0, 0.0], [1.0, 1.0], [20.0, 0.0]]), ..sum.clone() };
        let requirement = sum_requirement(&photometer, &row).unwrap();
        assert_eq!((requirement.unseen, requirement.comparisons.len()), (1, 0));
    }
}
