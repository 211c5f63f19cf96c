//! The filter and its settings.

use std::time::Instant;

use luz_image::Image;
use serde::Serialize;

use crate::plan::Plan;
use crate::{Border, FilterError, Filtered, Guide, Method, Progress, Range, Scale, SimdLevel, run};

/// How an image's opacity, the channel `A`, is to be understood. Images with one are filtered with premultiplied colours,
/// opacity being one more channel; so what can't be seen has no colour that could bleed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
pub enum Alpha {
    /// Premultiplied where samples were stored as floats (OpenEXR), else straight.
    #[default]
    Detect,
    /// Colours are independent of opacity, as in PNG.
    Straight,
    /// Colours are multiplied with opacity already.
    Premultiplied,
    /// `A` is a channel like others.
    Ignore,
}

/// The bilateral filter
///
/// `BF[I](x) = 1/K(x) · Σ_{y∈Ω(x)} I(y) f_s(‖x−y‖) g_r(‖I(y)−I(x)‖)`, `K(x) = Σ_{y∈Ω(x)} f_s g_r`,
///
/// with Gaussians `f_s` and `g_r` and a square window `Ω` of radius `R = ⌈5/2 σ_s⌉` and width `k = 2R + 1` pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BilateralFilter {
    /// The width σ_s of the spatial Gaussian in pixels, from 0.1 to 1000.
    pub sigma_spatial: f32,
    /// The range Gaussian of the image on itself. Ignored where guides are given: to let an image take part in its own
    /// filtering beside them, name it as a guide, too.
    pub range: Range,
    /// The scale on which values are averaged.
    pub mean_scale: Scale,
    /// How it is computed.
    pub method: Method,
    /// What lies beyond the edges.
    pub border: Border,
    /// What the channel `A` means.
    pub alpha: Alpha,
    /// Chooses the random numbers.
    pub seed: u64,
    /// Which instructions to use.
    pub simd: SimdLevel,
}

impl BilateralFilter {
    /// The exact filter with L2 distances on values as they are.
    pub fn new(sigma_spatial: f32, sigma_range: f32) -> Self {
        Self {
            sigma_spatial,
            range: Range::new(sigma_range),
            mean_scale: Scale::Linear,
            method: Method::Exact,
            border: Border::Mirror,
            alpha: Alpha::Detect,
            seed: 0,
            simd: SimdLevel::Auto,
        }
    }

    /// The window's radius `R` in pixels.
    pub fn radius(&self) -> usize {
        window_radius(self.sigma_spatial)
    }

    /// Filters an image of any channels: by its own values, or by guides of the same size if there are any.
    ///
    /// The result is a function of the image, the guides and the settings, the same to the last bit for any number of
    /// threads. It runs on rayon's current thread pool.
    ///
    /// # Errors
    /// When a width is out of its domain, a guide has another size, or the method is unsuitable for the guides.
    pub fn apply(&self, image: &Image, guides: &[Guide<'_>]) -> Result<Filtered, FilterError> {
        self.apply_with_progress(image, guides, &|_| {})
    }

    /// As [`Self::apply`]; `progress` is told now and then, from any thread, how far it is.
    ///
    /// # Errors
    /// As [`Self::apply`].
    pub fn apply_with_progress(
        &self,
        image: &Image,
        guides: &[Guide<'_>],
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<Filtered, FilterError> {
        let start = Instant::now();
        let plan = Plan::new(self, image, guides)?;
        let mut filtered = run::image(&plan, progress)?;
        filtered.report.seconds = start.elapsed().as_secs_f64();
        Ok(filtered)
    }
}

/// `⌈5/2 σ⌉`, for the decimal number that was meant: 1.2 is a little more than that in binary.
pub(crate) fn window_radius(sigma: f32) -> usize {
    (2.5 * f64::from(sigma) * (1.0 - 1e-6)).ceil() as usize
}
