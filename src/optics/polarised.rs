//! Polarised light: Stokes vectors and what interfaces do to them.
//!
//! Conventions: fields go as `exp(−iωt)`. A ray's transverse frame is `x = axis`, `y = d × axis`; with it
//! `I = |Ex|² + |Ey|²`, `Q = |Ex|² − |Ey|²`, `U = 2 Re(Ex* Ey)`, `V = 2 Im(Ex* Ey)`, so that `V > 0` turns from x to y: counter-
//! clockwise for an observer who looks at the source. At an interface `x` is s, the normal of the plane of incidence, the
//! same for the arriving, the reflected and the refracted ray; so `p = d × s` for each of them.
//!
//! Source: Born & Wolf, *Principles of Optics*, 1.4 and 1.5; Chandrasekhar, *Radiative Transfer*, 1.15.

use super::refraction::cos_transmitted;
use crate::math::{Vector, orthonormal_pair};
use std::ops::{Add, Div, Mul, Sub};

/// A Stokes vector with the transverse axis it refers to.
///
/// ```
/// use lampyris::math::Vector;
/// use lampyris::optics::polarised::{Stokes, reflected};
/// // At Brewster's angle, tan θ = n, only light across the plane of incidence is reflected.
/// let angle = 1.5f64.atan();
/// let d = Vector::new(angle.sin(), 0.0, -angle.cos());
/// let mirrored = Stokes::unpolarised(1.0, d).through(&reflected(angle.cos(), 1.0 / 1.5), d, Vector::Z);
/// assert!((mirrored.degree() - 1.0).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stokes {
    /// Power.
    pub i: f64,
    /// Linear along the axis, less across it.
    pub q: f64,
    /// Linear at 45° towards `d × axis`, less at −45°.
    pub u: f64,
    /// Counter-clockwise circular, seen against the light, less clockwise.
    pub v: f64,
    /// Unit vector across the direction of the ray, to which `q` and `u` refer.
    pub axis: Vector,
}

impl Stokes {
    /// Unpolarised light of some power along the unit direction `d`.
    pub fn unpolarised(power: f64, d: Vector) -> Self {
        Self { i: power, q: 0.0, u: 0.0, v: 0.0, axis: orthonormal_pair(d).0 }
    }

    /// Light of some power along the unit direction `d`, linearly polarised along the part of `field`, of any length, across `d`;
    /// unpolarised when there is none.
    pub fn linear(power: f64, d: Vector, field: Vector) -> Self {
        match (field - d * field.dot(d)).try_normalize() {
            Some(axis) => Self { i: power, q: power, u: 0.0, v: 0.0, axis },
            None => Self::unpolarised(power, d),
        }
    }

    /// Share of the power that is polarised; NaN for light of no power.
    pub fn degree(&self) -> f64 {
        (self.q * self.q + self.u * self.u + self.v * self.v).sqrt() / self.i
    }

    /// Describes the same light along `d` with respect to another unit vector across `d`.
    pub fn turned_to(&self, axis: Vector, d: Vector) -> Self {
        let (c, s) = (self.axis.dot(axis), d.cross(self.axis).dot(axis));
        // cos 2φ and sin 2φ, normalised so that a slightly skew axis creates no power.
        let r = 1.0 / (c * c + s * s).max(f64::MIN_POSITIVE);
        let (c2, s2) = ((c * c - s * s) * r, 2.0 * c * s * r);
        Self { q: c2 * self.q + s2 * self.u, u: c2 * self.u - s2 * self.q, axis, ..*self }
    }

    /// The light after an interface: turned to the plane of incidence, then changed; its axis is then that plane's normal.
    ///
    /// `d` is the direction of arrival, `n` the normal on either side. At normal incidence any plane will do.
    pub fn through(&self, interface: &Mueller, d: Vector, n: Vector) -> Self {
        let s = d.cross(n).try_normalize().unwrap_or(self.axis);
        let at = self.turned_to(s, d);
        let Mueller { a, b, c, e } = *interface;
        Self {
            i: a * at.i + b * at.q,
            q: b * at.i + a * at.q,
            u: c * at.u - e * at.v,
            v: e * at.u + c * at.v,
            axis: s,
        }
    }

