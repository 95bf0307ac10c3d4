//! Scattering at rough surfaces.

use super::abg::Abg;
use super::error::{Error, require};
use super::sampling::{cosine_power, direction_about, lambertian};
use crate::math::Vector;
use std::f64::consts::PI;

/// How light leaves a rough surface: part of it off the specular direction, by a lobe.
///
/// The same lobe serves reflection and transmission: `specular` is the mirrored or the refracted direction, `n` the unit
/// normal on the side that direction leaves to.
#[derive(Clone, Debug, PartialEq)]
pub struct Scatter {
    /// Share of the light that the lobe takes; the rest stays specular.
    pub share: f64,
    /// Where it goes.
    pub lobe: Lobe,
}

/// A distribution of directions about the specular one or the normal.
///
/// ```
/// use lampyris::math::Vector;
/// use lampyris::optics::Lobe;
/// // A Lambertian surface sends cos θ / π per steradian.
/// let out = Vector::new(0.6, 0.0, 0.8);
/// assert!((Lobe::Lambertian.density(Vector::Z, Vector::Z, out) - 0.8 / std::f64::consts::PI).abs() < 1e-15);
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Lobe {
    /// `cos θ/π` about the normal, wherever the light came from.
    Lambertian,
    /// The angle from the specular direction, laid out flat, is a two-dimensional Gaussian of deviation `sigma` (radians)
    /// in each direction.
    Gaussian {
        /// Radians.
        sigma: f64,
    },
    /// `cosᵐ` of the angle from the specular direction.
    Cosine {
        /// m, zero or more.
        exponent: f64,
    },
    /// `A/(B + |Δβ|^g)`, which also says how much is scattered: what it leaves stays specular.
    Abg(Abg),
}

impl Scatter {
    /// Makes a scatter of `share` by `lobe`.
    ///
    /// # Errors
    /// When the share is outside `[0, 1]`, a `sigma` is not positive or an exponent negative.
    pub fn new(share: f64, lobe: Lobe) -> Result<Self, Error> {
        require("the scattered share", share, (0.0..=1.0).contains(&share), "from 0 to 1")?;
        match lobe {
            Lobe::Gaussian { sigma } => require("sigma", sigma, sigma > 0.0, "a positive angle")?,
            Lobe::Cosine { exponent } => require("the exponent", exponent, exponent >= 0.0, "zero or more")?,
            _ => 0.0,
        };
        Ok(Self { share, lobe })
    }

    /// Whether any light leaves the specular direction.
    pub fn scatters(&self) -> bool {
        self.share > 0.0 && !matches!(&self.lobe, Lobe::Abg(abg) if abg.coefficients()[0] == 0.0)
    }

    /// Draws a unit direction to leave in, on the side of `n`; `None` when this light stays specular. `u` uniform in `[0, 1)³`.
    pub fn sample(&self, specular: Vector, n: Vector, u: [f64; 3]) -> Option<Vector> {
        if u[0] < self.share { self.lobe.sample(specular, n, [u[1], u[2]]) } else { None }
    }

    /// Share of the light per steradian around `out`, a unit direction, without the specular part; 0 below the surface.
    pub fn density(&self, specular: Vector, n: Vector, out: Vector) -> f64 {
        self.share * self.lobe.density(specular, n, out)
    }
}

impl Lobe {
    /// Draws a unit direction on the side of `n`; `None` for the share that stays specular (ABg alone). `u` uniform in `[0, 1)²`.
    ///
    /// What a lobe about the specular direction would send through the surface is mirrored in it, so that no power is lost
    /// at grazing incidence; [`Lobe::density`] accounts for it.
    pub fn sample(&self, specular: Vector, n: Vector, u: [f64; 2]) -> Option<Vector> {
        match self {
            Self::Lambertian => Some(lambertian(n, u)),
            Self::Gaussian { sigma } => {
                // The inverse of the flat Gaussian's cumulative, cut where an angle of π ends it.
                let angle = sigma * (-2.0 * (-u[0] * share_below_pi(*sigma)).ln_1p()).sqrt();
                Some(fold_to_side(direction_about(specular, angle.cos(), angle.sin(), u[1]), n))
            }
            Self::Cosine { exponent } => Some(fold_to_side(cosine_power(specular, *exponent, u), n)),
            Self::Abg(abg) => abg.sample(specular, n, u),
        }
    }

