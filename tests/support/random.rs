//! Random numbers, directions and rays that are the same everywhere.
// Every test binary that includes this file uses some of it.
#![allow(dead_code)]

use lampyris::math::{Point, Ray, Vector};
use std::f64::consts::PI;

/// SplitMix64 (Steele, Lea and Flood 2014) from a seed.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A number from 0 on and below 1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A whole number from 0 on and below `n`; 0 where there is none.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.bits() % n.max(1) as u64) as usize
    }

    /// A unit vector, evenly spread.
    pub(crate) fn direction(&mut self) -> Vector {
        let (z, phi) = (self.within(-1.0, 1.0), self.within(-PI, PI));
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vector::new(r * phi.cos(), r * phi.sin(), z).normalize()
    }

    /// A ray from a sphere of three times the radius towards a box around the centre.
    pub(crate) fn ray(&mut self, center: Point, half: Vector) -> Ray {
        let origin = center + self.direction() * 3.0 * half.length();
        let target =
            center + half * Vector::new(self.within(-1.1, 1.1), self.within(-1.1, 1.1), self.within(-1.1, 1.1));
        Ray::new(origin, (target - origin).normalize())
    }
}
