//! The hull of distances over a segment or a triangle: sharper than the largest distance of a control point.
//!
//! A convex distance of Σ cᵢwᵢBᵢ / Σ wᵢBᵢ is at most Σ dᵢwᵢBᵢ / Σ wᵢBᵢ with the distances dᵢ of the control points: a scalar
//! rational Bézier function. Its largest value is found by halving its coefficients alone, at a small share of what halving
//! the piece itself and measuring again would cost. For an arc, whose middle control point lies twice as far out as the arc,
//! the first halvings already give nearly the arc's own distance.

use smallvec::{SmallVec, smallvec};

/// Halvings in a row; two of them halve a triangle's sides, one a segment.
const DEPTH: [u32; 2] = [4, 8];

/// Distances over one piece, and buffers for halving.
#[derive(Default)]
pub(in crate::tessellate) struct ScalarBezier {
    degree: usize,
    /// Distance and weight of each control point, in the order of `simplex_net.rs`.
    control: Vec<(f64, f64)>,
    /// Nets that wait for halving, one after another.
    stack: Vec<f64>,
    line: Vec<f64>,
}

impl ScalarBezier {
    /// Takes in distances and weights of the control points of a segment or triangle; returns the largest distance.
    pub(in crate::tessellate) fn load(&mut self, points: impl Iterator<Item = (f64, f64)>, degree: usize) -> f64 {
        self.degree = degree;
        self.control.clear();
        self.control.extend(points);
        self.control.iter().map(|x| x.0).fold(0.0, f64::max)
    }

    /// Returns a bound of these distances over the segment (`N` = 2) or triangle (3), by control points or by halving; `None` unless within
    /// the limit.
    pub(in crate::tessellate) fn bound<const N: usize>(
        &mut self,
        points: impl Iterator<Item = (f64, f64)>,
        degree: usize,
        limit: f64,
    ) -> Option<f64> {
        let most = self.load(points, degree);
        if most <= limit { Some(most) } else { self.bound_within::<N>(limit) }
    }

    /// Returns the largest distance at the corners of the loaded piece, a segment (`N` = 2) or a triangle (3).
    pub(in crate::tessellate) fn largest_corner<const N: usize>(&self) -> f64 {
        let n = self.degree;
        let second = if N == 2 { n } else { n * (n + 1) / 2 };
        self.control[0].0.max(self.control[second].0).max(self.control[self.control.len() - 1].0)
    }

