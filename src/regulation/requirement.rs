//! Rows of a table as comparisons of photometer readings with limits.

use super::aim::Aim;
use super::few_rays::SIGMAS;
use super::map::IntensityMap;
use super::opening::{Measurement, Sensor};
use super::row::{Bound, Row, RowKind};
use super::table::Rules;
use super::zone::zone_holds;

/// One reading compared with one limit.
#[derive(Clone, Debug)]
pub(super) struct Comparison {
    pub(super) measurement: Measurement,
    /// Standard error of its reading by how far noise may have moved the aim, cd: to either side, and towards the limit.
    pub(super) by_aim: [f64; 2],
    /// Candela.
    pub(super) limit: f64,
    /// Whether the limit is a least value.
    pub(super) at_least: bool,
    /// Direction of the table, degrees.
    pub(super) direction: [f64; 2],
}

/// Comparisons of which all, or any one, decide a row.
#[derive(Clone, Debug)]
pub(super) struct Requirement {
    pub(super) comparisons: Vec<Comparison>,
    /// Directions among which that of a reading that all are compared with was chosen, as that of most light; 1 where it is given.
    pub(super) choices: usize,
    /// Whether one that holds is enough.
    pub(super) any: bool,
    /// Directions of the row that the far field does not hold.
    pub(super) unseen: usize,
}

/// A map, how it is turned and how it is read.
#[derive(Clone, Copy)]
pub(super) struct Photometer<'a> {
    pub(super) map: &'a IntensityMap,
    pub(super) aim: &'a Aim,
    pub(super) sensor: Sensor,
    /// Angle within which a point may be met; 0 where it must be met in its very direction.
    pub(super) tolerance_deg: f64,
}

/// A direction of the table, degrees, with what the photometer adds up there; `None` where its opening leaves the far field.
type Measured = ([f64; 2], Option<Measurement>);

/// Zones and lines end here, degrees from the middle: what the texts leave open to 90° is behind the lamp's own rim.
const MOST_DEG: f64 = 88.0;

/// Directions on a ring around one.
const TOLERANCE_RING: usize = 8;

impl Photometer<'_> {
    /// What the photometer adds up in a direction of the table, degrees; `None` where its opening leaves the far field.
    fn measure(&self, direction: [f64; 2]) -> Option<Measurement> {
        let [h, v] = self.turned(direction);
        self.map.measure(self.sensor, h, v)
    }

    /// Where a direction of the table is in the map, degrees.
    fn turned(&self, direction: [f64; 2]) -> [f64; 2] {
        [direction[0] + self.aim.h_deg, direction[1] + self.aim.v_deg]
    }

    /// A point's own direction, then those around it within the tolerance where the regulation lets it be met nearby; degrees of the table.
    fn near_directions(&self, direction: [f64; 2]) -> Vec<[f64; 2]> {
        if self.tolerance_deg > 0.0 { rings_around(direction, self.tolerance_deg) } else { vec![direction] }
    }

    /// Directions along a line, both ends included, at most half an opening apart, degrees of the table; none beyond [`MOST_DEG`].
    fn line_directions(&self, from: [f64; 2], to: [f64; 2]) -> Vec<[f64; 2]> {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        // Half an opening apart, so that nothing bright lies between two of them unseen.
        let steps = (length / self.sensor.half_deg).ceil().max(1.0);
        let at = |k: f64| [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * k / steps);
        let held = |direction: &[f64; 2]| direction.iter().all(|angle| angle.abs() <= MOST_DEG);
        (0..=steps as usize).map(|k| at(k as f64)).filter(held).collect()
    }

    /// What is measured in the directions in a polygon, rim included, half an opening apart, that the far field holds; and whether it holds
    /// all of the polygon.
    fn measure_zone(&self, polygon: &[[f64; 2]]) -> (Vec<Measured>, bool) {
        let step = self.sensor.half_deg;
        let shift = [self.aim.h_deg, self.aim.v_deg];
        let mut bounds = [[0.0; 2]; 2];
        let mut complete = true;
        for (axis, extent) in self.map.extent().into_iter().enumerate() {
            let values = || polygon.iter().map(|p| p[axis].clamp(-MOST_DEG, MOST_DEG));
            let asked = [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)];
            // The opening must fit: directions end half its width inside of the field.
            let held = [extent[0] + step - shift[axis], extent[1] - step - shift[axis]];
            // Two steps more: a zone that ends on the rim of the field counts as held, though no opening centred
            // there fits into it.
            complete &= asked[0] >= held[0] - 2.0 * step && asked[1] <= held[1] + 2.0 * step;
            bounds[axis] = [asked[0].max(held[0]), asked[1].min(held[1])];
        }
        let [h, v] = bounds;
        // Both ends count; an empty range has no direction.
        let count = |[low, high]: [f64; 2]| if high < low { 0 } else { ((high - low) / step).ceil() as usize + 1 };
        let place = |[low, high]: [f64; 2], k: usize| (low + step * k as f64).min(high);
        let mut measured = Vec::new();
        for j in 0..count(v) {
            for i in 0..count(h) {
                let direction = [place(h, i), place(v, j)];
                if !zone_holds(polygon, direction) {
                    continue;
                }
                match self.measure(direction) {
                    Some(measurement) => measured.push((direction, Some(measurement))),
                    // Towards the poles an opening takes more degrees of azimuth and may end beside the map.
                    None => complete &= self.map.beyond_sides(self.sensor, self.turned(direction)) <= 2.0 * step,
                }
            }
        }
        (measured, complete)
    }

    /// What is measured in each of these directions of the table.
    fn measure_each(&self, directions: Vec<[f64; 2]>) -> Vec<Measured> {
        directions.into_iter().map(|direction| (direction, self.measure(direction))).collect()
    }

    /// What is measured all over the far field, half an opening apart.
    fn measure_all(&self) -> Vec<Measured> {
        let [h, v] = self.map.extent();
        let (h, v) = (h.map(|x| x - self.aim.h_deg), v.map(|x| x - self.aim.v_deg));
        self.measure_zone(&[[h[0], v[0]], [h[1], v[0]], [h[1], v[1]], [h[0], v[1]]]).0
    }

    /// Returns what is measured in the direction in which the photometer reads most, and of how many; `None` where the far field holds no
    /// opening.
    fn measure_brightest(&self) -> Option<(Measurement, usize)> {
        let all = self.measure_all();
        let choices = all.len();
        let read = all.into_iter().filter_map(|(_, m)| m.map(|m| (self.map.read(&m).value, m)));
        read.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, brightest)| (brightest, choices))
    }
}

