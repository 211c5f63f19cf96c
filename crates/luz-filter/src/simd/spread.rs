//! Every so many samples of a row, put next to each other.

use super::lanes::{Lanes, Task};

/// `to[i] = factor · from[i · stride]`. Returns the largest absolute value; NaN if one of the
/// samples is.
///
/// Demands that `from` holds all samples: `(to.len() − 1) · stride < from.len()`.
pub(super) struct Spread<'a> {
    pub from: &'a [f32],
    pub stride: usize,
    pub factor: f32,
    pub to: &'a mut [f32],
}

impl Task for Spread<'_> {
    type Output = f32;

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) -> f32 {
        let Self { from, stride, factor, to } = self;
        let n = to.len();
        if n < L::COUNT {
            let mut largest = 0.0;
            for (i, to) in to.iter_mut().enumerate() {
                *to = factor * from[i * stride];
                largest = magnitude(largest, *to);
            }
            return largest;
        }
        // SAFETY: the caller vouches for the instructions and the places.
        unsafe {
            let (scale, mut largest) = (L::splat(factor), L::splat(0.0));
            let mut i = 0;
            loop {
                let samples = L::gather(from.as_ptr().add(i * stride), stride).mul(scale);
                largest = largest.max_magnitude(samples);
                samples.store(to.as_mut_ptr().add(i));
                if i + L::COUNT >= n {
                    break;
                }
                // The last vector overlaps the one before.
                i = (i + L::COUNT).min(n - L::COUNT);
            }
            let mut lanes = [0.0f32; 16];
            largest.store(lanes.as_mut_ptr());
            lanes.into_iter().fold(0.0, magnitude)
        }
    }
}

/// The larger of the absolute values; NaN if one of them is.
#[inline(always)]
fn magnitude(a: f32, b: f32) -> f32 {
    let bits = |v: f32| v.to_bits() & 0x7fff_ffff;
    f32::from_bits(bits(a).max(bits(b)))
}
