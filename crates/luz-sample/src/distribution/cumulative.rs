//! The parts that tables in one and two dimensions share: cumulative sums, and the cells of an interval.

use std::cmp::Ordering;

use super::DistributionError;
use crate::ONE_MINUS_EPSILON;

/// Fills `sums`, one longer than `weights`, with cumulative sums from 0 to 1, and returns the total.
///
/// Sums are taken in `f64`. A weight of zero leaves two neighbours equal, so that no `u` ever falls between them. All zero
/// gives even steps.
pub(super) fn accumulate(weights: impl ExactSizeIterator<Item = f64> + Clone, sums: &mut [f32]) -> f64 {
    let count = weights.len();
    let total: f64 = weights.clone().sum();
    let Some((last, rest)) = sums.split_last_mut() else { return total };
    let mut sum = 0.0f64;
    for (i, (c, w)) in rest.iter_mut().zip(weights).enumerate() {
        *c = if total > 0.0 { (sum / total) as f32 } else { i as f32 / count as f32 };
        sum += w;
    }
    *last = 1.0;
    total
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

/// The cell `[sums[i], sums[i + 1])` that `u ∈ [0, 1)` falls in, and where in it, in `[0, 1)`.
#[inline]
pub(super) fn find(sums: &[f32], u: f32) -> (usize, f32) {
    let u = u.clamp(0.0, ONE_MINUS_EPSILON);
    // The first sum is zero, so the count is at least one; the last is one, so it is at most the number of cells.
    let index = sums.partition_point(|&c| c <= u) - 1;
    let (low, high) = (sums[index], sums[index + 1]);
    (index, ((u - low) / (high - low)).min(ONE_MINUS_EPSILON))
}

/// The `u` that [`find`] would find at `offset` in cell `index`.
#[inline]
pub(super) fn lerp(sums: &[f32], index: usize, offset: f32) -> f32 {
    (sums[index] + offset * (sums[index + 1] - sums[index])).min(ONE_MINUS_EPSILON)
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
