//! Hot loops compiled once for every processor and once for wider instruction sets, the best taken at run time.
//!
//! A hot loop is a [`Kernel`]: plain Rust in one `#[inline(always)]` method, which [`dispatch`] inlines into a function compiled
//! for the instruction set that was found. Every version gives the same bits: the compiler neither fuses nor reorders
//! floating-point operations, what is to be fused is written as `mul_add`, which rounds once everywhere, and vectors of any
//! width round alike.
//!
//! `unsafe` is needed to call a function compiled for instructions that the build as a whole does not assume. It is sound because
//! the processor is asked first; the standard library caches its answer.
#![allow(unsafe_code)]
#![cfg_attr(
    not(target_arch = "x86_64"),
    expect(dead_code, reason = "elsewhere every loop is compiled for the target alone")
)]

pub(crate) mod f64x8;

/// An instruction set, known while compiling.
pub(crate) trait Instructions {
    /// Whether AVX2, FMA, BMI1, BMI2, LZCNT and POPCNT may be used.
    const AVX2: bool;
    /// Whether AVX-512 F, DQ and VL may be used as well.
    const AVX512: bool;
}

/// What every processor of the target has.
pub(crate) struct Portable;
/// What [`has_avx2`] asks for.
pub(crate) struct Avx2;
/// What [`has_avx512`] asks for.
pub(crate) struct Avx512;

impl Instructions for Portable {
    const AVX2: bool = false;
    const AVX512: bool = false;
}

impl Instructions for Avx2 {
    const AVX2: bool = true;
    const AVX512: bool = false;
}

impl Instructions for Avx512 {
    const AVX2: bool = true;
    const AVX512: bool = true;
}

/// A loop to be compiled for several instruction sets; what it works on is in the fields.
pub(crate) trait Kernel {
    /// What it returns.
    type Output;

    /// The loop. Implementations are `#[inline(always)]`, as is all that is hot inside: what is called instead runs with the
    /// instructions of the target's baseline.
    fn run<I: Instructions>(self) -> Self::Output;
}

/// Whether this processor has AVX2 and what came with it: FMA, BMI1, BMI2, LZCNT and POPCNT.
#[inline(always)]
pub(crate) fn has_avx2() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt")
    }
    #[cfg(not(target_arch = "x86_64"))]
    false
}

/// Whether this processor has AVX-512 F, DQ and VL beside AVX2.
#[inline(always)]
pub(crate) fn has_avx512() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        has_avx2()
            && is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
    }
    #[cfg(not(target_arch = "x86_64"))]
    false
}

/// An instruction set that this processor was found to have: for kernels so short that asking takes time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Level(Width);

/// The sets that kernels are compiled for.
#[derive(Clone, Copy, Debug)]
enum Width {
    Portable,
    Avx2,
    Avx512,
}

impl Level {
    /// What every processor has.
    pub(crate) const PORTABLE: Self = Self(Width::Portable);

    /// AVX2 and what came with it where the processor has them, else the baseline.
    pub(crate) fn avx2() -> Self {
        Self(if has_avx2() { Width::Avx2 } else { Width::Portable })
    }

    /// AVX-512, else AVX2, where the processor has it, else the baseline.
    pub(crate) fn widest() -> Self {
        if has_avx512() { Self(Width::Avx512) } else { Self::avx2() }
    }

    /// Runs a kernel with the instructions of this level.
    #[inline(always)]
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            // SAFETY: such a level is made only where the features were found.
            #[cfg(target_arch = "x86_64")]
            Width::Avx512 => unsafe { run_avx512(kernel) },
            // SAFETY: the same.
            #[cfg(target_arch = "x86_64")]
            Width::Avx2 => unsafe { run_avx2(kernel) },
            _ => kernel.run::<Portable>(),
        }
    }
}

/// Runs a kernel with AVX2 where the processor has it, else with the baseline; it asks the processor at each call.
#[inline]
pub(crate) fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if has_avx2() {
        // SAFETY: the features were found.
        return unsafe { run_avx2(kernel) };
    }
    run_portable(kernel)
}

/// Runs a kernel with AVX-512, else AVX2, where the processor has it: for loops that gain by registers of 64 bytes.
#[inline]
pub(crate) fn dispatch_widest<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if has_avx512() {
        // SAFETY: the features were found.
        return unsafe { run_avx512(kernel) };
    }
    dispatch(kernel)
}

/// Runs a kernel with the baseline: a function like the others, so that without optimisation its variables do not lie on the stack of
/// theirs.
pub(crate) fn run_portable<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Portable>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx2>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512dq,avx512vl")]
fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx512>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A polynomial by fused steps, eight at a time.
    struct Horner<'a>(&'a [f64; 5], [f64; 8]);

    impl Kernel for Horner<'_> {
        type Output = [u64; 8];

        #[inline(always)]
        fn run<I: Instructions>(self) -> [u64; 8] {
            let mut y = [0.0f64; 8];
            for &c in self.0 {
                for k in 0..8 {
                    y[k] = y[k].mul_add(self.1[k], c);
                }
            }
            y.map(f64::to_bits)
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let coefficients = [0.3, -1.7, 2.9, 1e-3, 5.5];
        let x = std::array::from_fn(|k| 0.1 + 0.37 * k as f64);
        let portable = Horner(&coefficients, x).run::<Portable>();
        assert_eq!(dispatch(Horner(&coefficients, x)), portable);
        assert_eq!(dispatch_widest(Horner(&coefficients, x)), portable);
        for level in [Level::PORTABLE, Level::avx2(), Level::widest()] {
            assert_eq!(level.run(Horner(&coefficients, x)), portable, "{level:?}");
        }
    }
}
