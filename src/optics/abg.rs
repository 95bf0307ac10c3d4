//! The ABg model of scatter by polished surfaces.

use super::error::{Error, ErrorKind, require};
use crate::math::Vector;
use crate::math::quadrature::GAUSS;
use std::f64::consts::PI;

/// The ABg model of polished surfaces: `BSDF = A/(B + |β − β₀|^g)`, β the direction cosines in the surface.
///
/// Source: Pfisterer, *Approximated Scatter Models for Stray Light Analysis*, Optics & Photonics News, 2011.
/// Because `cos θ dΩ = d²β`, the scattered share is an integral over the part of the unit disk of β; what would leave it
/// does not exist and stays specular, so the total scatter falls towards grazing incidence, as the model demands.
#[derive(Clone, Debug, PartialEq)]
pub struct Abg {
    a: f64,
    b: f64,
    g: f64,
    /// Radii, and the share scattered within each; empty when `g = 2`, which has a closed form.
    radii: Vec<f64>,
    shares: Vec<f64>,
}

/// How near a radius is found, as a direction cosine: fifty ulps of 1.
const RADIUS_TOLERANCE: f64 = 1e-14;
/// Largest possible |β − β₀|.
const REACH: f64 = 2.0;
/// Rings of the tabulated share: their width grows by a factor of 1.01 to 1.09.
const RINGS: usize = 256;
/// The first ring, as a share of the radius at which the weight bends: within it the weight is constant to 1e-3^g.
const FIRST_RING: f64 = 1e-3;
/// The smallest first ring, a direction cosine: sharper peaks than a nanoradian are mirrors.
const SHARPEST_RING: f64 = 1e-9;

impl Abg {
    /// A model of these coefficients: `a` zero or more (0 scatters nothing), `b` positive, `g` from 0 to 10.
    ///
    /// # Errors
    /// When one is out of range, or the disk of radius 2 would scatter more than there is.
    pub fn new(a: f64, b: f64, g: f64) -> Result<Self, Error> {
        require("A of the ABg model", a, a >= 0.0, "zero or more")?;
        require("B of the ABg model", b, b > 0.0, "positive")?;
        require("g of the ABg model", g, (0.0..=10.0).contains(&g), "from 0 to 10")?;
        let mut abg = Self { a, b, g, radii: Vec::new(), shares: Vec::new() };
        if g != 2.0 {
            abg.tabulate();
        }
        let total = abg.share_within(REACH);
        if total > 1.0 {
            let allowed = "small enough that A/(B + r^g), integrated to r = 2, is at most 1";
            return Err(ErrorKind::OutOfRange { what: "A of the ABg model", value: a, allowed }.into());
        }
        Ok(abg)
    }

    /// A, B and g.
    pub fn coefficients(&self) -> [f64; 3] {
        [self.a, self.b, self.g]
    }

    /// Share of the light that is scattered at normal incidence.
    pub fn total_scatter(&self) -> f64 {
        self.share_within(1.0)
    }

    /// Draws a unit direction on the side of the unit normal `n` from two numbers in [0, 1); `None` for the share that stays specular.
    pub(super) fn sample(&self, specular: Vector, n: Vector, u: [f64; 2]) -> Option<Vector> {
        let r = self.radius_of_share(u[0])?;
        let (s, c) = (2.0 * PI * u[1]).sin_cos();
        let (a, b) = crate::math::orthonormal_pair(n);
        let beta = specular - n * specular.dot(n) + (a * c + b * s) * r;
        // A step out of the unit disk belongs to no direction: that light stays specular.
        let up2 = 1.0 - beta.length_squared();
        (up2 > 0.0).then(|| (beta + n * up2.sqrt()).normalize())
    }

    /// The BSDF times the cosine of the outgoing direction, 1/sr; 0 below the surface.
    pub(super) fn density(&self, specular: Vector, n: Vector, out: Vector) -> f64 {
        let step = out - specular;
        let r = (step - n * step.dot(n)).length();
        self.a / (self.b + r.powf(self.g)) * out.dot(n).max(0.0)
    }

    /// Returns the share that the plane of β, taken as unbounded, would scatter within radius `r`, which is at most [`REACH`].
    fn share_within(&self, r: f64) -> f64 {
        if self.radii.is_empty() {
            return PI * self.a * (r * r / self.b).ln_1p();
        }
        let i = self.radii.partition_point(|&x| x <= r).max(1) - 1;
        self.shares[i] + self.ring(self.radii[i], r)
    }

