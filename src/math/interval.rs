//! Interval arithmetic that rounds outward.

use std::ops::{Add, Mul, Neg, Sub};

/// A closed interval of reals whose arithmetic rounds outward, so that results always contain the exact ones.
///
/// Each operation is computed to nearest and then moved outward by one ulp: wider than directed rounding by at
/// most one ulp a side, and free of rounding-mode switches. Bounds must be numbers: products pass over those that are not.
///
/// ```
/// use lampyris::math::Interval;
/// let tenth = Interval::point(1.0).checked_div(Interval::point(10.0)).unwrap();
/// // 1/10 is no binary number; it lies between the bounds, and so does ten times it.
/// assert!(tenth.lo < tenth.hi && (tenth * Interval::point(10.0)).contains(1.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower bound.
    pub lo: f64,
    /// Upper bound.
    pub hi: f64,
}

impl Interval {
    /// The interval that contains just `x`.
    pub fn point(x: f64) -> Self {
        Self { lo: x, hi: x }
    }

    /// The interval between two bounds in either order.
    pub fn new(a: f64, b: f64) -> Self {
        Self { lo: a.min(b), hi: a.max(b) }
    }

    /// The smallest interval that contains both.
    pub fn hull(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// Whether `x` lies inside.
    pub fn contains(&self, x: f64) -> bool {
        self.lo <= x && x <= self.hi
    }

    /// Whether the interval contains zero, or is not a number.
    pub fn may_be_zero(&self) -> bool {
        !(self.lo > 0.0 || self.hi < 0.0)
    }

    /// Upper bound of the absolute value.
    pub fn magnitude(&self) -> f64 {
        self.lo.abs().max(self.hi.abs())
    }

    /// Middle of the interval, not rounded outward.
    pub fn mid(&self) -> f64 {
        0.5 * (self.lo + self.hi)
    }

    /// Upper bound of the width.
    pub fn width(&self) -> f64 {
        (self.hi - self.lo).next_up()
    }

    /// The quotient, `None` when the divisor may be zero.
    pub fn checked_div(self, d: Self) -> Option<Self> {
        if d.may_be_zero() {
            return None;
        }
        Some(outward([self.lo / d.lo, self.lo / d.hi, self.hi / d.lo, self.hi / d.hi]))
    }

    /// The square, never negative.
    pub fn square(self) -> Self {
        // Not `self * self`, in which the two factors vary apart: −1 to 1 would give −1 to 1.
        let (a, b) = (self.lo * self.lo, self.hi * self.hi);
        let lo = if self.may_be_zero() { 0.0 } else { a.min(b).next_down().max(0.0) };
        Self { lo, hi: a.max(b).next_up() }
    }

    /// The square root of the non-negative part.
    pub fn sqrt(self) -> Self {
        Self { lo: self.lo.max(0.0).sqrt().next_down().max(0.0), hi: self.hi.max(0.0).sqrt().next_up() }
    }
}

/// The interval that holds all four, rounded outward.
fn outward(candidates: [f64; 4]) -> Interval {
    let lo = candidates.iter().copied().fold(f64::INFINITY, f64::min);
    let hi = candidates.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Interval { lo: lo.next_down(), hi: hi.next_up() }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { lo: (self.lo + o.lo).next_down(), hi: (self.hi + o.hi).next_up() }
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { lo: (self.lo - o.hi).next_down(), hi: (self.hi - o.lo).next_up() }
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        outward([self.lo * o.lo, self.lo * o.hi, self.hi * o.lo, self.hi * o.hi])
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Self { lo: -self.hi, hi: -self.lo }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn inside() -> impl Strategy<Value = (Interval, f64)> {
        (-1e3..1e3f64, -1e3..1e3f64, 0.0..1.0f64).prop_map(|(a, b, s)| {
            let i = Interval::new(a, b);
            (i, (i.lo + s * (i.hi - i.lo)).clamp(i.lo, i.hi))
        })
    }

    proptest! {
        #[test]
        fn operations_contain_their_samples((i, x) in inside(), (j, y) in inside()) {
            prop_assert!((i + j).contains(x + y));
            prop_assert!((i - j).contains(x - y));
            prop_assert!((i * j).contains(x * y));
            prop_assert!(i.square().contains(x * x));
            if let Some(q) = i.checked_div(j) { prop_assert!(q.contains(x / y)); }
        }
    }

    #[test]
    fn tenths_do_not_add_up_exactly_but_are_contained() {
        let tenth = Interval::new(0.1f64.next_down(), 0.1f64.next_up());
        let sum = (0..9).fold(tenth, |s, _| s + tenth);
        assert!(sum.contains(1.0) && sum.width() < 1e-14);
    }
}
