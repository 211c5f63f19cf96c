//! Taking noise out of images and videos that know nothing of it.

use luz_image::Image;
use serde::Serialize;

use super::{color, noise_level};
use crate::{BilateralFilter, FilterError, Filtered, Guide, Method, Progress, Range, VideoFilter, VideoGuide};

/// A bilateral filter whose range is that of the noise, for images, and over time for videos.
///
/// Noisy values are a bad judge of themselves: what is alike is decided by the frame after a slight Gaussian blur, in which
/// noise is lower and edges are still there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NoiseFilter {
    /// How far guides may differ, relative to their noise.
    pub strength: f32,
    /// The width σ_s in pixels.
    pub sigma_spatial: f32,
    /// The width σ_t in frames, for videos.
    pub sigma_temporal: f32,
    /// The standard deviation of the noise in each channel; measured where none is given.
    pub noise: Option<f32>,
    /// How the filter is computed.
    pub method: Method,
    /// Chooses the random numbers.
    pub seed: u64,
}

impl Default for NoiseFilter {
    fn default() -> Self {
        Self {
            strength: 1.0,
            sigma_spatial: 2.0,
            sigma_temporal: 1.5,
            noise: None,
            method: Method::Auto { quality: 45.0 },
            seed: 0,
        }
    }
}

/// The width of the blur that makes a guide of a frame, in pixels.
const GUIDE_BLUR: f32 = 0.8;
/// σ_r in deviations of a guide's noise at strength 1.
const TOLERANCE: f32 = 2.0;

impl NoiseFilter {
    /// The bilateral filter, and the guide of a frame of which `noise` is the deviation in each channel of the colour.
    fn guide(&self, frame: &Image, noise: f32) -> Result<VideoGuide, FilterError> {
        let rgb = color(frame)?;
        let names: Vec<&str> = if frame.channel_count() == 1 {
            frame.channels().iter().map(String::as_str).collect()
        } else if rgb[0] == rgb[1] {
            vec!["Y"]
        } else {
            vec!["R", "G", "B"]
        };
        let image = BilateralFilter::new(GUIDE_BLUR, f32::INFINITY).apply(&frame.select(&names)?, &[])?.image;
        // What a blur of this width leaves of the deviation of independent noise: Σ w² over the window.
        let weights: Vec<f32> = (-2..=2).map(|i| (-0.5 * (i as f32 / GUIDE_BLUR).powi(2)).exp()).collect();
        let total: f32 = weights.iter().sum();
        let left = weights.iter().map(|w| w * w).sum::<f32>() / (total * total);
        // Distances are over all channels, and between two noisy values.
        let sigma = self.strength * TOLERANCE * noise * left * (names.len() as f32).sqrt();
        Ok(VideoGuide { image, range: Range::new(sigma.max(1e-6)), widths: None })
    }

    fn filter(&self) -> BilateralFilter {
        let mut filter = BilateralFilter::new(self.sigma_spatial, 1.0);
        filter.method = self.method;
        filter.seed = self.seed;
        filter
    }

    /// The noise of a frame: what was given, or the mean over its colour channels of what is measured.
    pub fn noise_of(&self, frame: &Image) -> Result<f32, FilterError> {
        let rgb = color(frame)?;
        Ok(self.noise.unwrap_or_else(|| {
            let levels = noise_level(frame);
            (rgb.iter().map(|&c| levels[c] * levels[c]).sum::<f32>() / 3.0).sqrt()
        }))
    }

    /// An image with less noise: its values as they are, so encoded ones for images of screens.
    ///
    /// # Errors
    /// When a setting is out of its domain, or the image has no colour.
    pub fn image(&self, image: &Image, progress: &(dyn Fn(Progress) + Sync)) -> Result<Filtered, FilterError> {
        let guide = self.guide(image, self.noise_of(image)?)?;
        self.filter().apply_with_progress(
            image,
            &[Guide { image: &guide.image, range: guide.range, widths: None }],
            progress,
        )
    }

    /// Begins a video.
    ///
    /// # Errors
    /// When σ_t is out of its domain.
    pub fn video(&self) -> Result<VideoDenoiser, FilterError> {
        let video = VideoFilter::new(self.filter(), self.sigma_temporal)?;
        Ok(VideoDenoiser { settings: *self, video, noise: None })
    }
}

