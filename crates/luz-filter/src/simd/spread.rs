//! Every so many samples of a row, put next to each other.

use super::lanes::{Lanes, Task};

/// `to[i] = factor · from[i · stride]`. Returns at least the largest absolute value and at most twice their sum; something
/// not finite if one of them isn't.
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
            let mut sum = 0.0;
            for (i, to) in to.iter_mut().enumerate() {
                *to = factor * from[i * stride];
                sum += to.abs();
            }
            return sum;
        }
        // SAFETY: the caller vouches for the instructions and the places.
        unsafe {
            let (scale, mut sums) = (L::splat(factor), L::splat(0.0));
            let mut i = 0;
            loop {
                let samples = L::gather(from.as_ptr().add(i * stride), stride).mul(scale);
                sums = sums.add(samples.abs());
                samples.store(to.as_mut_ptr().add(i));
                if i + L::COUNT >= n {
                    break;
                }
                // The last vector overlaps the one before, and counts twice.
                i = (i + L::COUNT).min(n - L::COUNT);
            }
            let mut lanes = [0.0f32; 16];
            sums.store(lanes.as_mut_ptr());
            lanes.iter().sum()
        }
    }
}
