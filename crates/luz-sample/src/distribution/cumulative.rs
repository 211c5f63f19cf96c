//! The parts that tables in one and two dimensions share: cumulative sums, and the cells of an interval.

use std::cmp::Ordering;

use super::DistributionError;
use crate::ONE_MINUS_EPSILON;

/// Cumulative sums of one or more rows of weights of the same length, each from 0 to 1, to be inverted.
#[derive(Clone, Debug)]
pub(super) struct CumulativeRows {
    /// Weights of a row.
    count: usize,
    /// For every row one number more than weights.
    sums: Vec<f32>,
    /// Entries of a row's guide, less one: a power of two, so that a `u` times it is exact.
    steps: usize,
    /// For every row, the cells that `k / steps` falls in for every `k`, where the search begins and ends ("indexed search",
    /// Chen and Asau 1974).
    guides: Vec<u32>,
}

impl CumulativeRows {
    /// Sums of `rows` rows of `count` weights, to be filled.
    pub(super) fn new(count: usize, rows: usize) -> Self {
        // About one step for eight weights, so that the search stays within a cache line or two.
        let steps = (count / 8).next_power_of_two();
        Self { count, sums: vec![0.0; (count + 1) * rows], steps, guides: vec![0; (steps + 1) * rows] }
    }

    /// Sets the weights of a row and returns their total.
    ///
    /// Sums are taken in `f64`. A weight of zero leaves two neighbours equal, so that no `u` ever falls between them. All
    /// zero gives even steps.
    pub(super) fn fill(&mut self, row: usize, weights: impl Iterator<Item = f64> + Clone) -> f64 {
        let total: f64 = weights.clone().sum();
        let sums = &mut self.sums[row * (self.count + 1)..][..=self.count];
        let mut sum = 0.0f64;
        for (i, w) in weights.take(self.count).enumerate() {
            sums[i] = if total > 0.0 { (sum / total) as f32 } else { i as f32 / self.count as f32 };
            sum += w;
        }
        sums[self.count] = 1.0;
        let mut index = 0;
        for (k, guide) in self.guides[row * (self.steps + 1)..][..=self.steps].iter_mut().enumerate() {
            let u = k as f32 / self.steps as f32;
            while index + 1 < self.count && sums[index + 1] <= u {
                index += 1;
            }
            *guide = index as u32;
        }
        total
    }

    /// The cell `[sums[i], sums[i + 1])` of the row that `u ∈ [0, 1)` falls in, and where in it, in `[0, 1)`.
    #[inline]
    pub(super) fn find(&self, row: usize, u: f32) -> (usize, f32) {
        let u = u.clamp(0.0, ONE_MINUS_EPSILON);
        let sums = &self.sums[row * (self.count + 1)..][..=self.count];
        let guide = row * (self.steps + 1) + (u * self.steps as f32) as usize;
        let (first, last) = (self.guides[guide] as usize, self.guides[guide + 1] as usize);
        // The sum before `first` is at most u, the one after `last` is greater than u.
        let index = first + sums[first + 1..=last].partition_point(|&c| c <= u);
        let (low, high) = (sums[index], sums[index + 1]);
        (index, ((u - low) / (high - low)).min(ONE_MINUS_EPSILON))
    }

    /// The `u` that [`Self::find`] would find at `offset` in cell `index`.
    #[inline]
    pub(super) fn lerp(&self, row: usize, index: usize, offset: f32) -> f32 {
        let sums = &self.sums[row * (self.count + 1)..][..=self.count];
        (sums[index] + offset * (sums[index + 1] - sums[index])).min(ONE_MINUS_EPSILON)
    }
}

/// The density where a step function of this integral has this value; zero where the integral is zero.
#[inline]
pub(super) fn density(value: f32, integral: f64) -> f32 {
    if integral > 0.0 { (f64::from(value) / integral) as f32 } else { 0.0 }
}

/// The values, but zero where the density would underflow, so that whatever is sampled has a positive density.
pub(super) fn without_underflow(values: &[f32], integral: f64) -> Vec<f32> {
    values.iter().map(|&v| if density(v, integral) > 0.0 { v } else { 0.0 }).collect()
}

/// An interval cut into equal cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cells {
    min: f32,
    max: f32,
    count: usize,
    /// Cells per unit of length.
    scale: f32,
    /// About the greatest distance of neighbouring `f32` in the interval, at most a quarter of a cell.
    resolution: f32,
}

impl Cells {
    pub(super) fn new(min: f32, max: f32, count: usize) -> Result<Self, DistributionError> {
        if count > 1 << 21 {
            return Err(DistributionError::TooLarge);
        }
        let length = f64::from(max) - f64::from(min);
        let scale = (count as f64 / length) as f32;
        let resolution = f32::EPSILON * min.abs().max(max.abs());
        let wide = length.is_finite() && length / count as f64 >= 4.0 * f64::from(resolution) && scale.is_normal();
        if wide && min < max { Ok(Self { min, max, count, scale, resolution }) } else { Err(DistributionError::Domain) }
    }

    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// The length of a cell.
    pub(super) fn width(&self) -> f64 {
        (f64::from(self.max) - f64::from(self.min)) / self.count as f64
    }

    /// The number of cells left of `x`, with its fraction; cells are closed below.
    #[inline]
    fn coordinate(&self, x: f32) -> f32 {
        (x - self.min) * self.scale
    }

    /// The cell of `x`; `None` outside the closed interval.
    #[inline]
    pub(super) fn index(&self, x: f32) -> Option<usize> {
        (x >= self.min && x <= self.max).then(|| (self.coordinate(x) as usize).min(self.count - 1))
    }

    /// The cell of `x`, and where in it, in `[0, 1]`; `None` outside the closed interval.
    #[inline]
    pub(super) fn locate(&self, x: f32) -> Option<(usize, f32)> {
        let index = self.index(x)?;
        Some((index, (self.coordinate(x) - index as f32).clamp(0.0, 1.0)))
    }

    /// The point at `offset` in cell `index`, which [`Self::index`] finds in that very cell.
    #[inline]
    pub(super) fn point(&self, index: usize, offset: f32) -> f32 {
        let t = (index as f64 + f64::from(offset)) / self.count as f64;
        let mut x = (f64::from(self.min) + t * (f64::from(self.max) - f64::from(self.min))) as f32;
        // Rounding may have crossed an edge of the cell.
        for _ in 0..4 {
            x = x.clamp(self.min, self.max);
            let found = (self.coordinate(x) as usize).min(self.count - 1);
            x = match found.cmp(&index) {
                Ordering::Less => x + self.resolution,
                Ordering::Equal => return x,
                Ordering::Greater => x - self.resolution,
            };
        }
        x.clamp(self.min, self.max)
    }
}
