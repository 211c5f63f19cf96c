//! What sampling does to the bilateral filter: kernels, point sets, pictures, errors against samples and time.

mod kernel;
mod measure;
mod page;
mod points;

pub use kernel::{Kernel, interesting_pixels};
pub use measure::{Cell, Measured, StrategyOutcome};
pub use page::page;

use luz_color::encoding::linear_to_srgb;
use luz_filter::{FilterError, Strategy};
use luz_image::{Image, ImageError, SampleType};
use std::ops::ControlFlow;

/// What is to be studied.
#[derive(Clone, Debug, PartialEq)]
pub struct FilterStudy {
    /// σ_s in pixels.
    pub sigma_spatial: f32,
    /// σ_r of the values that [`values`] gives.
    pub sigma_range: f32,
    /// The strategies that are compared.
    pub strategies: Vec<Strategy>,
    /// Numbers of samples, as multiples of the window's width, ascending.
    pub samples: Vec<f32>,
    /// Seeds that everything is repeated with; at least one.
    pub seeds: u32,
    /// Pixels whose kernels are shown; where there are none, a flat place, an edge and a corner are looked for.
    pub kernels_at: Vec<[usize; 2]>,
}

impl Default for FilterStudy {
    fn default() -> Self {
        Self {
            sigma_spatial: 8.0,
            sigma_range: 0.1,
            strategies: Strategy::ALL.to_vec(),
            samples: vec![0.25, 0.5, 1.0, 2.0, 4.0],
            seeds: 5,
            kernels_at: Vec::new(),
        }
    }
}

/// Why a study has no outcome.
#[derive(Debug, thiserror::Error)]
pub enum FilterStudyError {
    /// The filter refuses its settings.
    #[error(transparent)]
    Filter(#[from] FilterError),
    /// The image has no colour, or the page's pictures can't be made.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A pixel lies beyond the image.
    #[error("the pixel {at:?} is not in the image, which has {width}×{height}")]
    NoSuchPixel {
        /// Column and row.
        at: [usize; 2],
        /// The image's width.
        width: usize,
        /// The image's height.
        height: usize,
    },
    /// It was stopped.
    #[error("stopped before everything had been measured once")]
    Stopped,
}

/// A studied image.
#[derive(Clone, Debug)]
pub struct FilterOutcome {
    /// What was studied.
    pub study: FilterStudy,
    /// The image's name.
    pub name: String,
    /// The values that were filtered.
    pub values: Image,
    /// How they come from the file.
    pub values_are: &'static str,
    /// The exact filter's result.
    pub exact: Image,
    /// Seconds that it took: the median.
    pub exact_seconds: f64,
    /// Peak signal-to-noise ratio of the unfiltered image against the exact result, in dB.
    pub unfiltered: f64,
    /// The width of the window in pixels.
    pub window: usize,
    /// The kernels.
    pub kernels: Vec<Kernel>,
    /// One for each strategy.
    pub strategies: Vec<StrategyOutcome>,
}

/// The values of an image that is read with [`luz_image::ReadOptions::stored`], and what they are: R, G and B (or Y) as stored;
/// light that is stored as floats is encoded as sRGB, with white at what 99 % of it stays below.
///
/// # Errors
/// When the image has no colour.
pub fn values(image: &Image) -> Result<(Image, &'static str), ImageError> {
    let mut colors = match image.rgb() {
        Some([r, g, _]) if r == g => image.select(&["Y"])?,
        None if image.channel_count() == 1 => image.clone(),
        _ => image.select(&["R", "G", "B"])?,
    };
    if matches!(colors.metadata.sample_type, Some(SampleType::Unsigned(_))) {
        return Ok((colors, "values as stored, from 0 to 1"));
    }
    let mut sorted: Vec<f32> = colors.data().iter().copied().filter(|v| v.is_finite()).collect();
    let at = sorted.len().saturating_sub(1) * 99 / 100;
    let white = if sorted.is_empty() { 1.0 } else { *sorted.select_nth_unstable_by(at, f32::total_cmp).1 };
    let scale = if white > 0.0 { 1.0 / white } else { 1.0 };
    colors.data_mut().iter_mut().for_each(|v| *v = linear_to_srgb(*v * scale));
    Ok((colors, "light, scaled so that 99 % of it is below 1, and encoded as sRGB"))
}

/// Measures everything. `progress` is told how far it is, from 0 to 1, and may stop it.
///
/// # Errors
/// When settings are out of their domain, a pixel isn't in the image, or it was stopped early; with at least one seed done, a
/// stopped study has that outcome.
pub fn run(
    study: &FilterStudy,
    name: &str,
    image: &Image,
    progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<FilterOutcome, FilterStudyError> {
    let (values, values_are) = values(image)?;
    let (width, height) = (values.width(), values.height());
    if let Some(&at) = study.kernels_at.iter().find(|at| at[0] >= width || at[1] >= height) {
        return Err(FilterStudyError::NoSuchPixel { at, width, height });
    }
    let Measured { exact, exact_seconds, unfiltered, window, strategies } = measure::measure(study, &values, progress)?;
    let places = if study.kernels_at.is_empty() {
        interesting_pixels(&values, window / 2)
    } else {
        study.kernels_at.iter().map(|at| (format!("({}, {})", at[0], at[1]), *at)).collect()
    };
    let kernels = places.into_iter().map(|(name, at)| Kernel::new(study, &values, name, at)).collect();
    Ok(FilterOutcome {
        study: study.clone(),
        name: name.to_owned(),
        values,
        values_are,
        exact,
        exact_seconds,
        unfiltered,
        window,
        kernels,
        strategies,
    })
}