    /// Probability per steradian of [`Lobe::sample`] around `out`, a unit direction; it integrates to 1, for ABg to the share it scatters,
    /// and is 0 below the surface.
    pub fn density(&self, specular: Vector, n: Vector, out: Vector) -> f64 {
        let cos = out.dot(n);
        if cos <= 0.0 {
            return 0.0;
        }
        // A direction is reached by itself, and from its mirror image by folding.
        let both = |lobe: &dyn Fn(f64) -> f64| lobe(specular.dot(out)) + lobe(specular.dot(mirror_image(out, n)));
        match self {
            Self::Lambertian => cos / PI,
            Self::Gaussian { sigma } => both(&|c| gaussian(c, *sigma)),
            Self::Cosine { exponent } => {
                both(&|c| if c > 0.0 { (exponent + 1.0) / (2.0 * PI) * c.powf(*exponent) } else { 0.0 })
            }
            Self::Abg(abg) => abg.density(specular, n, out),
        }
    }
}

/// Share of the flat Gaussian that lies within an angle of π.
fn share_below_pi(sigma: f64) -> f64 {
    -(-PI * PI / (2.0 * sigma * sigma)).exp_m1()
}

/// Angle, radians, below which it stands for its sine: they differ by a sixth of its square, 2e-9 of the density.
const SMALL_ANGLE: f64 = 1e-4;

/// Density per steradian of the Gaussian of deviation `sigma`, radians, at the cosine of the angle from its axis: the flat density times
/// θ/sin θ.
fn gaussian(cos: f64, sigma: f64) -> f64 {
    let angle = cos.clamp(-1.0, 1.0).acos();
    let stretch = if angle < SMALL_ANGLE { 1.0 } else { angle / angle.sin().max(f64::MIN_POSITIVE) };
    let flat = (-angle * angle / (2.0 * sigma * sigma)).exp() / (2.0 * PI * sigma * sigma);
    flat * stretch / share_below_pi(sigma)
}

/// `d` mirrored in the plane across the unit vector `n`.
fn mirror_image(d: Vector, n: Vector) -> Vector {
    d - n * (2.0 * d.dot(n))
}

