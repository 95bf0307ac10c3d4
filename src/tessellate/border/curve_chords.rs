//! Chords of a curve within a tolerance that changes along it.

use crate::math::{Point, Vector};
use crate::nurbs::Curve;
use crate::tessellate::proof::flat_triangle::distance_to_chord;

/// Most steps in which the shape of a piece is sampled before it is divided, fewest of conics, and those of one among many pieces.
const STEPS: usize = 64;
const FEWEST_STEPS: usize = 16;
const STEPS_OF_MANY: usize = 8;
/// Steps for each control point of conics behind the first.
const STEPS_PER_POINT: usize = 8;
/// Pieces from which on each is one of many.
const MANY_PIECES: usize = 10;
/// Tolerances vary slowly: one in so many samples asks for its own.
const TOLERANCE_EVERY: usize = 4;
/// Most chords that halving makes of any curve, and how many more each of its control points allows: a helix of 130 turns, 2500 points in
/// its file, takes 23,500 chords within 2.5 µm.
const MAX_CHORDS: usize = 20_000;
const CHORDS_PER_POINT: usize = 10;
/// Halvings of one chord at most: 4096 parts, of which the last differ by the rounding of trims that were fitted.
const MAX_HALVINGS: u32 = 12;
/// Share of a piece's length within which it is straight: rounding of the samples.
const STRAIGHT: f64 = 1e-12;
/// Chords that would be missing by this little of one are not made.
const CHORD_ROUNDING: f64 = 1e-3;
/// Excess over its tolerance with which a chord of the even spread passes, and from which more chords are no use because curvature
/// was misjudged: halving sees to it then.
const SPREAD_EXCESS: [f64; 2] = [1.02, 2.0];
/// Times that the even spread is made anew with more chords.
const MAX_SPREADS: usize = 3;
/// Share of the tolerance from which a chord is halved; above the excess with which the spread passes.
const HALVED_FROM: f64 = 1.03;
/// Where along a chord the curve is compared with it.
const PROBES: [f64; 5] = [0.2, 0.35, 0.5, 0.65, 0.8];
/// Sine of the angle between tangents from which a knot is a kink, and the share of the knot interval at which they are taken.
const KINK: f64 = 0.05;
const KINK_STEP: f64 = 1e-6;

/// Returns the parameters of a curve's ends and of the kinks between them, ascending. A kink is a knot of full multiplicity at which the
/// tangent turns by more than [`KINK`].
pub(in crate::tessellate) fn breaks(curve: &Curve) -> Vec<f64> {
    let b = curve.breakpoints();
    let n = b.len();
    // Of the knots of full multiplicity few are kinks: arcs of a circle meet at such knots, and are smooth there.
    let is_kink = |i: usize| {
        let k = b[i];
        // A knot of lower multiplicity leaves the curve smooth.
        if curve.knots.iter().filter(|&&x| x == k).count() < curve.degree {
            return false;
        }
        let step = KINK_STEP * (b[i + 1] - k).min(k - b[i - 1]);
        let tangent = |t: f64| curve.derivatives(t).first.try_normalize();
        // Tangents just before and behind: at the knot itself the derivative is one of the two.
        match (tangent(k - step), tangent(k + step)) {
            (Some(x), Some(y)) => x.cross(y).length() > KINK || x.dot(y) < 0.0,
            _ => false,
        }
    };
    (0..n).filter(|&i| i == 0 || i + 1 == n || is_kink(i)).map(|i| b[i]).collect()
}

/// Work limit for dividing a curve.
#[derive(Clone, Copy)]
pub(super) struct Effort {
    /// In how many steps a piece is sampled before it is divided.
    steps: usize,
    /// Chords of all pieces together up to which they are halved.
    most_chords: usize,
}

impl Effort {
    /// That of a curve without control points.
    pub(super) const UNKNOWN_CURVE: Self = Self { steps: STEPS, most_chords: MAX_CHORDS };