/// A direction and those on two rings around it, of this radius and of half of it, degrees: a smooth beam is as bright as is asked there if
/// anywhere within.
fn rings_around(direction: [f64; 2], radius_deg: f64) -> Vec<[f64; 2]> {
    let mut directions = vec![direction];
    for ring in [0.5, 1.0] {
        directions.extend((0..TOLERANCE_RING).map(|k| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / TOLERANCE_RING as f64).sin_cos();
            let radius = ring * radius_deg;
            [direction[0] + radius * cos, direction[1] + radius * sin]
        }));
    }
    directions
}

/// Turns what a row asks into requirements that must all be met, with what the errors of the aim change of their readings; empty where it
/// asks nothing that can be measured. `rows` are those of its function, to which a relative row refers.
pub(super) fn requirements(photometer: &Photometer, rules: &Rules, row: &Row, rows: &[Row]) -> Vec<Requirement> {
    let mut requirements = requirements_as_aimed(photometer, rules, row, rows);
    let read = |c: &Comparison| photometer.map.read(&c.measurement).value;
    for ends in &photometer.aim.moved {
        let ends = ends.map(|end| {
            let aim = &Aim::at(end);
            requirements_as_aimed(&Photometer { aim, ..*photometer }, rules, row, rows)
        });
        for (k, requirement) in requirements.iter_mut().enumerate() {
            let count = requirement.comparisons.len();
            for (j, here) in requirement.comparisons.iter_mut().enumerate() {
                // Where a direction leaves the field by the turn there is nothing to compare with.
                let there = ends.iter().map(|end| &end[k].comparisons).filter(|there| there.len() == count);
                let there: Vec<f64> = there.map(|there| read(&there[j]) - read(here)).collect();
                let [least, most] =
                    [there.iter().copied().fold(0.0, f64::min), there.iter().copied().fold(0.0, f64::max)];
                let towards = if read(here) < here.limit { most } else { -least };
                let [own, own_towards] = here.by_aim;
                here.by_aim = [own.hypot(0.5 * (most - least) / SIGMAS), own_towards.hypot(towards / SIGMAS)];
            }
        }
    }
    requirements
}

