//! Where words stand on a map: the names of points beside them, the levels of lines of equal value each on its line, and none over another.

use super::chart::Marks;
use super::contour::Isoline;
use crate::text::figures;

/// Digits of a level.
const DIGITS: usize = 3;

/// Places that are tried along a line, as shares of it: its middle first.
const PLACES: [f64; 7] = [0.5, 0.25, 0.75, 0.125, 0.375, 0.625, 0.875];

/// Sides of a point on which its name is tried, right and down: the usual one first.
const SIDES: [[i8; 2]; 8] = [[1, -1], [1, 1], [-1, -1], [-1, 1], [1, 0], [-1, 0], [0, -1], [0, 1]];

/// Gap between a point and its name along both axes, in the units of the picture.
pub(super) const NAME_GAP: [f64; 2] = [6.0, 3.0];

/// Radius of the disc of a point, in the units of the picture.
pub(super) const POINT_RADIUS: f64 = 3.5;

/// A level and where it is written.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LevelLabel {
    pub(super) text: String,
    /// The middle of the text, in the coordinates of the map.
    pub(super) at: [f64; 2],
}

/// A label on a map.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MapLabels {
    /// Sides of the points, right and down, on which their names stand; `None` where a name has no room.
    pub(super) sides: Vec<Option<[i8; 2]>>,
    /// Numbers of levels.
    pub(super) levels: Vec<LevelLabel>,
}

/// A part of the picture that something covers: its middle and half of its width and height.
#[derive(Clone, Copy)]
struct Cover {
    middle: [f64; 2],
    half: [f64; 2],
}

impl Cover {
    /// Returns what a text covers around its middle; `letter` is the width of a character and the height of a line.
    fn of_text(text: &str, middle: [f64; 2], [width, height]: [f64; 2]) -> Self {
        Self { middle, half: [0.5 * width * text.chars().count() as f64, 0.5 * height] }
    }

    /// Whether two lie over each other.
    fn meets(&self, other: &Self) -> bool {
        (0..2).all(|k| (self.middle[k] - other.middle[k]).abs() <= self.half[k] + other.half[k])
    }

    /// Whether it lies within a frame, given by two opposite corners.
    fn is_within(&self, [p, q]: [[f64; 2]; 2]) -> bool {
        (0..2).all(|k| {
            let [low, high] = [p[k].min(q[k]), p[k].max(q[k])];
            self.middle[k] - self.half[k] >= low && self.middle[k] + self.half[k] <= high
        })
    }
}

/// Lines that reach less far from their number than so many of its half sizes have none: it would hide the bright spot within them.
const LEAST_REACH: f64 = 2.0;

/// Half sizes of a number within which no middle of a ring lies: it would hide the peak of a small spot.
const SPARED: f64 = 1.5;

/// Returns the middle of a ring in the picture; `None` for a line that is not closed.
fn ring_middle(line: &Isoline, place: impl Fn([f64; 2]) -> [f64; 2]) -> Option<[f64; 2]> {
    if line.points.first() != line.points.last() {
        return None;
    }
    let points = line.points.iter().map(|p| place(*p));
    let empty = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    let [low, high] =
        points.fold(empty, |[low, high], p| [[0, 1].map(|k| low[k].min(p[k])), [0, 1].map(|k| high[k].max(p[k]))]);
    Some([0, 1].map(|k| 0.5 * (low[k] + high[k])))
}

/// Places the name of each point beside it, on the first side where it covers no other and no point and stays within the map, and the
/// number of each level on its longest line, where it covers nothing of these and not most of its line; what has no room is left out, of
/// levels the lowest first. `place` takes a point of the map to the picture, whose second axis points down, `frame` is two opposite
/// corners of the map there and `letter` the width of a character and the height of a line.
pub(super) fn map_labels(
    marks: &Marks,
    place: impl Fn([f64; 2]) -> [f64; 2],
    frame: [[f64; 2]; 2],
    letter: [f64; 2],
) -> MapLabels {
    let mut taken: Vec<Cover> =
        marks.points.iter().map(|p| Cover { middle: place(p.at), half: [POINT_RADIUS; 2] }).collect();
    let mut labels = MapLabels::default();
    for point in &marks.points {
        let at = place(point.at);
        let beside = |side: &[i8; 2]| {
            let name = Cover::of_text(&point.name, at, letter);
            let middle = [0, 1].map(|k| at[k] + f64::from(side[k]) * (NAME_GAP[k] + name.half[k]));
            Cover { middle, ..name }
        };
        let is_free = |name: &Cover| name.is_within(frame) && !taken.iter().any(|other| name.meets(other));
        let side = SIDES.into_iter().find(|side| is_free(&beside(side)));
        taken.extend(side.as_ref().map(beside));
        labels.sides.push(side);
    }
    let mut longest = longest_of_levels(&marks.lines);
    longest.sort_by(|a, b| b.level.total_cmp(&a.level));
    let peak = longest.first().and_then(|line| ring_middle(line, &place));
    for line in longest {
        let text = figures(line.level, DIGITS);
        let number = |at: [f64; 2]| Cover::of_text(&text, place(at), letter);
        let reaches_out = |number: &Cover| {
            let far = |p: [f64; 2]| (0..2).any(|k| (p[k] - number.middle[k]).abs() > LEAST_REACH * number.half[k]);
            line.points.iter().any(|p| far(place(*p)))
        };
        let own_peak = ring_middle(line, &place);
        let hides = |number: &Cover, peak: [f64; 2]| {
            (0..2).all(|k| (number.middle[k] - peak[k]).abs() < SPARED * number.half[k])
        };
        let spares = |number: &Cover| ![peak, own_peak].into_iter().flatten().any(|peak| hides(number, peak));
        let is_free = |number: &Cover| !taken.iter().any(|other| number.meets(other));
        let has_room = |number: &Cover| is_free(number) && reaches_out(number) && spares(number);
        let candidates = PLACES.map(|share| line.points[(share * (line.points.len() - 1) as f64) as usize]);
        // A level without room is left out: two texts over each other say less than one.
        if let Some(at) = candidates.into_iter().find(|at| has_room(&number(*at))) {
            taken.push(number(at));
            labels.levels.push(LevelLabel { text, at });
        }
    }
    labels
}

