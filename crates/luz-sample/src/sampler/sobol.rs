//! Padded Owen-scrambled Sobol points, independent between pixels.

use super::Points;
use super::order::{Order, block_size_log};
use crate::owen::{second_dimension, sobol_1d, sobol_2d};
use crate::random::{mix, scatter};

/// Every pair of dimensions is a randomised Sobol (0, 2)-sequence of its own, every single dimension a van der Corput
/// sequence: pixel and dimension choose an Owen scramble of each coordinate, and the order of the points.
///
/// The first two dimensions of Sobol's sequence have the best two-dimensional stratification that there is, in every pair
/// that is drawn together, whatever its number, and need no tables.
///
/// The order is random within aligned blocks of up to 16 points, and blocks follow one another as in the sequence.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sobol {
    /// What all samples of the pixel share.
    key: u64,
    order: Order,
    /// The first index of the block, and its reversed digits in the second dimension.
    start: u32,
    start_y: u32,
}

/// The second dimension of indices below 16, in four bits each. It is linear, and so can be added to that of the block.
const SMALL_Y: u64 = {
    let (mut packed, mut i) = (0, 16);
    while i > 0 {
        i -= 1;
        packed = packed << 4 | second_dimension(i) as u64;
    }
    packed
};

impl Sobol {
    #[inline]
    pub(super) fn new(key: u64, samples_per_pixel: u32, sample_index: u32) -> Self {
        let log = block_size_log(samples_per_pixel, sample_index);
        let start = sample_index >> log << log;
        let order = Order::new(mix(key ^ !u64::from(start)), log, sample_index);
        Self { key, order, start, start_y: second_dimension(u64::from(start)) }
    }
}

impl Points for Sobol {
    #[inline(always)]
    fn point_1d(&self, dimension: u32) -> u32 {
        let bits = scatter(self.key ^ u64::from(dimension));
        sobol_1d(self.start | self.order.place(bits), (bits >> 32) as u32)
    }

    #[inline(always)]
    fn point_2d(&self, dimension: u32) -> [u32; 2] {
        let bits = scatter(self.key ^ u64::from(dimension));
        let place = self.order.place(bits);
        let y = self.start_y ^ (SMALL_Y >> (4 * place)) as u32 & 15;
        sobol_2d(self.start | place, y, [(bits >> 32) as u32, bits as u32])
    }
}
