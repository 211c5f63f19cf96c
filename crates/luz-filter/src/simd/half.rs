//! AVX-512 FP16: thirty-two samples at once, in half precision.
//!
//! The compiler doesn't know these instructions yet (their intrinsics are newer than the oldest compiler that luz is built
//! with); so the loop over samples is written in assembly.
//!
//! Half precision has 11 bits. Differences of samples are nearly exact, so that what matters is the rounding of the samples,
//! 2⁻¹² relative: 70 dB below a value of 1. Sums are flushed to single precision after [`CHUNK`] samples.

use std::arch::asm;
use std::arch::x86_64::*;
use std::sync::OnceLock;

/// As [`RowJob`](super::RowJob) for an image that is its own guide, with planes in half precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HalfRowJob<'a> {
    /// The planes of the values, in bits.
    pub planes: &'a [u16],
    pub plane_size: usize,
    /// One to three.
    pub channels: usize,
    pub centre: usize,
    pub columns: usize,
    pub offsets: &'a [i32],
    /// The exponents of the weights, each twice.
    pub exponents: &'a [u32],
    pub reach: (i32, i32),
    pub centre_weight: f32,
    pub unscale: f32,
}

impl HalfRowJob<'_> {
    /// Panics unless all reads and writes are in bounds.
    pub fn check(&self, out: usize) {
        let columns = self.columns.next_multiple_of(LANES);
        assert_eq!(self.offsets.len(), self.exponents.len());
        assert!((1..=3).contains(&self.channels), "too many channels");
        assert!(out >= self.channels * columns, "no room for the results");
        assert!(self.centre as i64 + i64::from(self.reach.0.min(0)) >= 0, "neighbours before the first");
        let end = self.centre + columns + self.reach.1.max(0) as usize + (self.channels - 1) * self.plane_size;
        assert!(end <= self.planes.len(), "neighbours beyond the last");
        debug_assert!(self.offsets.iter().all(|o| (self.reach.0..=self.reach.1).contains(o)));
    }
}

const LANES: usize = 32;
/// Samples that are summed in half precision.
const CHUNK: usize = 16;

/// Whether the processor has the instructions.
pub(super) fn is_present() -> bool {
    use std::arch::is_x86_feature_detected as has;
    // The question is slow on virtual machines.
    static PRESENT: OnceLock<bool> = OnceLock::new();
    // Leaf 7 tells of AVX512-FP16 in bit 23 of EDX.
    let ask = || has!("avx512f") && has!("avx512bw") && __cpuid(0).eax >= 7 && __cpuid_count(7, 0).edx >> 23 & 1 == 1;
    *PRESENT.get_or_init(ask)
}

/// Samples in half precision, clamped to what that can hold.
///
/// # Safety
/// AVX-512 F must be present.
#[target_feature(enable = "avx512f,avx2,fma")]
pub(super) unsafe fn convert(from: &[f32], to: &mut [u16]) {
    /// Less than the largest number by so much that differences with small ones are finite, too.
    const LARGEST: f32 = 60_000.0;
    for (from, to) in from.chunks(16).zip(to.chunks_mut(16)) {
        if let (Ok(from), Ok(to)) = (<&[f32; 16]>::try_from(from), <&mut [u16; 16]>::try_from(&mut *to)) {
            // SAFETY: both arrays hold sixteen samples; the caller vouches for the instructions.
            unsafe {
                let samples = _mm512_loadu_ps(from.as_ptr());
                let samples = _mm512_min_ps(_mm512_set1_ps(LARGEST), _mm512_max_ps(_mm512_set1_ps(-LARGEST), samples));
                let halves = _mm512_cvtps_ph::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(samples);
                _mm256_storeu_si256(to.as_mut_ptr().cast(), halves);
            }
        } else {
            for (from, to) in from.iter().zip(to) {
                *to = half::f16::from_f32(from.clamp(-LARGEST, LARGEST)).to_bits();
            }
        }
    }
}

/// Filters a row.
///
/// # Safety
/// The instructions must be [present](is_present), and `job.check(out.len())` must have passed, with offsets within the reach.
#[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,avx2,fma")]
pub(super) unsafe fn filter_row(job: &HalfRowJob<'_>, out: &mut [f32]) {
    // SAFETY: passed on to the caller.
    unsafe {
        match job.channels {
            1 => filter::<1>(job, out),
            2 => filter::<2>(job, out),
            _ => filter::<3>(job, out),
        }
    }
}

