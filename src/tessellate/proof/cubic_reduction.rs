//! A patch of high degree over a small rectangle as one of degree three, with a bound of the difference.
//!
//! The triangular net of a patch of degrees (p, q) has degree p + q and costs the fourth power of that: 84 µs at degrees 9 and 9. Over
//! the rectangle of one facet such a patch is nearly a cubic: the Hermite cubic at both ends, raised to the degree again,
//! differs from the patch by at most the largest difference of their control points.

use crate::math::{Homogeneous, Point};
use crate::nurbs::BezierPatch;

/// Degree of what stands for the patch.
const REDUCED_DEGREE: usize = 3;

/// Whether either degree is above [`REDUCED_DEGREE`], so that reducing gains something.
pub(in crate::tessellate) fn is_high(patch: &BezierPatch) -> bool {
    patch.degree[0].max(patch.degree[1]) > REDUCED_DEGREE
}

/// Reduces patches to cubics, and holds the last one.
pub(in crate::tessellate) struct CubicReduction {
    /// The last one, over the parameters from 0 to 1.
    pub(in crate::tessellate) patch: BezierPatch,
    /// One line of the net, and the net after the first direction.
    line: Vec<Homogeneous>,
    cubic: Vec<Homogeneous>,
}

impl Default for CubicReduction {
    fn default() -> Self {
        let patch = BezierPatch { degree: [0, 0], points: Vec::new(), domain: [[0.0, 1.0]; 2] };
        Self { patch, line: Vec::new(), cubic: Vec::new() }
    }
}

impl CubicReduction {
    /// Sets `patch` to the cubic of `net`, whose positions are relative to `origin`; the patch itself is not. Returns a bound of the
    /// distance between the two, point by point, in mm; infinite where weights leave none.
    pub(in crate::tessellate) fn reduce(&mut self, net: &[Homogeneous], degree: [usize; 2], origin: Point) -> f64 {
        let [p, q] = degree;
        // Along u first, line by line; then along v. The differences of both add up.
        let (mut first, mut second) = ([0f64; 2], [0f64; 2]);
        self.cubic.clear();
        for j in 0..=q {
            self.line.clear();
            self.line.extend((0..=p).map(|i| net[i * (q + 1) + j]));
            reduce_line(&self.line, &mut self.cubic, &mut first);
        }
        let pk = p.min(REDUCED_DEGREE);
        self.patch.points.clear();
        for i in 0..=pk {
            self.line.clear();
            self.line.extend((0..=q).map(|j| self.cubic[j * (pk + 1) + i]));
            reduce_line(&self.line, &mut self.patch.points, &mut second);
        }
        self.patch.degree = [pk, q.min(REDUCED_DEGREE)];
        // S − S' = (A − A')/W' + S·(W' − W)/W'; seen from the facet, S is no longer than the facet is large.
        let lightest = net.iter().map(|c| c.w).fold(f64::INFINITY, f64::min);
        let far = net.iter().map(|c| c.truncate().length() / c.w).fold(0.0, f64::max);
        let (off, weight) = (first[0] + second[0], first[1] + second[1]);
        let positive = self.patch.points.iter().all(|c| c.w > 0.0) && weight < 0.5 * lightest;
        for c in &mut self.patch.points {
            *c = (c.truncate() + origin * c.w).extend(c.w);
        }
        if positive { (off + far * weight) / (lightest - weight) } else { f64::INFINITY }
    }
}

/// Appends the line's Hermite cubic to `out`, or the line itself where its degree is no higher. Raises `off` to the largest differences of
/// homogeneous positions and of weights.
fn reduce_line(line: &[Homogeneous], out: &mut Vec<Homogeneous>, off: &mut [f64; 2]) {
    let n = line.len() - 1;
    // Already a cubic or less: it is exact as it is.
    if n <= REDUCED_DEGREE {
        out.extend_from_slice(line);
        return;
    }
    let third = n as f64 / REDUCED_DEGREE as f64;
    let c = [line[0], line[0] + (line[1] - line[0]) * third, line[n] - (line[n] - line[n - 1]) * third, line[n]];
    out.extend_from_slice(&c);
    // Raised again: coefficient k is the sum of C(3, i) C(n − 3, k − i) / C(n, k) cᵢ, a hypergeometric distribution.
    // The first and last two coefficients agree by construction: Hermite's conditions are those.
    let (nf, mut worst) = (n as f64, [0f64; 2]);
    let all = nf * (nf - 1.0) * (nf - 2.0);
    for (k, &x) in line.iter().enumerate().take(n - 1).skip(2) {
        let (a, b) = (k as f64, nf - k as f64);
        let w = [
            b * (b - 1.0) * (b - 2.0) / all,
            3.0 * a * b * (b - 1.0) / all,
            3.0 * a * (a - 1.0) * b / all,
            a * (a - 1.0) * (a - 2.0) / all,
        ];
        let d = c[0] * w[0] + c[1] * w[1] + c[2] * w[2] + c[3] * w[3] - x;
        worst = [worst[0].max(d.truncate().length()), worst[1].max(d.w.abs())];
    }
    *off = [off[0].max(worst[0]), off[1].max(worst[1])];
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Uv;

    #[test]
    fn the_cubic_stays_within_its_bound() {
        let degree = [7, 5];
        let net: Vec<Homogeneous> = (0..8 * 6)
            .map(|k| {
                let (i, j) = ((k / 6) as f64 / 7.0, (k % 6) as f64 / 5.0);
                let w = 1.0 + 0.1 * i * j;
                let z = 0.3 * i * i + 0.2 * (3.0 * j).sin() + 0.05 * (5.0 * i).cos();
                (Point::new(i, j, z) * w).extend(w)
            })
            .collect();
        let whole = BezierPatch { degree, points: net.clone(), domain: [[0.0, 1.0]; 2] };
        let origin = Point::new(3.0, -2.0, 1.0);
        let mut reduction = CubicReduction::default();
        let off = reduction.reduce(&net, degree, origin);
        assert!(off < 0.05, "{off}");
        for k in 0..=400 {
            let x = Uv::new((k % 21) as f64 / 20.0, (k / 21) as f64 / 20.0);
            let [a, b] = [&whole, &reduction.patch].map(|p| p.homogeneous_point(x).project());
            assert!((a + origin - b).length() <= off + 1e-14);
        }
    }
}
