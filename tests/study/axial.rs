//! Light through surfaces about one axis, in a plane and in closed form: shares no code with the program.

/// A surface of revolution `z + h²/R / (1 + √(1 − (1+K)·h²/R²))` with the index behind it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interface {
    pub(crate) z: f64,
    /// Vertex radius; infinite for a plane.
    pub(crate) radius: f64,
    pub(crate) conic: f64,
    pub(crate) index: f64,
}

/// What comes of a disc of parallel light on one receiver: share of its power, and root mean square along either axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spot {
    pub(crate) power: f64,
    pub(crate) rms: f64,
}

/// Share of unpolarised light that passes from index `a` to index `b`, by the cosines on both sides.
pub(crate) fn transmitted(a: f64, b: f64, cos_a: f64, cos_b: f64) -> f64 {
    let s = (a * cos_a - b * cos_b) / (a * cos_a + b * cos_b);
    let p = (b * cos_a - a * cos_b) / (b * cos_a + a * cos_b);
    1.0 - 0.5 * (s * s + p * p)
}

/// Height on the plane `z` of the ray that comes in at height `h` parallel to the axis, and the share of it that gets there.
fn ray(interfaces: &[Interface], h: f64, z: f64) -> (f64, f64) {
    let (mut p, mut d, mut n, mut share) = ([h, -1e3], [0.0, 1.0], 1.0, 1.0);
    for i in interfaces {
        let u = p[1] - i.z;
        let normal;
        if i.radius.is_infinite() {
            let t = -u / d[1];
            p = [p[0] + t * d[0], i.z];
            normal = [0.0, -1.0];
        } else {
            let k = 1.0 + i.conic;
            let a = d[0] * d[0] + k * d[1] * d[1];
            let b = 2.0 * (p[0] * d[0] - i.radius * d[1] + k * u * d[1]);
            let c = p[0] * p[0] - 2.0 * i.radius * u + k * u * u;
            // Of both crossings that of the sheet with the vertex: u below R/(1+K) in size, which is checked by its own sag.
            let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
            let crossings = [(-b + root) / (2.0 * a), (-b - root) / (2.0 * a), -c / b];
            let sag = |h: f64| h * h / i.radius / (1.0 + (1.0 - k * h * h / (i.radius * i.radius)).max(0.0).sqrt());
            let off = |t: &f64| (u + t * d[1] - sag(p[0] + t * d[0])).abs();
            let t =
                crossings.into_iter().filter(|t| t.is_finite()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
            p = [p[0] + t * d[0], p[1] + t * d[1]];
            let gradient = [p[0], -i.radius + k * (p[1] - i.z)];
            let length = gradient[0].hypot(gradient[1]);
            normal = [gradient[0] / length, gradient[1] / length];
        }
        let along = d[0] * normal[0] + d[1] * normal[1];
        let normal = if along > 0.0 { [-normal[0], -normal[1]] } else { normal };
        let cos = along.abs();
        let eta = n / i.index;
        let cos_t = (1.0 - eta * eta * (1.0 - cos * cos)).sqrt();
        share *= transmitted(n, i.index, cos, cos_t);
        d = [0, 1].map(|k| eta * d[k] + (eta * cos - cos_t) * normal[k]);
        n = i.index;
    }
    (p[0] + (z - p[1]) / d[1] * d[0], share)
}

/// The spot of a disc of this radius on the plane `z`.
pub(crate) fn spot(interfaces: &[Interface], disc: f64, z: f64) -> Spot {
    let steps = 4000;
    let (mut power, mut square) = (0.0, 0.0);
    for k in 0..steps {
        let h = disc * (f64::from(k) + 0.5) / f64::from(steps);
        let (y, share) = ray(interfaces, h, z);
        power += share * h;
        square += share * h * 0.5 * y * y;
    }
    let area: f64 = 0.5 * f64::from(steps * steps) * disc / f64::from(steps);
    Spot { power: power / area, rms: (square / power).sqrt() }
}
