//! How different two images are.

mod error_map;
mod false_color;
mod ssim;

use rayon::prelude::*;
use serde::Serialize;

use crate::{Image, ImageError};

pub use error_map::{ErrorMap, ErrorMeasure, error_map};
pub use false_color::false_color;
pub use ssim::ssim;

/// What keeps the relative squared error finite where the reference is black: it is added to the squared reference.
/// The value 0.01 is that of Rousselle et al. 2011 and later work on adaptive rendering.
pub const RELATIVE_EPSILON: f64 = 1e-2;

/// The differences between an image and a reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Pixels of the reference with an infinite or NaN sample among the compared channels.
    pub non_finite_in_reference: usize,
    /// The same for the image.
    pub non_finite_in_image: usize,
    /// Pixels that are finite in both: only these enter the numbers below.
    pub compared_pixels: usize,
    /// The differences by channel.
    pub channels: Vec<ChannelDifference>,
    /// The mean over the channels; PSNR is that of the mean MSE.
    pub mean: Difference,
}

/// The differences of one channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelDifference {
    /// The channel's name.
    pub name: String,
    /// Its differences.
    #[serde(flatten)]
    pub difference: Difference,
}

/// Measures of the difference between an image a and a reference b.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Mean squared error, the mean of (a − b)².
    pub mse: f64,
    /// Mean relative squared error, the mean of (a − b)² / (b² + [`RELATIVE_EPSILON`]).
    pub rel_mse: f64,
    /// Mean absolute error, the mean of |a − b|.
    pub mae: f64,
    /// The largest |a − b|.
    pub max_error: f64,
    /// Peak signal-to-noise ratio in dB, 10 lg(peak² / MSE); infinite for equal images.
    pub psnr: f64,
    /// Structural similarity, 1 for equal images; none for images smaller than its window or full of holes.
    pub ssim: Option<f64>,
    /// The mean of the image.
    pub image_mean: f64,
    /// The mean of the reference.
    pub reference_mean: f64,
}

/// What to compare.
#[derive(Clone, Debug, PartialEq)]
pub struct CompareOptions {
    /// The channels. Empty: R, G and B where both images have them, else Y, else all that both have.
    pub channels: Vec<String>,
    /// The value of white for PSNR and SSIM.
    pub peak: f64,
}

impl Default for CompareOptions {
    fn default() -> Self {
        Self { channels: Vec::new(), peak: 1.0 }
    }
}

/// Compares an image with a reference of the same size.
///
/// Numbers are of the images as they are: for renderings, in linear light. Tone-map both to compare what one sees.
///
/// # Errors
/// [`ImageError::Mismatch`] when the sizes differ or no channel is common, [`ImageError::NoSuchChannel`] when a wanted one is
/// missing.
pub fn compare(image: &Image, reference: &Image, options: &CompareOptions) -> Result<Comparison, ImageError> {
    let (image, reference) = common_channels(image, reference, &options.channels)?;
    let n = image.channel_count();
    let row = image.width() * n;
    // Rows in parallel, sums in order: the same bits for any number of threads.
    let rows: Vec<Sums> = image
        .data()
        .par_chunks_exact(row)
        .zip(reference.data().par_chunks_exact(row))
        .map(|(a, b)| {
            let mut sums = Sums::new(n);
            a.chunks_exact(n).zip(b.chunks_exact(n)).for_each(|(a, b)| sums.add_pixel(a, b));
            sums
        })
        .collect();
    let mut sums = Sums::new(n);
    rows.iter().for_each(|row| sums.merge(row));

    let count = sums.compared as f64;
    let channels: Vec<ChannelDifference> = (0..n)
        .map(|c| {
            let s = &sums.channels[c];
            let mse = s.squared / count;
            let difference = Difference {
                mse,
                rel_mse: s.relative / count,
                mae: s.absolute / count,
                max_error: s.max,
                psnr: psnr(mse, options.peak),
                ssim: ssim(&image, &reference, c, options.peak),
                image_mean: s.image / count,
                reference_mean: s.reference / count,
            };
            ChannelDifference { name: image.channels()[c].clone(), difference }
        })
        .collect();
    let mean_of = |f: fn(&Difference) -> f64| channels.iter().map(|c| f(&c.difference)).sum::<f64>() / n as f64;
    let mse = mean_of(|d| d.mse);
    let ssim: Option<f64> = channels.iter().map(|c| c.difference.ssim).sum();
    let mean = Difference {
        mse,
        rel_mse: mean_of(|d| d.rel_mse),
        mae: mean_of(|d| d.mae),
        max_error: channels.iter().map(|c| c.difference.max_error).fold(0.0, f64::max),
        psnr: psnr(mse, options.peak),
        ssim: ssim.map(|sum| sum / n as f64),
        image_mean: mean_of(|d| d.image_mean),
        reference_mean: mean_of(|d| d.reference_mean),
    };
    Ok(Comparison {
        width: image.width(),
        height: image.height(),
        non_finite_in_reference: sums.non_finite[1],
        non_finite_in_image: sums.non_finite[0],
        compared_pixels: sums.compared,
        channels,
        mean,
    })
}

fn psnr(mse: f64, peak: f64) -> f64 {
    10.0 * (peak * peak / mse).log10()
}

/// Sums over pixels.
#[derive(Clone)]
struct Sums {
    compared: usize,
    /// Of the image and of the reference.
    non_finite: [usize; 2],
    channels: Vec<ChannelSums>,
}

#[derive(Clone, Copy, Default)]
struct ChannelSums {
    squared: f64,
    relative: f64,
    absolute: f64,
    max: f64,
    image: f64,
    reference: f64,
}

impl Sums {
    fn new(channels: usize) -> Self {
        Self { compared: 0, non_finite: [0; 2], channels: vec![ChannelSums::default(); channels] }
    }

