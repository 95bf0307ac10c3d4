//! Makes usable splines of what files hold: unclamped, periodic, with near-equal knots, bad counts or weights.
//!
//! Guarantee: what comes out satisfies the invariants of [`Curve`] and [`Surface`] and is the same shape over the domain
//! `[knots[degree], knots[n]]`, up to knots that are merged because they differ by less than 1e-10 of the domain. A knot whose multiplicity
//! exceeds the degree inside the domain splits the spline: the multiplicity is cut to the degree where the pieces meet, within 1 µm or a
//! millionth of a coordinate, and the spline refused where they do not.

// Negated comparisons refuse NaN together with what is out of range.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

use super::{ControlPoint, Curve, MAX_DEGREE, Spline, Surface};
use crate::math::{Homogeneous, Point};

/// Most control points in one spline: 134 MB.
const MAX_POINTS: usize = 1 << 22;

/// Weights below this share of the largest are none: a point of weight 0 lies at infinity.
const SMALLEST_WEIGHT: f64 = 1e-12;
/// Largest coordinate, mm: of differences that matter, 1e-1 mm and more, nothing is left of a double beyond it.
const LARGEST_COORDINATE_MM: f64 = 1e15;
/// Ends of pieces this near, mm, are one place, and those that differ by this share of a coordinate, as rounding to seven digits does.
const JOINED_MM: f64 = 1e-3;
/// See [`JOINED_MM`].
const JOINED_SHARE: f64 = 1e-6;
/// Knots nearer than this share of the domain are one knot.
const SAME_KNOT: f64 = 1e-10;

/// Control points of several lines, their common knots, and what was changed.
type Conformed = (Vec<Vec<Homogeneous>>, Vec<f64>, Repairs);

/// Why a spline cannot be repaired.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Defect {
    /// Degree 0 or above [`MAX_DEGREE`].
    #[error("degree is 0 or above {MAX_DEGREE}")]
    Degree,
    /// Knots and control points do not fit together.
    #[error("the number of knots does not fit the control points and the degree")]
    Counts,
    /// There is not one weight for each control point.
    #[error("the number of weights does not fit the control points")]
    WeightCount,
    /// Knots decrease or are no numbers.
    #[error("knots decrease or are not finite")]
    Knots,
    /// The domain is empty, or the knots end before they begin.
    #[error("the knots leave no domain")]
    Domain,
    /// A weight is not positive, or nothing beside the largest, or that is not finite.
    #[error("a weight is not positive")]
    Weights,
    /// A coordinate is no number, or 1e15 mm or more from 0.
    #[error("a control point is not finite")]
    Points,
    /// Pieces lie apart at a knot of full multiplicity, or their weights there differ from line to line of a surface.
    #[error("it is torn: its pieces lie apart at a knot")]
    Torn,
}

/// Changes that were necessary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Repairs {
    /// The spline was unclamped.
    pub clamped: bool,
    /// Knots that were all but equal were merged.
    pub merged_knots: bool,
    /// Multiplicities above the degree were cut.
    pub cut_multiplicity: bool,
}

impl Repairs {
    /// All that was changed in either.
    fn union(self, o: Self) -> Self {
        Self {
            clamped: self.clamped || o.clamped,
            merged_knots: self.merged_knots || o.merged_knots,
            cut_multiplicity: self.cut_multiplicity || o.cut_multiplicity,
        }
    }
}

/// Repeats distinct knots by their multiplicities in one knot vector; `None` when these add up to more than some four
/// million or the lists differ in length.
pub fn expand_knots(distinct: &[f64], multiplicities: &[usize]) -> Option<Vec<f64>> {
    if distinct.len() != multiplicities.len() {
        return None;
    }
    // Counted before anything is made: a file of a few bytes may ask for any number of knots.
    let total = multiplicities.iter().try_fold(0usize, |s, &m| s.checked_add(m))?;
    if total > MAX_POINTS + 2 * MAX_DEGREE {
        return None;
    }
    Some(distinct.iter().zip(multiplicities).flat_map(|(&k, &m)| std::iter::repeat_n(k, m)).collect())
}

/// Makes a clamped curve of a file's parts, mm, and reports what had to be repaired; without weights all are 1.
///
/// # Errors
/// What cannot be repaired: see [`Defect`].
pub fn curve(
    degree: usize,
    knots: Vec<f64>,
    points: &[Point],
    weights: Option<&[f64]>,
) -> Result<(Curve, Repairs), Defect> {
    let points = homogeneous(points, weights)?;
    let (knots, fixed) = check_knots(degree, knots, points.len())?;
    let (lines, knots, repairs) = conform(degree, knots, vec![points], fixed)?;
    let points = lines.into_iter().next().ok_or(Defect::Counts)?;
    Ok((Curve { degree, knots, points }, repairs))
}

