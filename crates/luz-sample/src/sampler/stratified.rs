//! Jittered strata.

use super::Points;
use crate::permutation::permute;
use crate::random::{Random, mix};

/// In one dimension `n` samples fall into `n` equal strata, in two into the cells of a grid of as nearly square cells as can
/// be, one in each (Cook 1986). Pixel and dimension choose the order. Where `n` has no pair of factors that are alike, the
/// grid has a few cells more, and some random ones stay empty.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stratified {
    /// Numbers that differ between samples.
    jitter: Random,
    /// Numbers that all samples of a round of the pixel share.
    order: Random,
    /// Samples of a round, and the index in it.
    count: u32,
    index: u32,
    grid: [u32; 2],
}

/// The columns and rows of a grid of at least `n` cells.
fn grid(n: u32) -> [u32; 2] {
    let root = n.isqrt();
    // Factors of a ratio up to about two, else columns and as few rows as hold all.
    let least = (root * 7).div_ceil(10).max(1);
    let rows = (least..=root).rev().find(|&rows| n.is_multiple_of(rows));
    let rows = rows.unwrap_or(root);
    [n.div_ceil(rows), rows]
}

impl Stratified {
    pub(super) fn new(key: u64, samples_per_pixel: u32, sample_index: u32) -> Self {
        let (round, index) = (sample_index / samples_per_pixel, sample_index % samples_per_pixel);
        Self {
            jitter: Random::of_stream(key, u64::from(sample_index)),
            order: Random::of_stream(mix(!key), u64::from(round)),
            count: samples_per_pixel,
            index,
            grid: grid(samples_per_pixel),
        }
    }
}

/// The 32-bit fraction `(stratum + jitter) / count`.
#[inline]
fn jittered(stratum: u32, jitter: u32, count: u32) -> u32 {
    ((u64::from(stratum) << 32 | u64::from(jitter)) / u64::from(count)) as u32
}

impl Points for Stratified {
    fn point_1d(&self, dimension: u32) -> u32 {
        let stratum = permute(self.index, self.count, self.order.at(dimension));
        jittered(stratum, self.jitter.point_1d(dimension), self.count)
    }

    fn point_2d(&self, dimension: u32) -> [u32; 2] {
        let [columns, rows] = self.grid;
        // Another order than that of the single dimension.
        let cell = permute(self.index, columns * rows, !self.order.at(dimension));
        let [x, y] = self.jitter.point_2d(dimension);
        [jittered(cell % columns, x, columns), jittered(cell / columns, y, rows)]
    }
}
