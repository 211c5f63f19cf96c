//! Errors and times of every strategy.

use super::{FilterStudy, FilterStudyError};
use luz_filter::{BilateralFilter, Filtered, Method, SampleCount, Sampling, Strategy};
use luz_image::Image;
use std::ops::ControlFlow;

/// One strategy with one number of samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// The number of samples as a multiple of the window's width.
    pub multiple: f32,
    /// Neighbours per pixel.
    pub samples: f64,
    /// Peak signal-to-noise ratio in dB against the exact filter, with a peak of 1, for each seed.
    pub quality: Vec<f64>,
    /// Seconds, for each seed.
    pub seconds: Vec<f64>,
}

/// What a strategy does.
#[derive(Clone, Debug)]
pub struct StrategyOutcome {
    /// Which.
    pub strategy: Strategy,
    /// For each number of samples.
    pub cells: Vec<Cell>,
    /// The result of the first seed, for the number of samples that is shown.
    pub picture: Option<Image>,
}

/// All that is measured.
#[derive(Debug)]
pub struct Measured {
    /// The exact result.
    pub exact: Image,
    /// Seconds that it took: the median.
    pub exact_seconds: f64,
    /// The unfiltered image against the exact result, in dB.
    pub unfiltered: f64,
    /// The window's width in pixels.
    pub window: usize,
    /// One for each strategy.
    pub strategies: Vec<StrategyOutcome>,
}

/// Which number of samples has its pictures shown: those nearest to one window's width.
pub(super) fn shown(samples: &[f32]) -> usize {
    let distance = |i: &usize| (samples[*i].ln().abs() * 1e6) as u64;
    (0..samples.len()).min_by_key(distance).unwrap_or(0)
}

/// Repeats everything with every seed, strategies taking turns, so that a noisy machine disturbs all of them alike.
pub(super) fn measure(
    study: &FilterStudy,
    values: &Image,
    progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Measured, FilterStudyError> {
    let exact_filter = BilateralFilter::new(study.sigma_spatial, study.sigma_range);
    let Filtered { image: exact, report } = exact_filter.apply(values, &[])?;
    let mut exact_seconds = vec![report.seconds];
    let shown = shown(&study.samples);
    let empty = |&strategy: &Strategy| StrategyOutcome {
        strategy,
        cells: study
            .samples
            .iter()
            .map(|&multiple| Cell { multiple, samples: 0.0, quality: Vec::new(), seconds: Vec::new() })
            .collect(),
        picture: None,
    };
    let mut strategies: Vec<StrategyOutcome> = study.strategies.iter().map(empty).collect();
    // Point sets are made at the first use; that is not what is timed.
    let total = (study.seeds as usize * study.samples.len() * strategies.len()).max(1) as f64;
    let mut done = 0;
    'seeds: for seed in 0..study.seeds {
        let mut round: Vec<Vec<(f64, f64, f64)>> = vec![Vec::new(); strategies.len()];
        for (index, &multiple) in study.samples.iter().enumerate() {
            for (strategy, round) in strategies.iter_mut().zip(&mut round) {
                let sampling = Sampling {
                    strategy: strategy.strategy,
                    samples: SampleCount::Windows(multiple),
                    ..Sampling::default()
                };
                let filter =
                    BilateralFilter { method: Method::Sampled(sampling), seed: u64::from(seed), ..exact_filter };
                let Filtered { image, report } = filter.apply(values, &[])?;
                round.push((report.samples_per_pixel, quality(&image, &exact), report.seconds));
                if seed == 0 && index == shown {
                    strategy.picture = Some(image);
                }
                done += 1;
                if progress(f64::from(done) / total).is_break() {
                    if seed == 0 {
                        return Err(FilterStudyError::Stopped);
                    }
                    // Seeds that aren't complete would favour some strategies.
                    break 'seeds;
                }
            }
        }
        for (strategy, round) in strategies.iter_mut().zip(round) {
            for (cell, (samples, quality, seconds)) in strategy.cells.iter_mut().zip(round) {
                cell.samples = samples;
                cell.quality.push(quality);
                cell.seconds.push(seconds);
            }
        }
        if seed < 2 {
            exact_seconds.push(exact_filter.apply(values, &[])?.report.seconds);
        }
    }
    exact_seconds.sort_unstable_by(f64::total_cmp);
    Ok(Measured {
        unfiltered: quality(values, &exact),
        exact_seconds: exact_seconds[exact_seconds.len() / 2],
        window: exact_filter.radius() * 2 + 1,
        exact,
        strategies,
    })
}

/// Peak signal-to-noise ratio in dB with a peak of 1, over all finite samples.
pub(super) fn quality(a: &Image, b: &Image) -> f64 {
    let (mut sum, mut count) = (0.0, 0u64);
    for (a, b) in a.data().iter().zip(b.data()) {
        let square = f64::from(a - b).powi(2);
        if square.is_finite() {
            sum += square;
            count += 1;
        }
    }
    // Equal images have no finite ratio; 200 dB are more than floats can hold.
    if sum > 0.0 { (-10.0 * (sum / count as f64).log10()).min(200.0) } else { 200.0 }
}
