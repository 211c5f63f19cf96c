//! Have two Monte Carlo estimates of a picture the same mean?

use luz::image::Image;
use luz::sample::test_support::{mean_z_test, sidak};
use serde::Serialize;

/// The family-wise significance that is reported where no threshold names another.
pub const SIGNIFICANCE: f64 = 0.01;

/// Rounding to `f32` files adds this to the standard error, relative to a value: half a unit in the last place.
const ROUNDING: f64 = f32::EPSILON as f64 / 2.0;

/// A picture's means and the variances of those means, three channels per pixel.
pub struct Estimate {
    /// R, G, B of every pixel.
    pub mean: Vec<f32>,
    /// Their variances.
    pub variance: Vec<f32>,
}

impl Estimate {
    /// The means of an image, with variances from another image's R, G, B, or else from its own `Variance.R` … .
    pub fn of(image: &Image, variance: Option<&Image>) -> Option<Self> {
        let variance = match variance {
            Some(variance) => channels(variance, variance.rgb()?),
            None => {
                let names = ["Variance.R", "Variance.G", "Variance.B"];
                let [r, g, b] = names.map(|name| image.channel(name));
                channels(image, [r?, g?, b?])
            }
        };
        Some(Self { mean: channels(image, image.rgb()?), variance })
    }
}

fn channels(image: &Image, which: [usize; 3]) -> Vec<f32> {
    image.data().chunks_exact(image.channel_count()).flat_map(|pixel| which.map(|c| pixel[c])).collect()
}

/// The outcome of the test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ZTest {
    /// One for every pixel and channel.
    pub tests: usize,
    /// The probability that any test fails although all means are equal.
    pub significance: f64,
    /// The level that each test has for it (Šidák 1967).
    pub level: f64,
    /// Tests that found a difference at that level.
    pub rejected: usize,
    /// The least likely of all differences.
    pub smallest_p: f64,
    /// The mean of z²: 1 where means are equal and variances right, and pixels are normal.
    pub mean_square_z: f64,
    /// z of the difference of both pictures' means, taking pixels as independent.
    pub mean_z: f64,
    /// Pixels and channels that could not be tested, since a mean or variance was not finite.
    pub untested: usize,
}

impl ZTest {
    /// Tests every pixel and channel; both estimates have the same number of them.
    pub fn new(a: &Estimate, b: &Estimate, significance: f64) -> Self {
        let samples: Vec<[f64; 4]> = (0..a.mean.len().min(b.mean.len()))
            .map(|i| [a.mean[i], a.variance[i], b.mean[i], b.variance[i]].map(f64::from))
            .collect();
        let usable = |s: &&[f64; 4]| s.iter().all(|v| v.is_finite()) && s[1] >= 0.0 && s[3] >= 0.0;
        let tests = samples.iter().filter(usable).count();
        let level = sidak(significance, tests);
        let mut result = Self {
            tests,
            significance,
            level,
            rejected: 0,
            smallest_p: 1.0,
            mean_square_z: 0.0,
            mean_z: 0.0,
            untested: samples.len() - tests,
        };
        let (mut difference, mut variance) = (0.0, 0.0);
        let mut squares = 0usize;
        for &[mean_a, variance_a, mean_b, variance_b] in samples.iter().filter(usable) {
            let squared_a = variance_a + (ROUNDING * mean_a).powi(2);
            let squared_b = variance_b + (ROUNDING * mean_b).powi(2);
            let p = mean_z_test(mean_a, squared_a, mean_b, squared_b);
            result.smallest_p = result.smallest_p.min(p);
            result.rejected += usize::from(p < level);
            difference += mean_a - mean_b;
            variance += squared_a + squared_b;
            if squared_a + squared_b > 0.0 {
                result.mean_square_z += (mean_a - mean_b).powi(2) / (squared_a + squared_b);
                squares += 1;
            }
        }
        result.mean_square_z /= squares.max(1) as f64;
        result.mean_z = if variance > 0.0 { difference / variance.sqrt() } else { 0.0 };
        result
    }

    /// Did any test find a difference?
    pub fn differs(&self) -> bool {
        self.rejected > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use luz::sample::random::{hash, unit_f32};

    /// Sums of twelve uniform numbers: normal enough for z below 5. Fixed seeds.
    fn noisy(mean: f32, sigma: f32, seed: u64) -> Estimate {
        let uniform = |i: u64, j: u32| unit_f32((hash(seed, i, 0, j) >> 32) as u32);
        let normal = |i: u64| (0..12).map(|j| uniform(i, j)).sum::<f32>() - 6.0;
        let count = 3 * 4096;
        Estimate {
            mean: (0..count).map(|i| mean + sigma * normal(i)).collect(),
            variance: vec![sigma * sigma; count as usize],
        }
    }

    #[test]
    fn equal_means_pass_and_unequal_ones_fail() {
        let equal = ZTest::new(&noisy(1.0, 0.1, 1), &noisy(1.0, 0.2, 2), 0.01);
        assert!(!equal.differs(), "{equal:?}");
        assert!((equal.mean_square_z - 1.0).abs() < 0.06, "{equal:?}");
        // Variances that are four times too small.
        let mut wrong = noisy(1.0, 0.2, 2);
        wrong.variance.iter_mut().for_each(|v| *v *= 0.25);
        assert!(ZTest::new(&noisy(1.0, 0.1, 1), &wrong, 0.01).differs());
        // A bias of one standard deviation is seen in the picture's mean.
        assert!(ZTest::new(&noisy(1.1, 0.1, 1), &noisy(1.0, 0.1, 2), 0.01).mean_z > 50.0);
    }

    #[test]
    fn numbers_that_are_not_finite_are_counted() {
        let mut a = noisy(1.0, 0.1, 1);
        a.mean[0] = f32::NAN;
        a.variance[1] = f32::INFINITY;
        let test = ZTest::new(&a, &noisy(1.0, 0.1, 2), 0.01);
        assert_eq!((test.untested, test.tests), (2, a.mean.len() - 2));
        assert!(test.smallest_p.is_finite());
    }

    #[test]
    fn known_values_need_no_variance() {
        let a = Estimate { mean: vec![1.0; 3], variance: vec![0.0; 3] };
        let b = Estimate { mean: vec![1.0, 1.0, 1.5], variance: vec![0.0; 3] };
        assert_eq!(ZTest::new(&a, &b, 0.01).rejected, 1);
        assert_eq!(ZTest::new(&a, &a, 0.01).rejected, 0);
    }
}