    /// Few steps for an arc or two of conics, which bend evenly; chords by the number of control points.
    pub(super) fn new(curve: &Curve) -> Self {
        let points = curve.points.len();
        let steps =
            if curve.degree > 2 { STEPS } else { (STEPS_PER_POINT * (points - 1)).clamp(FEWEST_STEPS, STEPS) };
        Self { steps, most_chords: MAX_CHORDS + CHORDS_PER_POINT * points }
    }
}

/// Divides a curve into chords within `tolerance`, mm, a function of the parameter and the chord's direction there: spread evenly in
/// `√(curvature / tolerance)` between `breaks`, then halved where that is not enough. Returns the parameters ascending, all `breaks`
/// included.
///
/// `breaks` are at least two, ascending. Limits on chords and halvings can leave chords that exceed the tolerance.
pub(in crate::tessellate) fn chord_parameters(
    breaks: &[f64],
    effort: Effort,
    at: impl Fn(f64) -> Point,
    tolerance: impl Fn(f64, Vector) -> f64,
) -> Vec<f64> {
    // Many pieces are short, and need not be looked at as closely as one.
    let steps = if breaks.len() > MANY_PIECES { STEPS_OF_MANY } else { effort.steps };
    let mut t = vec![breaks[0]];
    for pair in breaks.windows(2) {
        if let Some(piece) = Piece::new([pair[0], pair[1]], steps, &at, &tolerance) {
            t.extend(piece.spread_within_tolerance(&at));
        }
        t.push(pair[1]);
    }
    halve_long_chords(&mut t, effort, at, tolerance);
    t
}

/// One piece of a curve, sampled.
struct Piece {
    ends: [f64; 2],
    samples: Vec<f64>,
    /// Tolerances at one in [`TOLERANCE_EVERY`] samples.
    tolerances: Vec<f64>,
    /// Number of chords, not whole, that the tolerance asks for from the start up to each sample.
    chords: Vec<f64>,
}

impl Piece {
    /// Samples the curve `at` in `steps` steps over `[a, b]`, with tolerances (mm, by parameter and direction) at some; `None` where the
    /// piece is straight, which needs no inner parameters.
    fn new(
        [a, b]: [f64; 2],
        steps: usize,
        at: &impl Fn(f64) -> Point,
        tolerance: &impl Fn(f64, Vector) -> f64,
    ) -> Option<Self> {
        let samples: Vec<f64> = (0..=steps).map(|i| a + (b - a) * i as f64 / steps as f64).collect();
        let p: Vec<Point> = samples.iter().map(|&t| at(t)).collect();
        let chord = [p[0], p[steps]];
        // A straight piece has no curvature to spread chords by.
        if p.iter().all(|&q| distance_to_chord(q, &chord) <= STRAIGHT * (p[steps] - p[0]).length()) {
            return None;
        }
        // From the samples on both sides, since the tolerance depends on the direction of the chord.
        let own = |i: usize| tolerance(samples[i], p[(i + 1).min(steps)] - p[i.saturating_sub(1)]);
        let last = steps / TOLERANCE_EVERY;
        let tolerances: Vec<f64> = (0..=last).map(|k| own(TOLERANCE_EVERY * k)).collect();
        // A chord of length h over curvature κ sags by κh²/8: at tolerance ξ there are √(κ/8ξ) chords to a millimetre.
        let density = |i: usize| {
            let (k, f) = (i / TOLERANCE_EVERY, (i % TOLERANCE_EVERY) as f64 / TOLERANCE_EVERY as f64);
            let xi = tolerances[k] + (tolerances[(k + 1).min(last)] - tolerances[k]) * f;
            (sample_curvature(&p, i) / (8.0 * xi)).sqrt()
        };
        let d: Vec<f64> = (0..=steps).map(density).collect();
        let mut chords = vec![0.0];
        // Their number up to each sample, by the trapezoidal rule.
        for i in 0..steps {
            chords.push(chords[i] + 0.5 * (d[i] + d[i + 1]) * (p[i + 1] - p[i]).length());
        }
        Some(Self { ends: [a, b], samples, tolerances, chords })
    }