/// # Safety
/// As [`filter_row`].
#[inline]
#[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,avx2,fma")]
unsafe fn filter<const CHANNELS: usize>(job: &HalfRowJob<'_>, out: &mut [f32]) {
    let columns = job.columns.next_multiple_of(LANES);
    for column in (0..job.columns).step_by(LANES) {
        // SAFETY: `HalfRowJob::check` compared the farthest reads and writes with the slices' lengths.
        unsafe {
            let first = job.planes.as_ptr().add(job.centre + column);
            let zero = _mm512_setzero_si512();
            let mut centre = [zero; 3];
            for (c, centre) in centre.iter_mut().enumerate().take(CHANNELS) {
                *centre = _mm512_loadu_si512(first.add(c * job.plane_size).cast());
            }
            // The weights, then the weighted differences, as two vectors each.
            let mut sums = [[_mm512_setzero_ps(); 2]; 4];
            sums[0] = [_mm512_set1_ps(job.centre_weight); 2];
            for (offsets, exponents) in job.offsets.chunks(CHUNK).zip(job.exponents.chunks(CHUNK)) {
                let part = match CHANNELS {
                    1 => sum_1(first, centre[0], offsets, exponents),
                    2 => sum_2(first, job.plane_size, [centre[0], centre[1]], offsets, exponents),
                    _ => sum_3(first, job.plane_size, centre, offsets, exponents),
                };
                for (sum, part) in sums.iter_mut().zip(part).take(CHANNELS + 1) {
                    let [low, high] = widen(part);
                    *sum = [_mm512_add_ps(sum[0], low), _mm512_add_ps(sum[1], high)];
                }
            }
            let unscale = _mm512_set1_ps(job.unscale);
            for c in 0..CHANNELS {
                let centre = widen(centre[c]);
                for h in 0..2 {
                    // Differences are those of the centre from its neighbours.
                    let mean = _mm512_sub_ps(centre[h], _mm512_div_ps(sums[c + 1][h], sums[0][h]));
                    _mm512_storeu_ps(out.as_mut_ptr().add(c * columns + column + 16 * h), _mm512_mul_ps(mean, unscale));
                }
            }
        }
    }
}

#[inline]
#[target_feature(enable = "avx512f")]
fn widen(halves: __m512i) -> [__m512; 2] {
    [_mm512_cvtph_ps(_mm512_castsi512_si256(halves)), _mm512_cvtph_ps(_mm512_extracti64x4_epi64::<1>(halves))]
}

/// `[Σ wᵢ, Σ wᵢ dᵢ]` over some samples, with `dᵢ = centre − neighbour` and `wᵢ` the number whose bits are the integer nearest
/// to `exponent − dᵢ²`, zero for negative ones.
///
/// # Safety
/// As [`filter_row`], for each of the samples.
#[inline]
#[target_feature(enable = "avx512f,avx512bw")]
unsafe fn sum_1(first: *const u16, centre: __m512i, offsets: &[i32], exponents: &[u32]) -> [__m512i; 4] {
    let zero = _mm512_setzero_si512();
    let (mut weight, mut sum) = (zero, zero);
    if offsets.is_empty() {
        return [zero; 4];
    }
    // SAFETY: the caller vouches for the instructions and for the samples at the offsets; nothing is written.
    unsafe {
        asm!(
            "2:",
            "movsxd {place}, dword ptr [{offsets} + 4 * {i}]",
            "vpbroadcastd {w}, dword ptr [{exponents} + 4 * {i}]",
            "vsubph {d}, {centre}, [{first} + 2 * {place}]",
            "vfnmadd231ph {w}, {d}, {d}",
            "vmaxph {w}, {w}, {zero}",
            "vcvtph2w {w}, {w}",
            "vaddph {weight}, {weight}, {w}",
            "vfmadd231ph {sum}, {w}, {d}",
            "inc {i}",
            "cmp {i}, {count}",
            "jb 2b",
            i = inout(reg) 0usize => _,
            count = in(reg) offsets.len(),
            offsets = in(reg) offsets.as_ptr(),
            exponents = in(reg) exponents.as_ptr(),
            first = in(reg) first,
            place = out(reg) _,
            centre = in(zmm_reg) centre,
            zero = in(zmm_reg) zero,
            w = inout(zmm_reg) zero => _,
            d = inout(zmm_reg) zero => _,
            weight = inout(zmm_reg) weight,
            sum = inout(zmm_reg) sum,
            options(nostack, readonly),
        );
    }
    [weight, sum, zero, zero]
}