/// The same for the aim as it is, without its errors.
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
        RowKind::Zone => match (row.polygon.as_deref().map(|p| photometer.measure_zone(p)), row.spot_radius_deg) {
            (Some((measured, complete)), Some(radius)) => {
                counting_unseen(limits_beside_spots(photometer, row, radius, measured, false), complete)
            }
            (place, _) => limits_over(row, place),
        },
        // Some direction must reach the least maximum, and none may pass the greatest.
        RowKind::Imax => match row.spot_radius_deg {
            None => limits_at(row, &photometer.measure_all(), [true, false]),
            Some(radius) => limits_beside_spots(photometer, row, radius, photometer.measure_all(), true),
        },
        RowKind::Sum | RowKind::GroupSum => sum_requirement(photometer, row).into_iter().collect(),
        RowKind::Relative => relative_requirement(photometer, row, rows).into_iter().collect(),
        RowKind::Note => Vec::new(),
    }
}

/// A requirement each for a row's least and its greatest value at directions, none for a limit that it has not; `any` says for each
/// whether one direction is enough.
fn limits_at(row: &Row, measured: &[Measured], any: [bool; 2]) -> Vec<Requirement> {
    let limits = [(row.min, true, any[0]), (row.max, false, any[1])];
    let requirement = |(limit, at_least, any): (Option<f64>, bool, bool)| {
        // A limit that is not given asks for nothing.
        let limit = limit?;
        let seen = measured.iter().filter_map(|(direction, m)| Some((*direction, m.clone()?)));
        let comparisons: Vec<Comparison> = seen
            .map(|(direction, measurement)| Comparison {
                measurement,
                by_aim: [0.0; 2],
                limit,
                at_least,
                direction,
            })
            .collect();
        let unseen = measured.len() - comparisons.len();
        Some(Requirement { comparisons, choices: 1, any, unseen })
    };
    limits.into_iter().filter_map(requirement).collect()
}

/// The requirements of directions where a spot of this radius, degrees, may be brighter than the greatest value: around each direction that
/// is, one is not. `any_least` says whether the least value is enough in one direction.
fn limits_beside_spots(
    photometer: &Photometer,
    row: &Row,
    radius_deg: f64,
    all: Vec<Measured>,
    any_least: bool,
) -> Vec<Requirement> {
    let greatest = row.max.unwrap_or(f64::INFINITY);
    let exceeds = |m: &Option<Measurement>| m.as_ref().is_some_and(|m| photometer.map.read(m).value > greatest);
    let least = Row { max: None, ..row.clone() };
    let most = Row { min: None, ..row.clone() };
    let mut requirements = limits_at(&least, &all, [any_least, false]);
    let (brighter, others): (Vec<Measured>, Vec<Measured>) = all.into_iter().partition(|(_, m)| exceeds(m));
    requirements.extend(limits_at(&most, &others, [true, false]));
    for (direction, _) in brighter {
        let around = photometer.measure_each(rings_around(direction, radius_deg));
        requirements.extend(limits_at(&most, &around, [true, true]));
    }
    requirements
}

/// The requirements of a row's least and greatest value over all directions of a line or zone, given with whether the far field holds them
/// all. A row that does not say where counts as not seen: nothing that was read can meet it.
fn limits_over(row: &Row, place: Option<(Vec<Measured>, bool)>) -> Vec<Requirement> {
    let (measured, complete) = place.unwrap_or((Vec::new(), false));
    counting_unseen(limits_at(row, &measured, [false; 2]), complete)
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
    let measured: Vec<Option<Measurement>> = points.iter().map(|point| photometer.measure(*point)).collect();
    let unseen = measured.iter().filter(|m| m.is_none()).count();
    // A sum of which a part is unseen is unknown: no part of it may count for the whole.
    if unseen > 0 {
        return Some(Requirement { comparisons: Vec::new(), choices: 1, any: false, unseen });
    }
    let total = measured.iter().flatten().fold(Measurement::default(), |sum, m| sum.plus(1.0, m));
    let comparison =
        Comparison { measurement: total, by_aim: [0.0; 2], limit, at_least: true, direction: points[0] };
    Some(Requirement { comparisons: vec![comparison], choices: 1, any: false, unseen: 0 })
}