/// Returns `d`, or its mirror image in the surface where it points away from the side of the unit normal `n`.
fn fold_to_side(d: Vector, n: Vector) -> Vector {
    if d.dot(n) < 0.0 { mirror_image(d, n) } else { d }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::orthonormal_pair;
    use crate::optics::reflect;
    use crate::optics::testing::pairs;

    /// χ² of samples against the density, integrated by midpoints over 16 × 24 cells of cos θ and azimuth.
    fn chi_square(lobe: &Lobe, specular: Vector, n: Vector, samples: usize) -> (f64, f64) {
        const RINGS: usize = 16;
        const SECTORS: usize = 24;
        const FINE: usize = 24;
        let (a, b) = orthonormal_pair(n);
        let mut count = vec![0.0; RINGS * SECTORS + 1];
        for u in pairs(samples) {
            let Some(d) = lobe.sample(specular, n, u) else {
                count[RINGS * SECTORS] += 1.0;
                continue;
            };
            assert!((d.length() - 1.0).abs() < 1e-14 && d.dot(n) >= 0.0);
            let azimuth = d.dot(b).atan2(d.dot(a)).rem_euclid(2.0 * PI);
            let ring = (d.dot(n) * RINGS as f64).min(RINGS as f64 - 1.0) as usize;
            let sector = (azimuth / (2.0 * PI) * SECTORS as f64).min(SECTORS as f64 - 1.0) as usize;
            count[ring * SECTORS + sector] += 1.0;
        }
        let cell = 2.0 * PI / (RINGS * FINE * SECTORS * FINE) as f64;
        let mut expected = vec![0.0; RINGS * SECTORS + 1];
        for i in 0..RINGS * FINE {
            let z = (i as f64 + 0.5) / (RINGS * FINE) as f64;
            let r = (1.0 - z * z).sqrt();
            for j in 0..SECTORS * FINE {
                let (s, c) = (2.0 * PI * (j as f64 + 0.5) / (SECTORS * FINE) as f64).sin_cos();
                let out = (a * c + b * s) * r + n * z;
                expected[i / FINE * SECTORS + j / FINE] += lobe.density(specular, n, out) * cell;
            }
        }
        let total: f64 = expected.iter().sum();
        expected[RINGS * SECTORS] = (1.0 - total).max(0.0);
        // Cells that expect fewer than 20 go together.
        let (mut chi2, mut cells, mut rest) = (0.0, 0.0, [0.0; 2]);
        for (&c, &e) in count.iter().zip(&expected) {
            let e = e * samples as f64;
            if e < 20.0 {
                rest = [rest[0] + c, rest[1] + e];
            } else {
                chi2 += (c - e) * (c - e) / e;
                cells += 1.0;
            }
        }
        if rest[1] > 5.0 {
            chi2 += (rest[0] - rest[1]).powi(2) / rest[1];
        }
        (chi2 / cells, total)
    }

    #[test]
    fn samples_follow_their_densities_at_every_incidence() {
        let n = Vector::new(0.48, 0.6, 0.64);
        let (a, _) = orthonormal_pair(n);
        let lobes = [
            Lobe::Lambertian,
            Lobe::Gaussian { sigma: 0.3 },
            Lobe::Gaussian { sigma: 0.8 },
            Lobe::Cosine { exponent: 20.0 },
            Lobe::Cosine { exponent: 0.0 },
            Lobe::Abg(Abg::new(0.05, 0.02, 2.0).unwrap()),
            Lobe::Abg(Abg::new(0.03, 0.05, 1.3).unwrap()),
        ];
        for lobe in &lobes {
            for i_deg in [0.0, 50.0, 85.0f64] {
                let i = i_deg.to_radians();
                let specular = reflect(a * i.sin() - n * i.cos(), n);
                let (chi2, total) = chi_square(lobe, specular, n, 100_000);
                // Some 150 to 384 cells: a deviation of the mean χ² by 0.5 is beyond four standard deviations.
                assert!(chi2 < 1.5, "{lobe:?} at {i_deg}°: χ² per cell {chi2}");
                match lobe {
                    Lobe::Abg(_) => assert!(total < 1.0),
                    _ => assert!((total - 1.0).abs() < 3e-3, "{lobe:?} at {i_deg}°: {total}"),
                }
            }
        }
    }

    #[test]
    fn a_gaussian_keeps_0_865_within_two_deviations() {
        let lobe = Lobe::Gaussian { sigma: 0.02 };
        let n = 200_000;
        let inside = pairs(n)
            .filter(|&u| lobe.sample(Vector::Z, Vector::Z, u).unwrap().cross(Vector::Z).length().asin() < 0.04)
            .count();
        let share = inside as f64 / n as f64;
        assert!((share - 0.864665).abs() < 4.0 * (0.8647f64 * 0.1353 / n as f64).sqrt(), "{share}");
    }

    #[test]
    fn a_cosine_lobe_keeps_its_closed_share_within_a_cone() {
        // 1 - cos^(m+1).
        let (lobe, n) = (Lobe::Cosine { exponent: 30.0 }, 200_000);
        let inside = pairs(n).filter(|&u| lobe.sample(Vector::Z, Vector::Z, u).unwrap().z > 0.98).count();
        let (share, expected) = (inside as f64 / n as f64, 1.0 - 0.98f64.powi(31));
        assert!((share - expected).abs() < 4.0 * (expected * (1.0 - expected) / n as f64).sqrt(), "{share}");
    }

    #[test]
    fn mixed_with_specular_by_the_share() {
        let s = Scatter::new(0.25, Lobe::Lambertian).unwrap();
        assert_eq!(s.sample(Vector::Z, Vector::Z, [0.25, 0.5, 0.5]), None);
        assert!(s.sample(Vector::Z, Vector::Z, [0.2499, 0.5, 0.5]).is_some());
        assert!((s.density(Vector::Z, Vector::Z, Vector::Z) - 0.25 / PI).abs() < 1e-16);
        assert!(Scatter::new(1.1, Lobe::Lambertian).is_err());
        assert!(Scatter::new(0.5, Lobe::Gaussian { sigma: 0.0 }).is_err());
    }
}
