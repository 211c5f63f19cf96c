//! Tone mapping that keeps detail.

use luz_image::Image;
use rayon::prelude::*;
use serde::Serialize;

use super::{LUMINANCE, color};
use crate::{BilateralFilter, FilterError, Filtered, Method, Progress, Report, Scale};

/// The tone mapping of Durand and Dorsey 2002, "Fast Bilateral Filtering for the Display of High-Dynamic-Range Images": the
/// logarithm of luminance is a base, which the bilateral filter gives, plus detail; the base is scaled down to a contrast that
/// a display has, and the detail is added again.
///
/// With `l = log₁₀ L`, `b = BF[l]`, `d = l − b`: `log₁₀ L' = (b − b_max) · min(1, log₁₀ c / (b_max − b_min)) + f d`, and every
/// component of the colour becomes `L' (C / L)^s`. `b_max` and `b_min` are what all but a few of the pixels lie between.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LocalToneMap {
    /// The ratio `c` of the brightest to the darkest base in the result, above 1.
    pub contrast: f32,
    /// What detail is multiplied with: `f`.
    pub detail: f32,
    /// The exponent `s` of the ratio of each component to luminance: 0 is grey, 1 keeps the ratios.
    pub saturation: f32,
    /// The exposure in stops, applied to the result.
    pub exposure: f32,
    /// The filter's width σ_s as a fraction of the image's larger side.
    pub sigma_spatial: f32,
    /// The filter's width σ_r in powers of ten.
    pub sigma_range: f32,
    /// How the filter is computed.
    pub method: Method,
}

impl Default for LocalToneMap {
    fn default() -> Self {
        Self {
            contrast: 50.0,
            detail: 1.0,
            saturation: 1.0,
            exposure: 0.0,
            sigma_spatial: 0.02,
            sigma_range: 0.4,
            method: Method::Auto { quality: 45.0 },
        }
    }
}

/// The share of the pixels that may be brighter than the base's maximum, and darker than its minimum.
const BEYOND: f64 = 0.005;

impl LocalToneMap {
    /// The picture of linear light, for a display with white 1: still linear, to be encoded when it is written. Channels
    /// beside the colour stay. What lies above 1 is left to be clipped.
    ///
    /// Pixels that are black or aren't finite have no logarithm and no part in it: the former stay black, the latter as they
    /// are.
    ///
    /// # Errors
    /// When a setting is out of its domain, or the image has no colour.
    pub fn apply(&self, image: &Image, progress: &(dyn Fn(Progress) + Sync)) -> Result<(Image, Report), FilterError> {
        for (name, value, least, most) in [
            ("the contrast", self.contrast, 1.0, 1e30),
            ("the factor of detail", self.detail, 0.0, 1e3),
            ("the saturation", self.saturation, 0.0, 1e3),
            ("the exposure", self.exposure, -100.0, 100.0),
            ("σ_s as a fraction of the image's side", self.sigma_spatial, 1e-6, 10.0),
        ] {
            if !(least..=most).contains(&value) {
                let [value, least, most] = [value, least, most].map(f64::from);
                return Err(FilterError::OutOfDomain { name, value, least, most });
            }
        }
        let rgb = color(image)?;
        let n = image.channel_count();
        let luminance = |p: &[f32]| (0..3).map(|c| LUMINANCE[c] * p[rgb[c]].max(0.0)).sum::<f32>();
        let floor = floor(image.data().par_chunks_exact(n).map(luminance));
        let logarithms: Vec<f32> = image
            .data()
            .par_chunks_exact(n)
            .map(|p| {
                // NaN, which `max` would hide, and infinities stay what they are, so that the filter leaves them out.
                let is_finite = rgb.iter().all(|&c| p[c].is_finite());
                if is_finite { luminance(p).max(floor).log10() } else { f32::NAN }
            })
            .collect();
        let guide = Image::from_data(image.width(), image.height(), ["Y"], logarithms)?;
        let sigma = self.sigma_spatial * image.width().max(image.height()) as f32;
        let mut filter = BilateralFilter::new(sigma.clamp(0.1, 1000.0), self.sigma_range);
        filter.method = self.method;
        filter.mean_scale = Scale::Linear;
        let Filtered { image: base, report } = filter.apply_with_progress(&guide, &[], progress)?;

        let (darkest, brightest) = extent(base.data(), floor.log10());
        let range = brightest - darkest;
        let factor = if range > 0.0 { (self.contrast.log10() / range).min(1.0) } else { 1.0 };
        let gain = self.exposure.exp2();
        let mut mapped = image.clone();
        let samples = guide.data().par_iter().zip(base.data());
        mapped.data_mut().par_chunks_exact_mut(n).zip(samples).for_each(|(pixel, (&log, &base))| {
            let old = luminance(pixel);
            if !log.is_finite() || old <= 0.0 {
                return;
            }
            let new = gain * 10f32.powf((base - brightest) * factor + self.detail * (log - base));
            let scaled = |v: f32| if v > 0.0 { new * (v / old).powf(self.saturation) } else { 0.0 };
            let values = rgb.map(|c| scaled(pixel[c]));
            rgb.into_iter().zip(values).for_each(|(c, v)| pixel[c] = v);
        });
        Ok((mapped, report))
    }
}