    /// Returns the parameters strictly between the ends, ascending, of about as few chords as keep their middles within the tolerance;
    /// empty for one chord. Some may still exceed it after [`MAX_SPREADS`] spreads.
    fn spread_within_tolerance(&self, at: &impl Fn(f64) -> Point) -> Vec<f64> {
        let total = self.chords[self.chords.len() - 1];
        // Samples without length make the sum no number, and those of a line that turns back without bending make it 0: one chord, and
        // halving, is what is left then.
        if !(total.is_finite() && total > 0.0) {
            return Vec::new();
        }
        let mut n = (total - CHORD_ROUNDING).ceil().clamp(1.0, MAX_CHORDS as f64);
        let mut inner = self.even_parameters(n);
        // The samples' own chords miss a little of the curve: ask for more while the worst chord is too long.
        for _ in 0..MAX_SPREADS {
            let worst = self.worst_excess(&inner, at);
            if worst <= SPREAD_EXCESS[0] || worst > SPREAD_EXCESS[1] {
                break;
            }
            // The sag goes as the square of a chord's length: their number as the root of the excess.
            n = (n * worst.sqrt()).ceil().max(n + 1.0);
            inner = self.even_parameters(n);
        }
        inner
    }

    /// Returns the parameters that divide `chords`, whose sum is finite and above 0, evenly into `n`, a whole number of at least one; empty
    /// for one.
    fn even_parameters(&self, n: f64) -> Vec<f64> {
        let (ts, sum) = (&self.samples, &self.chords);
        let steps = ts.len() - 1;
        let parameter = |k: usize| {
            let goal = sum[steps] * k as f64 / n;
            let i = sum.partition_point(|&s| s <= goal).clamp(1, steps) - 1;
            ts[i] + (ts[i + 1] - ts[i]) * (goal - sum[i]) / (sum[i + 1] - sum[i])
        };
        (1..n as usize).map(parameter).collect()
    }

    /// Returns the largest distance of a chord's middle from the curve, over the tolerance there. `inner` are the parameters between the
    /// ends.
    fn worst_excess(&self, inner: &[f64], at: &impl Fn(f64) -> Point) -> f64 {
        let [a, b] = self.ends;
        let last = self.tolerances.len() - 1;
        let (mut from, mut start) = (a, at(a));
        let mut excess = |to: f64| {
            let (x, p) = (std::mem::replace(&mut from, to), std::mem::replace(&mut start, at(to)));
            let middle = 0.5 * (x + to);
            let i = ((middle - a) / (b - a) * last as f64) as usize;
            distance_to_chord(at(middle), &[p, start]) / self.tolerances[i.min(last)]
        };
        inner.iter().chain([&b]).map(|&to| excess(to)).fold(0.0, f64::max)
    }
}

/// Returns the curvature at sample `i` of at least three, 1/mm, from the circle through it and its neighbours; at either end that of the
/// next sample, 0 where samples coincide.
fn sample_curvature(p: &[Point], i: usize) -> f64 {
    // Ends have a neighbour on one side only.
    let i = i.clamp(1, p.len() - 2);
    let (x, y) = (p[i] - p[i - 1], p[i + 1] - p[i]);
    let scale = x.length() * y.length() * (p[i + 1] - p[i - 1]).length();
    if scale > 0.0 { 2.0 * x.cross(y).length() / scale } else { 0.0 }
}

