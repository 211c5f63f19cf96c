//! What pictures are compared with, and how far it can be trusted.

use super::measure::{Errors, trimmed_mean};
use super::prepare::Prepared;
use super::{Monitor, Progress, REFERENCE_FACTOR, StudyError, Work};
use luz_image::metrics::RELATIVE_EPSILON;
use luz_image::{Image, ImageError};
use luz_render::{Renderer, Settings};
use luz_sample::random::hash;
use luz_sample::statistics::Running;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// A reference is rendered in so many parts with seeds of their own, whose differences tell its error. That holds for every sampler;
/// the variance within a pixel would not, since samples that are well distributed are not independent.
const PARTS: u32 = 4;

/// Where a reference came from.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "origin", rename_all = "snake_case")]
pub enum ReferenceOrigin {
    /// It was read.
    File {
        /// The file.
        path: PathBuf,
    },
    /// It was rendered for the study.
    Rendered {
        /// Samples per pixel in all.
        samples: u32,
        /// Parts of different seeds.
        parts: u32,
        /// The seconds that it took.
        seconds: f64,
    },
}

/// What a report says of its reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReferenceSummary {
    /// Where it came from.
    #[serde(flatten)]
    pub origin: ReferenceOrigin,
    /// Its own error, which is subtracted from all others; `None` if it is not known.
    pub own_error: Option<Errors>,
    /// The mean over all pixels and channels.
    pub mean: f64,
    /// The standard error of that mean, as far as it is known.
    pub mean_error: Option<f64>,
    /// Pixels that are compared, those with finite values.
    pub compared_pixels: usize,
}

/// The reference's pixels.
#[derive(Clone, Debug)]
pub(super) struct Reference {
    pub size: [usize; 2],
    /// R, G, B of every pixel.
    pub mean: Vec<[f64; 3]>,
    /// The mean over the compared pixels and channels of Var(r), and of Var(r) / (r² + 0.01), also trimmed.
    pub own: Option<Errors>,
    /// How many pixels are finite.
    pub compared: usize,
    /// The variance of each pixel's mean, where it is known.
    pub variance: Option<Vec<[f64; 3]>>,
    mean_error: Option<f64>,
    origin: ReferenceOrigin,
}

impl Reference {
    pub fn new(
        size: [usize; 2],
        mean: Vec<[f64; 3]>,
        own: Option<Errors>,
        mean_error: Option<f64>,
        origin: ReferenceOrigin,
    ) -> Self {
        let compared = mean.iter().filter(|pixel| pixel.iter().all(|v| v.is_finite())).count();
        Self { size, mean, own, compared, variance: None, mean_error, origin }
    }

    /// With the variances of its pixels, of which its own error follows.
    fn with_variance(mut self, variance: Vec<[f64; 3]>) -> Self {
        let (mut mse, mut relative) = (0.0, Vec::with_capacity(self.compared));
        for (mean, variance) in self.mean.iter().zip(&variance) {
            if mean.iter().all(|v| v.is_finite()) {
                mse += variance.iter().sum::<f64>();
                let pixel: f64 = mean.iter().zip(variance).map(|(m, v)| v / (m * m + RELATIVE_EPSILON)).sum();
                relative.push([pixel; 2]);
            }
        }
        let count = 3.0 * self.compared.max(1) as f64;
        let rel_mse = relative.iter().map(|pixel| pixel[0]).sum::<f64>() / count;
        let trimmed_rel_mse = trimmed_mean(&mut relative) / 3.0;
        self.own = Some(Errors { mse: mse / count, rel_mse, trimmed_rel_mse });
        self.variance = Some(variance);
        self
    }

    /// Reads a file of the size of the frame or of what is rendered of it. Its channels `Variance.R` … tell its error, if it has them.
    pub fn read(path: &Path, settings: &Settings) -> Result<Self, StudyError> {
        let mut image = Image::read(path)?;
        let bounds = settings.bounds;
        let wanted = [bounds.width() as usize, bounds.height() as usize];
        let found = [image.width(), image.height()];
        if found != wanted {
            if found != settings.resolution.map(|size| size as usize) {
                return Err(StudyError::Size { found, wanted });
            }
            image = image.crop(bounds.x0 as usize, bounds.y0 as usize, wanted[0], wanted[1])?;
        }
        let colors = image
            .rgb()
            .ok_or_else(|| ImageError::NoSuchChannel { name: "R".to_owned(), known: image.channels().to_vec() })?;
        let pixels = |which: [usize; 3]| -> Vec<[f64; 3]> {
            image.data().chunks_exact(image.channel_count()).map(|p| which.map(|c| f64::from(p[c]))).collect()
        };
        let reference = Self::new(wanted, pixels(colors), None, None, ReferenceOrigin::File { path: path.to_owned() });
        let [r, g, b] = ["Variance.R", "Variance.G", "Variance.B"].map(|name| image.channel(name));
        let (Some(r), Some(g), Some(b)) = (r, g, b) else { return Ok(reference) };
        let variance = pixels([r, g, b]);
        // A picture of one sample knows no variance and says zero.
        let is_known = variance.iter().flatten().any(|v| *v > 0.0) && variance.iter().flatten().all(|v| v.is_finite());
        if !is_known {
            return Ok(reference);
        }
        let sum: f64 = variance.iter().flatten().sum();
        let mean_error = sum.sqrt() / (3 * variance.len()) as f64;
        Ok(Self { mean_error: Some(mean_error), ..reference.with_variance(variance) })
    }

