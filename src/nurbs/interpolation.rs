//! Rational splines through what can be evaluated, curves and surfaces, in as few pieces as an error leaves.
//!
//! Between corners a spline of degree n is C^(n − 1) and takes the given homogeneous points at its Greville abscissae (de Boor, *A
//! Practical Guide to Splines*, ch. XIII); pieces are halved where it strays between two of these. Of a rational shape the weights are
//! given too: its own polynomials are then met exactly, and only what is no polynomial has to be approximated.
//!
//! Known weakness: the lines of a surface run through all of it, so that a place that asks for small pieces makes them in its whole row and
//! column.

use super::basis::{WIDE, basis, find_span};
use super::{Curve, Surface};
use crate::math::{Homogeneous, Uv};
use std::ops::Range;

/// Least degree of a fit: of a turned ellipse quintics need a fifth of the control points of cubics at 1e-6 mm, and degree seven no fewer.
const LEAST_DEGREE: usize = 5;
/// Most pieces of a fit in one direction, or two between corners where there are more of them.
const MOST_PIECES: usize = 256;
/// How often the part between two corners is halved at one place: beside a corner that was not declared, further halving does not help.
const MOST_HALVINGS: i32 = 8;
/// Most lines of a surface along which pieces of the other direction are chosen.
const PROBED_LINES: usize = 33;
/// How often the pieces of a surface are chosen anew when between the lines it strays farther than along them.
const ROUNDS: usize = 3;
/// By how much the lines must follow more closely in each round.
const CLOSER: f64 = 0.25;

/// Fits a curve to the homogeneous points that `at` gives from the first to the last of `corners`, two or more and rising, where its
/// derivatives may jump. Weights must be polynomials of `degree` at most between corners. Returns it with the largest distance seen, mm: at
/// most `tolerance` unless that needs more pieces than are made; `None` where a point is missing or no number.
pub(crate) fn fit_curve(
    corners: &[f64],
    degree: usize,
    at: impl Fn(f64) -> Option<Homogeneous>,
    tolerance: f64,
) -> Option<(Curve, f64)> {
    let mut pieces = Pieces::new(corners, degree);
    loop {
        let Fitted { curve, strays, error } = pieces.fitted(&at, tolerance)?;
        if strays.is_empty() || !pieces.halve(&strays) {
            return Some((curve, error));
        }
    }
}

/// Fits a surface as [`fit_curve`] does a curve; `corners` and `degree` in u and in v.
pub(crate) fn fit_surface(
    corners: [&[f64]; 2],
    degree: [usize; 2],
    at: impl Fn(Uv) -> Option<Homogeneous>,
    tolerance: f64,
) -> Option<(Surface, f64)> {
    let mut pieces = [0, 1].map(|d| Pieces::new(corners[d], degree[d]));
    let (mut aim, mut round) = (tolerance, 1);
    loop {
        for d in 0..2 {
            refine_along(&mut pieces, d, &at, aim)?;
        }
        let surface = interpolate_surface(&pieces, &at)?;
        let mut error = 0f64;
        let [us, vs] = [0, 1].map(|d| pieces[d].probes());
        for (&x, &y) in us.iter().flat_map(|x| vs.iter().map(move |y| (x, y))) {
            let uv = Uv::new(x, y);
            let miss = (surface.evaluate(uv) - at(uv)?.project()).length();
            if !miss.is_finite() {
                return None;
            }
            error = error.max(miss);
        }
        if error <= tolerance || round == ROUNDS {
            return Some((surface, error));
        }
        aim *= CLOSER;
        round += 1;
    }
}

