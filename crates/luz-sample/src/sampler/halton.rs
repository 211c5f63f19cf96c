//! The scrambled Halton sequence.

use super::Points;
use crate::owen::{laine_karras, sobol_1d};
use crate::random::{Random, mix};

/// How many dimensions have a base of their own.
const DIMENSIONS: usize = 128;

/// The bases: the first primes.
const PRIMES: [u16; DIMENSIONS] = {
    let mut primes = [0; DIMENSIONS];
    let (mut found, mut candidate) = (0, 2);
    while found < DIMENSIONS {
        let mut i = 0;
        while i < found && candidate % primes[i] != 0 {
            i += 1;
        }
        if i == found {
            primes[found] = candidate;
            found += 1;
        }
        candidate += 1;
    }
    primes
};

/// Dimension `d` is the radical inverse of the sample index in the `d`-th prime (Halton 1960), each digit of which passes a
/// random map that depends on the digits before it (Owen 1995), so that pixels are independent of one another.
///
/// So many digits are taken as make the points of a pixel differ, and the rest is uniform, as it would be for infinitely many
/// digits. Dimensions beyond the 128th begin again with the first prime and a shuffled index.
#[derive(Clone, Copy, Debug)]
pub(super) struct Halton {
    /// Numbers that differ between samples.
    jitter: Random,
    /// Numbers that all samples of the pixel share.
    order: Random,
    index: u32,
    count: u32,
}

impl Halton {
    pub(super) fn new(key: u64, samples_per_pixel: u32, sample_index: u32) -> Self {
        Self {
            jitter: Random::of_stream(key, u64::from(sample_index)),
            order: Random::of_stream(mix(!key), 0),
            index: sample_index,
            count: samples_per_pixel.max(sample_index.saturating_add(1)),
        }
    }
}

/// A digit in a prime base under one of the maps `a x + b` modulo the base, `a ≠ 0`. These take any pair of digits to any other
/// pair equally often, as all permutations do, and that is all that the variance of a nested scramble depends on (Owen 1997; Matoušek
/// 1998, "On the L2-Discrepancy for Anchored Boxes").
#[inline]
fn scramble(digit: u32, base: u32, bits: u64) -> u32 {
    let below = |bits: u32, count: u32| ((u64::from(bits) * u64::from(count)) >> 32) as u32;
    let factor = 1 + below((bits >> 32) as u32, base - 1);
    let shift = below(bits as u32, base);
    (digit * factor + shift) % base
}

impl Points for Halton {
    fn point_1d(&self, dimension: u32) -> u32 {
        let round = dimension / DIMENSIONS as u32;
        let base = PRIMES[dimension as usize % DIMENSIONS];
        let mut index = self.index;
        if round > 0 {
            // Numbered from the far end of the dimensions, where nothing else is drawn.
            let seed = self.order.at(u32::MAX - round) as u32;
            index = laine_karras(index.reverse_bits(), seed).reverse_bits();
        }
        let seed = self.order.at(dimension);
        if base == 2 {
            return sobol_1d(index, seed as u32);
        }
        let base = u32::from(base);
        let (mut prefix, mut strata) = (0u64, 1u64);
        // Digits from the least significant, the first after the point.
        while strata < u64::from(self.count) {
            let digit = scramble(index % base, base, mix(seed.wrapping_add(prefix + strata)));
            index /= base;
            prefix = prefix * u64::from(base) + u64::from(digit);
            strata *= u64::from(base);
        }
        // At most 2³² × 719 strata: the sum has 42 bits before the point, 22 after it.
        let fraction = u64::from(self.jitter.point_1d(dimension)) >> 10;
        if strata <= 1 << 32 {
            // As below, with one division of 64 bits.
            return ((prefix << 32 | fraction << 10) / strata) as u32;
        }
        (((u128::from(prefix) << 22 | u128::from(fraction)) << 10) / u128::from(strata)) as u32
    }

    fn point_2d(&self, dimension: u32) -> [u32; 2] {
        [self.point_1d(dimension), self.point_1d(dimension.wrapping_add(1))]
    }
}
