//! Enhancing detail without halos.

use luz_image::Image;
use rayon::prelude::*;
use serde::Serialize;

use super::{LUMINANCE, color};
use crate::{BilateralFilter, FilterError, Filtered, Method, Progress, Report, Scale};

/// Detail is what the bilateral filter takes away; more of it makes a picture crisp, less makes it soft, and edges, which the
/// filter keeps, get no halos (Fattal, Agrawala and Rusinkiewicz 2007, "Multiscale Shape and Detail Enhancement from
/// Multi-light Image Collections").
///
/// All components of a pixel are changed by the same amount, `s (Y − Y_BF)` of luma, or of the logarithm of luminance: hues
/// and the noise of colours stay as they are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DetailEnhancement {
    /// How many times detail is added: `s`. Negative factors soften; −1 gives the luma of the filtered picture.
    pub strength: f32,
    /// The filter's width σ_s in pixels.
    pub sigma_spatial: f32,
    /// The filter's width σ_r: of values, or of the natural logarithm of light.
    pub sigma_range: f32,
    /// How the filter is computed.
    pub method: Method,
    /// On which scale values are: as they are (encoded ones), or [`Scale::Log`] for light of high dynamic range.
    pub scale: Scale,
}

impl Default for DetailEnhancement {
    fn default() -> Self {
        Self {
            strength: 1.0,
            sigma_spatial: 6.0,
            sigma_range: 0.1,
            method: Method::Auto { quality: 45.0 },
            scale: Scale::Linear,
        }
    }
}

impl DetailEnhancement {
    /// The picture with more detail. Channels beside the colour stay, and so do pixels that aren't finite. Values may leave
    /// `[0, 1]`.
    ///
    /// # Errors
    /// When a setting is out of its domain, or the image has no colour.
    pub fn apply(&self, image: &Image, progress: &(dyn Fn(Progress) + Sync)) -> Result<(Image, Report), FilterError> {
        if !(-100.0..=100.0).contains(&self.strength) {
            let value = f64::from(self.strength);
            return Err(FilterError::OutOfDomain { name: "the strength", value, least: -100.0, most: 100.0 });
        }
        let rgb = color(image)?;
        let n = image.channel_count();
        let names: Vec<&str> = if rgb[0] == rgb[1] { vec!["Y"] } else { vec!["R", "G", "B"] };
        let colors = if n == 1 { image.clone() } else { image.select(&names)? };
        let mut filter = BilateralFilter::new(self.sigma_spatial, self.sigma_range);
        filter.method = self.method;
        filter.range.scale = self.scale;
        filter.mean_scale = self.scale;
        let Filtered { image: base, report } = filter.apply_with_progress(&colors, &[], progress)?;
        let m = base.channel_count();
        let luma = |p: &[f32]| if m == 1 { p[0] } else { (0..3).map(|c| LUMINANCE[c] * p[c]).sum() };
        let mut enhanced = image.clone();
        let pairs = colors.data().par_chunks_exact(m).zip(base.data().par_chunks_exact(m));
        enhanced.data_mut().par_chunks_exact_mut(n).zip(pairs).for_each(|(pixel, (old, base))| {
            let change = self.strength * (self.scale.forward(luma(old)) - self.scale.forward(luma(base)));
            if !change.is_finite() {
                return;
            }
            let channels = if m == 1 { &rgb[..1] } else { &rgb[..] };
            for &c in channels {
                match self.scale {
                    Scale::Log => pixel[c] *= change.exp(),
                    scale => pixel[c] = scale.backward(scale.forward(pixel[c]) + change),
                }
            }
        });
        Ok((enhanced, report))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An edge of height 0.6 with a texture of ±0.02.
    fn picture(scale: f32) -> Image {
        let data = (0..48 * 24)
            .flat_map(|i| {
                let (x, y) = (i % 48, i / 48);
                let v = if x < 24 { 0.2 } else { 0.8 } + if (x + y) % 2 == 0 { 0.02 } else { -0.02 };
                [scale * v, scale * (v - 0.1), scale * v, 7.0]
            })
            .collect();
        Image::from_data(48, 24, ["R", "G", "B", "Z"], data).unwrap()
    }

    fn enhance(strength: f32, scale: Scale, image: &Image) -> Image {
        let method = Method::Exact;
        let settings = DetailEnhancement { strength, scale, sigma_spatial: 3.0, sigma_range: 0.2, method };
        settings.apply(image, &|_| {}).unwrap().0
    }

    #[test]
    fn texture_grows_by_the_strength_and_edges_get_no_halos() {
        let image = picture(1.0);
        for strength in [-1.0, 0.0, 1.0, 3.0] {
            let enhanced = enhance(strength, Scale::Linear, &image);
            let height = |x: usize| enhanced.pixel(x, 10)[0] - enhanced.pixel(x + 1, 10)[0];
            assert!((height(8).abs() - 0.04 * (1.0 + strength)).abs() < 0.004, "{strength}");
            // At the edge as far from it.
            assert!((height(22).abs() - 0.04 * (1.0 + strength)).abs() < 0.004, "{strength}");
            for (p, q) in enhanced.data().chunks(4).zip(image.data().chunks(4)) {
                assert!((p[0] - p[1] - (q[0] - q[1])).abs() < 1e-5 && p[3] == 7.0);
            }
        }
        assert_eq!(enhance(0.0, Scale::Linear, &image), image);
    }

    #[test]
    fn logarithms_know_no_exposure() {
        let (dim, bright) = (enhance(1.5, Scale::Log, &picture(0.01)), enhance(1.5, Scale::Log, &picture(100.0)));
        for (a, b) in dim.data().chunks(4).zip(bright.data().chunks(4)) {
            assert!((0..3).all(|c| (a[c] * 1e4 - b[c]).abs() < 1e-3 * b[c]), "{a:?} {b:?}");
        }
    }

    #[test]
    fn odd_pixels_stay_and_wrong_settings_are_refused() {
        let mut image = picture(1.0);
        image.pixel_mut(3, 3)[1] = f32::NAN;
        let enhanced = enhance(2.0, Scale::Linear, &image);
        assert!(enhanced.pixel(3, 3)[1].is_nan() && enhanced.pixel(3, 3)[0] == image.pixel(3, 3)[0]);
        assert_eq!(enhanced.non_finite_count(), 1);
        let settings = DetailEnhancement { strength: f32::NAN, ..Default::default() };
        assert!(settings.apply(&image, &|_| {}).is_err());
    }
}
