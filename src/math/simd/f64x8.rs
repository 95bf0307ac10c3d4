//! Eight numbers at a time: one register of AVX-512, two of AVX2, or an array.
//!
//! Every operation rounds once, and lanes do not see each other: whatever implementation runs, and whatever stands in the other lanes, a
//! lane has the same bits. Kernels of [`super`] choose an implementation while compiling.
//! Sound because those with registers are only named where their instructions were found, and loads and stores stay inside their arrays.
#![allow(unsafe_code)]

/// Lanes of an [`F64x8`].
pub(crate) const LANES: usize = 8;

/// Eight numbers.
pub(crate) trait F64x8: Copy {
    /// The same in every lane.
    fn splat(x: f64) -> Self;
    /// Lane `k` is `x[k]`.
    fn load(x: &[f64; LANES]) -> Self;
    /// Overwrites `to` with the lanes, in order.
    fn store(self, to: &mut [f64; LANES]);
    /// Transposes eight vectors: their first components in one, then the second, third and fourth ones.
    fn transpose(rows: [&[f64; 4]; LANES]) -> [Self; 4];
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    /// `self · factor + term`, rounded once.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// `term − self · factor`, rounded once.
    fn neg_mul_add(self, factor: Self, term: Self) -> Self;
    fn abs(self) -> Self;
    /// The greater; `other` where one of them is not a number.
    fn max(self, other: Self) -> Self;
    fn sqrt(self) -> Self;
    /// In which lanes it is less, one bit each; in none where one is not a number.
    fn mask_less(self, other: Self) -> u8;
    /// In which lanes it is less or equal, as [`F64x8::mask_less`].
    fn mask_at_most(self, other: Self) -> u8;
    /// `self` in the lanes of the mask, else `other`.
    fn select(self, mask: u8, other: Self) -> Self;
}

/// Eight numbers as an array.
#[derive(Clone, Copy)]
pub(crate) struct Array([f64; LANES]);

impl Array {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|k| f(self.0[k], other.0[k])))
    }

    #[inline(always)]
    fn mask(self, other: Self, f: impl Fn(&f64, &f64) -> bool) -> u8 {
        (0..LANES).fold(0, |mask, k| mask | u8::from(f(&self.0[k], &other.0[k])) << k)
    }
}

impl F64x8 for Array {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self([x; LANES])
    }
    #[inline(always)]
    fn load(x: &[f64; LANES]) -> Self {
        Self(*x)
    }
    #[inline(always)]
    fn store(self, to: &mut [f64; LANES]) {
        *to = self.0;
    }
    #[inline(always)]
    fn transpose(rows: [&[f64; 4]; LANES]) -> [Self; 4] {
        std::array::from_fn(|c| Self(rows.map(|row| row[c])))
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
    // Without an instruction for it each lane is a call: written out at every use they were 350 kB of code.
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k].mul_add(factor.0[k], term.0[k])))
    }
    #[inline(always)]
    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        Self(self.0.map(|x| -x)).mul_add(factor, term)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f64::abs))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // As the instruction has it: the second where one of them is not a number.
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }
    #[inline(always)]
    fn mask_less(self, other: Self) -> u8 {
        self.mask(other, |a, b| a < b)
    }
    #[inline(always)]
    fn mask_at_most(self, other: Self) -> u8 {
        self.mask(other, |a, b| a <= b)
    }
    #[inline(always)]
    fn select(self, mask: u8, other: Self) -> Self {
        Self(std::array::from_fn(|k| if mask >> k & 1 == 1 { self.0[k] } else { other.0[k] }))
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) use registers::{Avx2Pair, Avx512Register};

#[cfg(target_arch = "x86_64")]
mod registers {
    use super::{F64x8, LANES};
    use std::arch::x86_64::*;

    /// Eight numbers in one register of AVX-512; only where that was found.
    #[derive(Clone, Copy)]
    pub(crate) struct Avx512Register(__m512d);

    /// Eight numbers in two registers of AVX2, with FMA; only where these were found.
    #[derive(Clone, Copy)]
    pub(crate) struct Avx2Pair(__m256d, __m256d);