    /// Halves the loaded piece until a bound within the limit is found; `None` where a corner exceeds it or halvings run out.
    pub(in crate::tessellate) fn bound_within<const N: usize>(&mut self, limit: f64) -> Option<f64> {
        let n = self.degree;
        let heaviest = self.control.iter().fold(0.0, |a: f64, x| a.max(x.1));
        self.stack.clear();
        // Coefficients of W·(d − limit): a piece is within the limit where none is positive. Their sign answers the question
        // without a division, and halving keeps them as polynomials.
        let e = |x: usize| self.control[x].1 * (self.control[x].0 - limit);
        if N == 2 {
            self.stack.extend((0..=n).map(e));
        } else {
            // Lines along the side from the first corner to the last, which is halved first.
            for j in 0..=n {
                self.stack.extend((0..=n - j).map(|k| (j + k) * (j + k + 1) / 2 + k).map(e));
            }
        }
        let size = self.stack.len();
        let mut depths: SmallVec<[u32; 16]> = smallvec![DEPTH[3 - N]];
        let mut most = f64::NEG_INFINITY;
        while let Some(depth) = depths.pop() {
            let start = self.stack.len() - size;
            // A polynomial in Bernstein form is at most its largest coefficient.
            let worst = self.stack[start..].iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b));
            if worst <= 0.0 {
                most = most.max(worst);
                self.stack.truncate(start);
                continue;
            }
            // Coefficients at corners are values: a positive one shows that the limit is passed, and no halving helps.
            if depth == 0 || self.largest_value_taken::<N>(start) > 0.0 {
                return None;
            }
            if N == 2 {
                self.halve_segment(start, n)
            } else {
                self.halve_triangle(start, n)
            }
            // Depth first: as many nets wait as there are levels, not as there are parts.
            depths.extend([depth - 1, depth - 1]);
        }
        // From W·(d − limit) ≤ most ≤ 0 follows d ≤ limit + most/W, and W is at most its largest coefficient.
        Some(limit + most / heaviest)
    }

    /// Returns the largest corner of the net from `start` on: its value is taken, not only approached.
    fn largest_value_taken<const N: usize>(&self, start: usize) -> f64 {
        let n = self.degree;
        let net = &self.stack[start..];
        let last = net[net.len() - 1];
        if N == 2 { net[0].max(last) } else { net[0].max(net[n]).max(last) }
    }

    /// Halves the polynomial of degree `n` that the stack holds from `start` to its top: the lower half takes its place, the upper follows.
    fn halve_segment(&mut self, start: usize, n: usize) {
        self.stack.extend_from_within(start..);
        let (low, high) = self.stack[start..].split_at_mut(n + 1);
        // The second half takes its first points step by step.
        for step in 0..=n {
            low[step] = high[0];
            for k in 0..n - step {
                high[k] = 0.5 * (high[k] + high[k + 1]);
            }
        }
    }

    /// Replaces the triangle's net on top of the stack by its two halves, cut at the middle of the side along its lines; the halves' lines
    /// run across the next side, opposite to the new corner.
    fn halve_triangle(&mut self, start: usize, n: usize) {
        let size = (n + 1) * (n + 2) / 2;
        self.stack.resize(start + 3 * size, 0.0);
        let (net, halves) = self.stack[start..].split_at_mut(size);
        let (a, b) = halves.split_at_mut(size);
        // First place of each line of a half.
        let place = |line: usize| line * (n + 1) - line * line.saturating_sub(1) / 2;
        let mut from = 0;
        for k in 0..=n {
            let len = n - k + 1;
            self.line.clear();
            self.line.extend_from_slice(&net[from..from + len]);
            from += len;
            // After r steps, the first entry belongs to the half at the start, the last to that at the end.
            for r in 0..len {
                let now = len - r;
                a[place(r) + k] = self.line[0];
                b[place(r) + k] = self.line[now - 1];
                for i in 0..now - 1 {
                    self.line[i] = 0.5 * (self.line[i] + self.line[i + 1]);
                }
            }
        }
        net.copy_from_slice(a);
        a.copy_from_slice(b);
        self.stack.truncate(start + 2 * size);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Value of the loaded function over a triangle at barycentric coordinates.
    fn value(d: &[f64], n: usize, b: [f64; 3]) -> f64 {
        let factorial = |k: usize| (1..=k).map(|x| x as f64).product::<f64>();
        let mut sum = 0.0;
        for m in 0..=n {
            for k in 0..=m {
                let (i, j) = (n - m, m - k);
                let c = factorial(n) / factorial(i) / factorial(j) / factorial(k);
                sum += d[m * (m + 1) / 2 + k] * c * b[0].powi(i as i32) * b[1].powi(j as i32) * b[2].powi(k as i32);
            }
        }
        sum
    }

    #[test]
    fn halving_bounds_the_largest_value_and_comes_near() {
        let n = 4;
        for seed in 1..40u64 {
            let mut x = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
            let mut random = || {
                x ^= x << 13;
                x ^= x >> 7;
                x ^= x << 17;
                (x >> 11) as f64 / (1u64 << 53) as f64
            };
            let mut d: Vec<f64> = (0..15).map(|_| random()).collect();
            (d[0], d[10], d[14]) = (0.0, 0.0, 0.0);
            let mut most = 0f64;
            for i in 0..=40 {
                for j in 0..=40 - i {
                    let (a, b) = (i as f64 / 40.0, j as f64 / 40.0);
                    most = most.max(value(&d, n, [a, b, 1.0 - a - b]));
                }
            }
            let mut scalar = ScalarBezier::default();
            scalar.load(d.iter().map(|&d| (d, 1.0)), n);
            assert!(scalar.bound_within::<3>(0.999 * most).is_none());
            // Random coefficients are far rougher than distances; four halvings come within a fifth.
            let bound = scalar.bound_within::<3>(1.2 * most).unwrap();
            assert!(most <= bound && bound <= 1.2 * most, "{most} {bound}");
            let row: Vec<f64> = (0..=n).map(|j| d[j * (j + 1) / 2]).collect();
            let along = (0..=100).map(|i| value(&d, n, [1.0 - i as f64 / 100.0, i as f64 / 100.0, 0.0]));
            let most = along.fold(0.0, f64::max);
            scalar.load(row.iter().map(|&d| (d, 1.0)), n);
            assert!(scalar.bound_within::<2>(0.999 * most).is_none());
            let bound = scalar.bound_within::<2>(1.01 * most).unwrap();
            assert!(most <= bound && bound <= 1.01 * most, "{most} {bound}");
        }
    }
}
