//! A Bézier net as a ray sees it: what its hull excludes, and its parts.

use crate::math::{Homogeneous, Uv};
use glam::{DVec2, DVec3};
use smallvec::SmallVec;

/// Share of a box by which the hull's range is widened for the rounding of its crossings.
const RANGE_ROUNDING: f64 = 1e-10;

/// Control points as the ray sees them, `(w·a, w·b, w·t, w)` for two planes through the ray, over a rectangle of the unit square.
#[derive(Clone)]
pub(super) struct Net {
    pub(super) points: SmallVec<[Homogeneous; 16]>,
    pub(super) degree: [usize; 2],
    pub(super) domain: [[f64; 2]; 2],
}

impl Net {
    /// Whether all control points lie on one side of a plane through the ray by more than `rounding`, so that there is no root.
    pub(super) fn misses(&self, rounding: f64) -> bool {
        let (mut lo, mut hi) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for p in &self.points {
            let across = p.truncate().truncate();
            (lo, hi) = (lo.min(across), hi.max(across));
        }
        lo.x > rounding || lo.y > rounding || hi.x < -rounding || hi.y < -rounding
    }

    /// A distance along the ray, mm, before all of its points; minus infinity where a weight is not positive and the hull bounds nothing.
    pub(super) fn nearest(&self) -> f64 {
        let near = |p: &Homogeneous| if p.w > 0.0 { p.z / p.w } else { f64::NEG_INFINITY };
        self.points.iter().map(near).fold(f64::INFINITY, f64::min)
    }

    fn control(&self, i: usize, j: usize) -> Homogeneous {
        self.points[i * (self.degree[1] + 1) + j]
    }

    /// The homogeneous point at shares of the net, as the ray sees it, by de Casteljau.
    pub(super) fn point(&self, local: Uv) -> Homogeneous {
        let row = |i: usize| {
            let line = (0..=self.degree[1]).map(|j| self.control(i, j)).collect();
            blossom(line, |_| local.y)
        };
        blossom((0..=self.degree[0]).map(row).collect(), |_| local.x)
    }

    /// Longest distance between corresponding control points of the two sides that a parameter joins, mm.
    pub(super) fn edge_length(&self, direction: usize) -> f64 {
        let [p, q] = self.degree;
        let at = |i: usize, j: usize| self.control(i, j).project();
        if direction == 0 {
            (0..=q).map(|j| at(0, j).distance(at(p, j))).fold(0.0, f64::max)
        } else {
            (0..=p).map(|i| at(i, 0).distance(at(i, q))).fold(0.0, f64::max)
        }
    }

    /// Range of one parameter, as shares of the net, that can hold a root, by the hull of distances to a line through the ray along the
    /// other parameter; `None` where none can.
    pub(super) fn range(&self, direction: usize, rounding: f64) -> Option<[f64; 2]> {
        let [p, q] = self.degree;
        // A line through the origin roughly along the other parameter, so that distances grow with this one.
        let flat = |i: usize, j: usize| {
            let h = self.control(i, j);
            h.truncate().truncate() / h.w
        };
        let along = if direction == 0 {
            flat(0, q) - flat(0, 0) + flat(p, q) - flat(p, 0)
        } else {
            flat(p, 0) - flat(0, 0) + flat(p, q) - flat(0, q)
        };
        let Some(normal) = along.perp().try_normalize() else { return Some([0.0, 1.0]) };
        // Bézier clipping (Nishita, Sederberg & Kakimoto 1990): a distance is a polynomial in Bernstein form, whose graph lies in the
        // hull of its control points at k/n. Weights are positive, so that they change no sign and need no division.
        let n = self.degree[direction];
        // Lowest and highest distance at each station.
        let stations: SmallVec<[DVec3; 8]> = (0..=n)
            .map(|k| {
                let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
                for line in 0..=self.degree[1 - direction] {
                    let h = if direction == 0 { self.control(k, line) } else { self.control(line, k) };
                    let distance = h.truncate().truncate().dot(normal);
                    (lo, hi) = (lo.min(distance - 2.0 * rounding), hi.max(distance + 2.0 * rounding));
                }
                DVec3::new(k as f64 / n as f64, lo, hi)
            })
            .collect();
        let (mut first, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
        for (k, s) in stations.iter().enumerate() {
            if s.y <= 0.0 && s.z >= 0.0 {
                (first, last) = (first.min(s.x), last.max(s.x));
            }
            // The hull's edges are among the lines between two of its points, and the other lines lie within it.
            for r in &stations[k + 1..] {
                for (a, b) in [(s.y, r.y), (s.y, r.z), (s.z, r.y), (s.z, r.z)] {
                    if (a < 0.0) != (b < 0.0) {
                        let x = s.x + (r.x - s.x) * a / (a - b);
                        (first, last) = (first.min(x), last.max(x));
                    }
                }
            }
        }
        (first <= last).then(|| [(first - RANGE_ROUNDING).max(0.0), (last + RANGE_ROUNDING).min(1.0)])
    }

    /// The part over `[lo, hi]` of one parameter, as shares of the net, which may reach beyond it.
    pub(super) fn cut(&self, direction: usize, [lo, hi]: [f64; 2]) -> Self {
        let q = self.degree[1];
        let n = self.degree[direction];
        let mut out = self.clone();
        for line in 0..=self.degree[1 - direction] {
            let index = |k: usize| if direction == 0 { k * (q + 1) + line } else { line * (q + 1) + k };
            for k in 0..=n {
                // The blossom of a Bézier curve at n − k times `lo` and k times `hi` is control point k of the part between
                // (Ramshaw).
                let points = (0..=n).map(|i| self.points[index(i)]).collect();
                out.points[index(k)] = blossom(points, |step| if step < k { hi } else { lo });
            }
        }
        let [a, b] = self.domain[direction];
        out.domain[direction] = [a + (b - a) * lo, a + (b - a) * hi];
        out
    }
}

/// The blossom of a polynomial: step `k` of de Casteljau's triangle is taken at `at(k)`.
fn blossom(mut points: SmallVec<[Homogeneous; 8]>, at: impl Fn(usize) -> f64) -> Homogeneous {
    for step in 0..points.len() - 1 {
        let x = at(step);
        for i in 0..points.len() - 1 - step {
            points[i] = points[i] * (1.0 - x) + points[i + 1] * x;
        }
    }
    points[0]
}
