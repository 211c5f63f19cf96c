//! Padded Owen-scrambled Sobol points, independent between pixels.

use super::Points;
use crate::owen::{MIXED_BITS, laine_karras, mix_low_bits, sobol_1d, sobol_2d};
use crate::random::{GOLDEN, mix};

/// Every pair of dimensions is a randomised Sobol (0, 2)-sequence of its own, every single dimension a van der Corput
/// sequence: pixel and dimension choose an Owen shuffle of the index and an Owen scramble of each coordinate (Burley 2020).
///
/// The first two dimensions of Sobol's sequence have the best two-dimensional stratification that there is, in every pair
/// that is drawn together, whatever its number, and need no tables. Where the sample count is a multiple of a power of two,
/// blocks of as many samples, up to 16, are in random order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sobol {
    key: u64,
    /// The sample index, bit-reversed.
    reversed: u32,
    /// The low bits of the index whose order is given up.
    mask: u32,
}

impl Sobol {
    #[inline]
    pub(super) fn new(key: u64, samples_per_pixel: u32, sample_index: u32) -> Self {
        // Whole blocks, so that all samples of the pixel are a prefix of the sequence.
        let block = 1 << samples_per_pixel.trailing_zeros().min(MIXED_BITS);
        Self { key, reversed: sample_index.reverse_bits(), mask: block - 1 }
    }

    /// The shuffled index, and the seed of the first scramble and a word for the second.
    #[inline(always)]
    fn shuffle(&self, dimension: u32) -> (u32, u64) {
        let bits = mix(self.key.wrapping_add(GOLDEN.wrapping_mul(u64::from(dimension))));
        let index = laine_karras(self.reversed, bits as u32).reverse_bits();
        (mix_low_bits(index, self.mask, (bits >> 16) as u32), bits)
    }
}

impl Points for Sobol {
    #[inline(always)]
    fn point_1d(&self, dimension: u32) -> u32 {
        let (index, bits) = self.shuffle(dimension);
        sobol_1d(index, (bits >> 32) as u32)
    }

    #[inline(always)]
    fn point_2d(&self, dimension: u32) -> [u32; 2] {
        let (index, bits) = self.shuffle(dimension);
        let more = bits.wrapping_mul(0xd6e8_feb8_6659_fd93);
        sobol_2d(u64::from(index), [(bits >> 32) as u32, (more >> 32) as u32])
    }
}
