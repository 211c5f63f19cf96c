//! What one pixel has received.

use super::splat::SplatEstimate;
use bytemuck::{Pod, Zeroable};

/// The sums of one pixel, or of one half of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Pixel {
    /// Σ Lᵢ.
    sum: [f64; 3],
    /// Σ Lᵢ².
    squared: [f64; 3],
    /// n.
    count: u32,
    /// Samples that were not finite; they are counted as zero in the sums.
    dropped: u32,
}

/// What a pixel keeps besides, under a filter with negative lobes.
///
/// With filter signs sᵢ = ±1 and samples Lᵢ, the pixel's value is r = Σ sᵢLᵢ / Σ sᵢ, and the variance of that ratio
/// estimator is, to first order, n/(n−1) · Σ (Lᵢ − r)² / (Σ sᵢ)²; without negative lobes it is the sample variance of the
/// mean, exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SignedSums {
    /// Σ sᵢLᵢ.
    sum: [f64; 3],
    /// Σ sᵢ.
    weight: f64,
}

impl Pixel {
    /// Adds a sample; one that is not finite is counted as dropped and adds zero radiance. Returns whether it was kept.
    #[inline]
    pub fn add(&mut self, rgb: [f32; 3]) -> bool {
        self.count += 1;
        if !rgb.iter().all(|v| v.is_finite()) {
            self.dropped += 1;
            return false;
        }
        for (channel, &value) in rgb.iter().enumerate() {
            let value = f64::from(value);
            self.sum[channel] += value;
            self.squared[channel] += value * value;
        }
        true
    }

    /// How many samples arrived.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// How many of them were not finite.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// The average of the samples.
    pub fn mean(&self) -> [f64; 3] {
        self.sum.map(|sum| sum / f64::from(self.count.max(1)))
    }

    /// The variance of one sample; infinite with fewer than two.
    pub fn sample_variance(&self) -> [f64; 3] {
        self.spread(&self.mean()).map(|spread| spread / (f64::from(self.count) - 1.0).max(0.0))
    }

    /// Σ (Lᵢ − r)², infinite with fewer than two samples.
    fn spread(&self, center: &[f64; 3]) -> [f64; 3] {
        if self.count < 2 {
            return [f64::INFINITY; 3];
        }
        let n = f64::from(self.count);
        std::array::from_fn(|c| {
            let r = center[c];
            (self.squared[c] - 2.0 * r * self.sum[c] + n * r * r).max(0.0)
        })
    }
}

impl SignedSums {
    /// Adds a sample that the pixel has kept, or zero radiance of one that it has dropped.
    #[inline]
    pub fn add(&mut self, rgb: [f32; 3], sign: f32, was_kept: bool) {
        self.weight += f64::from(sign);
        if was_kept {
            self.sum.iter_mut().zip(rgb).for_each(|(sum, value)| *sum += f64::from(sign) * f64::from(value));
        }
    }
}

/// What is known of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The filtered value; zero without samples.
    pub mean: [f64; 3],
    /// The variance of the mean; infinite where it is not known.
    pub variance: [f64; 3],
    /// How many samples arrived.
    pub count: u32,
    /// How many of them were not finite.
    pub dropped: u32,
    /// The sum of the samples' filter signs.
    pub weight: f64,
}

impl Estimate {
    fn of(pixel: &Pixel, signed: Option<&SignedSums>) -> Self {
        let (sum, weight) = signed.map_or((pixel.sum, f64::from(pixel.count)), |signed| (signed.sum, signed.weight));
        let Pixel { count, dropped, .. } = *pixel;
        if weight == 0.0 {
            return Self { mean: [0.0; 3], variance: [f64::INFINITY; 3], count, dropped, weight };
        }
        let mean = sum.map(|s| s / weight);
        let n = f64::from(count);
        let variance = pixel.spread(&mean).map(|spread| spread * n / ((n - 1.0) * weight * weight));
        Self { mean, variance, count, dropped, weight }
    }