    /// The same state with its power scaled.
    pub fn scaled(&self, factor: f64) -> Self {
        let f = factor;
        Self { i: self.i * f, q: self.q * f, u: self.u * f, v: self.v * f, axis: self.axis }
    }

    /// The same power without polarisation: what a rough surface leaves of it.
    pub fn depolarised(&self) -> Self {
        Self { q: 0.0, u: 0.0, v: 0.0, ..*self }
    }
}

/// The Mueller matrix of an interface in the frame of its plane of incidence:
/// `[[a, b, 0, 0], [b, a, 0, 0], [0, 0, c, −e], [0, 0, e, c]]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mueller {
    /// Mean of the power shares of s and p.
    pub a: f64,
    /// Half the difference of the shares, s less p.
    pub b: f64,
    /// Real part of `rs*·rp`.
    pub c: f64,
    /// Imaginary part of `rs*·rp`.
    pub e: f64,
}

impl Mueller {
    /// The matrix of an interface with these complex amplitudes of s and p, in units of the field that arrives; powers are their squares
    /// times `factor`.
    fn from_amplitudes(s: Complex, p: Complex, factor: f64) -> Self {
        let (ps, pp, cross) = (s.square(), p.square(), s.conjugate() * p);
        Self {
            a: 0.5 * factor * (ps + pp),
            b: 0.5 * factor * (ps - pp),
            c: factor * cross.re,
            e: factor * cross.im,
        }
    }

    /// The matrix of the power shares of s and p alone, without a phase between them: a tabulated coating.
    pub fn without_phase(power: super::fresnel::PowerShares) -> Self {
        Self::from_amplitudes(Complex::real(power.rs.sqrt()), Complex::real(power.rp.sqrt()), 1.0)
    }
}

/// The matrix of reflection at an interface of two transparent media, total reflection with its phases included; `cos_i = |d·n|`,
/// `eta = n1/n2`.
pub fn reflected(cos_i: f64, eta: f64) -> Mueller {
    let [s, p] = amplitudes(cos_i, eta);
    Mueller::from_amplitudes(s, p, 1.0)
}

/// The matrix of transmission of power through such an interface; zero at total reflection and at grazing incidence.
pub fn transmitted(cos_i: f64, eta: f64) -> Mueller {
    let Some(cos_t) = cos_transmitted(cos_i, eta) else {
        return Mueller { a: 0.0, b: 0.0, c: 0.0, e: 0.0 };
    };
    let s = Complex::real(2.0 * eta * cos_i / (eta * cos_i + cos_t));
    let p = Complex::real(2.0 * eta * cos_i / (cos_i + eta * cos_t));
    // Power: (n2 cos t)/(n1 cos i) times the square of the field.
    let factor = if cos_i > 0.0 { cos_t / (eta * cos_i) } else { 0.0 };
    Mueller::from_amplitudes(s, p, factor)
}

/// The matrix of reflection at a metal of index `n + i·k` seen from a medium of index `outside`; `cos_i = |d·n|`.
pub fn metal(cos_i: f64, outside: f64, n: f64, k: f64) -> Mueller {
    let index = Complex { re: n / outside, im: k / outside };
    let sin2 = (1.0 - cos_i) * (1.0 + cos_i);
    let n2 = index * index;
    // n·cos t, with the root that decays inside.
    let q = Complex { re: n2.re - sin2, im: n2.im }.sqrt();
    let c = Complex::real(cos_i);
    let s = (c - q) / (c + q);
    let p = (n2 * c - q) / (n2 * c + q);
    Mueller::from_amplitudes(s, p, 1.0)
}