/// The least luminance that is told from black: far below what most of the picture has.
fn floor(luminances: impl ParallelIterator<Item = f32>) -> f32 {
    let bright: Vec<f64> = luminances.filter(|l| *l > 0.0 && l.is_finite()).map(|l| f64::from(l).ln()).collect();
    // In order, so that equal images give equal bits.
    let mean = bright.iter().sum::<f64>() / bright.len().max(1) as f64;
    ((mean.exp() * 1e-4) as f32).max(1e-30)
}

/// The range that the base of all but a few of the pixels that aren't black lies in.
fn extent(base: &[f32], floor: f32) -> (f32, f32) {
    let mut sorted: Vec<f32> = base.par_iter().copied().filter(|v| v.is_finite() && *v > floor + 0.01).collect();
    sorted.par_sort_unstable_by(f32::total_cmp);
    if sorted.is_empty() {
        return (0.0, 0.0);
    }
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share).round() as usize];
    (at(BEYOND), at(1.0 - BEYOND))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A dark and a bright half with the same relative texture.
    fn halves() -> Image {
        let data = (0..64 * 32)
            .flat_map(|i| {
                let (x, y) = (i % 64, i / 64);
                let light = if x < 32 { 0.01 } else { 1000.0 };
                let texture = if (x + y) % 2 == 0 { 1.1 } else { 1.0 };
                [light * texture, 0.5 * light * texture, 0.25 * light * texture]
            })
            .collect();
        Image::from_data(64, 32, ["R", "G", "B"], data).unwrap()
    }

    fn apply(map: &LocalToneMap, image: &Image) -> Image {
        map.apply(image, &|_| {}).unwrap().0
    }

    #[test]
    fn contrast_is_reached_and_detail_and_hues_are_kept() {
        let map =
            LocalToneMap { contrast: 20.0, sigma_spatial: 0.06, method: Method::Exact, ..LocalToneMap::default() };
        let image = halves();
        let mapped = apply(&map, &image);
        let ratio = |a: &[f32], b: &[f32]| a[0] / b[0];
        // Far from the edge the base is flat: the texture keeps its ratio, the halves have the contrast asked for.
        assert!((ratio(mapped.pixel(10, 10), mapped.pixel(11, 10)) - 1.1).abs() < 0.01);
        assert!((ratio(mapped.pixel(50, 10), mapped.pixel(51, 10)) - 1.1).abs() < 0.01);
        assert!((ratio(mapped.pixel(50, 10), mapped.pixel(10, 10)) - 20.0).abs() < 0.5);
        for (p, q) in mapped.data().chunks(3).zip(image.data().chunks(3)) {
            assert!((p[1] / p[0] - q[1] / q[0]).abs() < 1e-4 && (p[2] / p[0] - q[2] / q[0]).abs() < 1e-4);
        }
        // A global curve of the same contrast would have lost half of the texture.
        let flat = LocalToneMap { detail: 0.0, ..map };
        assert!((ratio(apply(&flat, &image).pixel(10, 10), apply(&flat, &image).pixel(11, 10)) - 1.0).abs() < 0.01);
    }

    #[test]
    fn a_picture_of_low_contrast_keeps_it() {
        let data = (0..16 * 16).map(|i| 0.5 + 0.01 * (i % 16) as f32).collect();
        let image = Image::from_data(16, 16, ["Y"], data).unwrap();
        let map = LocalToneMap { method: Method::Exact, ..LocalToneMap::default() };
        let mapped = apply(&map, &image);
        let factor = mapped.data()[0] / image.data()[0];
        assert!(mapped.data().iter().zip(image.data()).all(|(a, b)| (a / b - factor).abs() < 1e-4 * factor));
    }

    #[test]
    fn odd_light_does_no_harm() {
        let mut image = halves();
        image.pixel_mut(5, 5).copy_from_slice(&[0.0; 3]);
        image.pixel_mut(20, 5).copy_from_slice(&[f32::NAN, 1.0, 1.0]);
        image.pixel_mut(40, 5).copy_from_slice(&[f32::INFINITY, 1.0, 1.0]);
        image.pixel_mut(41, 9).copy_from_slice(&[-5.0, -1.0, -1.0]);
        let map = LocalToneMap { method: Method::Exact, ..LocalToneMap::default() };
        let (mapped, report) = map.apply(&image, &|_| {}).unwrap();
        assert_eq!(report.excluded_pixels, 2);
        assert_eq!(mapped.pixel(5, 5), [0.0; 3]);
        let odd = [(20, 5), (40, 5)];
        for y in 0..32 {
            for x in (0..64).filter(|&x| !odd.contains(&(x, y))) {
                assert!(mapped.pixel(x, y).iter().all(|v| v.is_finite()), "{x} {y}");
            }
        }
        for black in [Image::new(4, 4, ["R", "G", "B"]).unwrap(), Image::new(1, 1, ["Y"]).unwrap()] {
            assert_eq!(apply(&map, &black).data(), black.data());
        }
        assert!(map.apply(&Image::new(2, 2, ["a", "b"]).unwrap(), &|_| {}).is_err());
        for wrong in [
            LocalToneMap { contrast: 0.5, ..map },
            LocalToneMap { contrast: f32::NAN, ..map },
            LocalToneMap { detail: -1.0, ..map },
            LocalToneMap { sigma_spatial: f32::INFINITY, ..map },
            LocalToneMap { sigma_range: 0.0, ..map },
        ] {
            assert!(wrong.apply(&halves(), &|_| {}).is_err(), "{wrong:?}");
        }
    }
}