/// Makes a clamped surface of a file's parts, mm, and reports repairs; `points[i * count_v + j]`, as are weights, which are
/// 1 where there are none.
///
/// # Errors
/// What cannot be repaired: see [`Defect`].
pub fn surface(
    degree: [usize; 2],
    knots: [Vec<f64>; 2],
    counts: [usize; 2],
    points: &[Point],
    weights: Option<&[f64]>,
) -> Result<(Surface, Repairs), Defect> {
    let [nu, nv] = counts;
    if nu.checked_mul(nv) != Some(points.len()) || points.is_empty() {
        return Err(Defect::Counts);
    }
    let points = homogeneous(points, weights)?;
    let [ku, kv] = knots;
    let (ku, fixed_u) = check_knots(degree[0], ku, nu)?;
    let (kv, fixed_v) = check_knots(degree[1], kv, nv)?;
    let columns = (0..nv).map(|j| (0..nu).map(|i| points[i * nv + j]).collect()).collect();
    // Columns are curves over the knots in u, rows over those in v: one repair serves both.
    let (columns, ku, repairs_u) = conform(degree[0], ku, columns, fixed_u)?;
    let nu = columns[0].len();
    let rows = (0..nu).map(|i| columns.iter().map(|c| c[i]).collect()).collect();
    let (rows, kv, repairs_v) = conform(degree[1], kv, rows, fixed_v)?;
    let points = rows.into_iter().flatten().collect();
    Ok((Surface { degree, knots: [ku, kv], points }, repairs_u.union(repairs_v)))
}

/// Homogeneous control points of positions and weights, 1 where there are none; weights beyond 10⁶ or below 10⁻⁶ at their largest are
/// scaled to a largest of 1. An error where their number is another, one is not positive beside the largest, or a coordinate is not
/// finite or beyond 1e15 mm.
fn homogeneous(points: &[Point], weights: Option<&[f64]>) -> Result<Vec<Homogeneous>, Defect> {
    if points.len() > MAX_POINTS {
        return Err(Defect::Counts);
    }
    if weights.is_some_and(|w| w.len() != points.len()) {
        return Err(Defect::WeightCount);
    }
    // Only ratios of weights matter: scaled so that the largest is 1.
    let largest = weights.map_or(1.0, |w| w.iter().copied().fold(0.0, f64::max));
    if !(largest > 0.0 && largest.is_finite()) {
        return Err(Defect::Weights);
    }
    // Weights of ordinary size stay as they are, to the bit.
    let scale = if largest.log2().abs() > 20.0 { largest } else { 1.0 };
    // Divided: the inverse of a subnormal weight is infinite.
    let weight = |i: usize| weights.map_or(1.0, |w| w[i] / scale);
    let least = SMALLEST_WEIGHT * largest / scale;
    points
        .iter()
        .enumerate()
        .map(|(i, &p)| {
            let w = weight(i);
            if !(w > least) {
                Err(Defect::Weights)
            } else if !(p.is_finite() && p.abs().max_element() < LARGEST_COORDINATE_MM) {
                Err(Defect::Points)
            } else {
                Ok(Homogeneous::weighted(p, w))
            }
        })
        .collect()
}

/// Checks degree, count, order and domain of knots for so many points, and merges near-equal ones.
fn check_knots(degree: usize, mut knots: Vec<f64>, points: usize) -> Result<(Vec<f64>, Repairs), Defect> {
    if degree == 0 || degree > MAX_DEGREE {
        return Err(Defect::Degree);
    }
    if points < degree + 1 || knots.len() != points + degree + 1 {
        return Err(Defect::Counts);
    }
    let mut repairs = Repairs::default();
    if knots.iter().any(|k| !k.is_finite()) {
        return Err(Defect::Knots);
    }
    let extent = knots[knots.len() - 1] - knots[0];
    if !(extent > 0.0) {
        return Err(Defect::Domain);
    }
    // Differences below rounding of the parameter itself are noise as well.
    let magnitude = knots[0].abs().max(knots[knots.len() - 1].abs());
    let same = (SAME_KNOT * extent).max(4.0 * f64::EPSILON * magnitude);
    for i in 1..knots.len() {
        // A small step back is the rounding of equal knots.
        let step = knots[i] - knots[i - 1];
        if step < -same {
            return Err(Defect::Knots);
        }
        if step != 0.0 && step <= same {
            knots[i] = knots[i - 1];
            repairs.merged_knots = true;
        }
    }
    if !(knots[points] > knots[degree]) {
        return Err(Defect::Domain);
    }
    Ok((knots, repairs))
}

