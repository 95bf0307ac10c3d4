//! Scattering inside a medium.

use super::error::{Error, require};
use crate::math::{Vector, orthonormal_pair};
use std::f64::consts::PI;

/// Scattering inside a medium, with the phase function of Henyey and Greenstein (Astrophys. J. 93, 70, 1941).
///
/// ```
/// use lampyris::optics::BulkScatter;
/// let fog = BulkScatter::new(0.1, 0.0)?;
/// // Isotropic, and after ten mm a share of 1/e has not been scattered.
/// assert!((fog.density(0.3) - 0.25 / std::f64::consts::PI).abs() < 1e-15);
/// assert!((fog.free_path(1.0 - (-1f64).exp()) - 10.0).abs() < 1e-12);
/// # Ok::<(), lampyris::optics::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BulkScatter {
    /// Scattering events per mm of way.
    pub coefficient: f64,
    /// Mean cosine of the scattering angle, in (−1, 1): 0 isotropic, towards 1 forward.
    pub g: f64,
}

/// Mean cosine below which the series in g is used: its next term, g², is below the rounding that division by 2g leaves.
const ISOTROPIC: f64 = 1e-6;
/// Most events per mm: over ways shorter than a wavelength light does not scatter event by event, and paths would never end.
const LARGEST_COEFFICIENT: f64 = 1e4;

impl BulkScatter {
    /// Scattering with this coefficient, events per mm, and mean cosine `g`.
    ///
    /// # Errors
    /// When the coefficient is negative or above 10⁴ per mm, or `g` outside (−1, 1).
    pub fn new(coefficient: f64, g: f64) -> Result<Self, Error> {
        let is_possible = (0.0..=LARGEST_COEFFICIENT).contains(&coefficient);
        require("a scattering coefficient", coefficient, is_possible, "from 0 to 10 000 per mm")?;
        require("the mean cosine g", g, g.abs() < 1.0, "above -1 and below 1")?;
        Ok(Self { coefficient, g })
    }

    /// Draws the way to the next event, mm, exponentially distributed; infinite without scattering. `u` uniform in `[0, 1)`.
    pub fn free_path(&self, u: f64) -> f64 {
        if self.coefficient > 0.0 { -(-u).ln_1p() / self.coefficient } else { f64::INFINITY }
    }

    /// Share of the scattered light per steradian at this cosine of the scattering angle; it integrates to 1.
    pub fn density(&self, cos: f64) -> f64 {
        let g = self.g;
        let d = 1.0 + g * g - 2.0 * g * cos;
        (1.0 - g * g) / (4.0 * PI * d * d.sqrt())
    }

    /// Draws the unit direction after an event from the unit direction `d` before it; `u` uniform in `[0, 1)²`.
    pub fn sample(&self, d: Vector, u: [f64; 2]) -> Vector {
        let g = self.g;
        let cos = if g.abs() < ISOTROPIC {
            // The limit of the formula below, which would divide by zero; its next term is of order g.
            2.0 * u[0] - 1.0 + 1.5 * g * (1.0 - (2.0 * u[0] - 1.0).powi(2))
        // The cumulative distribution of the cosine has this closed inverse.
        } else {
            let q = (1.0 - g * g) / (1.0 - g + 2.0 * g * u[0]);
            (1.0 + g * g - q * q) / (2.0 * g)
        }
        .clamp(-1.0, 1.0);
        let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
        let (a, b) = orthonormal_pair(d);
        let (s, c) = (2.0 * PI * u[1]).sin_cos();
        (d * cos + (a * c + b * s) * sin).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::testing::{numbers, pairs};

    #[test]
    fn the_mean_cosine_is_g() {
        for g in [-0.7, 0.0, 3e-7, 0.3, 0.85] {
            let s = BulkScatter::new(1.0, g).unwrap();
            let d = Vector::new(0.48, -0.6, 0.64);
            let n = 100_000;
            let mean = pairs(n).map(|u| s.sample(d, u).dot(d)).sum::<f64>() / n as f64;
            // Variance of the cosine is at most 1/3 + g².
            assert!((mean - g).abs() < 4.0 * (0.6f64 / n as f64).sqrt(), "g = {g}: {mean}");
        }
    }

    #[test]
    fn ways_shorter_than_a_wavelength_are_refused() {
        assert!(BulkScatter::new(1e4, 0.0).is_ok() && BulkScatter::new(0.0, 0.0).is_ok());
        for wrong in [-1.0, 1e5, f64::INFINITY, f64::NAN] {
            assert!(BulkScatter::new(wrong, 0.0).is_err(), "{wrong}");
        }
    }

    #[test]
    fn samples_follow_the_density() {
        let s = BulkScatter::new(1.0, 0.6).unwrap();
        let (bins, n) = (20, 200_000);
        let mut count = vec![0.0; bins];
        for u in pairs(n) {
            let cos = s.sample(Vector::Z, u).z;
            count[((cos + 1.0) * 0.5 * bins as f64).min(bins as f64 - 1.0) as usize] += 1.0;
        }
        // Integral of the density: (1 - g²)/(2g)·[1/√(1 + g² - 2g·cos)] between the bounds.
        let antiderivative = |c: f64| (1.0 - 0.36) / 1.2 / (1.36 - 1.2 * c).sqrt();
        let mut chi2 = 0.0;
        for (i, c) in count.iter().enumerate() {
            let (a, b) = (-1.0 + 0.1 * i as f64, -0.9 + 0.1 * i as f64);
            let expected = n as f64 * (antiderivative(b) - antiderivative(a));
            chi2 += (c - expected) * (c - expected) / expected;
            let (low, high) = (0.5 * (a + b) - 1e-4, 0.5 * (a + b) + 1e-4);
            let mean = (antiderivative(high) - antiderivative(low)) / 2e-4;
            assert!((2.0 * PI * s.density(0.5 * (a + b)) - mean).abs() < 1e-6 * mean);
        }
        assert!(chi2 < 19.0 + 5.0 * 38f64.sqrt(), "{chi2}");
    }

    #[test]
    fn free_paths_have_the_mean_of_an_exponential() {
        let s = BulkScatter::new(0.25, 0.0).unwrap();
        let n = 100_000;
        let mean = numbers(n).map(|u| s.free_path(u)).sum::<f64>() / n as f64;
        assert!((mean - 4.0).abs() < 4.0 * 4.0 / (n as f64).sqrt());
        assert_eq!(BulkScatter::new(0.0, 0.0).unwrap().free_path(0.5), f64::INFINITY);
        assert!(BulkScatter::new(1.0, 1.0).is_err());
    }
}