/// Halves pieces of direction `d`, 0 for u and 1 for v, until curves along some lines of the other stray no farther than `aim`, mm, or no
/// more pieces are made; `None` where a point is missing or no number.
fn refine_along(
    pieces: &mut [Pieces; 2],
    d: usize,
    at: &impl Fn(Uv) -> Option<Homogeneous>,
    aim: f64,
) -> Option<()> {
    let lines = pieces[1 - d].nodes();
    let lines: Vec<f64> = lines.iter().copied().step_by(lines.len().div_ceil(PROBED_LINES)).collect();
    let along = |t: f64, line: f64| at(if d == 0 { Uv::new(t, line) } else { Uv::new(line, t) });
    loop {
        let mut strays = Vec::new();
        for &line in &lines {
            strays.extend(pieces[d].fitted(|t| along(t, line), aim)?.strays);
        }
        strays.sort_by(f64::total_cmp);
        if strays.is_empty() || !pieces[d].halve(&strays) {
            return Some(());
        }
    }
}

/// The surface through the points at all pairs of nodes; `None` where one is missing.
fn interpolate_surface(pieces: &[Pieces; 2], at: impl Fn(Uv) -> Option<Homogeneous>) -> Option<Surface> {
    let [us, vs] = [0, 1].map(|d| pieces[d].nodes());
    let mut points = Vec::with_capacity(us.len() * vs.len());
    for &u in &us {
        let row: Vec<Homogeneous> = vs.iter().map(|&v| at(Uv::new(u, v))).collect::<Option<_>>()?;
        points.extend(pieces[1].interpolate(&row));
    }
    for j in 0..vs.len() {
        let column: Vec<Homogeneous> = (0..us.len()).map(|i| points[i * vs.len() + j]).collect();
        for (i, point) in pieces[0].interpolate(&column).into_iter().enumerate() {
            points[i * vs.len() + j] = point;
        }
    }
    let [u, v] = pieces;
    Some(Surface { degree: [u.degree, v.degree], knots: [u.knots(), v.knots()], points })
}

/// A curve through given points, and how far it strays between them.
struct Fitted {
    curve: Curve,
    /// Places where it strays too far, rising.
    strays: Vec<f64>,
    /// The largest distance seen, mm.
    error: f64,
}

/// The pieces of a fit in one direction.
struct Pieces {
    degree: usize,
    /// What lies between two corners, in order; one ends where the next begins.
    blocks: Vec<Block>,
}

/// What lies between two corners.
struct Block {
    /// Ends of its pieces, rising.
    borders: Vec<f64>,
    /// Greville abscissae, first and last at the corners; as many as control points.
    nodes: Vec<f64>,
    collocation: BandMatrix,
}

impl Pieces {
    /// One piece between each two of `corners`, of `degree` or [`LEAST_DEGREE`].
    fn new(corners: &[f64], degree: usize) -> Self {
        let degree = degree.max(LEAST_DEGREE);
        Self { degree, blocks: corners.windows(2).map(|ends| Block::new(ends.to_vec(), degree)).collect() }
    }

    /// All places where the fit takes its points, corners once.
    fn nodes(&self) -> Vec<f64> {
        let first = self.blocks.first().and_then(|b| b.nodes.first()).copied();
        first.into_iter().chain(self.blocks.iter().flat_map(|b| b.nodes[1..].iter().copied())).collect()
    }

    /// The middles between neighbouring nodes, where a fit strays farthest.
    fn probes(&self) -> Vec<f64> {
        self.nodes().windows(2).map(|t| 0.5 * (t[0] + t[1])).collect()
    }

    /// Takes the points that `at` gives at the nodes, and looks where the curve through them strays farther than `tolerance`, mm; `None`
    /// where a point is missing or no number.
    fn fitted(&self, at: impl Fn(f64) -> Option<Homogeneous>, tolerance: f64) -> Option<Fitted> {
        let values: Vec<Homogeneous> = self.nodes().into_iter().map(&at).collect::<Option<_>>()?;
        let curve = Curve { degree: self.degree, knots: self.knots(), points: self.interpolate(&values) };
        let (mut strays, mut error) = (Vec::new(), 0f64);
        for t in self.probes() {
            let miss = (curve.evaluate(t) - at(t)?.project()).length();
            if !miss.is_finite() {
                return None;
            }
            error = error.max(miss);
            if miss > tolerance {
                strays.push(t);
            }
        }
        Some(Fitted { curve, strays, error })
    }

