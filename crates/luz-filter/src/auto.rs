//! Which method reaches a quality soonest, by trying on some of the image's pixels.

use luz_sample::random::{hash, unit_f64};

use crate::pattern::{self, PHASES, Pattern};
use crate::plan::{Frame, Plan};
use crate::tile::{Area, Layout};
use crate::worker::{Compiled, Worker};
use crate::{Density, FilterError, Method, Precision, SampleCount, Sampling, Strategy, cosines};

/// What was chosen.
pub(crate) struct Choice {
    pub method: Method,
    /// In dB, as measured on the pixels that were tried; none for methods that needn't be.
    pub quality: Option<f64>,
}

/// Runs of pixels that are tried.
const RUNS: usize = 192;
/// The width of a run in pixels, of which each phase has as many as fit in a vector.
const RUN: usize = 64;
/// How many standard errors the mean squared error may be worse than measured.
const CAUTION: f64 = 3.0;
/// The time for a neighbour of the exact filter relative to one of the sampled filter.
const EXACT_COST: f64 = 1.5;

/// Chooses a method for a quality in dB.
///
/// Errors of sampled filters at runs of pixels all over the image are measured against the exact filter (or, where that
/// takes long, against many samples), for more and more samples until the quality is reached. The number that just reaches
/// it is interpolated: the logarithm of the error is nearly linear in that of the number.
pub(crate) fn choose(plan: &Plan<'_>, window: &[Option<Frame<'_>>], quality: f64) -> Result<Choice, FilterError> {
    let all = plan.window.pixels();
    let image = plan.frame.image;
    if image.width() < PHASES || all < 64 || image.width() * image.height() < RUNS * RUN {
        return Ok(Choice { method: Method::Exact, quality: None });
    }
    let precision = match quality {
        q if q <= 54.0 => Precision::Half,
        q if q <= 57.0 => Precision::Fast,
        q if q <= 75.0 => Precision::Fine,
        _ => Precision::Full,
    };
    let mut plan = plan.clone();
    plan.lay_out(precision)?;
    let target = 10f64.powf(-quality / 10.0);
    let areas = areas(&plan);
    let sampling = |count: f64| Sampling {
        strategy: Strategy::Vogel,
        samples: SampleCount::Count(count.ceil() as u32),
        density: Density::Gaussian,
        regression: false,
        precision,
    };
    let trial = |count: f64, reference: &Reference| {
        let patterns = pattern::sampled(&plan.window, &sampling(count), plan.filter.seed);
        let results = results(&plan, window, &areas, &patterns)?;
        Ok::<_, FilterError>(error(&results, &reference.results))
    };
    let cosines = if window.len() == 1 { cosines::cost(&plan, quality) } else { None };
    let most = cosines.unwrap_or(f64::INFINITY).min(all as f64 * EXACT_COST);
    let otherwise = || match cosines {
        Some(cost) if cost <= all as f64 * EXACT_COST => Choice { method: Method::Cosines { quality }, quality: None },
        _ => Choice { method: Method::Exact, quality: None },
    };
    let mut reference = Reference { neighbours: 0, results: Vec::new() };
    let mut before: Option<(f64, f64)> = None;
    let mut count = (0.5 * f64::from(2 * plan.window.radius as u32 + 1)).max(12.0);
    loop {
        // Half the last count has failed.
        if 0.5 * count > most || count > all as f64 {
            return Ok(otherwise());
        }
        // The reference's own error adds to that which is measured: 6 times as many samples have a tenth of it.
        reference.refine(&plan, window, &areas, (6.0 * count) as usize)?;
        let (mse, bound) = trial(count, &reference)?;
        if bound <= target {
            let fewest = match before {
                Some((fewer, worse)) => {
                    let slope = (bound / worse).ln() / (count / fewer).ln();
                    (fewer.ln() + (target / worse).ln() / slope).exp().clamp(fewer, count)
                }
                None => count,
            };
            if fewest > most {
                return Ok(otherwise());
            }
            // The number is tried, too: errors are not quite a smooth function of it.
            let mut chosen = fewest;
            let mut quality = mse;
            while chosen < count {
                let (mse, bound) = trial(chosen, &reference)?;
                if bound <= target {
                    quality = mse;
                    break;
                }
                chosen = (chosen * 1.1).min(count);
            }
            let method = Method::Sampled(sampling(chosen));
            return Ok(Choice { method, quality: Some(-10.0 * quality.log10()) });
        }
        // Errors fall with about the power −1.2 of the number.
        if count * (bound / target).powf(1.0 / 1.2) > 1.5 * most {
            return Ok(otherwise());
        }
        before = Some((count, bound));
        count *= 2.0;
    }
}

