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
pub const GUIDE_BLUR: f32 = 0.8;
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