    /// Knots: as many as leave a corner where blocks meet, one between pieces.
    fn knots(&self) -> Vec<f64> {
        let mut knots = Vec::new();
        for block in &self.blocks {
            let times = if knots.is_empty() { self.degree + 1 } else { self.degree };
            knots.extend(std::iter::repeat_n(block.borders[0], times));
            knots.extend(&block.borders[1..block.borders.len() - 1]);
        }
        let end = self.blocks.last().and_then(|b| b.borders.last());
        knots.extend(end.into_iter().flat_map(|&t| std::iter::repeat_n(t, self.degree + 1)));
        knots
    }

    /// The control points of the spline that has these values at the nodes.
    fn interpolate(&self, values: &[Homogeneous]) -> Vec<Homogeneous> {
        let mut points = Vec::with_capacity(values.len());
        let mut start = 0;
        for block in &self.blocks {
            let end = start + block.nodes.len();
            let solved = block.collocation.solve(&values[start..end]);
            // The corner is the last point of the block before, which has the same value.
            points.extend(&solved[usize::from(start > 0)..]);
            start = end - 1;
        }
        points
    }

    /// Halves each piece that holds one of `places`, rising; whether there was one that may be.
    fn halve(&mut self, places: &[f64]) -> bool {
        let most = MOST_PIECES.max(2 * self.blocks.len());
        let mut room = most.saturating_sub(self.blocks.iter().map(|b| b.borders.len() - 1).sum());
        let mut halved = false;
        for block in &mut self.blocks {
            let (first, last) = (block.borders[0], block.borders[block.borders.len() - 1]);
            let shortest = (last - first) * 0.5f64.powi(MOST_HALVINGS);
            let mut borders = vec![first];
            for piece in block.borders.windows(2) {
                let within = places.partition_point(|&t| t < piece[0])..places.partition_point(|&t| t <= piece[1]);
                if !within.is_empty() && room > 0 && piece[1] - piece[0] > 1.5 * shortest {
                    borders.push(0.5 * (piece[0] + piece[1]));
                    room -= 1;
                }
                borders.push(piece[1]);
            }
            if borders.len() > block.borders.len() {
                *block = Block::new(borders, self.degree);
                halved = true;
            }
        }
        halved
    }
}

impl Block {
    /// Prepares the interpolation over pieces with these ends.
    fn new(borders: Vec<f64>, degree: usize) -> Self {
        let (first, last) = (borders[0], borders[borders.len() - 1]);
        let mut knots = vec![first; degree];
        knots.extend(&borders);
        knots.extend(std::iter::repeat_n(last, degree));
        let count = knots.len() - degree - 1;
        let mean = |i: usize| knots[i + 1..=i + degree].iter().sum::<f64>() / degree as f64;
        let mut nodes: Vec<f64> = (0..count).map(mean).collect();
        // A mean of equal numbers may be rounded.
        (nodes[0], nodes[count - 1]) = (first, last);
        let collocation = BandMatrix::collocation(&knots, degree, &nodes);
        Self { borders, nodes, collocation }
    }
}

/// A matrix with as many entries beside the diagonal as a degree, factorised. Collocation matrices of B-splines are totally positive:
/// elimination needs no exchange of rows (de Boor and Pinkus 1977).
struct BandMatrix {
    half_width: usize,
    /// Row by row, the diagonal in the middle; below it the factors of the elimination.
    rows: Vec<Vec<f64>>,
}

impl BandMatrix {
    /// Factorises the values of all B-splines at `nodes`, one row a node.
    fn collocation(knots: &[f64], degree: usize, nodes: &[f64]) -> Self {
        let mut matrix = Self { half_width: degree, rows: vec![vec![0.0; 2 * degree + 1]; nodes.len()] };
        for (i, &t) in nodes.iter().enumerate() {
            let span = find_span(knots, degree, t);
            let [values, ..] = basis::<0, WIDE>(knots, degree, span, t);
            // A node lies within the support of its own B-spline, so that all that are not zero there are in the band.
            for (j, &value) in (span - degree..).zip(&values[..=degree]) {
                matrix.rows[i][j + degree - i] = value;
            }
        }
        for k in 0..nodes.len() {
            for i in matrix.below(k) {
                let factor = matrix.rows[i][k + degree - i] / matrix.rows[k][degree];
                matrix.rows[i][k + degree - i] = factor;
                for j in matrix.below(k) {
                    let above = matrix.rows[k][j + degree - k];
                    matrix.rows[i][j + degree - i] -= factor * above;
                }
            }
        }
        matrix
    }

