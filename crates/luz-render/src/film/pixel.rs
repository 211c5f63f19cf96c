//! What one pixel has received.

/// The sums of one pixel.
///
/// With filter signs sᵢ = ±1 and samples Lᵢ, the pixel's value is r = Σ sᵢLᵢ / Σ sᵢ, and the variance of that ratio
/// estimator is, to first order, n/(n−1) · Σ (Lᵢ − r)² / (Σ sᵢ)²; for filters without negative lobes it is the sample
/// variance of the mean, exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    /// Σ sᵢLᵢ.
    signed: [f64; 3],
    /// Σ Lᵢ.
    plain: [f64; 3],
    /// Σ Lᵢ².
    squared: [f64; 3],
    /// Σ sᵢ.
    weight: f64,
    /// n.
    count: u32,
    /// Samples that were not finite; they are counted as zero in the sums.
    dropped: u32,
}

impl Pixel {
    /// Adds a sample; one that is not finite is counted as dropped and adds zero radiance. Returns whether it was kept.
    #[inline]
    pub fn add(&mut self, rgb: [f32; 3], sign: f32) -> bool {
        let finite = rgb.iter().all(|v| v.is_finite());
        self.weight += f64::from(sign);
        self.count += 1;
        if !finite {
            self.dropped += 1;
            return false;
        }
        for (channel, &value) in rgb.iter().enumerate() {
            let value = f64::from(value);
            self.signed[channel] += f64::from(sign) * value;
            self.plain[channel] += value;
            self.squared[channel] += value * value;
        }
        true
    }

    /// The filtered value; zero without samples.
    pub fn mean(&self) -> [f64; 3] {
        if self.weight == 0.0 { [0.0; 3] } else { self.signed.map(|s| s / self.weight) }
    }

    /// The variance of [`mean`](Self::mean); infinite with fewer than two samples.
    pub fn variance(&self) -> [f64; 3] {
        if self.count < 2 || self.weight == 0.0 {
            return [f64::INFINITY; 3];
        }
        let n = f64::from(self.count);
        let mean = self.mean();
        std::array::from_fn(|c| {
            let spread = self.squared[c] - 2.0 * mean[c] * self.plain[c] + n * mean[c] * mean[c];
            (spread.max(0.0) * n / (n - 1.0)) / (self.weight * self.weight)
        })
    }

    /// The sum of the samples' filter signs.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// How many samples arrived.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// How many of them were not finite.
    pub fn dropped(&self) -> u32 {
        self.dropped
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
    /// The mean of independent halves. Each has the same weight, whatever its number of samples: that number depends on the
    /// other half's values, and a weight that did so too would make the mean biased.
    pub(super) fn of_halves(halves: &[Pixel]) -> Self {
        let filled = || halves.iter().filter(|half| half.count > 0);
        let share = 1.0 / filled().count().max(1) as f64;
        let sum = |value: &dyn Fn(&Pixel) -> [f64; 3]| {
            filled().map(value).fold([0.0; 3], |sum, v| std::array::from_fn(|c| sum[c] + v[c]))
        };
        let variance = if filled().next().is_none() { [f64::INFINITY; 3] } else { sum(&Pixel::variance) };
        Self {
            mean: sum(&Pixel::mean).map(|v| v * share),
            variance: variance.map(|v| v * share * share),
            count: halves.iter().map(|half| half.count).sum(),
            dropped: halves.iter().map(|half| half.dropped).sum(),
            weight: halves.iter().map(|half| half.weight).sum(),
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
            pixel.add([value, 0.5, 0.0], 1.0);
        }
        assert!((pixel.mean()[0] - 7.0 / 3.0).abs() < 1e-12);
        // Sample variance 7/3, of the mean 7/9.
        assert!((pixel.variance()[0] - 7.0 / 9.0).abs() < 1e-12);
        assert_eq!(pixel.variance()[1], 0.0);
    }

    #[test]
    fn a_nan_is_counted_and_adds_nothing() {
        let mut pixel = Pixel::default();
        assert!(pixel.add([1.0; 3], 1.0));
        assert!(!pixel.add([f32::NAN, 1.0, 1.0], 1.0));
        assert_eq!((pixel.count(), pixel.dropped()), (2, 1));
        assert_eq!(pixel.mean(), [0.5; 3]);
    }

    #[test]
    fn negative_lobes_subtract() {
        let mut pixel = Pixel::default();
        pixel.add([3.0; 3], 1.0);
        pixel.add([3.0; 3], 1.0);
        pixel.add([3.0; 3], -1.0);
        assert_eq!(pixel.mean(), [3.0; 3]);
        assert_eq!(pixel.variance(), [0.0; 3]);
    }

    #[test]
    fn halves_count_alike() {
        let (mut few, mut many) = (Pixel::default(), Pixel::default());
        few.add([1.0; 3], 1.0);
        few.add([3.0; 3], 1.0);
        for value in [3.0, 5.0, 3.0, 5.0] {
            many.add([value; 3], 1.0);
        }
        let both = Estimate::of_halves(&[few, many]);
        assert_eq!((both.mean, both.count), ([3.0; 3], 6));
        assert!((both.variance[0] - (1.0 + 1.0 / 3.0) / 4.0).abs() < 1e-12);
        let one = Estimate::of_halves(&[few, Pixel::default()]);
        assert_eq!((one.mean, one.variance), (few.mean(), few.variance()));
        assert_eq!(Estimate::of_halves(&[Pixel::default(); 2]).variance, [f64::INFINITY; 3]);
    }
}