    /// Renders one, in parts that take turns.
    pub fn render(
        prepared: &Prepared,
        samples: Option<u32>,
        monitor: &mut dyn Monitor,
        work: &mut Work,
    ) -> Result<Self, StudyError> {
        let base = &prepared.base;
        let samples = samples.unwrap_or_else(|| prepared.longest().saturating_mul(REFERENCE_FACTOR));
        let parts = PARTS.min(samples).max(2);
        let per_part = samples.div_ceil(parts).max(1);
        let settings: Vec<Settings> = (0..parts)
            .map(|part| Settings {
                samples_per_pixel: per_part,
                sample_limit: per_part,
                adaptive: None,
                technique_images: false,
                seed: hash(base.settings.seed, u64::MAX, u64::from(part), 0),
                ..base.settings.clone()
            })
            .collect();
        let mut renderers: Vec<Renderer<'_>> =
            settings.iter().map(|settings| Renderer::new(prepared.world(base), &base.camera, settings)).collect();
        while renderers.iter().any(|r| !r.is_finished()) {
            for renderer in &mut renderers {
                renderer.pass(renderer.next_pass());
                if monitor.is_stopped() {
                    return Err(StudyError::NothingDone);
                }
            }
            let done = renderers.iter().map(Renderer::progress).sum::<f64>() / f64::from(parts);
            let doing =
                format!("reference: {} of {per_part} samples in each of {parts} parts", renderers[0].samples_done());
            monitor.progress(&Progress { doing, done: work.share(done * work.reference) });
        }
        work.done += work.reference;
        let films: Vec<Vec<[f64; 3]>> =
            renderers.iter().map(|r| r.film().estimates().map(|pixel| pixel.mean).collect()).collect();
        let seconds = renderers.iter().map(|r| r.cost().seconds).sum();
        let origin = ReferenceOrigin::Rendered { samples: per_part * parts, parts, seconds };
        let bounds = base.settings.bounds;
        Ok(Self::of_parts([bounds.width() as usize, bounds.height() as usize], &films, origin))
    }

    /// The mean of independent pictures of the same size, two or more. Their differences give its variance.
    pub fn of_parts(size: [usize; 2], parts: &[Vec<[f64; 3]>], origin: ReferenceOrigin) -> Self {
        let count = size[0] * size[1];
        let (mut mean, mut variance) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for i in 0..count {
            let running: [Running; 3] = std::array::from_fn(|c| parts.iter().map(|part| part[i][c]).collect());
            mean.push(running.map(|r| r.mean()));
            variance.push(running.map(|r| r.standard_error().powi(2)));
        }
        let means: Running =
            parts.iter().map(|part| part.iter().flatten().sum::<f64>() / (3 * count.max(1)) as f64).collect();
        Self::new(size, mean, None, Some(means.standard_error()), origin).with_variance(variance)
    }

    /// The mean over all compared pixels and channels.
    pub fn whole_mean(&self) -> f64 {
        let finite = self.mean.iter().filter(|pixel| pixel.iter().all(|v| v.is_finite()));
        finite.flatten().sum::<f64>() / (3.0 * self.compared.max(1) as f64)
    }

    /// What a report says of it.
    pub fn summary(&self) -> ReferenceSummary {
        ReferenceSummary {
            origin: self.origin.clone(),
            own_error: self.own,
            mean: self.whole_mean(),
            mean_error: self.mean_error,
            compared_pixels: self.compared,
        }
    }

    /// The picture, with the variances of its pixels if they are known: to be kept, and read again by another study.
    pub fn to_image(&self) -> Result<Image, ImageError> {
        let mut channels = vec!["R", "G", "B"];
        if self.variance.is_some() {
            channels.extend(["Variance.R", "Variance.G", "Variance.B"]);
        }
        let mut data = Vec::with_capacity(self.mean.len() * channels.len());
        for (i, mean) in self.mean.iter().enumerate() {
            data.extend(mean.map(|v| v as f32));
            if let Some(variance) = &self.variance {
                data.extend(variance[i].map(|v| v as f32));
            }
        }
        Image::from_data(self.size[0], self.size[1], channels, data)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use luz_sample::random::unit_f64;

    #[test]
    fn the_parts_tell_the_error_of_their_mean() {
        // Uniform numbers of variance 1/12; four parts: 1/48. 3·2500 of them: a standard error of 0.9 % for the variance, four allowed.
        let part = |p: u64| -> Vec<[f64; 3]> {
            (0..2500).map(|i| std::array::from_fn(|c| unit_f64(hash(7, p, i, c as u32)))).collect()
        };
        let parts: Vec<_> = (0..4).map(part).collect();
        let origin = ReferenceOrigin::Rendered { samples: 4, parts: 4, seconds: 1.0 };
        let reference = Reference::of_parts([50, 50], &parts, origin);
        let own = reference.own.unwrap();
        assert!((own.mse * 48.0 - 1.0).abs() < 0.04, "{}", own.mse * 48.0);
        assert!((reference.whole_mean() - 0.5).abs() < 4.0 * (1.0 / 48.0 / 7500.0f64).sqrt());
        let summary = reference.summary();
        assert_eq!(summary.compared_pixels, 2500);
        // Kept and read again, it knows the same.
        let image = reference.to_image().unwrap();
        assert_eq!(image.channel_count(), 6);
    }
}
