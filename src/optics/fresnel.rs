//! Reflected power at an interface: Fresnel's equations for dielectrics and conductors.
//!
//! Source: Born & Wolf, *Principles of Optics*, 1.5.2 (dielectric) and 14.2 (absorbing second medium).

use super::refraction::cos_transmitted;

/// Shares of power (reflected, unless said otherwise), for light polarised across (s) and in (p) the plane of incidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerShares {
    /// Electric field perpendicular to the plane of incidence.
    pub rs: f64,
    /// Electric field in the plane of incidence.
    pub rp: f64,
}

impl PowerShares {
    /// All power reflected.
    pub const TOTAL: Self = Self { rs: 1.0, rp: 1.0 };

    /// No power reflected.
    pub const NONE: Self = Self { rs: 0.0, rp: 0.0 };

    /// Share of power for unpolarised light: the mean of `rs` and `rp`.
    #[inline]
    pub fn unpolarised(&self) -> f64 {
        0.5 * (self.rs + self.rp)
    }

    /// Adds `weight` times another pair of shares.
    pub(super) fn add(&mut self, other: Self, weight: f64) {
        self.rs += other.rs * weight;
        self.rp += other.rp * weight;
    }
}

/// Reflected shares at an interface of two transparent media; what is not reflected is transmitted.
///
/// `cos_i` in `[0, 1]`, `eta = n1/n2` as for [`super::refract`]. [`PowerShares::TOTAL`] at and beyond the critical angle.
///
/// ```
/// let r = lampyris::optics::fresnel::dielectric(1.0, 1.0 / 1.5);
/// assert!((r.unpolarised() - 0.04).abs() < 1e-15);
/// ```
#[inline]
pub fn dielectric(cos_i: f64, eta: f64) -> PowerShares {
    cos_transmitted(cos_i, eta).map_or(PowerShares::TOTAL, |cos_t| of_cosines(cos_i, cos_t, eta))
}

/// As [`dielectric`] where the cosine of the angle of refraction is known; NaN where both cosines are zero.
#[inline]
pub fn of_cosines(cos_i: f64, cos_t: f64, eta: f64) -> PowerShares {
    let rs = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let rp = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    PowerShares { rs: rs * rs, rp: rp * rp }
}

