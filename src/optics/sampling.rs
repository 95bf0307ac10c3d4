//! Directions and points from pairs of numbers in `[0, 1)²`, without rejection, so that every sample costs the same numbers.
//!
//! Source: Pharr, Jakob, Humphreys, *Physically Based Rendering*, 4th ed., A.5 (concentric disk of Shirley and Chiu 1997).

use crate::math::{Uv, Vector, orthonormal_pair};
use std::f64::consts::{FRAC_PI_4, TAU};

/// Sine and cosine of `2π·turns`, for `|turns|` up to 2⁴⁰: right to 3e-16, the same bits on every machine, and without a call.
///
/// The Taylor series to x¹⁷ leave 1e-17 on an eighth of a turn.
#[inline]
pub fn sin_cos_turns(turns: f64) -> (f64, f64) {
    // One addition rounds to whole quarters, and leaves their number in the lowest bits.
    const SHIFT: f64 = 6_755_399_441_055_744.0;
    let shifted = 4.0 * turns + SHIFT;
    let (quarters, quarter) = (shifted - SHIFT, shifted.to_bits());
    let x = (turns - 0.25 * quarters) * TAU;
    let y = x * x;
    let series = |c: [f64; 8]| {
        let high = (c[4] + y * c[5]) + (y * y) * (c[6] + y * c[7]);
        let low = (c[0] + y * c[1]) + (y * y) * (c[2] + y * c[3]);
        low + (y * y) * (y * y) * high
    };
    let sin = x + x * y * series(SINE);
    let cos = 1.0 + y * series(COSINE);
    let (a, b) = if quarter & 1 == 0 { (sin, cos) } else { (cos, sin) };
    // Signs by their bit: without branches or conversions, loops over this run in vectors.
    let signed = |x: f64, negative: u64| f64::from_bits(x.to_bits() ^ (negative & 2) << 62);
    (signed(a, quarter), signed(b, quarter.wrapping_add(1)))
}

/// `±1/(2k + 3)!` and `±1/(2k + 2)!`.
const SINE: [f64; 8] = inverse_factorials(3);
const COSINE: [f64; 8] = inverse_factorials(2);

/// Coefficients of the series of the sine (`first` 3, from 1/3!) or cosine (2, from 1/2!), with their signs.
const fn inverse_factorials(first: u32) -> [f64; 8] {
    let mut terms = [0.0; 8];
    let (mut k, mut factorial) = (0, if first == 3 { 6.0 } else { 2.0 });
    while k < 8 {
        terms[k] = if k % 2 == 0 { -1.0 / factorial } else { 1.0 / factorial };
        let n = first as f64 + 2.0 * k as f64;
        factorial *= (n + 1.0) * (n + 2.0);
        k += 1;
    }
    terms
}

/// Maps a pair in `[0, 1]²` to a uniform point of the unit disk; neighbouring pairs stay neighbours.
pub fn disk([u, v]: [f64; 2]) -> Uv {
    let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    // The centre has no azimuth, and the formula below would divide by zero.
    if x == 0.0 && y == 0.0 {
        return Uv::ZERO;
    }
    let (r, angle) = if x.abs() > y.abs() { (x, FRAC_PI_4 * (y / x)) } else { (y, FRAC_PI_4 * (2.0 - x / y)) };
    Uv::new(r * angle.cos(), r * angle.sin())
}

/// Maps a pair in `[0, 1)²` to a unit direction with density `cos θ/π` per steradian about the unit vector `n`: Lambert's law.
pub fn lambertian(n: Vector, u: [f64; 2]) -> Vector {
    let p = disk(u);
    let (a, b) = orthonormal_pair(n);
    let z = (1.0 - p.length_squared()).max(0.0).sqrt();
    (a * p.x + b * p.y + n * z).normalize()
}

