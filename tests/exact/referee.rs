//! A judge of 32 digits that shares nothing with the tracer: sums of two floats, and de Boor's algorithm on the surface as given.

use lampyris::math::{Ray, Uv, Vector};
use lampyris::nurbs::Surface;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number of 32 digits: a float and what it rounds away.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Wide(f64, f64);

fn exact_sum(a: f64, b: f64) -> Wide {
    let s = a + b;
    let t = s - a;
    Wide(s, (a - (s - t)) + (b - t))
}

impl Wide {
    pub(crate) fn value(self) -> f64 {
        self.0 + self.1
    }
}

impl From<f64> for Wide {
    fn from(x: f64) -> Self {
        Self(x, 0.0)
    }
}

impl Neg for Wide {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl Add for Wide {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        let (high, low) = (exact_sum(self.0, b.0), exact_sum(self.1, b.1));
        let sum = exact_sum(high.0, high.1 + low.0);
        exact_sum(sum.0, sum.1 + low.1)
    }
}

impl Sub for Wide {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        self + -b
    }
}

impl Mul for Wide {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        // Veltkamp's split: no fused operation is needed.
        let halves = |x: f64| {
            let c = 134_217_729.0 * x;
            let high = c - (c - x);
            (high, x - high)
        };
        let product = self.0 * b.0;
        let ((ah, al), (bh, bl)) = (halves(self.0), halves(b.0));
        let error = ((ah * bh - product) + ah * bl + al * bh) + al * bl;
        exact_sum(product, error + (self.0 * b.1 + self.1 * b.0))
    }
}

impl Div for Wide {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        let first = self.0 / b.0;
        let rest = self - b * first.into();
        let second = rest.0 / b.0;
        let third = (rest - b * second.into()).0 / b.0;
        exact_sum(first, second) + third.into()
    }
}

pub(crate) type Wide3 = [Wide; 3];

/// A point and two derivatives.
pub(crate) struct Place {
    pub(crate) point: Wide3,
    pub(crate) du: Wide3,
    pub(crate) dv: Wide3,
}

pub(crate) fn cross(a: Wide3, b: Wide3) -> Wide3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn wide3(v: Vector) -> Wide3 {
    v.to_array().map(Wide::from)
}

pub(crate) fn rounded(v: Wide3) -> Vector {
    Vector::from_array(v.map(Wide::value))
}

/// The last span that begins at or before `t`, never an empty one.
fn span(knots: &[f64], degree: usize, t: f64) -> usize {
    let last = knots.len() - degree - 2;
    (degree..=last).filter(|&k| knots[k] < knots[k + 1] && (knots[k] <= t || k == degree)).max().unwrap_or(last)
}

fn de_boor(knots: &[f64], p: usize, k: usize, mut d: Vec<[Wide; 4]>, t: Wide) -> ([Wide; 4], [Wide; 4]) {
    let mut slope = [Wide::default(); 4];
    for r in 1..=p {
        if r == p {
            let scale = Wide::from(p as f64) / (Wide::from(knots[k + 1]) - knots[k].into());
            slope = std::array::from_fn(|c| (d[p][c] - d[p - 1][c]) * scale);
        }
        for j in (r..=p).rev() {
            let (low, high) = (Wide::from(knots[k - p + j]), Wide::from(knots[k + 1 + j - r]));
            let a = (t - low) / (high - low);
            d[j] = std::array::from_fn(|c| d[j - 1][c] + (d[j][c] - d[j - 1][c]) * a);
        }
    }
    (d[p], slope)
}

/// Point and derivatives in the polynomial piece that holds `piece`.
pub(crate) fn place(s: &Surface, [u, v]: [Wide; 2], piece: Uv) -> Place {
    let [p, q] = s.degree;
    let (ku, kv) = (span(&s.knots[0], p, piece.x), span(&s.knots[1], q, piece.y));
    let columns = s.counts()[1];
    let (mut values, mut slopes) = (Vec::new(), Vec::new());
    for i in ku - p..=ku {
        let row = (kv - q..=kv).map(|j| s.points[i * columns + j].to_array().map(Wide::from)).collect();
        let (value, slope) = de_boor(&s.knots[1], q, kv, row, v);
        values.push(value);
        slopes.push(slope);
    }
    let (h, hu) = de_boor(&s.knots[0], p, ku, values, u);
    let (hv, _) = de_boor(&s.knots[0], p, ku, slopes, u);
    let point: Wide3 = std::array::from_fn(|k| h[k] / h[3]);
    let slope = |x: &[Wide; 4]| std::array::from_fn(|k| (x[k] - point[k] * x[3]) / h[3]);
    let (du, dv) = (slope(&hu), slope(&hv));
    Place { point, du, dv }
}

pub(crate) fn place_at(s: &Surface, uv: Uv) -> Place {
    place(s, [uv.x.into(), uv.y.into()], uv)
}

/// A root of 32 digits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TrueRoot {
    pub(crate) t: f64,
    /// Of the angle between ray and surface.
    pub(crate) sine: f64,
    /// How far inside the domain it lies, mm; negative outside.
    pub(crate) inside: f64,
}

/// The root that Newton's method finds from `start` in the polynomial piece there.
pub(crate) fn root(s: &Surface, ray: &Ray, start: Uv) -> Option<TrueRoot> {
    let d = ray.direction;
    let main = (0..3).max_by(|&a, &b| d[a].abs().total_cmp(&d[b].abs()))?;
    let others = [(main + 1) % 3, (main + 2) % 3];
    let domain = s.domain();
    let (o, dw) = (wide3(ray.origin), wide3(d));
    let mut uv: [Wide; 2] = [start.x.into(), start.y.into()];
    for _ in 0..30 {
        let at = place(s, uv, start);
        let off: Wide3 = std::array::from_fn(|k| at.point[k] - o[k]);
        let beside = |x: &Wide3, k: usize| x[k] * dw[main] - x[main] * dw[k];
        let f = others.map(|k| beside(&off, k));
        let (a, b) = (others.map(|k| beside(&at.du, k)), others.map(|k| beside(&at.dv, k)));
        let det = a[0] * b[1] - b[0] * a[1];
        let step = [(b[1] * f[0] - b[0] * f[1]) / det, (a[0] * f[1] - a[1] * f[0]) / det];
        let size = [0, 1].map(|k| step[k].value().abs() / (domain[k][1] - domain[k][0]));
        let largest = size[0].max(size[1]);
        if largest.is_nan() || largest >= 1.0 {
            return None;
        }
        uv = [uv[0] - step[0], uv[1] - step[1]];
        if largest < 1e-24 {
            let (du, dv) = (rounded(at.du), rounded(at.dv));
            let n = rounded(cross(at.du, at.dv));
            let beyond = [0, 1].map(|k: usize| {
                let x = uv[k].value();
                (x - domain[k][0]).min(domain[k][1] - x) * if k == 0 { du.length() } else { dv.length() }
            });
            // Beyond its span a polynomial piece is not the surface.
            let piece = |x: [f64; 2]| [0, 1].map(|k| span(&s.knots[k], s.degree[k], x[k]));
            if piece(uv.map(Wide::value)) != piece(start.to_array()) {
                return None;
            }
            return Some(TrueRoot {
                t: (off[main] / dw[main]).value(),
                sine: n.dot(d).abs() / n.length(),
                inside: beyond[0].min(beyond[1]),
            });
        }
    }
    None
}
