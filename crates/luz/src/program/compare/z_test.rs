//! Have two Monte Carlo estimates of a picture the same mean?

use luz::image::Image;
use luz::sample::test_support::{mean_z_test, sidak};
use serde::Serialize;

/// The family-wise significance that is reported where no threshold names another.
pub const SIGNIFICANCE: f64 = 0.01;

/// Rounding to `f32` files adds this to the standard error, relative to a value: half a unit in the last place.
const ROUNDING: f64 = f32::EPSILON as f64 / 2.0;

/// Side of the tiles, in pixels, over which means are tested, too.
pub const TILE: usize = 16;

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

impl Estimate {
    /// The means over tiles of [`TILE`]² pixels (fewer at the right and lower edges), pixels taken as independent. Sums of
    /// many samples are nearer to normal than pixels are, and small biases are seen in them.
    pub fn tiles(&self, width: usize) -> Self {
        let height = self.mean.len() / 3 / width.max(1);
        let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
        let mut sums = vec![[0.0f64; 3]; columns * rows * 3];
        for (i, (&mean, &variance)) in self.mean.iter().zip(&self.variance).enumerate() {
            let (pixel, channel) = (i / 3, i % 3);
            let tile = pixel / width / TILE * columns + pixel % width / TILE;
            let [means, variances, count] = &mut sums[3 * tile + channel];
            *means += f64::from(mean);
            *variances += f64::from(variance);
            *count += 1.0;
        }
        Self {
            mean: sums.iter().map(|[means, _, n]| (means / n) as f32).collect(),
            variance: sums.iter().map(|[_, variances, n]| (variances / (n * n)) as f32).collect(),
        }
    }
}

fn channels(image: &Image, which: [usize; 3]) -> Vec<f32> {
    image.data().chunks_exact(image.channel_count()).flat_map(|pixel| which.map(|c| pixel[c])).collect()
}

/// The outcome of the test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ZTest {
    /// One for every pixel (or tile) and channel.
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
    fn tiles_show_a_bias_that_pixels_hide() {
        // 4096 pixels of 3 channels: 64 × 64. A bias of a fifth of the standard deviation of a difference.
        let (a, b) = (noisy(1.028, 0.1, 1), noisy(1.0, 0.1, 2));
        assert!(!ZTest::new(&a, &b, 0.01).differs());
        assert!(ZTest::new(&a.tiles(64), &b.tiles(64), 0.01).differs());
        let (a, b) = (noisy(1.0, 0.1, 1), noisy(1.0, 0.1, 2));
        let tiles = ZTest::new(&a.tiles(64), &b.tiles(64), 0.01);
        assert_eq!(tiles.tests, 3 * 16);
        assert!(!tiles.differs(), "{tiles:?}");
    }

    #[test]
    fn tiles_at_the_edges_are_means_of_what_there_is() {
        // 17 × 2 pixels: a tile of 16 × 2 and one of 1 × 2.
        let mean: Vec<f32> = (0..17 * 2 * 3).map(|i| if (i / 3) % 17 == 16 { 5.0 } else { 1.0 }).collect();
        let estimate = Estimate { variance: vec![0.5; mean.len()], mean };
        let tiles = estimate.tiles(17);
        assert_eq!(tiles.mean, [1.0, 1.0, 1.0, 5.0, 5.0, 5.0]);
        assert_eq!(tiles.variance, [0.5 / 32.0, 0.5 / 32.0, 0.5 / 32.0, 0.25, 0.25, 0.25]);
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
