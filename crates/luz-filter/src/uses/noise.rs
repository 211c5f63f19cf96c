//! How much noise a picture has.

use luz_image::Image;
use rayon::prelude::*;

/// The side of the blocks that are looked at, in pixels.
const BLOCK: usize = 16;
/// The share of the blocks that are smoother than the one that counts.
const SMOOTHER: f64 = 0.1;

/// The standard deviation of the noise of each channel, from the picture alone.
///
/// The mask `1 −2 1; −2 4 −2; 1 −2 1` takes away what is locally linear, and leaves six times the deviation of independent noise
/// (Immerkær 1996, "Fast Noise Variance Estimation"). That is measured in blocks of 16 × 16 pixels, and the block counts that
/// a tenth of the others are smoother than, since texture looks like noise and not every block has it. Blocks without any
/// variation, which clipping and drawing give, don't count. Noise that neighbours share, as lossy codecs leave it, is
/// underestimated.
pub fn noise_level(image: &Image) -> Vec<f32> {
    let (width, height, n) = (image.width(), image.height(), image.channel_count());
    if width < 3 || height < 3 {
        return vec![0.0; n];
    }
    let rows: Vec<usize> = (1..height - 1).step_by(BLOCK).collect();
    let blocks: Vec<Vec<f64>> = rows
        .into_par_iter()
        .flat_map_iter(|y| (1..width - 1).step_by(BLOCK).map(move |x| (x, y)))
        .map(|(x, y)| (0..n).map(|c| block(image, x, y, c)).collect())
        .collect();
    (0..n)
        .map(|c| {
            let mut levels: Vec<f64> = blocks.iter().map(|b| b[c]).filter(|v| v.is_finite() && *v > 0.0).collect();
            levels.sort_unstable_by(f64::total_cmp);
            levels.get((levels.len() as f64 * SMOOTHER) as usize).map_or(0.0, |&v| v as f32)
        })
        .collect()
}

/// The deviation in the block whose first pixel is (`x`, `y`).
fn block(image: &Image, x: usize, y: usize, channel: usize) -> f64 {
    let (width, n) = (image.width(), image.channel_count());
    let at = |x: usize, y: usize| f64::from(image.data()[(y * width + x) * n + channel]);
    let (mut sum, mut count) = (0.0, 0);
    for y in y..(y + BLOCK).min(image.height() - 1) {
        for x in x..(x + BLOCK).min(width - 1) {
            let row = |y: usize, a: f64, b: f64| a * (at(x - 1, y) + at(x + 1, y)) + b * at(x, y);
            sum += (row(y - 1, 1.0, -2.0) + row(y, -2.0, 4.0) + row(y + 1, 1.0, -2.0)).abs();
            count += 1;
        }
    }
    // The mean of |x| of a Gaussian is √(2/π) of its deviation.
    sum / f64::from(count.max(1)) * std::f64::consts::FRAC_PI_2.sqrt() / 6.0
}

#[cfg(test)]
pub(crate) mod tests {
    use luz_sample::random::{hash, unit_f64};

    use super::*;

    /// A number of the standard normal distribution.
    pub(crate) fn normal(seed: u64, index: u64) -> f32 {
        let (u, v) = (unit_f64(hash(seed, index, 0, 0)), unit_f64(hash(seed, index, 0, 1)));
        ((-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()) as f32
    }

    #[test]
    fn the_level_is_found_beside_edges_texture_and_clipping() {
        for sigma in [0.005, 0.02, 0.1] {
            let data = (0..160 * 128)
                .flat_map(|i| {
                    let (x, y) = (i % 160, i / 160);
                    let texture = if x > 110 { 0.2 * ((x * 7 + y * 13) % 5) as f32 } else { 0.0 };
                    let ramp = 0.002 * x as f32 + if y > 60 { 0.3 } else { 0.0 };
                    let v = ramp + texture + sigma * normal(1, i as u64);
                    [if y < 20 { 0.0 } else { v }, 0.5]
                })
                .collect();
            let image = Image::from_data(160, 128, ["R", "G"], data).unwrap();
            let levels = noise_level(&image);
            assert!((levels[0] / sigma - 1.0).abs() < 0.15, "{sigma}: {levels:?}");
            assert_eq!(levels[1], 0.0);
        }
    }

    #[test]
    fn odd_images_have_a_level() {
        for (w, h) in [(1, 1), (2, 9), (3, 3), (17, 3)] {
            let image = Image::new(w, h, ["Y"]).unwrap();
            assert_eq!(noise_level(&image), [0.0]);
            let nan = Image::from_data(w, h, ["Y"], vec![f32::NAN; w * h]).unwrap();
            assert_eq!(noise_level(&nan), [0.0]);
        }
    }
}
