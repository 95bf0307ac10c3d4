//! Directions of reflected and refracted light.

use crate::math::Vector;

/// The mirror image of direction `d` in a surface with unit normal `n` (either side).
///
/// The result is renormalised by one Newton step, so that 10⁴ reflections in a light guide do not drift; `d` must be of unit length.
#[inline]
pub fn reflect(d: Vector, n: Vector) -> Vector {
    unit(d - n * (2.0 * d.dot(n)))
}

/// The refracted direction by Snell's law, `None` at total internal reflection.
///
/// `d` travels towards the surface, `n` is its unit normal on either side, `eta = n1/n2` with `n1` on the side of
/// arrival. At the critical angle itself the answer is `None`, as [`super::fresnel::dielectric`] says `R = 1` there.
///
/// ```
/// use lampyris::{math::Vector, optics::refract};
/// let d = Vector::new(0.5f64.sqrt(), 0.0, -0.5f64.sqrt());
/// let t = refract(d, Vector::Z, 1.0 / 1.5).unwrap();
/// assert!((t.x.asin().to_degrees() - 28.12551).abs() < 1e-5);
/// assert!(refract(d, Vector::Z, 1.5).is_none());
/// ```
#[inline]
pub fn refract(d: Vector, n: Vector, eta: f64) -> Option<Vector> {
    Some(refract_with_cosine(d, n, eta)?.0)
}

/// As [`refract`], with the cosine of the angle of refraction, which Fresnel's equations want too.
#[inline]
pub fn refract_with_cosine(d: Vector, n: Vector, eta: f64) -> Option<(Vector, f64)> {
    let along = d.dot(n);
    let cos_t = cos_transmitted(along.abs(), eta)?;
    // Tangential part scaled by eta, normal part of length cos_t on the far side.
    Some((unit((d - n * along) * eta + n * cos_t.copysign(along)), cos_t))
}

/// Cosine of the angle of refraction for `cos_i = |d·n|` and `eta = n1/n2`; `None` at and beyond the critical angle.
#[inline]
pub(super) fn cos_transmitted(cos_i: f64, eta: f64) -> Option<f64> {
    // (1 - cos)(1 + cos) keeps the sine exact near normal incidence, where 1 - cos² would cancel.
    let sin2_t = eta * eta * ((1.0 - cos_i) * (1.0 + cos_i)).max(0.0);
    (sin2_t < 1.0).then(|| (1.0 - sin2_t).sqrt())
}