/// A video whose noise is taken out: frames in, frames out some frames later, in bounded memory.
#[derive(Debug)]
pub struct VideoDenoiser {
    settings: NoiseFilter,
    video: VideoFilter,
    /// The noise of the first frame, which is taken for that of all.
    noise: Option<f32>,
}

impl VideoDenoiser {
    /// Takes the next frame and gives one that is done.
    ///
    /// # Errors
    /// As [`VideoFilter::push`].
    pub fn push(
        &mut self,
        frame: Image,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<Option<Filtered>, FilterError> {
        let noise = match self.noise {
            Some(noise) => noise,
            None => *self.noise.insert(self.settings.noise_of(&frame)?),
        };
        let guide = self.settings.guide(&frame, noise)?;
        self.video.push_with_progress(frame, vec![guide], progress)
    }

    /// After the last frame: the next that is missing, or none.
    ///
    /// # Errors
    /// As [`VideoFilter::flush`].
    pub fn flush(&mut self) -> Result<Option<Filtered>, FilterError> {
        self.video.flush()
    }

    /// The noise that was given or measured; none before the first frame.
    pub fn noise(&self) -> Option<f32> {
        self.noise
    }
}

#[cfg(test)]
mod tests {
    use super::super::noise::tests::normal;
    use super::*;

    const SIGMA: f32 = 0.06;

    /// A disk that moves over a ramp; the noise of each frame is its own.
    fn frame(number: usize, noise: f32) -> Image {
        let data = (0..72 * 56)
            .flat_map(|i| {
                let (x, y) = ((i % 72) as f32, (i / 72) as f32);
                let is_disk = (x - 20.0 - 2.0 * number as f32).hypot(y - 28.0) < 12.0;
                let v = if is_disk { 0.75 } else { 0.2 + 0.003 * x };
                [0, 1, 2].map(|c| v + noise * normal(c + 3 * number as u64, i as u64))
            })
            .collect();
        Image::from_data(72, 56, ["R", "G", "B"], data).unwrap()
    }

    fn error(a: &Image, b: &Image) -> f32 {
        a.data().iter().zip(b.data()).map(|(a, b)| (a - b) * (a - b)).sum::<f32>() / a.data().len() as f32
    }

    #[test]
    fn an_image_loses_its_noise() {
        let settings = NoiseFilter { method: Method::Exact, ..NoiseFilter::default() };
        let clean = settings.image(&frame(0, SIGMA), &|_| {}).unwrap().image;
        assert!(error(&clean, &frame(0, 0.0)) < SIGMA * SIGMA / 8.0, "{}", error(&clean, &frame(0, 0.0)));
    }

    #[test]
    fn a_video_loses_more_and_what_moves_leaves_no_trail() {
        let settings = NoiseFilter { method: Method::Exact, sigma_spatial: 1.5, ..NoiseFilter::default() };
        let mut video = settings.video().unwrap();
        let mut clean = Vec::new();
        for i in 0..9 {
            clean.extend(video.push(frame(i, SIGMA), &|_| {}).unwrap());
        }
        while let Some(frame) = video.flush().unwrap() {
            clean.push(frame);
        }
        assert!((video.noise().unwrap() / SIGMA - 1.0).abs() < 0.15, "{:?}", video.noise());
        assert_eq!(clean.len(), 9);
        for (i, clean) in clean.iter().enumerate() {
            let alone = settings.image(&frame(i, SIGMA), &|_| {}).unwrap().image;
            let (left, alone) = (error(&clean.image, &frame(i, 0.0)), error(&alone, &frame(i, 0.0)));
            assert!(left < 0.6 * alone && left < SIGMA * SIGMA / 10.0, "frame {i}: {left} {alone}");
        }
    }

    #[test]
    fn wrong_settings_and_odd_images_are_refused_or_harmless() {
        for settings in [
            NoiseFilter { sigma_spatial: f32::NAN, ..NoiseFilter::default() },
            NoiseFilter { sigma_temporal: 0.0, ..NoiseFilter::default() },
        ] {
            let still = settings.image(&frame(0, SIGMA), &|_| {});
            assert!(still.is_err() || settings.video().is_err());
        }
        let settings = NoiseFilter::default();
        for image in [Image::new(1, 1, ["Y"]).unwrap(), Image::new(1, 40, ["R", "G", "B", "A"]).unwrap()] {
            assert_eq!(settings.image(&image, &|_| {}).unwrap().image.data(), image.data());
        }
        assert!(settings.image(&Image::new(4, 4, ["a", "b"]).unwrap(), &|_| {}).is_err());
    }
}
