//! Numbers of 32 digits: sums of two `f64` without overlap.
//!
//! Dekker 1971 and Knuth's error-free sum; products by a fused multiply-add. A sum, product or quotient is right to about 2⁻¹⁰⁴.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number of 32 digits.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub(super) struct DoubleDouble {
    high: f64,
    low: f64,
}

/// The sum of two numbers without any rounding: the rounded one, and what it rounds away.
#[inline(always)]
fn two_sum(a: f64, b: f64) -> DoubleDouble {
    let high = a + b;
    let of_b = high - a;
    DoubleDouble { high, low: (a - (high - of_b)) + (b - of_b) }
}

/// As [`two_sum`], right only for `|a| ≥ |b|`.
#[inline(always)]
fn quick_two_sum(a: f64, b: f64) -> DoubleDouble {
    let high = a + b;
    DoubleDouble { high, low: b - (high - a) }
}

impl DoubleDouble {
    pub(super) const ZERO: Self = Self { high: 0.0, low: 0.0 };

    /// The nearest `f64`.
    #[inline(always)]
    pub(super) fn to_f64(self) -> f64 {
        self.high
    }
}

impl From<f64> for DoubleDouble {
    #[inline(always)]
    fn from(x: f64) -> Self {
        Self { high: x, low: 0.0 }
    }
}

impl Neg for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Add for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // The accurate sum (as in Hida, Li and Bailey's QD library): the shorter one, which adds the low parts in
        // plain `f64`, has no bound where the high parts cancel, and residuals cancel.
        let high = two_sum(self.high, other.high);
        let low = two_sum(self.low, other.low);
        let sum = quick_two_sum(high.high, high.low + low.high);
        quick_two_sum(sum.high, sum.low + low.low)
    }
}

impl Sub for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // The product of the low parts, 2⁻¹⁰⁶ of the whole, is below what is kept.
        let high = self.high * other.high;
        let low = self.high.mul_add(other.high, -high);
        quick_two_sum(high, low + (self.high * other.low + self.low * other.high))
    }
}

impl Div for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        // Long division: two quotients make 32 digits, and the third corrects the last.
        let first = self.high / other.high;
        let rest = self - other * first.into();
        let second = rest.high / other.high;
        let rest = rest - other * second.into();
        quick_two_sum(first, second) + (rest.high / other.high).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thirds_and_products_keep_thirty_digits() {
        let third = DoubleDouble::from(1.0) / 3.0.into();
        let rest = third * 3.0.into() - 1.0.into();
        assert!(rest.to_f64().abs() < 1e-31);
        // (1 + 2⁻⁶⁰)² − 1 − 2⁻⁵⁹ = 2⁻¹²⁰, of which 2⁻¹⁰⁴ is in reach.
        let x = DoubleDouble::from(1.0) + 2f64.powi(-60).into();
        let square = x * x - 1.0.into() - 2f64.powi(-59).into();
        assert!(square.to_f64().abs() < 2f64.powi(-104));
        assert_eq!((DoubleDouble::from(1e300) + 1.0.into() - 1e300.into()).to_f64(), 1.0);
    }
}