/// Amplitudes of reflection of s and p at an interface of two transparent media, of length 1 beyond the critical angle.
fn amplitudes(cos_i: f64, eta: f64) -> [Complex; 2] {
    let cos_t = match cos_transmitted(cos_i, eta) {
        Some(c) => Complex::real(c),
        // Total reflection: the cosine beyond is imaginary, and positive, so that the field decays away from the
        // surface.
        None => Complex { re: 0.0, im: (eta * eta * (1.0 - cos_i) * (1.0 + cos_i) - 1.0).max(0.0).sqrt() },
    };
    let (c, e) = (Complex::real(cos_i), Complex::real(eta));
    let s = (e * c - cos_t) / (e * c + cos_t);
    let p = (c - e * cos_t) / (c + e * cos_t);
    [s, p]
}

/// A complex amplitude.
#[derive(Clone, Copy, Debug)]
struct Complex {
    re: f64,
    im: f64,
}

impl Complex {
    fn real(re: f64) -> Self {
        Self { re, im: 0.0 }
    }

    fn conjugate(self) -> Self {
        Self { re: self.re, im: -self.im }
    }

    /// The square of its length.
    fn square(self) -> f64 {
        self.re * self.re + self.im * self.im
    }

    /// The root with non-negative real and imaginary part, for a non-negative imaginary part.
    fn sqrt(self) -> Self {
        let length = self.re.hypot(self.im);
        Self { re: (0.5 * (length + self.re)).max(0.0).sqrt(), im: (0.5 * (length - self.re)).max(0.0).sqrt() }
    }
}

impl Add for Complex {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { re: self.re + o.re, im: self.im + o.im }
    }
}

impl Sub for Complex {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { re: self.re - o.re, im: self.im - o.im }
    }
}

impl Mul for Complex {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self { re: self.re * o.re - self.im * o.im, im: self.re * o.im + self.im * o.re }
    }
}

