//! AVX-512: sixteen samples at once.

use std::arch::x86_64::*;

use super::lanes::{Lanes, Task, polynomial};

/// [`Task::run`], compiled for AVX-512 as a whole.
///
/// # Safety
/// As [`Task::run`], with the instructions of [`Avx512`].
#[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,avx2,fma")]
pub(super) unsafe fn run<T: Task>(task: T) -> T::Output {
    // SAFETY: passed on to the caller.
    unsafe { task.run::<Avx512>() }
}

#[derive(Clone, Copy)]
pub(super) struct Avx512(__m512);

// SAFETY of all blocks below: whoever calls a method vouches for AVX-512 F and DQ, and for pointers to sixteen samples.
impl Lanes for Avx512 {
    const COUNT: usize = 16;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_set1_ps(value) })
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_loadu_ps(from) })
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: see above.
        unsafe { _mm512_storeu_ps(to, self.0) }
    }

    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_add_ps(self.0, other.0) })
    }

    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_sub_ps(self.0, other.0) })
    }

    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_mul_ps(self.0, other.0) })
    }

    #[inline(always)]
    unsafe fn div(self, other: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_div_ps(self.0, other.0) })
    }

    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_max_ps(self.0, other.0) })
    }

    #[inline(always)]
    unsafe fn abs(self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_abs_ps(self.0) })
    }

    #[inline(always)]
    unsafe fn max_magnitude(self, other: Self) -> Self {
        // SAFETY: see above.
        unsafe {
            let (a, b) = (_mm512_castps_si512(self.abs().0), _mm512_castps_si512(other.abs().0));
            Self(_mm512_castsi512_ps(_mm512_max_epu32(a, b)))
        }
    }

    #[inline(always)]
    unsafe fn mul_add(self, factor: Self, summand: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_fmadd_ps(self.0, factor.0, summand.0) })
    }

    #[inline(always)]
    unsafe fn neg_mul_add(self, factor: Self, summand: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_fnmadd_ps(self.0, factor.0, summand.0) })
    }

    #[inline(always)]
    unsafe fn exp2<const TERMS: usize>(self, coefficients: &[Self; TERMS]) -> Self {
        // SAFETY: see above.
        unsafe {
            // Adding 1.5 · 2²³ rounds to an integer, which then stands in the low bits.
            let magic = _mm512_set1_ps(12_582_912.0);
            let shifted = _mm512_add_ps(self.0, magic);
            let fraction = Self(_mm512_sub_ps(self.0, _mm512_sub_ps(shifted, magic)));
            let mantissa = polynomial(fraction, coefficients);
            let exponent = _mm512_slli_epi32::<23>(_mm512_castps_si512(shifted));
            Self(_mm512_castsi512_ps(_mm512_add_epi32(_mm512_castps_si512(mantissa.0), exponent)))
        }
    }

    #[inline(always)]
    unsafe fn bits_of_nearest(self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_castsi512_ps(_mm512_cvtps_epi32(self.0)) })
    }

    #[inline(always)]
    unsafe fn gather(from: *const f32, stride: usize) -> Self {
        // SAFETY: see above; the caller vouches for the places.
        unsafe {
            let numbers = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
            let places = _mm512_mullo_epi32(numbers, _mm512_set1_epi32(stride as i32));
            Self(_mm512_i32gather_ps::<4>(places, from))
        }
    }
}
