//! A straight piece of a seam: what it may meet, how it meets a side, and whether it runs through a polygon that it only touches.

use super::tolerances::CROSSING_NOISE;
use crate::math::Uv;
use crate::math::polygon::{is_inside_sides, polygon_sides};

/// How a straight line meets a side, or several.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Contact {
    Apart,
    /// One ends on the other, or they lie on one line: the side of a polygon before and after the contact is not known.
    Touching,
    Crossing,
}

/// A straight line between two places.
pub(super) struct Segment {
    pub(super) ends: [Uv; 2],
    /// What counts as touching, in parameters.
    slack: f64,
    /// Lowest and highest corner of the box around it, larger by the slack.
    pub(super) bounds: [Uv; 2],
}

impl Segment {
    pub(super) fn new(ends: [Uv; 2]) -> Self {
        let [a, b] = ends;
        let slack = CROSSING_NOISE * (b - a).length();
        Self { ends, slack, bounds: [a.min(b) - slack, a.max(b) + slack] }
    }

    /// Whether it may cross something inside a box, given by its lowest and highest corner.
    pub(super) fn may_meet(&self, [lo, hi]: [Uv; 2]) -> bool {
        if lo.cmpgt(self.bounds[1]).any() || hi.cmplt(self.bounds[0]).any() {
            return false;
        }
        // Corners of a box farther off than half its extent across the line lie on one side of it.
        let along = self.ends[1] - self.ends[0];
        let half = 0.5 * (hi - lo) + self.slack;
        let off = along.perp_dot(0.5 * (lo + hi) - self.ends[0]);
        off.abs() <= along.x.abs() * half.y + along.y.abs() * half.x
    }

    /// Whether it runs through the inside of a polygon between two places at which it meets sides, its ends included. Along a side it does
    /// not. Takes as many steps as there are sides, and sorts those that it meets.
    pub(super) fn runs_through(&self, polygon: &[Uv]) -> bool {
        let [a, b] = self.ends;
        let along = b - a;
        if along == Uv::ZERO {
            return is_inside_sides(polygon_sides(polygon), a);
        }
        let noise = self.slack * along.length();
        let share = |p: Uv| (p - a).dot(along) / along.length_squared();
        // Where sides meet the line, and the parts of it that lie along a side, as shares of it.
        let mut shares = vec![0.0, 1.0];
        let mut covered: Vec<[f64; 2]> = Vec::new();
        // Where sides cross a line just left of this one, beyond all places on it.
        let mut crossings: Vec<f64> = Vec::new();
        for [p, q] in polygon_sides(polygon) {
            let (off_p, off_q) = (along.perp_dot(p - a), along.perp_dot(q - a));
            let met = if off_p.abs() <= noise {
                if off_q.abs() <= noise {
                    covered.push([share(p).min(share(q)), share(p).max(share(q))]);
                }
                Some(share(p))
            } else if off_q.abs() <= noise {
                Some(share(q))
            } else if (off_p > 0.0) != (off_q > 0.0) {
                Some(share(p + (q - p) * (off_p / (off_p - off_q))))
            } else {
                None
            };
            shares.extend(met);
            crossings.extend(met.filter(|_| (off_p > noise) != (off_q > noise)));
        }
        shares.retain(|t| (0.0..=1.0).contains(t));
        shares.sort_unstable_by(f64::total_cmp);
        crossings.sort_unstable_by(f64::total_cmp);
        covered.sort_unstable_by(|x, y| x[0].total_cmp(&y[0]));
        // Each up to the farthest end of those before it.
        let mut farthest = f64::NEG_INFINITY;
        for part in &mut covered {
            farthest = farthest.max(part[1]);
            part[1] = farthest;
        }
        let is_covered = |t: f64| {
            let before = covered.partition_point(|part| part[0] <= t);
            before > 0 && covered[before - 1][1] >= t
        };
        let is_inside = |t: f64| crossings.partition_point(|crossing| *crossing <= t) % 2 == 1;
        shares.windows(2).any(|part| {
            let middle = 0.5 * (part[0] + part[1]);
            part[1] - part[0] > CROSSING_NOISE && !is_covered(middle) && is_inside(middle)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A U of 3 by 2 whose notch is the unit square at its top.
    #[test]
    fn a_line_between_two_places_on_a_polygon_runs_inside_or_outside() {
        let u = [[0., 0.], [3., 0.], [3., 2.], [2., 2.], [2., 1.], [1., 1.], [1., 2.], [0., 2.]].map(Uv::from);
        let runs_through = |a: [f64; 2], b: [f64; 2]| Segment::new([a, b].map(Uv::from)).runs_through(&u);
        for (a, b) in [([0.5, 0.0], [0.5, 2.0]), ([0.0, 1.5], [1.0, 1.5]), ([0.0, 0.5], [3.0, 0.5])] {
            assert!(runs_through(a, b) && runs_through(b, a), "{a:?} to {b:?}, through");
        }
        // Through both arms with the bottom of the notch between them, and through a corner into one.
        assert!(runs_through([0.0, 1.0], [3.0, 1.0]) && runs_through([1.0, 1.0], [0.0, 0.0]));
        // Over the tips of both arms, across the notch, along a side, and away from one.
        for (a, b) in [
            ([-1.0, 2.0], [4.0, 2.0]),
            ([1.0, 1.5], [2.0, 1.5]),
            ([0.0, 0.0], [3.0, 0.0]),
            ([3.0, 0.5], [5.0, 1.0]),
        ] {
            assert!(!runs_through(a, b) && !runs_through(b, a), "{a:?} to {b:?}, past");
        }
    }

    /// A comb whose 100,000 teeth end on a line, flat and pointed ones in turn, and the same with one that ends beyond it. Each tooth
    /// compared with all would take minutes.
    #[test]
    fn a_line_along_the_tips_of_a_comb_runs_past_it() {
        let comb = |longest: f64| {
            let teeth = (0..100_000).flat_map(|k| {
                let (x, tip) = (f64::from(4 * k), if k == 50_000 { longest } else { 1.0 });
                [[x, 0.0], [x + 0.5, tip], [x + 1.5, tip], [x + 2.0, 0.0], [x + 3.0, 1.0]].map(Uv::from)
            });
            let back = [[400_000.0, 0.0], [400_000.0, -1.0], [0.0, -1.0]].map(Uv::from);
            teeth.chain(back).collect::<Vec<Uv>>()
        };
        let line = Segment::new([[-1.0, 1.0], [400_001.0, 1.0]].map(Uv::from));
        for (longest, is_through) in [(1.0, false), (1.5, true)] {
            assert_eq!(line.runs_through(&comb(longest)), is_through, "{longest}");
        }
    }
}
