//! The sums over neighbours by instruction set, chosen at run time.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod cosines;
#[cfg(target_arch = "x86_64")]
mod half;
mod kernel;
mod lanes;
mod portable;
mod rescale;
mod spread;

use serde::Serialize;

use crate::Scale;

use self::cosines::{AddProduct, Multiply, Rotate};
pub(crate) use self::cosines::{CosinePass, CosineTerm};
#[cfg(target_arch = "x86_64")]
pub(crate) use self::half::HalfRowJob;
use self::kernel::FilterRow;
pub use self::kernel::Precision;
pub(crate) use self::kernel::{Group, Metric, RowJob};
use self::lanes::Task;
use self::rescale::Rescale;
use self::spread::Spread;

/// Which instructions the filter uses. Different ones round differently, in the last bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
pub enum SimdLevel {
    /// The fastest that the machine has.
    #[default]
    Auto,
    /// Portable code.
    Scalar,
    /// AVX2 and FMA, on x86-64.
    Avx2,
    /// AVX-512 (F, VL, BW, DQ), on x86-64.
    Avx512,
}

/// An instruction set that is known to be present.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    Scalar,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Level {
    /// The best that is present and not above `wanted`.
    pub fn choose(wanted: SimdLevel) -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::is_x86_feature_detected as has;
            let avx2 = has!("avx2") && has!("fma");
            let avx512 = avx2 && has!("avx512f") && has!("avx512vl") && has!("avx512bw") && has!("avx512dq");
            match wanted {
                SimdLevel::Auto | SimdLevel::Avx512 if avx512 => return Self::Avx512,
                SimdLevel::Auto | SimdLevel::Avx512 | SimdLevel::Avx2 if avx2 => return Self::Avx2,
                _ => {}
            }
        }
        let _ = wanted;
        Self::Scalar
    }

    /// The public name.
    pub fn name(self) -> SimdLevel {
        match self {
            Self::Scalar => SimdLevel::Scalar,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => SimdLevel::Avx2,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => SimdLevel::Avx512,
        }
    }

    /// Does a task with the instructions of the level.
    ///
    /// # Safety
    /// What the task demands must hold.
    #[inline]
    unsafe fn run<T: Task>(self, task: T) -> T::Output {
        // SAFETY: the level is chosen only where the instructions are present, and portable lanes need none; the rest is
        // passed on to the caller.
        unsafe {
            match self {
                Self::Scalar => task.run::<portable::Portable>(),
                #[cfg(target_arch = "x86_64")]
                Self::Avx2 => avx2::run(task),
                #[cfg(target_arch = "x86_64")]
                Self::Avx512 => avx512::run(task),
            }
        }
    }

    /// `to[i] = factor · from[i · stride]`. Returns the largest absolute value; NaN if one of the samples
    /// is.
    /// Panics when `from` doesn't hold all samples, or the stride exceeds 16 bits.
    pub fn spread(self, from: &[f32], stride: usize, factor: f32, to: &mut [f32]) -> f32 {
        assert!(to.is_empty() || (to.len() - 1) * stride < from.len(), "samples beyond the last");
        assert!(stride <= usize::from(u16::MAX), "samples too far apart");
        // SAFETY: the places were checked.
        unsafe { self.run(Spread { from, stride, factor, to }) }
    }

    /// Takes linear values to a scale, or back, and multiplies them with a factor. Values that aren't finite become NaN.
    /// Returns the largest absolute value; NaN if one is.
    pub fn rescale(self, scale: Scale, backward: bool, factor: f32, values: &mut [f32]) -> f32 {
        // SAFETY: a slice is all it touches.
        unsafe { self.run(Rescale { scale, backward, factor, values }) }
    }

    /// Filters a row; see [`RowJob`]. Does nothing but panic when the job reaches beyond the planes or the output.
    pub fn filter_row(self, job: &RowJob<'_>, out: &mut [f32]) {
        job.check(out.len());
        // SAFETY: the job was checked.
        unsafe { self.run(FilterRow { job, out }) }
    }

    /// Whether rows can be filtered in half precision.
    pub fn has_half_precision(self) -> bool {
        #[cfg(target_arch = "x86_64")]
        return self == Self::Avx512 && half::is_present();
        #[cfg(not(target_arch = "x86_64"))]
        return false;
    }

    /// Samples in half precision, clamped to ±60,000. Does nothing where [`Self::has_half_precision`] says no.
    pub fn convert_to_half(self, from: &[f32], to: &mut [u16]) {
        #[cfg(target_arch = "x86_64")]
        if self == Self::Avx512 {
            // SAFETY: the level is chosen only where the instructions are present.
            unsafe { half::convert(from, to) }
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = (from, to);
    }

    /// Filters a row in half precision. Panics when the instructions are missing, or the job reaches beyond its slices.
    #[cfg(target_arch = "x86_64")]
    pub fn filter_half_row(self, job: &HalfRowJob<'_>, out: &mut [f32]) {
        assert!(self.has_half_precision(), "no half precision");
        job.check(out.len());
        // SAFETY: both were checked.
        unsafe { half::filter_row(job, out) }
    }

    /// Filters columns with a sum of cosines; see [`CosinePass`]. Panics when the pass reaches beyond its slices.
    pub fn cosine_pass(self, pass: CosinePass<'_>) {
        pass.check();
        // SAFETY: the pass was checked.
        unsafe { self.run(pass) }
    }

    /// `to = a · b`.
    pub fn multiply(self, a: &[f32], b: &[f32], to: &mut [f32]) {
        // SAFETY: slices are all it touches.
        unsafe { self.run(Multiply { a, b, to }) }
    }

    /// `to += factor · a · b`.
    pub fn add_product(self, a: &[f32], b: &[f32], factor: f32, to: &mut [f32]) {
        // SAFETY: slices are all it touches.
        unsafe { self.run(AddProduct { a, b, factor, to }) }
    }

    /// Turns the vectors `(cos, sin)` by the angles of `(by_cos, by_sin)`.
    pub fn rotate(self, cos: &mut [f32], sin: &mut [f32], by_cos: &[f32], by_sin: &[f32]) {
        // SAFETY: slices are all it touches.
        unsafe { self.run(Rotate { cos, sin, by_cos, by_sin }) }
    }
}