/// Halves chords between the parameters `t`, within the limits of [`bisect_coarse`], while any of [`PROBES`] lies farther from its
/// chord than [`HALVED_FROM`] times the tolerance, mm, at the chord's middle and in its direction.
pub(super) fn halve_long_chords(
    t: &mut Vec<f64>,
    effort: Effort,
    at: impl Fn(f64) -> Point,
    tolerance: impl Fn(f64, Vector) -> f64,
) {
    bisect_coarse(t, effort, |a, b| {
        let chord = [at(a), at(b)];
        let along = chord[1] - chord[0];
        let xi = tolerance(0.5 * (a + b), along) * HALVED_FROM;
        PROBES.iter().any(|f| distance_to_chord(at(a + (b - a) * f), &chord) > xi)
    });
}

/// Halves the intervals between the ascending `t` while `coarse` holds, at most [`MAX_HALVINGS`] times each and until there are
/// [`Effort::most_chords`] in all. Where these end, what is left is halved once less often than the rest: one end of a helix left as it
/// was had chords across its cylinder.
pub(super) fn bisect_coarse(t: &mut Vec<f64>, effort: Effort, coarse: impl Fn(f64, f64) -> bool) {
    let mut are_open = vec![true; t.len()];
    // Held to a number of chords and of halvings, so that no curve of a file, however wild, costs more.
    for _ in 0..MAX_HALVINGS {
        let mut room = effort.most_chords.saturating_sub(t.len());
        let (mut halved, mut are_halves) = (Vec::with_capacity(2 * t.len()), Vec::with_capacity(2 * t.len()));
        for (pair, &is_open) in t.windows(2).zip(&are_open) {
            let (a, b) = (pair[0], pair[1]);
            let m = 0.5 * (a + b);
            halved.push(a);
            let is_coarse = is_open && room > 0 && a < m && m < b && coarse(a, b);
            are_halves.push(is_coarse);
            if is_coarse {
                room -= 1;
                halved.push(m);
                are_halves.push(true);
            }
        }
        halved.extend(t.last());
        if halved.len() == t.len() {
            break;
        }
        (*t, are_open) = (halved, are_halves);
    }
}

/// Halves every interval between the ascending `t` once, in place.
pub(super) fn bisect_all(t: &mut Vec<f64>) {
    let mut out = Vec::with_capacity(2 * t.len());
    for pair in t.windows(2) {
        out.extend([pair[0], 0.5 * (pair[0] + pair[1])]);
    }
    out.extend(t.last());
    *t = out;
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    #[test]
    fn a_line_that_overshoots_its_end_and_turns_back_is_divided_at_numbers() {
        // x = 4t(1 − t) + t², which ends at 1 and comes to 4/3 on its way: no curvature, and a middle that its chord misses.
        let at = |t: f64| Point::new(4.0 * t * (1.0 - t) + t * t, 0.0, 0.0);
        let parameters = chord_parameters(&[0.0, 1.0], Effort::UNKNOWN_CURVE, at, |_, _| 0.2);
        assert!(parameters.windows(2).all(|w| w[0] < w[1]), "{parameters:?}");
        // By hand: the curve lies up to 1/3 beyond the one chord, and within the tolerance of two.
        assert!(parameters.len() > 2 && parameters.iter().all(|t| (0.0..=1.0).contains(t)), "{parameters:?}");
    }

    /// A helix of 1000 turns, at a tolerance that asks for ten times the chords that there may be: they are about equally long all along.
    #[test]
    fn chords_that_end_early_are_as_long_at_both_ends() {
        let turns = 1000.0;
        let at = |t: f64| {
            let (sin, cos) = (turns * TAU * t).sin_cos();
            Point::new(cos, sin, turns * t)
        };
        // Chords of a fraction a of a turn sag by 1 − cos(πa).
        let of_most = 1.0 - (PI * turns / MAX_CHORDS as f64).cos();
        let parameters = chord_parameters(&[0.0, 1.0], Effort::UNKNOWN_CURVE, at, |_, _| 0.01 * of_most);
        assert!(parameters.len() > MAX_CHORDS / 2 && parameters.len() <= MAX_CHORDS + 1, "{}", parameters.len());
        let longest = parameters.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
        assert!(longest < 4.0 / MAX_CHORDS as f64, "{longest}");
    }
}