/// Returns the line with most points of each level, which bears its number.
fn longest_of_levels(lines: &[Isoline]) -> Vec<&Isoline> {
    let mut longest: Vec<&Isoline> = Vec::new();
    for line in lines {
        match longest.iter_mut().find(|l| l.level == line.level) {
            Some(known) if known.points.len() < line.points.len() => *known = line,
            Some(_) => {}
            None => longest.push(line),
        }
    }
    longest
}

#[cfg(test)]
mod tests {
    use super::super::chart::MapPoint;
    use super::*;

    const FRAME: [[f64; 2]; 2] = [[-500.0, -500.0], [500.0, 500.0]];

    fn labels(marks: &Marks) -> Vec<String> {
        map_labels(marks, |p| p, FRAME, [7.0, 13.0]).levels.into_iter().map(|l| l.text).collect()
    }

    /// Upright lines at a steep flank, 5 units apart, each 200 long: labels of three characters are 21 wide and 13 high, so that
    /// neighbours must stand at other heights; of ten lines seven places are enough, for every fifth is far enough aside.
    #[test]
    fn labels_at_a_steep_flank_stand_apart() {
        let upright = |k: usize| Isoline {
            level: 100.0 * (k + 1) as f64,
            points: (0..=200).map(|y| [5.0 * k as f64, f64::from(y)]).collect(),
        };
        let marks = Marks { lines: (0..9).map(upright).collect(), ..Marks::default() };
        let found = map_labels(&marks, |p| p, FRAME, [7.0, 13.0]).levels;
        assert_eq!(found.len(), 9);
        for (k, a) in found.iter().enumerate() {
            for b in &found[..k] {
                assert!((a.at[0] - b.at[0]).abs() > 21.0 || (a.at[1] - b.at[1]).abs() > 13.0, "{a:?} {b:?}");
            }
        }
        // On short lines there is no other height: the highest level stays, and those that are far enough from it.
        let short = |k: usize| Isoline {
            points: (0..6).map(|y| [5.0 * k as f64, 6.0 * f64::from(y)]).collect(),
            ..upright(k)
        };
        let marks = Marks { lines: (0..9).map(short).collect(), ..Marks::default() };
        assert_eq!(labels(&marks), ["900", "400"]);
    }

    #[test]
    fn names_of_points_are_not_written_over() {
        let line = Isoline { level: 5.0, points: (0..6).map(|x| [17.0 + 3.0 * f64::from(x), -6.0]).collect() };
        let point = MapPoint { name: "HV".into(), note: String::new(), at: [10.0, 0.0] };
        let mut marks = Marks { lines: vec![line], points: vec![point], ..Marks::default() };
        assert!(labels(&marks).is_empty());
        marks.points[0].at = [10.0, 40.0];
        assert_eq!(labels(&marks), ["5"]);
    }

    /// Names of two characters are 14 by 13, 6 and 3 from their points. Of two points 4 above each other the second has its name on the
    /// other side, at the right rim it stands to the left, and eight points around one, 9 apart, leave it without.
    #[test]
    fn names_stand_apart_and_within_the_map() {
        let sides = |at: &[[f64; 2]]| {
            let point = |at: &[f64; 2]| MapPoint { name: "HV".into(), note: String::new(), at: *at };
            let marks = Marks { points: at.iter().map(point).collect(), ..Marks::default() };
            map_labels(&marks, |p| p, FRAME, [7.0, 13.0]).sides
        };
        assert_eq!(sides(&[[0.0, 0.0], [0.0, 4.0]]), [Some([1, -1]), Some([1, 1])]);
        assert_eq!(sides(&[[490.0, 0.0]]), [Some([-1, -1])]);
        assert_eq!(sides(&[[490.0, -490.0]]), [Some([-1, 1])]);
        let around = [-1.0, 0.0, 1.0].map(|j| [-1.0, 0.0, 1.0].map(|i| [9.0 * i, 9.0 * j]));
        assert_eq!(sides(around.as_flattened())[4], None);
    }

    /// Rings about a spot: the number, 21 by 13, is written at the left of a ring of radius 40 and would hide one of radius 6.
    #[test]
    fn a_number_hides_no_spot() {
        let ring = |level: f64, radius: f64| Isoline {
            level,
            points: (0..=64)
                .map(|k| f64::from(k % 64) * std::f64::consts::TAU / 64.0)
                .map(|t| [radius * t.cos(), radius * t.sin()])
                .collect(),
        };
        let marks = Marks { lines: vec![ring(100.0, 40.0), ring(900.0, 6.0)], ..Marks::default() };
        assert_eq!(labels(&marks), ["100"]);
        // "200000", 49 by 13 with its space: at the top of a ring of radius 8 it would still hide its middle, of 20 no more.
        for (radius, shown) in [(8.0, 0), (20.0, 1)] {
            assert_eq!(labels(&Marks { lines: vec![ring(200_000.0, radius)], ..Marks::default() }).len(), shown);
        }
    }
}