/// Runs of pixels, jittered over the image.
fn areas(plan: &Plan<'_>) -> Vec<Area> {
    let (width, height) = (plan.frame.image.width(), plan.frame.image.height());
    let run = RUN.min(width / PHASES * PHASES);
    let aspect = width as f64 / height as f64;
    let across = ((RUNS as f64 * aspect).sqrt().round() as usize).clamp(1, RUNS);
    let down = RUNS.div_ceil(across);
    let mut areas = Vec::with_capacity(across * down);
    for i in 0..across * down {
        let random = |d: u32| unit_f64(hash(0x7069_6c6f, plan.filter.seed, i as u64, d));
        let x = ((i % across) as f64 + random(0)) / across as f64 * (width - run) as f64;
        let y = ((i / across) as f64 + random(1)) / down as f64 * height as f64;
        let x = (x as usize / PHASES * PHASES).min(width - run);
        areas.push(Area { x, y: (y as usize).min(height - 1), width: run, height: 1 });
    }
    areas
}

/// What the sampled filters are compared with.
struct Reference {
    /// How many neighbours; 0 for nothing yet.
    neighbours: usize,
    results: Vec<Vec<f32>>,
}

impl Reference {
    /// Makes the reference one of at least `neighbours` samples, or of all.
    fn refine(
        &mut self,
        plan: &Plan<'_>,
        window: &[Option<Frame<'_>>],
        areas: &[Area],
        neighbours: usize,
    ) -> Result<(), FilterError> {
        if self.neighbours >= neighbours {
            return Ok(());
        }
        let all = plan.window.pixels();
        let mut exact = plan.clone();
        exact.lay_out(Precision::Full)?;
        let wanted = neighbours.next_power_of_two().max(4096);
        let patterns = if wanted * 3 > all {
            self.neighbours = usize::MAX;
            vec![pattern::window(&plan.window)]
        } else {
            self.neighbours = wanted;
            let sampling = Sampling {
                samples: SampleCount::Count(wanted as u32),
                strategy: Strategy::Vogel,
                density: Density::Gaussian,
                regression: false,
                precision: Precision::Full,
            };
            // Of another seed, so that the two are independent.
            pattern::sampled(&plan.window, &sampling, !plan.filter.seed)
        };
        self.results = results(&exact, window, areas, &patterns)?;
        Ok(())
    }
}

/// Filters some areas.
fn results(
    plan: &Plan<'_>,
    window: &[Option<Frame<'_>>],
    areas: &[Area],
    patterns: &[Pattern],
) -> Result<Vec<Vec<f32>>, FilterError> {
    use rayon::prelude::*;
    let phases = patterns.len().isqrt();
    let width = areas.iter().map(|a| a.width).max().unwrap_or(PHASES);
    let layout = Layout::new(plan, phases, width, 1).ok_or_else(|| plan.too_large())?;
    let frames = plan.existing(window);
    // Areas have one row; each uses another row of patterns.
    let compiled: Vec<Vec<Compiled>> = (0..phases)
        .map(|shift| {
            (0..phases * phases)
                .map(|i| {
                    let pattern = &patterns[(i + shift * phases) % (phases * phases)];
                    Compiled::new(&pattern.within_frames(&frames), &layout, [i % phases, i / phases], plan.precision)
                })
                .collect()
        })
        .collect();
    let numbered: Vec<(usize, Area)> = areas.iter().copied().enumerate().collect();
    let parts: Vec<Vec<Vec<f32>>> = numbered
        .par_chunks(areas.len().div_ceil(4).max(1))
        .map(|part| {
            part.iter()
                .map(|(i, area)| {
                    let mut worker = Worker::new(plan, layout, &compiled[i % phases]);
                    worker.load(window, &frames, area);
                    let mut result = vec![0.0; area.width * plan.values.1];
                    worker.filter(area, &mut [&mut result]);
                    result
                })
                .collect()
        })
        .collect();
    Ok(parts.into_iter().flatten().collect())
}

/// The mean squared error, and what it is unlikely to exceed.
fn error(results: &[Vec<f32>], reference: &[Vec<f32>]) -> (f64, f64) {
    let errors: luz_sample::statistics::Running = results
        .iter()
        .zip(reference)
        .map(|(a, b)| {
            let squares = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).filter(|e| e.is_finite());
            squares.sum::<f64>() / a.len().max(1) as f64
        })
        .collect();
    (errors.mean(), errors.mean() + CAUTION * errors.standard_error())
}