/// Renormalises a vector of nearly unit length by one Newton step: exact to the last bits for lengths within 1e-8 of 1.
#[inline]
fn unit(v: Vector) -> Vector {
    v * (1.5 - 0.5 * v.length_squared())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn direction() -> impl Strategy<Value = Vector> {
        (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64)
            .prop_filter_map("not zero", |(x, y, z)| Vector::new(x, y, z).try_normalize())
    }

    fn at(angle_deg: f64) -> Vector {
        let i = angle_deg.to_radians();
        Vector::new(i.sin(), 0.0, -i.cos())
    }

    /// A normalised vector is of unit length to 3e-16; two reflections multiply that by 8, their rounding adds 1e-15.
    const ROUNDING: f64 = 4e-15;

    proptest! {
        #[test]
        fn reflection_is_its_own_inverse_and_ignores_the_side(d in direction(), n in direction()) {
            let r = reflect(d, n);
            prop_assert!((r.length() - 1.0).abs() < ROUNDING);
            prop_assert!((reflect(r, n) - d).length() < ROUNDING);
            prop_assert_eq!(r, reflect(d, -n));
            prop_assert!((r.dot(n) + d.dot(n)).abs() < ROUNDING);
        }

        #[test]
        fn refraction_keeps_snells_invariant_and_is_reversible(d in direction(), n in direction(), eta in 0.3..3.0f64) {
            let Some(t) = refract(d, n, eta) else {
                prop_assert!(d.cross(n).length() * eta >= 1.0 - ROUNDING);
                return Ok(());
            };
            prop_assert!((t.length() - 1.0).abs() < ROUNDING);
            prop_assert!((t.cross(n) - d.cross(n) * eta).length() < 4e-15);
            prop_assert_eq!(t, refract(d, -n, eta).unwrap());
            // Near grazing the way back is as ill-conditioned as 1/cos.
            if t.dot(n).abs() > 1e-3 && d.dot(n).abs() > 1e-3 {
                let back = refract(-t, n, 1.0 / eta).unwrap();
                prop_assert!((back + d).length() < 1e-11, "{:e}", (back + d).length());
            }
        }
    }

    #[test]
    fn angles_of_refraction_of_glass() {
        // i, t in degrees for n = 1.5, from arcsin(sin i / 1.5).
        for (i, t) in
            [(30.0, 19.471221), (45.0, 28.125506), (60.0, 35.264390), (75.0, 40.087036), (89.0, 41.802511)]
        {
            let out = refract(at(i), Vector::Z, 1.0 / 1.5).unwrap();
            assert!(
                (out.x.atan2(-out.z).to_degrees() - t).abs() < 1e-6,
                "{i}: {}",
                out.x.atan2(-out.z).to_degrees()
            );
        }
        for (i, t) in [(30.0, 48.590378), (40.0, 74.618568)] {
            let out = refract(at(i), Vector::Z, 1.5).unwrap();
            assert!((out.x.atan2(-out.z).to_degrees() - t).abs() < 1e-5);
        }
    }

    #[test]
    fn total_reflection_begins_at_the_critical_angle() {
        let critical = (1.0 / 1.5f64).asin().to_degrees();
        assert!((critical - 41.810315).abs() < 1e-6);
        assert!(refract(at(critical - 1e-9), Vector::Z, 1.5).is_some());
        assert!(refract(at(critical + 1e-9), Vector::Z, 1.5).is_none());
    }

    #[test]
    fn ten_thousand_reflections_do_not_drift() {
        let (mut d, n) = (at(33.0), Vector::new(0.6, 0.0, 0.8 + 1e-16));
        for _ in 0..10_000 {
            d = reflect(d, n);
        }
        assert!((d - at(33.0)).length() < 1e-11 && (d.length() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn plate_shift_prism_deviation_and_rainbow() {
        // Parallel plate 10 mm, n = 1.5, 45°: shift t·sin(i - r)/cos r.
        let inside = refract(at(45.0), Vector::Z, 1.0 / 1.5).unwrap();
        let across = inside * (10.0 / -inside.z);
        assert!((across.cross(at(45.0)).length() - 3.291423).abs() < 1e-6);
        // 60° prism at minimum deviation: inside at 30° to both faces, so i = asin(n·sin 30°).
        for (index, expected) in [(1.5, 37.180756), (1.516800, 38.646699)] {
            let i = (index * 0.5f64).asin();
            let (n1, n2) =
                (Vector::new(-(0.5f64 * 3f64.sqrt()), 0.5, 0.0), Vector::new(0.5 * 3f64.sqrt(), 0.5, 0.0));
            let d =
                Vector::new((std::f64::consts::FRAC_PI_6 - i).cos(), -(std::f64::consts::FRAC_PI_6 - i).sin(), 0.0);
            let out = refract(refract(d, n1, 1.0 / index).unwrap(), n2, index).unwrap();
            assert!((out.dot(d).acos().to_degrees() - expected).abs() < 2e-5, "{index}");
        }
        // A drop of n = 4/3 with k internal reflections: stationary total deviation.
        for (k, i_deg, expected) in [(1, 59.3911, 137.9703), (2, 71.8320, 230.9781)] {
            let turn = |i: f64| {
                let mut d = Vector::new(1.0, 0.0, 0.0);
                let mut p = Vector::new(-i.cos(), i.sin(), 0.0);
                let mut total = 0.0;
                let mut step = |from: &mut Vector, to: Vector| {
                    total += from.cross(to).z.atan2(from.dot(to));
                    *from = to;
                };
                let to = refract(d, p, 0.75).unwrap();
                step(&mut d, to);
                for bounce in 0..=k {
                    p -= d * (2.0 * p.dot(d));
                    let to = if bounce < k { reflect(d, p) } else { refract(d, p, 4.0 / 3.0).unwrap() };
                    step(&mut d, to);
                }
                total.to_degrees().abs()
            };
            let i = f64::to_radians(i_deg);
            assert!((turn(i) - expected).abs() < 1e-4, "k = {k}: {}", turn(i));
            assert!(turn(i) <= turn(i + 1e-3) && turn(i) <= turn(i - 1e-3), "the rainbow is the least deviation");
        }
    }
}