/// Maps a pair in `[0, 1)²` to a unit direction with density `(m + 1)/2π · cosᵐ θ` per steradian about the unit vector `axis`; `exponent`
/// is m, zero or more.
pub fn cosine_power(axis: Vector, exponent: f64, [u, v]: [f64; 2]) -> Vector {
    // The inverse of the cumulative 1 − cosᵐ⁺¹; 1 − u is never zero, so that no direction grazes by the number
    // drawn.
    let cos = (1.0 - u).powf(1.0 / (exponent + 1.0));
    direction_about(axis, cos, ((1.0 - cos) * (1.0 + cos)).sqrt(), v)
}

/// The unit direction at an angle of this cosine and sine from the unit vector `axis`, at azimuth `2π·turn`.
pub(super) fn direction_about(axis: Vector, cos: f64, sin: f64, turn: f64) -> Vector {
    let (a, b) = orthonormal_pair(axis);
    let (s, c) = sin_cos_turns(turn);
    (axis * cos + (a * c + b * s) * sin).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::fresnel;
    use crate::optics::testing::pairs;

    const N: usize = 200_000;

    fn mean(values: impl Iterator<Item = f64>) -> f64 {
        values.sum::<f64>() / N as f64
    }

    #[test]
    fn sines_of_turns_agree_with_the_library() {
        for i in -40_000..40_000 {
            let turns = f64::from(i) / 9973.0;
            let (s, c) = sin_cos_turns(turns);
            let (es, ec) = ((turns - turns.round()) * TAU).sin_cos();
            assert!((s - es).abs() < 4e-16 && (c - ec).abs() < 4e-16, "{turns}: {s} {es} {c} {ec}");
        }
        let quarters = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)];
        (0..8).for_each(|i| assert_eq!(sin_cos_turns(0.25 * i as f64), quarters[i % 4]));
    }

    #[test]
    fn moments_of_directions() {
        let axis = Vector::new(0.36, 0.48, -0.8);
        let five_sigma = 5.0 * 0.6 / (N as f64).sqrt();
        assert!((mean(pairs(N).map(|u| lambertian(axis, u).dot(axis))) - 2.0 / 3.0).abs() < five_sigma);
        // Mean of cos under cosᵐ: (m + 1)/(m + 2).
        assert!((mean(pairs(N).map(|u| cosine_power(axis, 6.0, u).dot(axis))) - 7.0 / 8.0).abs() < five_sigma);
        assert!((mean(pairs(N).map(|u| disk(u).length_squared())) - 0.5).abs() < five_sigma);
    }

    #[test]
    fn walshs_diffuse_reflection_by_monte_carlo() {
        // Walsh's closed form (Prahl 1988, B41): outside, and inside by 1 - (1 - R)/n².
        for (n, outside, inside) in
            [(1.5, 0.091778, 0.596346), (4.0 / 3.0, 0.066458, 0.474883), (1.5168, 0.094240, 0.606308)]
        {
            for (eta, expected) in [(1.0 / n, outside), (n, inside)] {
                let values: Vec<f64> = pairs(N)
                    .map(|u| fresnel::dielectric(lambertian(Vector::Z, u).z.min(1.0), eta).unpolarised())
                    .collect();
                let m = mean(values.iter().copied());
                let sigma = (mean(values.iter().map(|v| (v - m) * (v - m))) / N as f64).sqrt();
                assert!((m - expected).abs() < 4.0 * sigma, "n = {n}: {m} ± {sigma}, not {expected}");
                assert!(sigma < 0.0012);
            }
        }
    }

    #[test]
    fn a_diffuse_disk_lights_a_disk() {
        // Coaxial equal disks at a distance of one radius: form factor 0.381966.
        let hits = mean(pairs(N).zip(pairs(2 * N).skip(N)).map(|(u, v)| {
            let d = lambertian(Vector::Z, v);
            let p = disk(u) + d.truncate() / d.z;
            f64::from(u8::from(p.length_squared() <= 1.0))
        }));
        assert!((hits - 0.381966).abs() < 4.0 * (0.382f64 * 0.618 / N as f64).sqrt(), "{hits}");
    }
}
