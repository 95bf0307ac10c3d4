//! Random numbers for picking the rays of a study, each a pure function of seed, index and draw.

use crate::math::Vector;

/// Random numbers that are a pure function of (seed, index, draw): any ray can be made again alone.
///
/// The generator is SplitMix64 (Steele, Lea, Flood, *Fast Splittable Pseudorandom Number Generators*, 2014) started from a
/// mix of seed and index; enough for picking rays, not for estimating power (that is `simulate`'s).
///
/// ```
/// use lampyris::study::Random;
/// // The same seed and index give the same numbers, whatever else was drawn.
/// assert_eq!(Random::new(7, 3).unit(), Random::new(7, 3).unit());
/// assert!((Random::new(7, 4).direction().length() - 1.0).abs() < 1e-15);
/// ```
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

/// SplitMix64's step: 2⁶⁴ over the golden ratio, odd.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Scrambles 64 bits: SplitMix64's output function, a bijection.
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Random {
    /// Begins the stream of one index under a seed.
    pub fn new(seed: u64, index: u64) -> Self {
        // The index is mixed by itself: neighbours would else run along one sequence, shifted by one.
        Self { state: mix(seed.wrapping_add(GOLDEN)) ^ mix(index.wrapping_mul(GOLDEN).wrapping_add(1)) }
    }

    /// Draws the next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(GOLDEN);
        mix(self.state)
    }

    /// Draws a number uniform in `[0, 1)`.
    pub fn unit(&mut self) -> f64 {
        // The 53 upper bits: as many as a double holds below 1.
        (self.bits() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Draws a number uniform in `[a, b)`.
    pub fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.unit()
    }

    /// Draws a direction uniform on the unit sphere.
    pub fn direction(&mut self) -> Vector {
        let z = self.between(-1.0, 1.0);
        let (sin, cos) = self.between(0.0, std::f64::consts::TAU).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vector::new(r * cos, r * sin, z).normalize()
    }

    /// Draws a direction uniform on the hemisphere about the unit vector `n`.
    pub fn hemisphere(&mut self, n: Vector) -> Vector {
        let d = self.direction();
        if d.dot(n) < 0.0 { -d } else { d }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_moments_of_uniform_numbers_and_directions() {
        let n = 20_000;
        let (mut mean, mut square, mut sum) = (0.0, 0.0, Vector::ZERO);
        for i in 0..n {
            let mut r = Random::new(7, i);
            let x = r.unit();
            mean += x / n as f64;
            square += x * x / n as f64;
            sum += r.direction() / n as f64;
        }
        // Five standard deviations of each mean.
        assert!((mean - 0.5).abs() < 5.0 * (1.0f64 / 12.0 / n as f64).sqrt());
        assert!((square - 1.0 / 3.0).abs() < 5.0 * (4.0f64 / 45.0 / n as f64).sqrt());
        assert!(sum.length() < 5.0 * (1.0 / n as f64).sqrt());
    }
}