    /// An operation of two numbers.
    macro_rules! in_register {
        ($name:ident, $instruction:ident) => {
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self(unsafe { $instruction(self.0, other.0) })
            }
        };
    }

    /// An operation of two numbers.
    macro_rules! in_pair {
        ($name:ident, $instruction:ident) => {
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                unsafe { Self($instruction(self.0, other.0), $instruction(self.1, other.1)) }
            }
        };
    }

    /// Two vectors in one register.
    #[inline(always)]
    unsafe fn load_both(low: &[f64; 4], high: &[f64; 4]) -> __m512d {
        unsafe {
            let low = _mm512_castpd256_pd512(_mm256_loadu_pd(low.as_ptr()));
            _mm512_insertf64x4::<1>(low, _mm256_loadu_pd(high.as_ptr()))
        }
    }

    impl F64x8 for Avx512Register {
        #[inline(always)]
        fn splat(x: f64) -> Self {
            Self(unsafe { _mm512_set1_pd(x) })
        }
        #[inline(always)]
        fn load(x: &[f64; LANES]) -> Self {
            Self(unsafe { _mm512_loadu_pd(x.as_ptr()) })
        }
        #[inline(always)]
        fn store(self, to: &mut [f64; LANES]) {
            unsafe { _mm512_storeu_pd(to.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn transpose(rows: [&[f64; 4]; LANES]) -> [Self; 4] {
            unsafe {
                // Rows 0 and 2, 1 and 3, 4 and 6, 5 and 7, so that pairs of rows end in order.
                let (a, b) = (load_both(rows[0], rows[2]), load_both(rows[1], rows[3]));
                let (c, d) = (load_both(rows[4], rows[6]), load_both(rows[5], rows[7]));
                let (even, odd) = (_mm512_unpacklo_pd(a, b), _mm512_unpackhi_pd(a, b));
                let (even_high, odd_high) = (_mm512_unpacklo_pd(c, d), _mm512_unpackhi_pd(c, d));
                [
                    Self(_mm512_shuffle_f64x2::<0x88>(even, even_high)),
                    Self(_mm512_shuffle_f64x2::<0x88>(odd, odd_high)),
                    Self(_mm512_shuffle_f64x2::<0xdd>(even, even_high)),
                    Self(_mm512_shuffle_f64x2::<0xdd>(odd, odd_high)),
                ]
            }
        }
        #[inline(always)]
        fn mul_add(self, factor: Self, term: Self) -> Self {
            Self(unsafe { _mm512_fmadd_pd(self.0, factor.0, term.0) })
        }
        #[inline(always)]
        fn neg_mul_add(self, factor: Self, term: Self) -> Self {
            Self(unsafe { _mm512_fnmadd_pd(self.0, factor.0, term.0) })
        }
        #[inline(always)]
        fn abs(self) -> Self {
            Self(unsafe { _mm512_abs_pd(self.0) })
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            Self(unsafe { _mm512_sqrt_pd(self.0) })
        }
        #[inline(always)]
        fn mask_less(self, other: Self) -> u8 {
            unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0) }
        }
        #[inline(always)]
        fn mask_at_most(self, other: Self) -> u8 {
            unsafe { _mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, other.0) }
        }
        #[inline(always)]
        fn select(self, mask: u8, other: Self) -> Self {
            Self(unsafe { _mm512_mask_blend_pd(mask, other.0, self.0) })
        }
        in_register!(add, _mm512_add_pd);
        in_register!(sub, _mm512_sub_pd);
        in_register!(mul, _mm512_mul_pd);
        in_register!(div, _mm512_div_pd);
        in_register!(max, _mm512_max_pd);
    }

    /// Sets all bits of each of four lanes whose bit is set in the four lowest of a mask, and none of the others.
    #[inline(always)]
    unsafe fn widen_mask(mask: u8) -> __m256d {
        unsafe {
            let bits = _mm256_set_epi64x(8, 4, 2, 1);
            let own = _mm256_and_si256(_mm256_set1_epi64x(i64::from(mask)), bits);
            _mm256_castsi256_pd(_mm256_cmpeq_epi64(own, bits))
        }
    }

    /// Transposes four vectors: the first components of all, then the second, third and fourth ones.
    #[inline(always)]
    unsafe fn transpose_four(a: &[f64; 4], b: &[f64; 4], c: &[f64; 4], d: &[f64; 4]) -> [__m256d; 4] {
        unsafe {
            let (a, b) = (_mm256_loadu_pd(a.as_ptr()), _mm256_loadu_pd(b.as_ptr()));
            let (c, d) = (_mm256_loadu_pd(c.as_ptr()), _mm256_loadu_pd(d.as_ptr()));
            let (even, odd) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
            let (even_high, odd_high) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
            [
                _mm256_permute2f128_pd::<0x20>(even, even_high),
                _mm256_permute2f128_pd::<0x20>(odd, odd_high),
                _mm256_permute2f128_pd::<0x31>(even, even_high),
                _mm256_permute2f128_pd::<0x31>(odd, odd_high),
            ]
        }
    }

    impl F64x8 for Avx2Pair {
        #[inline(always)]
        fn splat(x: f64) -> Self {
            let x = unsafe { _mm256_set1_pd(x) };
            Self(x, x)
        }
        #[inline(always)]
        fn load(x: &[f64; LANES]) -> Self {
            unsafe { Self(_mm256_loadu_pd(x.as_ptr()), _mm256_loadu_pd(x.as_ptr().add(4))) }
        }
        #[inline(always)]
        fn store(self, to: &mut [f64; LANES]) {
            unsafe {
                _mm256_storeu_pd(to.as_mut_ptr(), self.0);
                _mm256_storeu_pd(to.as_mut_ptr().add(4), self.1);
            }
        }
        #[inline(always)]
        fn transpose(rows: [&[f64; 4]; LANES]) -> [Self; 4] {
            unsafe {
                let [x, y, z, w] = transpose_four(rows[0], rows[1], rows[2], rows[3]);
                let [x_high, y_high, z_high, w_high] = transpose_four(rows[4], rows[5], rows[6], rows[7]);
                [Self(x, x_high), Self(y, y_high), Self(z, z_high), Self(w, w_high)]
            }
        }
        #[inline(always)]
        fn mul_add(self, factor: Self, term: Self) -> Self {
            unsafe { Self(_mm256_fmadd_pd(self.0, factor.0, term.0), _mm256_fmadd_pd(self.1, factor.1, term.1)) }
        }
        #[inline(always)]
        fn neg_mul_add(self, factor: Self, term: Self) -> Self {
            unsafe { Self(_mm256_fnmadd_pd(self.0, factor.0, term.0), _mm256_fnmadd_pd(self.1, factor.1, term.1)) }
        }
        #[inline(always)]
        fn abs(self) -> Self {
            unsafe {
                let sign = _mm256_set1_pd(-0.0);
                Self(_mm256_andnot_pd(sign, self.0), _mm256_andnot_pd(sign, self.1))
            }
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            unsafe { Self(_mm256_sqrt_pd(self.0), _mm256_sqrt_pd(self.1)) }
        }
        #[inline(always)]
        fn mask_less(self, other: Self) -> u8 {
            unsafe {
                let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0));
                let high = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(self.1, other.1));
                (low | high << 4) as u8
            }
        }
        #[inline(always)]
        fn mask_at_most(self, other: Self) -> u8 {
            unsafe {
                let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0));
                let high = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(self.1, other.1));
                (low | high << 4) as u8
            }
        }
        #[inline(always)]
        fn select(self, mask: u8, other: Self) -> Self {
            unsafe {
                Self(
                    _mm256_blendv_pd(other.0, self.0, widen_mask(mask)),
                    _mm256_blendv_pd(other.1, self.1, widen_mask(mask >> 4)),
                )
            }
        }
        in_pair!(add, _mm256_add_pd);
        in_pair!(sub, _mm256_sub_pd);
        in_pair!(mul, _mm256_mul_pd);
        in_pair!(div, _mm256_div_pd);
        in_pair!(max, _mm256_max_pd);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::simd::{Instructions, Kernel, Portable, dispatch, dispatch_widest};

    /// Every operation on the same numbers; the bits of all that comes of it.
    struct Operations;

    impl Kernel for Operations {
        type Output = Vec<u64>;

        #[inline(always)]
        fn run<I: Instructions>(self) -> Vec<u64> {
            #[cfg(target_arch = "x86_64")]
            if I::AVX512 {
                return operate::<Avx512Register>();
            } else if I::AVX2 {
                return operate::<Avx2Pair>();
            }
            operate::<Array>()
        }
    }

    #[inline(always)]
    fn operate<V: F64x8>() -> Vec<u64> {
        let rows: [[f64; 4]; LANES] =
            std::array::from_fn(|k| std::array::from_fn(|c| 0.7 + (k * 4 + c) as f64 * 1.3 - 9.0 * (c as f64)));
        let [a, b, c, d] = V::transpose([0, 1, 2, 3, 4, 5, 6, 7].map(|k| &rows[k]));
        let not_a_number = V::splat(f64::NAN).select(0b1000_0100, b);
        let masks = [a.mask_less(b), b.mask_at_most(b), a.mask_less(not_a_number), not_a_number.mask_at_most(b)];
        let results = [
            a.add(b),
            a.sub(b),
            a.mul(b),
            c.div(d),
            a.mul_add(b, c),
            a.neg_mul_add(b, c),
            d.abs(),
            d.max(a),
            a.max(not_a_number),
            d.abs().sqrt(),
            a.select(0b0110_1001, d),
        ];
        let mut bits: Vec<u64> = masks.map(u64::from).to_vec();
        for result in results {
            let mut lanes = [0.0; LANES];
            result.store(&mut lanes);
            bits.extend(lanes.map(f64::to_bits));
        }
        bits
    }

    #[test]
    fn every_implementation_gives_the_same_bits() {
        let portable = Operations.run::<Portable>();
        // The second components are less than the first, and two lanes are not numbers.
        assert_eq!(portable[..4], [0, 0xff, 0, 0x7b]);
        assert_eq!(dispatch(Operations), portable);
        assert_eq!(dispatch_widest(Operations), portable);
    }
}
