//! Spots that may be brighter than a greatest value: as many directions around each as its solid angle holds.

use super::few_rays::SIGMAS;
use super::photometer::{Photometer, Sighting};
use std::collections::HashMap;

/// A place of the grid that may be brighter.
#[derive(Default)]
struct Place {
    /// The most that is read there, cd.
    brightest: f64,
    /// Indices of the sightings there.
    sightings: Vec<usize>,
}

/// Returns the sightings without those that belong to spots: of every connected group of directions that may be brighter than `greatest`,
/// cd, the brightest are let pass, up to the solid angle of a disc of this radius, degrees.
///
/// What is left of a group is compared with the limit like any other direction: surely brighter, it fails, because the group is then larger
/// than a spot may be. The sightings are those of a grid half an opening apart.
pub(super) fn outside_spots(
    photometer: &Photometer,
    sightings: Vec<Sighting>,
    greatest: f64,
    radius_deg: f64,
) -> Vec<Sighting> {
    let step = photometer.sensor.half_deg;
    let allowed = std::f64::consts::PI * radius_deg * radius_deg;
    let Some(&(corner, _)) = sightings.first() else { return sightings };
    // Directions that may be brighter, by their place on the grid.
    let mut bright: HashMap<[i64; 2], Place> = HashMap::new();
    for (index, (direction, weights)) in sightings.iter().enumerate() {
        let reading = weights.as_ref().map(|weights| photometer.map.read(weights));
        if let Some(reading) = reading.filter(|r| r.value + SIGMAS * r.known_error() > greatest) {
            let place = [0, 1].map(|axis| ((direction[axis] - corner[axis]) / step).round() as i64);
            let place = bright.entry(place).or_default();
            place.brightest = place.brightest.max(reading.value);
            place.sightings.push(index);
        }
    }
    let mut is_excused = vec![false; sightings.len()];
    while let Some(&first) = bright.keys().min() {
        let mut group = connected(&mut bright, first);
        // The brightest first: what is left over is as near to the limit as it can be.
        group.sort_by(|a, b| b.brightest.total_cmp(&a.brightest).then(a.sightings.cmp(&b.sightings)));
        let mut area = 0.0;
        for place in group {
            area += step * step * sightings[place.sightings[0]].0[1].to_radians().cos();
            if area > allowed {
                break;
            }
            place.sightings.into_iter().for_each(|index| is_excused[index] = true);
        }
    }
    let kept = sightings.into_iter().zip(is_excused).filter(|(_, excused)| !excused);
    kept.map(|(sighting, _)| sighting).collect()
}

/// Takes out of a grid the places that are joined with one, side by side or by a corner, and returns what they held.
fn connected(bright: &mut HashMap<[i64; 2], Place>, first: [i64; 2]) -> Vec<Place> {
    let mut open = vec![first];
    let mut group = Vec::new();
    while let Some([h, v]) = open.pop() {
        let Some(place) = bright.remove(&[h, v]) else { continue };
        group.push(place);
        open.extend((-1..=1).flat_map(|i| (-1..=1).map(move |j| [h + i, v + j])));
    }
    group
}

#[cfg(test)]
mod tests {
    use crate::regulation::test_lamps::edges;
    use crate::regulation::{Assumptions, IntensityMap, Regulation, Verdict, assess};

    /// A stop lamp's 300 cd may be passed in spots of 0.5° radius between its test points, 20° to the sides and 10° up and down.
    #[test]
    fn a_spot_may_be_brighter_than_the_maximum_and_no_streak() {
        let mut regulation = Regulation::find("FMVSS 108 stop-1").unwrap();
        regulation.function.rows.retain(|row| row.id == "Maximum");
        let [maximum] = &regulation.function.rows[..] else { panic!("one maximum") };
        assert_eq!((maximum.max, maximum.spot_radius_deg), (Some(300.0), Some(0.5)));
        let (h, v) = (edges(22.0, 0.1), edges(12.0, 0.1));
        let middle = |e: &[f64], k: usize| 0.5 * (e[k] + e[k + 1]);
        let verdict = |is_bright: &dyn Fn(f64, f64) -> bool, brightness: f64, error: f64| {
            let cells = (0..240 * 440).map(|k| is_bright(middle(&h, k % 440), middle(&v, k / 440)));
            let cells = cells.map(|bright| 300.0 * if bright { brightness } else { 0.5 });
            let cells = cells.map(|i| [i, error * i, 0.0]).collect();
            let lamp = IntensityMap::new(h.clone(), v.clone(), cells).unwrap();
            assess(&lamp, &regulation, &Assumptions::default()).unwrap().verdict
        };
        let spot = |at: [f64; 2], radius: f64| move |h: f64, v: f64| (h - at[0]).hypot(v - at[1]) < radius;
        assert_eq!(verdict(&spot([2.0, -1.0], 0.3), 2.0, 1e-3), Verdict::Pass);
        assert_eq!(verdict(&spot([2.0, -1.0], 1.0), 2.0, 1e-3), Verdict::Fail);
        assert_eq!(verdict(&spot([2.0, -1.0], 1.0), 0.9, 1e-3), Verdict::Pass);
        // What may be brighter by its error fills more than a spot.
        assert_eq!(verdict(&spot([2.0, -1.0], 1.0), 1.02, 0.05), Verdict::Unsure);
        // Two spots are two, a streak is larger than one however thin, and beyond the test points there is no requirement.
        let [left, right] = [spot([-6.0, 2.0], 0.4), spot([6.0, 2.0], 0.4)];
        assert_eq!(verdict(&|h, v| left(h, v) || right(h, v), 3.0, 1e-3), Verdict::Pass);
        assert_eq!(verdict(&|h: f64, v: f64| h.abs() < 0.4 && v.abs() < 10.0, 3.0, 1e-3), Verdict::Fail);
        assert_eq!(verdict(&|_, v: f64| v > 10.2, 3.0, 1e-3), Verdict::Pass);
    }
}
