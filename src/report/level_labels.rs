//! Where the levels of lines of equal value are written: each on its line, and none over another.

use super::chart::Marks;
use super::contour::Isoline;
use super::number::figures;

/// Digits of a level.
const DIGITS: usize = 3;

/// Places that are tried along a line, as shares of it: its middle first.
const PLACES: [f64; 7] = [0.5, 0.25, 0.75, 0.125, 0.375, 0.625, 0.875];

/// A level and where it is written.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LevelLabel {
    pub(super) text: String,
    /// The middle of the text, in the coordinates of the map.
    pub(super) at: [f64; 2],
}

/// Returns half of the width and height of a text; `width` is that of a character, `height` that of a line.
fn half_size(text: &str, [width, height]: [f64; 2]) -> [f64; 2] {
    [0.5 * width * text.chars().count() as f64, 0.5 * height]
}

/// Lines that reach less far from their number than so many of its half sizes have none: it would hide the bright spot within them.
const LEAST_REACH: f64 = 2.0;

/// Places the number of each level on its longest line, where it covers no other, no named point and not most of its line; levels without
/// room are left out, the lowest first. `place` takes a point of the map to the picture,
/// `letter` is the width of a character and the height of a line there.
pub(super) fn level_labels(
    marks: &Marks,
    place: impl Fn([f64; 2]) -> [f64; 2],
    letter: [f64; 2],
) -> Vec<LevelLabel> {
    // Middle and half size of what is written already: the names of points stand to the right of them.
    let mut taken: Vec<[[f64; 2]; 2]> = Vec::new();
    for point in &marks.points {
        let half = half_size(&point.name, letter);
        let [x, y] = place(point.at);
        taken.push([[x + half[0] + letter[0], y - half[1]], half]);
    }
    let mut longest = longest_of_levels(&marks.lines);
    longest.sort_by(|a, b| b.level.total_cmp(&a.level));
    let mut labels = Vec::new();
    for line in longest {
        let text = figures(line.level, DIGITS);
        let half = half_size(&text, letter);
        let is_free = |[x, y]: [f64; 2]| {
            taken.iter().all(|[m, h]| (x - m[0]).abs() > half[0] + h[0] || (y - m[1]).abs() > half[1] + h[1])
        };
        let reaches_out = |[x, y]: [f64; 2]| {
            let away = |p: &[f64; 2]| {
                let [u, v] = place(*p);
                (u - x).abs() > LEAST_REACH * half[0] || (v - y).abs() > LEAST_REACH * half[1]
            };
            line.points.iter().any(away)
        };
        let candidates = PLACES.map(|share| line.points[(share * (line.points.len() - 1) as f64) as usize]);
        // A level without room is left out: two texts over each other say less than one.
        if let Some(at) = candidates.into_iter().find(|at| is_free(place(*at)) && reaches_out(place(*at))) {
            taken.push([place(at), half]);
            labels.push(LevelLabel { text, at });
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

    fn labels(marks: &Marks) -> Vec<String> {
        level_labels(marks, |p| p, [7.0, 13.0]).into_iter().map(|l| l.text).collect()
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
        let found = level_labels(&marks, |p| p, [7.0, 13.0]);
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

    /// Rings about a spot: the number, 21 by 13, is written at the left of a ring of radius 40 and would hide one of radius 6.
    #[test]
    fn a_number_hides_no_spot() {
        let ring = |level: f64, radius: f64| Isoline {
            level,
            points: (0..=64)
                .map(|k| f64::from(k) * std::f64::consts::TAU / 64.0)
                .map(|t| [radius * t.cos(), radius * t.sin()])
                .collect(),
        };
        let marks = Marks { lines: vec![ring(100.0, 40.0), ring(900.0, 6.0)], ..Marks::default() };
        assert_eq!(labels(&marks), ["100"]);
    }
}