impl Div for Complex {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let (n, d) = (self * o.conjugate(), o.square());
        // 0/0 comes up at grazing incidence alone, where all light is reflected.
        if d > 0.0 { Self { re: n.re / d, im: n.im / d } } else { Self::real(1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::{fresnel, reflect, refract};
    use proptest::prelude::*;

    fn along(angle: f64) -> Vector {
        Vector::new(angle.sin(), 0.0, -angle.cos())
    }

    proptest! {
        #[test]
        fn power_agrees_with_the_unpolarised_laws(i in 0.0..1.57f64, n in 0.3..3.0f64) {
            let (cos_i, eta) = (i.cos(), 1.0 / n);
            let (m, r) = (reflected(cos_i, eta), fresnel::dielectric(cos_i, eta));
            prop_assert!((m.a + m.b - r.rs).abs() < 1e-12 && (m.a - m.b - r.rp).abs() < 1e-12);
            let t = transmitted(cos_i, eta);
            prop_assert!((m.a + t.a - 1.0).abs() < 1e-12 && (m.b + t.b).abs() < 1e-12);
        }

        #[test]
        fn a_metal_agrees_with_its_power_law(i in 0.0..1.57f64, n in 0.05..4.0f64, k in 0.0..8.0f64) {
            let (m, r) = (metal(i.cos(), 1.0, n, k), fresnel::conductor(i.cos(), 1.0, n, k));
            prop_assert!((m.a + m.b - r.rs).abs() < 1e-11 && (m.a - m.b - r.rp).abs() < 1e-11);
        }

        #[test]
        fn a_lossless_interface_keeps_pure_states_pure(
            i in 0.0..1.5f64, n in 0.4..3.0f64, turn in 0.0..6.3f64, phase in 0.0..6.3f64
        ) {
            let d = along(i);
            let axis = Vector::Y * turn.cos() + d.cross(Vector::Y) * turn.sin();
            let s = Stokes { i: 2.0, q: 2.0 * phase.cos(), u: 0.0, v: 2.0 * phase.sin(), axis };
            for m in [reflected(i.cos(), 1.0 / n), transmitted(i.cos(), 1.0 / n)] {
                let out = s.through(&m, d, Vector::Z);
                prop_assume!(out.i > 1e-6);
                prop_assert!((out.degree() - 1.0).abs() < 1e-6, "{}", out.degree());
            }
        }

        #[test]
        fn turning_the_frame_changes_nothing(a in 0.0..6.3f64, b in 0.0..6.3f64) {
            let d = Vector::Z;
            let at = |t: f64| Vector::new(t.cos(), t.sin(), 0.0);
            let s = Stokes { i: 1.0, q: 0.3, u: -0.5, v: 0.2, axis: Vector::X };
            let (once, twice) = (s.turned_to(at(b), d), s.turned_to(at(a), d).turned_to(at(b), d));
            prop_assert!((once.q - twice.q).abs() < 1e-14 && (once.u - twice.u).abs() < 1e-14 && once.v == twice.v);
        }
    }

    #[test]
    fn light_at_brewsters_angle_comes_back_polarised_across_the_plane() {
        let i = 1.5f64.atan();
        let out = Stokes::unpolarised(1.0, along(i)).through(&reflected(i.cos(), 1.0 / 1.5), along(i), Vector::Z);
        assert!((out.i - 0.073964).abs() < 1e-6 && (out.q / out.i - 1.0).abs() < 1e-14);
        assert!((out.axis.y.abs() - 1.0).abs() < 1e-15, "across the plane of incidence");
    }

    #[test]
    fn malus_law_by_two_mirrors_at_brewsters_angle() {
        // The second plane of incidence turned by 60° leaves cos² 60° of what the first gave, times Rs again.
        let i = 1.5f64.atan();
        let m = reflected(i.cos(), 1.0 / 1.5);
        let first = Stokes::unpolarised(1.0, along(i)).through(&m, along(i), Vector::Z);
        let d = reflect(along(i), Vector::Z);
        let turned = first.axis * 60f64.to_radians().cos() + d.cross(first.axis) * 60f64.to_radians().sin();
        // A normal whose plane of incidence with d has the normal `turned`.
        let n = -d * i.cos() + turned.cross(d) * i.sin();
        let second = first.through(&m, d, n);
        assert!((second.i / first.i - 0.25 * 2.0 * 0.073964).abs() < 1e-6, "{}", second.i / first.i);
    }

    #[test]
    fn a_fresnel_rhomb_turns_linear_into_circular() {
        // Two total reflections inside n = 1.5 at 50.2296° or 53.2585°, 45.000° of phase each.
        for i_deg in [50.2296f64, 53.2585] {
            let i = i_deg.to_radians();
            let m = reflected(i.cos(), 1.5);
            assert!((m.e.atan2(m.c).abs().to_degrees() - 45.0).abs() < 1e-4, "{}", m.e.atan2(m.c).to_degrees());
            let d = along(i);
            let s = d.cross(Vector::Z).normalize();
            let input = Stokes::linear(1.0, d, s + d.cross(s));
            let once = input.through(&m, d, Vector::Z);
            let back = reflect(d, Vector::Z);
            let twice = once.through(&m, back, -Vector::Z);
            assert!((twice.v.abs() - 1.0).abs() < 1e-9 && (twice.i - 1.0).abs() < 1e-14, "{twice:?}");
        }
    }

    #[test]
    fn a_pile_of_plates_polarises_along_the_plane() {
        let i = 1.5f64.atan();
        let (mut light, mut d) = (Stokes::unpolarised(1.0, along(i)), along(i));
        let mut expected = [0.5, 0.5];
        for _ in 0..10 {
            for (eta, n) in [(1.0 / 1.5, Vector::Z), (1.5, Vector::Z)] {
                let cos = d.dot(n).abs();
                light = light.through(&transmitted(cos, eta), d, n);
                let r = fresnel::dielectric(cos, eta);
                expected = [expected[0] * (1.0 - r.rs), expected[1] * (1.0 - r.rp)];
                d = refract(d, n, eta).unwrap();
            }
        }
        assert!((light.i - expected[0] - expected[1]).abs() < 1e-14);
        assert!((light.q - expected[0] + expected[1]).abs() < 1e-14 && light.q < -0.4);
        assert!((expected[1] - 0.5).abs() < 1e-12, "nothing in the plane is lost at Brewster's angle");
        assert_eq!(light.depolarised().degree(), 0.0);
    }
}