/// The requirement of a reading compared with a multiple of another: the difference is one measurement, so that what both have in common
/// cancels. `None` where the row names no factor, bound, place or reference that is found.
fn relative_requirement(photometer: &Photometer, row: &Row, rows: &[Row]) -> Option<Requirement> {
    // Without a factor the row is text.
    let (factor, bound) = row.factor.zip(row.bound)?;
    let (reference, choices) = match row.of.as_deref()? {
        "imax" => photometer.measure_brightest().map(|(brightest, choices)| (Some(brightest), choices))?,
        name => {
            let place = rows.iter().find(|r| r.id == name).and_then(|r| Some([r.h?, r.v?]))?;
            (photometer.measure(place), 1)
        }
    };
    let (measured, complete) = match (&row.polygon, row.h.zip(row.v)) {
        (Some(polygon), _) => photometer.measure_zone(polygon),
        (None, Some((h, v))) => (photometer.measure_each(photometer.near_directions([h, v])), true),
        (None, None) => return None,
    };
    // For a point near its place any direction will do, in a zone all of them must hold.
    let any = row.polygon.is_none() && photometer.tolerance_deg > 0.0;
    let mut requirement = Requirement { comparisons: Vec::new(), choices, any, unseen: usize::from(!complete) };
    for (direction, measurement) in measured {
        match (measurement, &reference) {
            (Some(measurement), Some(reference)) => requirement.comparisons.push(Comparison {
                // Errors of cells that both readings share would count twice if the two were judged apart.
                measurement: measurement.plus(-factor, reference),
                by_aim: [0.0; 2],
                limit: 0.0,
                at_least: bound == Bound::Min,
                direction,
            }),
            _ => requirement.unseen += 1,
        }
    }
    Some(requirement)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_to_the_side_lies_in_the_field_of_a_half_space() {
        let edges =
            |half: f64, cells: usize| (0..=cells).map(|k| half * (2.0 * k as f64 / cells as f64 - 1.0)).collect();
        let map = IntensityMap::new(edges(90.0, 1800), edges(2.0, 40), vec![[0.0; 3]; 1800 * 40]).unwrap();
        let aim = Aim::unchanged("test");
        let sensor = Sensor { half_deg: 0.0745, round: false };
        let photometer = Photometer { map: &map, aim: &aim, sensor, tolerance_deg: 0.0 };
        let directions = photometer.line_directions([1.0, 1.5], [90.0, 1.5]);
        assert!(directions.iter().all(|d| photometer.measure(*d).is_some()));
        assert!(directions.last().unwrap()[0] > 87.9);
    }

    /// A sum of three directions of which one lies beside the far field is not known, for one direction.
    #[test]
    fn a_sum_counts_the_directions_that_it_does_not_see() {
        let edges = |half: f64| (0..=100).map(|k| half * (f64::from(k) / 50.0 - 1.0)).collect::<Vec<f64>>();
        let map = IntensityMap::new(edges(5.0), edges(5.0), vec![[1.0, 0.0, 0.0]; 10_000]).unwrap();
        let aim = Aim::unchanged("test");
        let sensor = Sensor { half_deg: 0.0745, round: false };
        let photometer = Photometer { map: &map, aim: &aim, sensor, tolerance_deg: 0.0 };
        let regulation = crate::regulation::Regulation::find("FMVSS 108 stop-1").unwrap();
        let sum = regulation.function.rows.iter().find(|row| row.kind == RowKind::GroupSum).unwrap();
        let row = Row { points: Some(vec![[0.0, 0.0], [1.0, 1.0], [20.0, 0.0]]), ..sum.clone() };
        let requirement = sum_requirement(&photometer, &row).unwrap();
        assert_eq!((requirement.unseen, requirement.comparisons.len()), (1, 0));
    }

    /// At 75° up an opening takes 1/cos 75° = 3.9 times its width of azimuth: one that just fits at the horizon ends beside the field.
    #[test]
    fn a_zone_whose_rim_the_opening_leaves_is_not_held() {
        let edges = |low: f64, high: f64| (0..=100).map(|k| low + (high - low) * f64::from(k) / 100.0).collect();
        let aim = Aim::unchanged("test");
        let sensor = Sensor { half_deg: 0.5, round: false };
        let held = |low: f64| {
            let cells = vec![[1.0, 0.0, 0.0]; 10_000];
            let map = IntensityMap::new(edges(-10.0, 10.0), edges(low, low + 10.0), cells).unwrap();
            let photometer = Photometer { map: &map, aim: &aim, sensor, tolerance_deg: 0.0 };
            photometer.measure_zone(&[[-9.5, low], [9.5, low], [9.5, low + 10.0], [-9.5, low + 10.0]]).1
        };
        assert!(held(-5.0) && !held(70.0));
    }
}