/// Reflected shares at a metal of complex index `n + i·k` seen from a medium of index `outside`; the rest is absorbed.
///
/// `cos_i` in `[0, 1]`. With `k = 0` it agrees with [`dielectric`].
pub fn conductor(cos_i: f64, outside: f64, n: f64, k: f64) -> PowerShares {
    let (eta, kappa) = (n / outside, k / outside);
    let (cos2, sin2) = (cos_i * cos_i, (1.0 - cos_i) * (1.0 + cos_i));
    // a² and b² are real and imaginary part of the refracted normal component.
    let real = eta * eta - kappa * kappa - sin2;
    let length = real.hypot(2.0 * eta * kappa);
    let a = (0.5 * (length + real)).max(0.0).sqrt();
    let rs = (length - 2.0 * a * cos_i + cos2) / (length + 2.0 * a * cos_i + cos2);
    let (p, q) = (cos2 * length + sin2 * sin2, 2.0 * a * cos_i * sin2);
    let rp = if cos_i == 0.0 { 1.0 } else { rs * (p - q) / (p + q) };
    PowerShares { rs: rs.clamp(0.0, 1.0), rp: rp.clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cos(angle_deg: f64) -> f64 {
        angle_deg.to_radians().cos()
    }

    #[test]
    fn table_of_glass_in_air() {
        for (i, rs, rp, mean) in [
            (0.0, 0.040000, 0.040000, 0.040000),
            (30.0, 0.057796, 0.025249, 0.041523),
            (45.0, 0.092013, 0.008466, 0.050240),
            (56.309932, 0.147929, 0.0, 0.073964),
            (60.0, 0.176571, 0.001802, 0.089187),
            (75.0, 0.399356, 0.106765, 0.253061),
            (85.0, 0.732345, 0.493254, 0.612800),
            (89.0, 0.939472, 0.868898, 0.904185),
        ] {
            let r = dielectric(cos(i), 1.0 / 1.5);
            assert!((r.rs - rs).abs() < 1e-6 && (r.rp - rp).abs() < 1e-6, "{i}: {r:?}");
            assert!((r.unpolarised() - mean).abs() < 1e-6, "{i}");
        }
        for (i, rs, rp, mean) in [(30.0, 0.105773, 0.004608, 0.055190), (40.0, 0.390518, 0.100064, 0.245291)] {
            let r = dielectric(cos(i), 1.5);
            assert!((r.rs - rs).abs() < 1e-6 && (r.rp - rp).abs() < 1e-6, "inside {i}: {r:?}");
            assert!((r.unpolarised() - mean).abs() < 1e-6, "inside {i}");
        }
    }

    #[test]
    fn nothing_polarised_in_plane_is_reflected_at_brewsters_angle() {
        let brewster = 1.5f64.atan();
        assert!(dielectric(brewster.cos(), 1.0 / 1.5).rp < 1e-30);
    }

    #[test]
    fn everything_is_reflected_from_the_critical_angle_on() {
        let critical = (1.0 / 1.5f64).asin();
        assert_eq!(dielectric((critical + 1e-11).cos(), 1.5), PowerShares::TOTAL);
        let before = dielectric((critical - 1e-11).cos(), 1.5);
        assert!(before.rs < 1.0 && before.rp < 1.0 && before.rs > 0.9999);
        assert_eq!(dielectric(0.0, 1.5), PowerShares::TOTAL);
        assert_eq!(dielectric(0.0, 1.0 / 1.5), PowerShares::TOTAL);
    }

    #[test]
    fn a_slab_transmits_2n_over_n2_plus_1() {
        // All internal orders at normal incidence: (1 - R)/(1 + R).
        for (n, t) in [(1.516800, 0.919083), (1.490618, 0.925292), (1.584763, 0.902620)] {
            let r = dielectric(1.0, 1.0 / n).unpolarised();
            assert!(((1.0 - r) / (1.0 + r) - t).abs() < 1e-6);
            assert!(((1.0 - r) / (1.0 + r) - 2.0 * n / (n * n + 1.0)).abs() < 1e-15);
        }
    }

    #[test]
    fn silver_like_metal_at_normal_incidence() {
        // ((n-1)² + k²)/((n+1)² + k²) for n = 0.2, k = 3.
        let r = conductor(1.0, 1.0, 0.2, 3.0);
        let expected = (0.64 + 9.0) / (1.44 + 9.0);
        assert!((r.rs - expected).abs() < 1e-15 && (r.rp - expected).abs() < 1e-15);
        assert_eq!(conductor(0.0, 1.0, 0.2, 3.0).unpolarised(), 1.0);
    }

    proptest! {
        #[test]
        fn both_ways_through_an_interface_reflect_the_same(i in 0.0..1.57f64, n in 1.01..3.0f64) {
            let (cos_i, eta) = (i.cos(), 1.0 / n);
            let cos_t = cos_transmitted(cos_i, eta).unwrap();
            let (there, back) = (dielectric(cos_i, eta), dielectric(cos_t, n));
            prop_assert!((there.rs - back.rs).abs() < 1e-11 && (there.rp - back.rp).abs() < 1e-11);
            prop_assert!((0.0..=1.0).contains(&there.rs) && there.rp <= there.rs + 1e-15);
        }

        #[test]
        fn a_metal_that_does_not_absorb_is_a_dielectric(i in 0.0..1.57f64, n in 1.01..3.0f64) {
            let (m, d) = (conductor(i.cos(), 1.0, n, 0.0), dielectric(i.cos(), 1.0 / n));
            prop_assert!((m.rs - d.rs).abs() < 1e-12 && (m.rp - d.rp).abs() < 1e-12, "{:?} {:?}", m, d);
        }

        #[test]
        fn a_metal_never_gives_more_than_it_gets(i in 0.0..1.57f64, n in 0.05..4.0f64, k in 0.0..8.0f64) {
            let r = conductor(i.cos(), 1.0, n, k);
            prop_assert!(r.rp <= r.rs + 1e-12 && (0.0..=1.0).contains(&r.rs) && (0.0..=1.0).contains(&r.rp));
        }
    }
}
