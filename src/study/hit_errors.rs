//! Errors of the hits of one intersector against the exact hits of the same rays, and the order at which they fall.

use super::{Quantiles, cross_check::angle_deg};
use crate::intersect::Hit;
use crate::math::Ray;
use crate::optics::{reflect, refract};

/// Sum of squares of logarithms below which all points stand at one abscissa and have no slope.
const SAME_ABSCISSA: f64 = 1e-12;

/// Index of air over that of glass: the refraction that direction errors are given for.
const AIR_TO_GLASS: f64 = 1.0 / 1.5;

/// Errors of one intersector's hits against the exact hits of the same rays.
#[derive(Clone, Debug, Default)]
pub(super) struct HitErrors {
    /// Distance between the two hit points, mm.
    pub(super) position: Quantiles,
    /// Angle between the mirrored directions, degrees.
    pub(super) reflected: Quantiles,
    /// Angle between the directions refracted into glass, degrees.
    pub(super) refracted: Quantiles,
    /// Euclidean distance of the unit normals.
    pub(super) normal: Quantiles,
    /// Rays where only one hits, or where they hit different faces.
    pub(super) flips: u64,
}

impl HitErrors {
    /// Measures the errors of hits against the exact ones of the same rays; a ray that hits on one side alone, or another face, is only
    /// counted.
    pub(super) fn between(rays: &[Ray], hits: &[Option<Hit>], exact: &[Option<Hit>]) -> Self {
        let mut e = Self::default();
        for ((ray, hit), truth) in rays.iter().zip(hits).zip(exact) {
            let (h, t) = match (hit, truth) {
                (None, None) => continue,
                // On another face the distance says nothing about the facets: it is counted, not averaged.
                (Some(h), Some(t)) if h.face == t.face => (h, t),
                _ => {
                    e.flips += 1;
                    continue;
                }
            };
            e.position.add((h.t - t.t).abs());
            e.normal.add(h.normal.distance(t.normal));
            e.reflected.add(angle_deg(reflect(ray.direction, h.normal), reflect(ray.direction, t.normal)));
            // Total reflection of either leaves no direction to compare.
            if let (Some(a), Some(b)) =
                (refract(ray.direction, h.normal, AIR_TO_GLASS), refract(ray.direction, t.normal, AIR_TO_GLASS))
            {
                e.refracted.add(angle_deg(a, b));
            }
        }
        e
    }
}

/// Returns the slope of log y over log x by least squares; `None` with fewer than two points above 0, or all at one x.
pub(crate) fn slope(points: &[[f64; 2]]) -> Option<f64> {
    // Powers are straight lines over logarithms.
    let logs: Vec<[f64; 2]> = points.iter().filter(|p| p[0] > 0.0 && p[1] > 0.0).map(|p| p.map(f64::ln)).collect();
    let n = logs.len() as f64;
    let [mx, my] = [0, 1].map(|k| logs.iter().map(|p| p[k]).sum::<f64>() / n);
    let (sxy, sxx) = logs.iter().fold((0.0, 0.0), |(a, b), [x, y]| (a + (x - mx) * (y - my), b + (x - mx).powi(2)));
    (logs.len() >= 2 && sxx > SAME_ABSCISSA).then(|| sxy / sxx)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_of_a_power_law() {
        let points: Vec<_> = (1..6).map(|i| [f64::from(i), 3.0 * f64::from(i).powf(1.5)]).collect();
        assert!((slope(&points).unwrap() - 1.5).abs() < 1e-12);
        assert_eq!(slope(&points[..1]), None);
        // The mean of three equal logarithms is an ulp off.
        assert_eq!(slope(&[[0.03, 1.0], [0.03, 2.0], [0.03, 5.0]]), None);
    }
}
