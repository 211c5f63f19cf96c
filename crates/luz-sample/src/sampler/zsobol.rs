//! Owen-scrambled Sobol points in shuffled Z-order over the image.

use super::Points;
use super::order::{Order, block_size_log};
use crate::owen::{laine_karras_64, second_dimension, sobol_1d, sobol_2d};
use crate::random::{mix, scatter, stream_key};

/// One randomised Sobol sequence for every pair of dimensions, dealt out to all samples of all pixels along the Z-order curve
/// of the image, whose quadrants are shuffled at every level (Ahmed and Wonka 2020, "Screen-Space Blue-Noise Diffusion of
/// Monte Carlo Sampling Error via Hierarchical Ordering of Pixels").
///
/// All samples of a pixel, of four neighbouring pixels, of sixteen … are a block of the sequence, hence well distributed
/// together, and their errors cancel.
///
/// The paper shuffles quadrants by a permutation drawn for each. Here a nested uniform scramble of the curve's index does,
/// which gives the eight permutations that keep two pairs of quadrants together, and before it a random choice of the pairs:
/// side by side, one above the other, or crosswise.
#[derive(Clone, Copy, Debug)]
pub(super) struct ZSobol {
    key: u64,
    /// The index along the curve, bit-reversed.
    reversed: u64,
    /// The order of a block of the pixel's samples.
    order: Order,
    /// Where the higher bits of quadrants are in the reversed index.
    quadrants: u64,
}

/// The bits of `x` at the even places of a 64-bit number.
#[inline]
fn spread(x: u32) -> u64 {
    let mut v = u64::from(x);
    v = (v | v << 16) & 0x0000_ffff_0000_ffff;
    v = (v | v << 8) & 0x00ff_00ff_00ff_00ff;
    v = (v | v << 4) & 0x0f0f_0f0f_0f0f_0f0f;
    v = (v | v << 2) & 0x3333_3333_3333_3333;
    (v | v << 1) & 0x5555_5555_5555_5555
}

impl ZSobol {
    #[inline]
    pub(super) fn new(seed: u64, [x, y]: [u32; 2], samples_per_pixel: u32, sample_index: u32) -> Self {
        // The bits of a sample count, rounded up to a power of two; 31 at most, so that shifts are defined.
        let bits = (u32::BITS - (samples_per_pixel.max(1) - 1).leading_zeros()).min(31);
        // Samples beyond start another round with a sequence of its own.
        let round = u64::from(sample_index >> bits);
        let sample = u64::from(sample_index & ((1 << bits) - 1));
        let curve = spread(x) | spread(y) << 1;
        let odd_places = 0xaaaa_aaaa_aaaa_aaaa_u64;
        let index = curve << bits | sample;
        let (key, log) = (stream_key(seed, round), block_size_log(samples_per_pixel, sample as u32).min(bits));
        Self {
            key,
            order: Order::new(mix(key ^ !(index >> log)), log, sample_index),
            reversed: index.reverse_bits(),
            quadrants: (odd_places << bits).reverse_bits(),
        }
    }

    /// The shuffled index along the sequence, and random bits that depend on the dimension alone.
    #[inline(always)]
    fn shuffle(&self, dimension: u32) -> (u64, u64) {
        let bits = scatter(self.key ^ u64::from(dimension));
        // Bits below a place hash what is above it in the curve. Two of them choose the pairs of a quadrant.
        let chance = self.reversed.wrapping_mul(bits | 1).wrapping_add(bits.rotate_left(32));
        let mut v = self.reversed;
        let crosswise = chance << 1 & self.quadrants;
        let swap = (v ^ v >> 1) & (chance << 2) & self.quadrants & !crosswise;
        v ^= swap | swap << 1;
        v ^= v >> 1 & crosswise;
        let shuffled = laine_karras_64(v, bits.wrapping_mul(0xa076_1d64_78bd_642f));
        let index = shuffled.reverse_bits();
        (index & !u64::from(self.order.mask) | u64::from(self.order.place(bits)), bits)
    }
}

impl Points for ZSobol {
    #[inline]
    fn point_1d(&self, dimension: u32) -> u32 {
        let (index, bits) = self.shuffle(dimension);
        sobol_1d(index as u32, (bits >> 32) as u32)
    }

    #[inline]
    fn point_2d(&self, dimension: u32) -> [u32; 2] {
        let (index, bits) = self.shuffle(dimension);
        let more = bits.wrapping_mul(0xd6e8_feb8_6659_fd93);
        sobol_2d(index as u32, second_dimension(index), [(bits >> 32) as u32, (more >> 32) as u32])
    }
}
