//! Portable lanes.

use super::lanes::{Lanes, polynomial};

/// Eight samples, in which the compiler may see vectors of its own.
#[derive(Clone, Copy)]
pub(super) struct Portable([f32; 8]);

impl Portable {
    #[inline(always)]
    fn with(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
}

impl Lanes for Portable {
    const COUNT: usize = 8;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        Self([value; 8])
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller vouches for eight samples; arrays of them need no further alignment.
        Self(unsafe { from.cast::<[f32; 8]>().read() })
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: as in `load`.
        unsafe { to.cast::<[f32; 8]>().write(self.0) }
    }

    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        self.with(other, |a, b| a + b)
    }

    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        self.with(other, |a, b| a - b)
    }

    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        self.with(other, |a, b| a * b)
    }

    #[inline(always)]
    unsafe fn div(self, other: Self) -> Self {
        self.with(other, |a, b| a / b)
    }

    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        self.with(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    unsafe fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }

    #[inline(always)]
    unsafe fn max_magnitude(self, other: Self) -> Self {
        let bits = |v: f32| v.to_bits() & 0x7fff_ffff;
        self.with(other, |a, b| f32::from_bits(bits(a).max(bits(b))))
    }

    #[inline(always)]
    unsafe fn mul_add(self, factor: Self, summand: Self) -> Self {
        // Without the instruction, a fused product is a slow call.
        Self(std::array::from_fn(|i| self.0[i] * factor.0[i] + summand.0[i]))
    }

    #[inline(always)]
    unsafe fn neg_mul_add(self, factor: Self, summand: Self) -> Self {
        Self(std::array::from_fn(|i| summand.0[i] - self.0[i] * factor.0[i]))
    }

    #[inline(always)]
    unsafe fn exp2<const TERMS: usize>(self, coefficients: &[Self; TERMS]) -> Self {
        // Adding 1.5 · 2²³ rounds to an integer, which then stands in the low bits.
        const MAGIC: f32 = 12_582_912.0;
        let shifted = self.0.map(|x| x + MAGIC);
        let fraction = Self(std::array::from_fn(|i| self.0[i] - (shifted[i] - MAGIC)));
        // SAFETY: portable.
        let mantissa = unsafe { polynomial(fraction, coefficients) };
        Self(std::array::from_fn(|i| {
            f32::from_bits(mantissa.0[i].to_bits().wrapping_add(shifted[i].to_bits().wrapping_shl(23)))
        }))
    }

    #[inline(always)]
    unsafe fn bits_of_nearest(self) -> Self {
        Self(self.0.map(|x| f32::from_bits((x + 0.5) as i32 as u32)))
    }

    #[inline(always)]
    unsafe fn gather(from: *const f32, stride: usize) -> Self {
        // SAFETY: the caller vouches for the places.
        Self(std::array::from_fn(|i| unsafe { from.add(i * stride).read() }))
    }
}