/// Cuts excess multiplicities and clamps, for several lines, at least one, over the same knots; adds what it did to `repairs`.
fn conform(
    degree: usize,
    mut knots: Vec<f64>,
    mut lines: Vec<Vec<Homogeneous>>,
    mut repairs: Repairs,
) -> Result<Conformed, Defect> {
    let p = degree;
    // A knot inside the domain, or a doubled end, at most `degree` (at the ends `degree + 1`) times.
    let mut i = 0;
    while i < knots.len() {
        let run = knots[i..].iter().take_while(|&&k| k == knots[i]).count();
        let at_end = i == 0 || i + run == knots.len();
        let allowed = if at_end { p + 1 } else { p };
        if run > allowed && lines[0].len() > p + 1 {
            repairs.cut_multiplicity = true;
            let excess = run - allowed;
            if lines[0].len() < p + 1 + excess {
                return Err(Defect::Counts);
            }
            if !at_end {
                join_pieces(&mut lines, i - 1, i - 1 + excess)?;
            }
            // Of control points that share all their knots with a neighbour, the inner one is redundant.
            let first = i.min(lines[0].len() - excess);
            knots.drain(i..i + excess);
            for line in &mut lines {
                line.drain(first..first + excess);
            }
            i += allowed;
        } else {
            i += run;
        }
    }
    let n = lines[0].len();
    let (a, b) = (knots[p], knots[n]);
    if !(b > a) {
        return Err(Defect::Domain);
    }
    let first = Spline { degree, knots: knots.clone(), points: lines[0].clone() };
    // Where the ends are not clamped, the domain begins inside the knots: cut there, the curve is the same and its ends are control
    // points.
    if first.is_clamped() {
        return Ok((lines, knots, repairs));
    }
    repairs.clamped = true;
    let cut: Vec<Curve> =
        lines.into_iter().map(|points| Spline { degree, knots: knots.clone(), points }.restricted(a, b)).collect();
    let knots = cut[0].knots.clone();
    Ok((cut.into_iter().map(|c| c.points).collect(), knots, repairs))
}