/// As [`sum_1`] for two planes.
///
/// # Safety
/// As [`sum_1`].
#[inline]
#[target_feature(enable = "avx512f,avx512bw")]
unsafe fn sum_2(
    first: *const u16,
    plane_size: usize,
    centre: [__m512i; 2],
    offsets: &[i32],
    exponents: &[u32],
) -> [__m512i; 4] {
    let zero = _mm512_setzero_si512();
    let (mut weight, mut sums) = (zero, [zero; 2]);
    if offsets.is_empty() {
        return [zero; 4];
    }
    // SAFETY: as in `sum_1`; the second plane is within the slice, too.
    unsafe {
        asm!(
            "2:",
            "movsxd {place}, dword ptr [{offsets} + 4 * {i}]",
            "vpbroadcastd {w}, dword ptr [{exponents} + 4 * {i}]",
            "vsubph {d0}, {c0}, [{p0} + 2 * {place}]",
            "vsubph {d1}, {c1}, [{p1} + 2 * {place}]",
            "vfnmadd231ph {w}, {d0}, {d0}",
            "vfnmadd231ph {w}, {d1}, {d1}",
            "vmaxph {w}, {w}, {zero}",
            "vcvtph2w {w}, {w}",
            "vaddph {weight}, {weight}, {w}",
            "vfmadd231ph {s0}, {w}, {d0}",
            "vfmadd231ph {s1}, {w}, {d1}",
            "inc {i}",
            "cmp {i}, {count}",
            "jb 2b",
            i = inout(reg) 0usize => _,
            count = in(reg) offsets.len(),
            offsets = in(reg) offsets.as_ptr(),
            exponents = in(reg) exponents.as_ptr(),
            p0 = in(reg) first,
            p1 = in(reg) first.add(plane_size),
            place = out(reg) _,
            c0 = in(zmm_reg) centre[0],
            c1 = in(zmm_reg) centre[1],
            zero = in(zmm_reg) zero,
            w = inout(zmm_reg) zero => _,
            d0 = inout(zmm_reg) zero => _,
            d1 = inout(zmm_reg) zero => _,
            weight = inout(zmm_reg) weight,
            s0 = inout(zmm_reg) sums[0],
            s1 = inout(zmm_reg) sums[1],
            options(nostack, readonly),
        );
    }
    [weight, sums[0], sums[1], zero]
}

/// As [`sum_1`] for three planes.
///
/// # Safety
/// As [`sum_1`].
#[inline]
#[target_feature(enable = "avx512f,avx512bw")]
unsafe fn sum_3(
    first: *const u16,
    plane_size: usize,
    centre: [__m512i; 3],
    offsets: &[i32],
    exponents: &[u32],
) -> [__m512i; 4] {
    let zero = _mm512_setzero_si512();
    let (mut weight, mut sums) = (zero, [zero; 3]);
    if offsets.is_empty() {
        return [zero; 4];
    }
    // SAFETY: as in `sum_1`; the other planes are within the slice, too.
    unsafe {
        asm!(
            "2:",
            "movsxd {place}, dword ptr [{offsets} + 4 * {i}]",
            "vpbroadcastd {w}, dword ptr [{exponents} + 4 * {i}]",
            "vsubph {d0}, {c0}, [{p0} + 2 * {place}]",
            "vsubph {d1}, {c1}, [{p1} + 2 * {place}]",
            "vsubph {d2}, {c2}, [{p2} + 2 * {place}]",
            "vfnmadd231ph {w}, {d0}, {d0}",
            "vfnmadd231ph {w}, {d1}, {d1}",
            "vfnmadd231ph {w}, {d2}, {d2}",
            "vmaxph {w}, {w}, {zero}",
            "vcvtph2w {w}, {w}",
            "vaddph {weight}, {weight}, {w}",
            "vfmadd231ph {s0}, {w}, {d0}",
            "vfmadd231ph {s1}, {w}, {d1}",
            "vfmadd231ph {s2}, {w}, {d2}",
            "inc {i}",
            "cmp {i}, {count}",
            "jb 2b",
            i = inout(reg) 0usize => _,
            count = in(reg) offsets.len(),
            offsets = in(reg) offsets.as_ptr(),
            exponents = in(reg) exponents.as_ptr(),
            p0 = in(reg) first,
            p1 = in(reg) first.add(plane_size),
            p2 = in(reg) first.add(2 * plane_size),
            place = out(reg) _,
            c0 = in(zmm_reg) centre[0],
            c1 = in(zmm_reg) centre[1],
            c2 = in(zmm_reg) centre[2],
            zero = in(zmm_reg) zero,
            w = inout(zmm_reg) zero => _,
            d0 = inout(zmm_reg) zero => _,
            d1 = inout(zmm_reg) zero => _,
            d2 = inout(zmm_reg) zero => _,
            weight = inout(zmm_reg) weight,
            s0 = inout(zmm_reg) sums[0],
            s1 = inout(zmm_reg) sums[1],
            s2 = inout(zmm_reg) sums[2],
            options(nostack, readonly),
        );
    }
    [weight, sums[0], sums[1], sums[2]]
}
