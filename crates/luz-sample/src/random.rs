//! Counter-based random numbers: a pure function of (seed, stream, index, dimension), with no state to carry about.
//!
//! A *stream* is whatever draws independently of all others: a pixel, a light, a Markov chain. The *index* counts the
//! samples of a stream, the *dimension* the numbers of a sample. Any number can be had at any time in any order, which is
//! what makes results independent of threads and of interruptions.
//!
//! Construction: seed, stream and index are absorbed one after the other by a 64-bit finaliser of full avalanche
//! (Stafford's "mix 13" of the MurmurHash3 finaliser) to a start `k` and an odd step `g`; dimension `d` is the finaliser
//! of `k + d g`. That is SplitMix (Steele, Lea and Flood 2014, "Fast Splittable Pseudorandom Number Generators") with a
//! generator of its own for every sample: two of them share numbers only if both `k` and `g` fall together.

use glam::Vec2;

use crate::Samples;

/// A 64-bit bijection in which every input bit flips every output bit with a probability near one half.
#[inline(always)]
pub(crate) const fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A faster, less thorough [`mix`] for words that are random already but for some low bits: two foldings of 128-bit products.
#[inline(always)]
pub(crate) const fn scatter(x: u64) -> u64 {
    const fn fold(a: u64, b: u64) -> u64 {
        let product = a as u128 * b as u128;
        product as u64 ^ (product >> 64) as u64
    }
    fold(fold(x, 0xa076_1d64_78bd_642f), 0xe703_7ed1_a0b4_28db)
}

/// The fraction of 2⁶⁴ that the golden ratio gives; as a summand it keeps zero from being a fixed point of [`mix`].
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// The number of (seed, stream, index, dimension), uniform over all 64-bit integers.
#[inline]
pub const fn hash(seed: u64, stream: u64, index: u64, dimension: u32) -> u64 {
    Random::new(seed, stream, index).at(dimension)
}

/// The number in `[0, 1)` whose 24 bits are the high ones of `bits`.
#[inline(always)]
pub const fn unit_f32(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1u32 << 24) as f32)
}

/// The number in `[0, 1)` whose 53 bits are the high ones of `bits`.
#[inline(always)]
pub const fn unit_f64(bits: u64) -> f64 {
    (bits >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

/// A cursor along the dimensions of one sample of one stream.
///
/// `next_2d` draws both its numbers from one 64-bit number and advances by two dimensions; whatever is drawn before, what
/// is drawn at a dimension depends on that dimension alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Random {
    start: u64,
    step: u64,
    dimension: u32,
}

impl Random {
    /// The numbers of sample `index` of `stream`, from dimension 0.
    #[inline]
    pub const fn new(seed: u64, stream: u64, index: u64) -> Self {
        Self::of_stream(stream_key(seed, stream), index)
    }

    /// As [`Self::new`], from the [`stream_key`] that all samples of a stream share.
    #[inline(always)]
    pub(crate) const fn of_stream(key: u64, index: u64) -> Self {
        // The step depends on the stream alone, so that no two streams have samples in common by a mere shift of the index.
        Self { start: mix(key ^ index), step: key | 1, dimension: 0 }
    }

    /// The dimension to be drawn next.
    #[inline(always)]
    pub const fn dimension(&self) -> u32 {
        self.dimension
    }

    /// The number of a dimension, without moving the cursor.
    #[inline(always)]
    pub(crate) const fn at(&self, dimension: u32) -> u64 {
        mix(self.start.wrapping_add(self.step.wrapping_mul(dimension as u64)))
    }

    /// The next dimension as 64 uniform bits.
    #[inline(always)]
    pub const fn next_u64(&mut self) -> u64 {
        let bits = self.at(self.dimension);
        self.dimension = self.dimension.wrapping_add(1);
        bits
    }

    /// The next dimension as 32 uniform bits.
    #[inline(always)]
    pub const fn next_u32(&mut self) -> u32 {
        (self.next_u64() >> 32) as u32
    }

    /// The next dimension as a number in `[0, 1)` of 53 bits.
    #[inline(always)]
    pub const fn next_f64(&mut self) -> f64 {
        unit_f64(self.next_u64())
    }
}

/// The key that all samples of a stream share.
#[inline(always)]
pub(crate) const fn stream_key(seed: u64, stream: u64) -> u64 {
    mix(mix(seed.wrapping_add(GOLDEN)) ^ stream)
}

impl Samples for Random {
    #[inline(always)]
    fn next_1d(&mut self) -> f32 {
        unit_f32(self.next_u32())
    }

    #[inline(always)]
    fn next_2d(&mut self) -> Vec2 {
        let bits = self.at(self.dimension);
        self.dimension = self.dimension.wrapping_add(2);
        Vec2::new(unit_f32((bits >> 32) as u32), unit_f32(bits as u32))
    }

    #[inline(always)]
    fn set_dimension(&mut self, dimension: u32) {
        self.dimension = dimension;
    }
}
