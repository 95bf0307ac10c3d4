//! A photometer before a lamp: what it adds up in directions of the tables.

use super::aim::Aim;
use super::map::IntensityMap;
use super::opening::{CellWeights, Sensor};
use super::zone::zone_holds;
use std::rc::Rc;

/// A map, how it is turned and how it is read.
#[derive(Clone, Copy)]
pub(super) struct Photometer<'a> {
    pub(super) map: &'a IntensityMap,
    pub(super) aim: &'a Aim,
    /// Turns of the lamp among which this one was looked for, as one with which no row fails; 1 where it was not.
    pub(super) turns: usize,
    pub(super) sensor: Sensor,
    /// Angle within which a point may be met; 0 where it must be met in its very direction.
    pub(super) tolerance_deg: f64,
}

/// A direction of the table, degrees, with what the photometer adds up there; `None` where its opening leaves the far field.
pub(super) type Sighting = ([f64; 2], Option<Rc<CellWeights>>);

/// Zones and lines end here, degrees from the middle: what the texts leave open to 90° is behind the lamp's own rim.
const MOST_DEG: f64 = 88.0;

/// Directions on a ring around one.
const TOLERANCE_RING: usize = 8;

/// A beam whose light on the rim of the far field is below this share of its brightest has its brightest direction within: the contour of
/// half the maximum, by which widths of beams are given, is closed.
const RIM_SHARE: f64 = 0.5;

impl Photometer<'_> {
    /// What the photometer adds up in a direction of the table, degrees; `None` where its opening leaves the far field.
    pub(super) fn measure(&self, direction: [f64; 2]) -> Option<Rc<CellWeights>> {
        let [h, v] = self.turned(direction);
        self.map.measure(self.sensor, h, v).map(Rc::new)
    }

    /// Where a direction of the table is in the map, degrees.
    fn turned(&self, direction: [f64; 2]) -> [f64; 2] {
        [direction[0] + self.aim.h_deg, direction[1] + self.aim.v_deg]
    }

    /// A point's own direction, then those around it within the tolerance where the regulation lets it be met nearby; degrees of the table.
    pub(super) fn near_directions(&self, direction: [f64; 2]) -> Vec<[f64; 2]> {
        if self.tolerance_deg > 0.0 { rings_around(direction, self.tolerance_deg) } else { vec![direction] }
    }

    /// Directions along a line, both ends included, at most half an opening apart, degrees of the table; none beyond [`MOST_DEG`].
    pub(super) fn line_directions(&self, from: [f64; 2], to: [f64; 2]) -> Vec<[f64; 2]> {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        // Half an opening apart, so that nothing bright lies between two of them unseen.
        let steps = (length / self.sensor.half_deg).ceil().max(1.0);
        let at = |k: f64| [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * k / steps);
        let held = |direction: &[f64; 2]| direction.iter().all(|angle| angle.abs() <= MOST_DEG);
        (0..=steps as usize).map(|k| at(k as f64)).filter(held).collect()
    }

    /// Measures a polygon in directions half an opening apart, as far as the far field holds them, and says whether it holds all of it, to
    /// within an opening. The directions are those of a grid from the lowest H and V; along the sides too where that makes more, for then
    /// the polygon is too narrow for the grid.
    pub(super) fn measure_zone(&self, polygon: &[[f64; 2]]) -> (Vec<Sighting>, bool) {
        let (bounds, within) = self.held_bounds(polygon);
        let (mut sightings, complete) = self.measure_grid(polygon, bounds);
        let is_held = |d: &[f64; 2]| (0..2).all(|axis| (bounds[axis][0]..=bounds[axis][1]).contains(&d[axis]));
        let corners = polygon.iter().zip(polygon.iter().cycle().skip(1));
        let sides = corners.flat_map(|(from, to)| self.line_directions(*from, *to)).filter(is_held);
        let sides: Vec<[f64; 2]> = sides.collect();
        if sightings.len() < sides.len() {
            sightings.extend(self.measure_each(sides));
        }
        (sightings, complete && within)
    }

    /// The bounds of a polygon as far as openings in them lie in the far field, degrees of the table, and whether that is all of it.
    fn held_bounds(&self, polygon: &[[f64; 2]]) -> ([[f64; 2]; 2], bool) {
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
        (bounds, complete)
    }

    /// What is measured on a grid between bounds in the directions that lie in a polygon, and whether no opening left the far field.
    fn measure_grid(&self, polygon: &[[f64; 2]], [h, v]: [[f64; 2]; 2]) -> (Vec<Sighting>, bool) {
        let step = self.sensor.half_deg;
        // Both ends count; an empty range has no direction.
        let count = |[low, high]: [f64; 2]| if high < low { 0 } else { ((high - low) / step).ceil() as usize + 1 };
        let place = |[low, high]: [f64; 2], k: usize| (low + step * k as f64).min(high);
        let mut complete = true;
        let mut sightings = Vec::new();
        for j in 0..count(v) {
            for i in 0..count(h) {
                let direction = [place(h, i), place(v, j)];
                if !zone_holds(polygon, direction) {
                    continue;
                }
                match self.measure(direction) {
                    Some(weights) => sightings.push((direction, Some(weights))),
                    // Towards the poles an opening takes more degrees of azimuth and may end beside the map.
                    None => complete &= self.map.beyond_sides(self.sensor, self.turned(direction)) <= 2.0 * step,
                }
            }
        }
        (sightings, complete)
    }

    /// What is measured in each of these directions of the table.
    pub(super) fn measure_each(&self, directions: Vec<[f64; 2]>) -> Vec<Sighting> {
        directions.into_iter().map(|direction| (direction, self.measure(direction))).collect()
    }

    /// What is measured all over the far field, half an opening apart, and whether the brightest direction of the lamp lies within: its rim
    /// is darker than [`RIM_SHARE`] of its brightest. Light apart from the beam and beyond the field is not known of.
    pub(super) fn measure_all(&self) -> (Vec<Sighting>, bool) {
        let [h, v] = self.map.extent();
        let (h, v) = (h.map(|x| x - self.aim.h_deg), v.map(|x| x - self.aim.v_deg));
        let field = [[h[0], v[0]], [h[1], v[0]], [h[1], v[1]], [h[0], v[1]]];
        let (bounds, _) = self.held_bounds(&field);
        let (sightings, _) = self.measure_grid(&field, bounds);
        let is_rim = |d: &[f64; 2]| (0..2).any(|axis| bounds[axis].contains(&d[axis]));
        let mut most = [0.0f64; 2];
        for (direction, weights) in &sightings {
            let value = weights.as_ref().map_or(0.0, |weights| self.map.read(weights).value);
            let most = &mut most[usize::from(is_rim(direction))];
            *most = most.max(value);
        }
        let [inside, rim] = most;
        (sightings, rim <= RIM_SHARE * inside)
    }

    /// Returns what is measured in the direction in which the photometer reads most, of how many, and whether the lamp has its brightest
    /// direction in the field; `None` where that holds no opening.
    pub(super) fn measure_brightest(&self) -> Option<(Rc<CellWeights>, usize, bool)> {
        let (all, is_within) = self.measure_all();
        let choices = all.len();
        let read = all.into_iter().filter_map(|(_, weights)| weights.map(|w| (self.map.read(&w).value, w)));
        read.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, brightest)| (brightest, choices, is_within))
    }
}