    fn add_pixel(&mut self, image: &[f32], reference: &[f32]) {
        let finite = [image, reference].map(|pixel| pixel.iter().all(|v| v.is_finite()));
        self.non_finite[0] += usize::from(!finite[0]);
        self.non_finite[1] += usize::from(!finite[1]);
        if finite != [true; 2] {
            return;
        }
        self.compared += 1;
        for (sums, (&a, &b)) in self.channels.iter_mut().zip(image.iter().zip(reference)) {
            let (a, b) = (f64::from(a), f64::from(b));
            let d = a - b;
            sums.squared += d * d;
            sums.relative += d * d / (b * b + RELATIVE_EPSILON);
            sums.absolute += d.abs();
            sums.max = sums.max.max(d.abs());
            sums.image += a;
            sums.reference += b;
        }
    }

    fn merge(&mut self, other: &Self) {
        self.compared += other.compared;
        self.non_finite[0] += other.non_finite[0];
        self.non_finite[1] += other.non_finite[1];
        for (a, b) in self.channels.iter_mut().zip(&other.channels) {
            a.squared += b.squared;
            a.relative += b.relative;
            a.absolute += b.absolute;
            a.max = a.max.max(b.max);
            a.image += b.image;
            a.reference += b.reference;
        }
    }
}

/// Both images reduced to the channels that are compared.
fn common_channels(image: &Image, reference: &Image, wanted: &[String]) -> Result<(Image, Image), ImageError> {
    image.check_same_size(reference)?;
    let both = |name: &&str| image.channel(name).is_some() && reference.channel(name).is_some();
    let names: Vec<&str> = if !wanted.is_empty() {
        wanted.iter().map(String::as_str).collect()
    } else if ["R", "G", "B"].iter().all(both) {
        vec!["R", "G", "B"]
    } else if both(&"Y") {
        vec!["Y"]
    } else {
        image.channels().iter().map(String::as_str).filter(both).collect()
    };
    if names.is_empty() {
        return Err(ImageError::Mismatch(format!(
            "one has the channels {}, the other {}",
            image.channels().join(", "),
            reference.channels().join(", ")
        )));
    }
    Ok((image.select(&names)?, reference.select(&names)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rgb(width: usize, height: usize, f: impl Fn(usize) -> f32) -> Image {
        Image::from_data(width, height, ["R", "G", "B"], (0..width * height * 3).map(f).collect()).unwrap()
    }

    #[test]
    fn equal_images_have_no_difference() {
        let image = rgb(16, 12, |i| (i % 7) as f32 / 7.0);
        let c = compare(&image, &image, &CompareOptions::default()).unwrap();
        assert_eq!((c.mean.mse, c.mean.rel_mse, c.mean.mae, c.mean.max_error), (0.0, 0.0, 0.0, 0.0));
        assert_eq!(c.mean.psnr, f64::INFINITY);
        assert!((c.mean.ssim.unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(c.compared_pixels, 16 * 12);
    }

    #[test]
    fn a_constant_offset_has_the_errors_of_the_formulas() {
        let reference = rgb(20, 20, |_| 0.5);
        let image = rgb(20, 20, |_| 0.6);
        let c = compare(&image, &reference, &CompareOptions { peak: 2.0, ..Default::default() }).unwrap();
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-6 * b.abs().max(1.0), "{a} {b}");
        close(c.mean.mse, 0.01);
        close(c.mean.mae, 0.1);
        close(c.mean.rel_mse, 0.01 / 0.26);
        close(c.mean.psnr, 10.0 * (4.0f64 / 0.01).log10());
        close(c.mean.image_mean, 0.6);
        // Only SSIM's luminance term differs from one; C₁ = (0.01 · peak)².
        close(c.mean.ssim.unwrap(), (2.0 * 0.3 + 4e-4) / (0.36 + 0.25 + 4e-4));
    }

    #[test]
    fn non_finite_pixels_are_counted_and_left_out() {
        let reference = rgb(12, 12, |_| 1.0);
        let mut image = reference.clone();
        image.pixel_mut(3, 4)[1] = f32::NAN;
        image.pixel_mut(0, 0)[0] = f32::INFINITY;
        let mut holes = reference.clone();
        holes.pixel_mut(5, 5)[2] = f32::NEG_INFINITY;
        let c = compare(&image, &holes, &CompareOptions::default()).unwrap();
        assert_eq!((c.non_finite_in_image, c.non_finite_in_reference, c.compared_pixels), (2, 1, 141));
        assert_eq!(c.mean.mse, 0.0);
    }

    #[test]
    fn channels_are_chosen() {
        let image = Image::from_data(1, 1, ["R", "G", "B", "A"], vec![1.0, 2.0, 3.0, 4.0]).unwrap();
        let other = Image::from_data(1, 1, ["B", "G", "R", "Z"], vec![3.0, 2.0, 0.0, 4.0]).unwrap();
        let c = compare(&image, &other, &CompareOptions::default()).unwrap();
        assert_eq!(c.channels.iter().map(|c| c.difference.mse).collect::<Vec<_>>(), [1.0, 0.0, 0.0]);
        assert_eq!(c.mean.ssim, None);
        let error = compare(&image, &other, &CompareOptions { channels: vec!["A".into()], peak: 1.0 }).unwrap_err();
        assert_eq!(error.to_string(), "the image has no channel `A`; its channels are B, G, R, Z");
        let z = Image::from_data(1, 1, ["Z"], vec![4.0]).unwrap();
        let error = compare(&image, &z, &CompareOptions::default()).unwrap_err();
        assert_eq!(error.to_string(), "the images don't match: one has the channels R, G, B, A, the other Z");
    }
}