    /// Returns the indices of the rows below `k`, which are those of the columns right of it, within the band.
    fn below(&self, k: usize) -> Range<usize> {
        k + 1..(k + 1 + self.half_width).min(self.rows.len())
    }

    /// Returns the control points whose spline has these values at the nodes, one a row.
    fn solve(&self, values: &[Homogeneous]) -> Vec<Homogeneous> {
        let mut x = values.to_vec();
        let n = self.half_width;
        for k in 0..x.len() {
            for i in self.below(k) {
                let known = x[k];
                x[i] -= known * self.rows[i][k + n - i];
            }
        }
        for k in (0..x.len()).rev() {
            let mut rest = x[k];
            for j in self.below(k) {
                rest -= x[j] * self.rows[k][j + n - k];
            }
            x[k] = rest / self.rows[k][n];
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Point;
    use std::f64::consts::TAU;

    #[test]
    fn a_fit_meets_its_tolerance_everywhere_and_corners_exactly() {
        // An ellipse of axes 50 and 30 by its angle, and a corner at 2.
        let at = |t: f64| {
            let bend = 5.0 * (t - 2.0f64).abs();
            Point::new(50.0 * t.cos(), 30.0 * t.sin(), bend)
        };
        for tolerance in [1e-3, 1e-6, 1e-9] {
            let corners = [0.0, 2.0, TAU];
            let (curve, error) = fit_curve(&corners, 1, |t| Some(at(t).extend(1.0)), tolerance).unwrap();
            assert!(error <= tolerance);
            let seen = (0..=5000).map(|k| TAU * f64::from(k) / 5000.0);
            let worst = seen.map(|t| (curve.evaluate(t) - at(t)).length()).fold(0.0, f64::max);
            // Between nodes the product of the distances from them is greatest near the middles that were looked at.
            assert!(worst <= 1.5 * tolerance, "{worst} at {tolerance}");
            assert!(corners.iter().all(|&t| (curve.evaluate(t) - at(t)).length() < 1e-13));
        }
    }

    #[test]
    fn what_is_a_rational_spline_is_met_at_once() {
        // A quarter of a sphere by two quarter circles: nothing has to be approximated.
        let arc = |t: f64| {
            let (x, y, w) = (1.0 - t * t, 2.0 * t, 1.0 + t * t);
            (x, y, w)
        };
        let at = |uv: Uv| {
            let ((c, s, a), (r, z, b)) = (arc(uv.x), arc(uv.y));
            Some(Homogeneous::new(c * r, s * r, z * a, a * b))
        };
        let (surface, error) = fit_surface([&[0.0, 1.0]; 2], [2, 2], at, 1e-12).unwrap();
        assert!(error < 1e-15);
        assert_eq!(surface.bezier_patches().len(), 1);
        assert!((surface.evaluate(Uv::new(0.3, 0.7)).length() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn what_is_torn_or_missing_is_not_refined_for_ever() {
        let torn = |t: f64| Some(Point::new(t, f64::from(u8::from(t > 0.3)), 0.0).extend(1.0));
        let (curve, error) = fit_curve(&[0.0, 1.0], 3, torn, 1e-6).unwrap();
        assert!(error > 0.1 && curve.points.len() <= MOST_PIECES + LEAST_DEGREE);
        assert!(fit_curve(&[0.0, 1.0], 3, |t| (t < 0.4).then_some(Homogeneous::ONE), 1e-6).is_none());
        assert!(fit_curve(&[0.0, 1.0], 3, |_| Some(Homogeneous::NAN), 1e-6).is_none());
    }
}