    /// With what splats add. Where chains alone make the picture, a pixel without samples is known as well as they know it; `count`
    /// is then that of mutations, in so many of which each pixel has its share.
    pub(super) fn with_splats(self, splats: SplatEstimate, mutations_each: u64) -> Self {
        let count = self.count.max(u32::try_from(mutations_each).unwrap_or(u32::MAX));
        if self.count == 0 {
            return Self { mean: splats.mean, variance: splats.variance, count, ..self };
        }
        Self {
            mean: std::array::from_fn(|c| self.mean[c] + splats.mean[c]),
            variance: std::array::from_fn(|c| self.variance[c] + splats.variance[c]),
            count,
            ..self
        }
    }

    /// The mean of independent halves. Each has the same weight, whatever its number of samples: that number depends on the
    /// other half's values, and a weight that did so too would make the mean biased.
    pub(super) fn of_halves(halves: &[Pixel], signed: Option<&[SignedSums]>) -> Self {
        let each = |i: usize| Self::of(&halves[i], signed.map(|signed| &signed[i]));
        if halves.len() < 2 || halves[1].count == 0 {
            return each(0);
        }
        let (first, second) = (each(0), each(1));
        if first.count == 0 {
            return second;
        }
        Self {
            mean: std::array::from_fn(|c| 0.5 * (first.mean[c] + second.mean[c])),
            variance: std::array::from_fn(|c| 0.25 * (first.variance[c] + second.variance[c])),
            count: first.count + second.count,
            dropped: first.dropped + second.dropped,
            weight: first.weight + second.weight,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_filtered_pixel_has_the_textbook_mean_and_variance() {
        let mut pixel = Pixel::default();
        for value in [1.0, 2.0, 4.0] {
            pixel.add([value, 0.5, 0.0]);
        }
        let estimate = Estimate::of(&pixel, None);
        assert!((estimate.mean[0] - 7.0 / 3.0).abs() < 1e-12);
        // Sample variance 7/3, of the mean 7/9.
        assert!((estimate.variance[0] - 7.0 / 9.0).abs() < 1e-12);
        assert!((pixel.sample_variance()[0] - 7.0 / 3.0).abs() < 1e-12);
        assert_eq!(estimate.variance[1], 0.0);
    }

    #[test]
    fn a_nan_is_counted_and_adds_nothing() {
        let mut pixel = Pixel::default();
        assert!(pixel.add([1.0; 3]));
        assert!(!pixel.add([f32::NAN, 1.0, 1.0]));
        assert_eq!((pixel.count(), pixel.dropped()), (2, 1));
        assert_eq!(Estimate::of(&pixel, None).mean, [0.5; 3]);
    }

    #[test]
    fn negative_lobes_subtract() {
        let (mut pixel, mut signed) = (Pixel::default(), SignedSums::default());
        for sign in [1.0, 1.0, -1.0] {
            let was_kept = pixel.add([3.0; 3]);
            signed.add([3.0; 3], sign, was_kept);
        }
        let estimate = Estimate::of(&pixel, Some(&signed));
        assert_eq!((estimate.mean, estimate.variance), ([3.0; 3], [0.0; 3]));
    }

    #[test]
    fn positive_filters_need_no_signs() {
        let (mut pixel, mut signed) = (Pixel::default(), SignedSums::default());
        for value in [0.3, 1.7, 0.9] {
            let was_kept = pixel.add([value; 3]);
            signed.add([value; 3], 1.0, was_kept);
        }
        assert_eq!(Estimate::of(&pixel, Some(&signed)), Estimate::of(&pixel, None));
    }

    #[test]
    fn halves_count_alike() {
        let (mut few, mut many) = (Pixel::default(), Pixel::default());
        few.add([1.0; 3]);
        few.add([3.0; 3]);
        for value in [3.0, 5.0, 3.0, 5.0] {
            many.add([value; 3]);
        }
        let both = Estimate::of_halves(&[few, many], None);
        assert_eq!((both.mean, both.count), ([3.0; 3], 6));
        assert!((both.variance[0] - (1.0 + 1.0 / 3.0) / 4.0).abs() < 1e-12);
        let empty = Pixel::default();
        assert_eq!(Estimate::of_halves(&[few, empty], None), Estimate::of(&few, None));
        assert_eq!(Estimate::of_halves(&[empty, few], None), Estimate::of(&few, None));
        assert_eq!(Estimate::of_halves(&[empty, empty], None).variance, [f64::INFINITY; 3]);
    }
}