    /// The radius, a difference of direction cosines, within which `share` is scattered; `None` when even [`REACH`] does not hold it.
    fn radius_of_share(&self, share: f64) -> Option<f64> {
        if share >= self.share_within(REACH) {
            return None;
        }
        if self.radii.is_empty() {
            // With g = 2 the share within r is πA·ln(1 + r²/B), which has an inverse.
            return Some((self.b * (share / (PI * self.a)).exp_m1()).sqrt());
        }
        let i = self.shares.partition_point(|&s| s <= share).max(1) - 1;
        let (low, high) = (self.radii[i], self.radii[(i + 1).min(RINGS)]);
        let missing = |r: f64| (self.shares[i] + self.ring(low, r) - share, self.weight(r));
        // Without a change of sign in the ring the share lies on its border, but for rounding.
        crate::math::safe_newton(missing, low, high, RADIUS_TOLERANCE).or(Some(low))
    }

    /// Share scattered per unit of radius, at radius `r`.
    fn weight(&self, r: f64) -> f64 {
        2.0 * PI * r * self.a / (self.b + r.powf(self.g))
    }

    /// Share scattered between two radii, the integral of the weight, by Gauss–Legendre with five points: 1e-13 of the whole on these
    /// rings.
    fn ring(&self, from: f64, to: f64) -> f64 {
        let width = to - from;
        width * GAUSS.iter().map(|&(x, weight)| weight * self.weight(from + width * x)).sum::<f64>()
    }

    /// Fills `radii` and `shares` by adding up the weight ring by ring, in rings that grow by one factor.
    fn tabulate(&mut self) {
        // The bend of the weight lies at r = b^(1/g), and nothing changes far below it: rings start there.
        let start = (self.b.powf(1.0 / self.g.max(0.1)) * FIRST_RING).clamp(SHARPEST_RING, 0.1);
        let factor = (REACH / start).powf(1.0 / (RINGS - 1) as f64);
        self.radii = std::iter::once(0.0).chain((0..RINGS).map(|i| start * factor.powi(i as i32))).collect();
        self.radii[RINGS] = REACH;
        let mut sum = 0.0;
        self.shares = vec![0.0];
        for i in 0..RINGS {
            sum += self.ring(self.radii[i], self.radii[i + 1]);
            self.shares.push(sum);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn total_scatter_has_a_closed_form_for_g_2() {
        let s = Abg::new(1e-3, 1e-4, 2.0).unwrap();
        assert!((s.total_scatter() - PI * 1e-3 * (1.0 + 1e4f64).ln()).abs() < 1e-15);
        // The tabulated path must find the same; g = 0 is Lambertian with A/(B + 1).
        let mut t = Abg::new(1e-3, 1e-4, 2.0).unwrap();
        t.tabulate();
        assert!((t.total_scatter() - s.total_scatter()).abs() < 1e-12 * s.total_scatter());
        for i in 0..100 {
            let share = s.share_within(REACH) * (i as f64 + 0.5) / 100.0;
            let (r, q) = (s.radius_of_share(share).unwrap(), t.radius_of_share(share).unwrap());
            assert!((r - q).abs() < 1e-10 * r.max(1e-3), "{r} {q}");
        }
        let flat = Abg::new(0.1, 1.0, 0.0).unwrap();
        assert!((flat.total_scatter() - PI * 0.05).abs() < 1e-13);
        assert_eq!(s.radius_of_share(0.9), None);
    }

    #[test]
    fn g_of_one_and_four_have_closed_forms_too() {
        let (a, b) = (2e-3, 0.05);
        let one = Abg::new(a, b, 1.0).unwrap();
        assert!((one.total_scatter() - 2.0 * PI * a * (1.0 - b * (1.0 + 1.0 / b).ln())).abs() < 1e-13);
        let four = Abg::new(a, b, 4.0).unwrap();
        assert!((four.total_scatter() - PI * a / b.sqrt() * (1.0 / b.sqrt()).atan()).abs() < 1e-13);
    }

    #[test]
    fn more_light_than_there_is_is_refused() {
        let e = Abg::new(10.0, 0.1, 2.0).unwrap_err();
        assert!(e.to_string().contains("A of the ABg model is 10"), "{e}");
        assert!(Abg::new(0.1, 0.0, 2.0).is_err() && Abg::new(0.1, 0.1, f64::NAN).is_err());
    }
}
