//! AVX2 and FMA: eight samples at once.

use std::arch::x86_64::*;

use super::lanes::{Lanes, Task, polynomial};

/// [`Task::run`], compiled for AVX2 as a whole.
///
/// # Safety
/// As [`Task::run`], with the instructions of [`Avx2`].
#[target_feature(enable = "avx2,fma")]
pub(super) unsafe fn run<T: Task>(task: T) -> T::Output {
    // SAFETY: passed on to the caller.
    unsafe { task.run::<Avx2>() }
}

#[derive(Clone, Copy)]
pub(super) struct Avx2(__m256);

// SAFETY of all blocks below: whoever calls a method vouches for AVX2 and FMA, and for pointers to eight samples.
impl Lanes for Avx2 {
    const COUNT: usize = 8;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_set1_ps(value) })
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_loadu_ps(from) })
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: see above.
        unsafe { _mm256_storeu_ps(to, self.0) }
    }

    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_add_ps(self.0, other.0) })
    }

    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_sub_ps(self.0, other.0) })
    }

    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_mul_ps(self.0, other.0) })
    }

    #[inline(always)]
    unsafe fn div(self, other: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_div_ps(self.0, other.0) })
    }

    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_max_ps(self.0, other.0) })
    }

    #[inline(always)]
    unsafe fn abs(self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
    }

    #[inline(always)]
    unsafe fn max_magnitude(self, other: Self) -> Self {
        // SAFETY: see above.
        unsafe {
            let (a, b) = (_mm256_castps_si256(self.abs().0), _mm256_castps_si256(other.abs().0));
            Self(_mm256_castsi256_ps(_mm256_max_epu32(a, b)))
        }
    }

    #[inline(always)]
    unsafe fn mul_add(self, factor: Self, summand: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_fmadd_ps(self.0, factor.0, summand.0) })
    }

    #[inline(always)]
    unsafe fn neg_mul_add(self, factor: Self, summand: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_fnmadd_ps(self.0, factor.0, summand.0) })
    }

    #[inline(always)]
    unsafe fn exp2<const TERMS: usize>(self, coefficients: &[Self; TERMS]) -> Self {
        // SAFETY: see above.
        unsafe {
            // Adding 1.5 · 2²³ rounds to an integer, which then stands in the low bits.
            let magic = _mm256_set1_ps(12_582_912.0);
            let shifted = _mm256_add_ps(self.0, magic);
            let fraction = Self(_mm256_sub_ps(self.0, _mm256_sub_ps(shifted, magic)));
            let mantissa = polynomial(fraction, coefficients);
            let exponent = _mm256_slli_epi32::<23>(_mm256_castps_si256(shifted));
            Self(_mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256(mantissa.0), exponent)))
        }
    }

    #[inline(always)]
    unsafe fn bits_of_nearest(self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_castsi256_ps(_mm256_cvtps_epi32(self.0)) })
    }

    #[inline(always)]
    unsafe fn gather(from: *const f32, stride: usize) -> Self {
        // SAFETY: see above; the caller vouches for the places.
        unsafe {
            let places =
                _mm256_mullo_epi32(_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7), _mm256_set1_epi32(stride as i32));
            Self(_mm256_i32gather_ps::<4>(from, places))
        }
    }
}