/// Makes the piece that begins with the control point `begin` go on from the one that ends with `end`, in every line: its weights are
/// scaled, by one factor for all lines, so that the point that both have has one weight.
///
/// # Errors
/// [`Defect::Torn`] where the two points lie apart in a line, or the lines ask for different factors.
fn join_pieces(lines: &mut [Vec<Homogeneous>], end: usize, begin: usize) -> Result<(), Defect> {
    let factor = lines[0][end].weight() / lines[0][begin].weight();
    let is_torn = |line: &Vec<Homogeneous>| {
        let [a, b] = [line[end], line[begin]].map(|p| p.position());
        let is_apart = (a - b).length() > JOINED_MM + JOINED_SHARE * a.abs().max_element();
        is_apart || (line[end].weight() / line[begin].weight() - factor).abs() > JOINED_SHARE * factor
    };
    if lines.iter().any(is_torn) {
        return Err(Defect::Torn);
    }
    // A piece stays what it is where all its homogeneous coordinates are scaled alike; left out where it would only round.
    if factor != 1.0 {
        lines.iter_mut().flat_map(|line| &mut line[begin..]).for_each(|p| *p *= factor);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn zigzag(n: usize) -> Vec<Point> {
        (0..n).map(|i| Point::new(i as f64, (i % 2) as f64, (i % 3) as f64)).collect()
    }

    #[test]
    fn an_unclamped_spline_is_clamped_on_its_domain() {
        let knots: Vec<f64> = (0..10).map(f64::from).collect();
        let raw = Curve {
            degree: 3,
            knots: knots.clone(),
            points: zigzag(6).into_iter().map(|p| Homogeneous::weighted(p, 1.0)).collect(),
        };
        let (c, repairs) = curve(3, knots, &zigzag(6), None).unwrap();
        assert!(repairs.clamped && c.is_clamped());
        assert_eq!(c.domain(), [3.0, 6.0]);
        for i in 0..=30 {
            let t = 3.0 + 0.1 * f64::from(i);
            assert!((c.evaluate(t) - raw.evaluate(t)).length() < 1e-14);
        }
    }

    #[test]
    fn near_equal_knots_are_merged() {
        let knots = vec![0.0, 0.0, 0.0, 0.5, 0.5 + 1e-14, 1.0, 1.0, 1.0];
        let (c, repairs) = curve(2, knots, &zigzag(5), None).unwrap();
        assert!(repairs.merged_knots);
        assert_eq!(c.knots[3], c.knots[4]);
    }

    #[test]
    fn too_many_equal_end_knots_are_cut() {
        let knots = vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        let (c, repairs) = curve(2, knots, &zigzag(4), None).unwrap();
        assert!(repairs.cut_multiplicity);
        assert_eq!(c.points.len() + c.degree + 1, c.knots.len());
        assert_eq!(c.evaluate(0.0), zigzag(4)[1]);
    }

    /// Two arcs of one circle whose weights differ by a factor, over knots that part them 3 and 4 times.
    #[test]
    fn pieces_of_other_weights_stay_the_same_conics() {
        let circle = [[5.0, 0.0], [5.0, 5.0], [0.0, 5.0], [0.0, 5.0], [-5.0, 5.0], [-5.0, 0.0]];
        let points = circle.map(|[x, y]| Point::new(x, y, 0.0));
        let cosine = std::f64::consts::FRAC_1_SQRT_2;
        let weights = [1.0, cosine, 1.0, 3.0, 3.0 * cosine, 3.0];
        let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0];
        let (three, repairs) = curve(2, knots, &points, Some(&weights)).unwrap();
        assert!(repairs.cut_multiplicity);
        // The further knot has a point that no piece knows.
        let mut points = points.to_vec();
        points.insert(3, Point::new(70.0, 80.0, 90.0));
        let mut weights = weights.to_vec();
        weights.insert(3, 0.5);
        let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0];
        let (four, _) = curve(2, knots, &points, Some(&weights)).unwrap();
        for k in 0..=40 {
            let t = 0.05 * f64::from(k);
            let places = [three.evaluate(t), four.evaluate(t)];
            assert!(places.iter().all(|p| (p.length() - 5.0).abs() < 1e-14), "{places:?} at {t}");
            assert!(places[0].y >= 0.0 && (places[0].x >= -1e-14) == (t <= 1.0));
        }
    }

    /// The columns of a surface are scaled together: where they ask for different factors its second patch would change.
    #[test]
    fn a_surface_whose_lines_join_by_different_weights_is_torn() {
        let knots = [vec![0.0, 0.0, 1.0, 1.0, 2.0, 2.0], vec![0.0, 0.0, 1.0, 1.0]];
        let points: Vec<Point> =
            [0.0, 1.0, 1.0, 2.0].iter().flat_map(|&x| [0.0, 1.0].map(|y| Point::new(x, y, 0.0))).collect();
        let joined = [1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0];
        assert!(surface([1, 1], knots.clone(), [4, 2], &points, Some(&joined)).is_ok());
        let torn = [1.0, 1.0, 1.0, 1.0, 2.0, 3.0, 2.0, 3.0];
        assert_eq!(surface([1, 1], knots, [4, 2], &points, Some(&torn)).unwrap_err(), Defect::Torn);
    }

    #[test]
    fn hopeless_input_is_refused_with_its_defect() {
        let p = zigzag(3);
        assert_eq!(curve(0, vec![0.0; 4], &p, None).unwrap_err(), Defect::Degree);
        assert_eq!(curve(2, vec![0.0; 5], &p, None).unwrap_err(), Defect::Counts);
        assert_eq!(curve(2, vec![0.0; 6], &p, None).unwrap_err(), Defect::Domain);
        let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        assert_eq!(curve(2, knots.clone(), &p, Some(&[1.0, 0.0, 1.0])).unwrap_err(), Defect::Weights);
        assert_eq!(curve(2, knots.clone(), &p, Some(&[1.0, 1.0])).unwrap_err(), Defect::WeightCount);
        assert_eq!(curve(2, vec![0.0, 0.0, 1.0, 0.0, 1.0, 1.0], &p, None).unwrap_err(), Defect::Knots);
        let far = [Point::ZERO, Point::splat(f64::NAN), Point::ONE];
        assert_eq!(curve(2, knots, &far, None).unwrap_err(), Defect::Points);
        assert_eq!(expand_knots(&[0.0, 1.0], &[1_000_000_000, 2]), None);
    }
}