/// A direction and those on two rings around it, of this radius and of half of it, degrees: a smooth beam is as bright as required there if
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
        let photometer = Photometer { map: &map, aim: &aim, turns: 1, sensor, tolerance_deg: 0.0 };
        let directions = photometer.line_directions([1.0, 1.5], [90.0, 1.5]);
        assert!(directions.iter().all(|d| photometer.measure(*d).is_some()));
        assert!(directions.last().unwrap()[0] > 87.9);
    }

    /// Of a lone bright cell the neighbours along H and V are lit towards it; beside its corner they were darker than none on the far side.
    #[test]
    fn no_reading_is_below_none() {
        let edges: Vec<f64> = (0..=4).map(f64::from).collect();
        let aim = Aim::unchanged("test");
        let sensor = Sensor { half_deg: 0.1, round: false };
        // Row after row: dark below and on the left, bright above and on the right of the cell in the middle.
        let values = [[0.0, 0.0, 0.0, 0.0], [0.0, 10.0, 90.0, 0.0], [0.0, 90.0, 90.0, 0.0], [0.0; 4]];
        let cells = values.as_flattened().iter().map(|value| [*value, 1.0, 0.0]).collect();
        let map = IntensityMap::new(edges.clone(), edges, cells).unwrap();
        let photometer = Photometer { map: &map, aim: &aim, turns: 1, sensor, tolerance_deg: 0.0 };
        let read = |h: f64, v: f64| map.read(&photometer.measure([h, v]).unwrap()).value;
        // 10 − 0.4 · 20 along either axis, and as much again along the other.
        assert!((0.0..1e-9).contains(&read(1.1, 1.1)), "{}", read(1.1, 1.1));
        assert!((read(1.5, 1.1) - 2.0).abs() < 0.1, "{}", read(1.5, 1.1));
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
            let photometer = Photometer { map: &map, aim: &aim, turns: 1, sensor, tolerance_deg: 0.0 };
            photometer.measure_zone(&[[-9.5, low], [9.5, low], [9.5, low + 10.0], [-9.5, low + 10.0]]).1
        };
        assert!(held(-5.0) && !held(70.0));
    }

    /// A sliver along the slanted line V = H/7 from 0.37° on, narrower than an opening, holds no direction of a grid.
    #[test]
    fn a_zone_narrower_than_the_grid_is_seen_along_its_sides() {
        let edges: Vec<f64> = (0..=100).map(|k| 5.0 * (f64::from(k) / 50.0 - 1.0)).collect();
        let map = IntensityMap::new(edges.clone(), edges, vec![[1.0, 0.0, 0.0]; 10_000]).unwrap();
        let aim = Aim::unchanged("test");
        let sensor = Sensor { half_deg: 0.5, round: false };
        let photometer = Photometer { map: &map, aim: &aim, turns: 1, sensor, tolerance_deg: 0.0 };
        let at = |h: f64, aside: f64| [h, h / 7.0 + aside];
        let (sightings, complete) = photometer.measure_zone(&[at(0.37, 0.0), at(3.0, -0.01), at(3.3, 0.01)]);
        assert!(complete && sightings.len() > 12, "{}", sightings.len());
        assert!(sightings.iter().all(|([h, v], weights)| (v - h / 7.0).abs() < 0.02 && weights.is_some()));
    }
}
