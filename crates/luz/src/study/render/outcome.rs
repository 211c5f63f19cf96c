//! What a study has found.

use super::measure::{Accumulator, Errors};
use super::prepare::Prepared;
use super::reference::{Reference, ReferenceOrigin, ReferenceSummary};
use super::{Axis, Budget, Study};
use crate::study::statistics::{
    CONFIDENCE, Interval, PowerLaw, fit_power_law, mean_interval, median, ratio_interval, student_t_quantile,
};
use luz_image::Image;
use luz_render::RenderCost;
use luz_render::film::PixelBounds;
use serde::Serialize;
use std::path::PathBuf;

/// The error of a render after some passes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Checkpoint {
    /// Rounds of samples: samples per pixel, where sampling is not adaptive.
    pub rounds: u32,
    /// Samples, or mutations, per pixel, on average.
    pub samples: f64,
    /// Wall-clock seconds of rendering.
    pub seconds: f64,
    /// The errors.
    #[serde(flatten)]
    pub errors: Errors,
}

/// A variant, rendered with a seed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SeedRun {
    /// The seed.
    pub seed: u64,
    /// Rounds of samples that were done.
    pub rounds: u32,
    /// What it cost.
    pub cost: RenderCost,
    /// Its errors, at powers of two of the rounds and at the end.
    pub checkpoints: Vec<Checkpoint>,
}

/// What all runs of a variant say together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct VariantSummary {
    /// Samples per pixel of a render.
    pub samples: f64,
    /// Seconds of a render.
    pub seconds: f64,
    /// Camera paths per second.
    pub paths_per_second: f64,
    /// Rays of both kinds per second.
    pub rays_per_second: f64,
    /// Rays to the closest hit, per path.
    pub closest_rays_per_path: f64,
    /// Rays to any hit, per path.
    pub shadow_rays_per_path: f64,
    /// The mean squared error at the end.
    pub mse: Option<Interval>,
    /// The relative mean squared error at the end.
    pub rel_mse: Option<Interval>,
    /// The relative mean squared error at the end without the worst pixels, [`Errors::trimmed_rel_mse`].
    pub trimmed_rel_mse: Option<Interval>,
    /// 1 / (MSE · time) over that of the first variant; `None` where an MSE is not above zero.
    pub efficiency: Option<Interval>,
    /// 1 / (relMSE · time) over that of the first variant.
    pub rel_efficiency: Option<Interval>,
    /// 1 / (relMSE · time) without the worst pixels over that of the first variant.
    pub trimmed_rel_efficiency: Option<Interval>,
    /// The median over the seeds of MSE · time, that of the first variant over this one's: an efficiency that a seed with a single
    /// bright pixel does not decide. `None` where a median is not above zero.
    pub median_efficiency: Option<f64>,
    /// The same by the relMSE.
    pub median_rel_efficiency: Option<f64>,
    /// The exponents of the MSE and of the relMSE as powers of the samples.
    pub slopes_by_samples: [Option<Interval>; 2],
    /// The exponents of the MSE and of the relMSE as powers of the time.
    pub slopes_by_seconds: [Option<Interval>; 2],
    /// The mean of the picture over that of the reference, less one; with the reference's own uncertainty, if it is known.
    pub brightness: Option<Interval>,
    /// The part of the MSE that more samples do not lessen; scatters around zero where there is none.
    pub squared_bias: Option<Interval>,
    /// Samples that were left out because they were not finite, in all renders.
    pub dropped_samples: u64,
}

/// A variant, and what it did.
#[derive(Clone, Debug, Serialize)]
pub struct VariantOutcome {
    /// What it is called.
    pub name: String,
    /// Its value on each axis.
    pub values: Vec<String>,
    /// What all runs say together.
    pub summary: VariantSummary,
    /// One for each seed.
    pub runs: Vec<SeedRun>,
    /// Pictures, for the page.
    #[serde(skip)]
    pub(super) pictures: Pictures,
}

/// What is to be seen of a variant.
#[derive(Clone, Debug)]
pub(super) struct Pictures {
    /// The picture of the first seed.
    pub first: Vec<[f32; 3]>,
    /// Each pixel's relative error, over all seeds.
    pub relative_errors: Vec<f32>,
    /// With the channels of the techniques.
    pub techniques: Option<Image>,
}

/// Wall-clock seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Seconds {
    /// Reading the scene.
    pub read: f64,
    /// Building what light meets, for all variants.
    pub build: f64,
    /// Rendering a little to warm up, and to see how many samples fit.
    pub calibration: f64,
    /// Rendering the reference, or reading it.
    pub reference: f64,
    /// Rendering the variants.
    pub variants: f64,
    /// Rendering variants with a seed that was not done when the study was stopped.
    pub discarded: f64,
    /// Measuring their errors.
    pub measuring: f64,
    /// Rendering what each technique finds.
    pub techniques: f64,
    /// All of it.
    pub total: f64,
}

/// How it was done.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Setup {
    /// The scene.
    pub scene: PathBuf,
    /// Width and height of the frame in pixels.
    pub resolution: [u32; 2],
    /// The part of the frame that was rendered.
    pub bounds: PixelBounds,
    /// The sampler of the scene as it stands; variants may have others, and so with what follows.
    pub sampler: String,
    /// Its longest path, in scattering events.
    pub max_depth: u32,
    /// Its samples per pixel.
    pub samples_per_pixel: u32,
    /// The first seed.
    pub seed: u64,
    /// Seconds that each render may take; `None` if samples alone end it.
    pub seconds_budget: Option<f64>,
    /// Seeds that were asked for.
    pub seeds: u32,
    /// The probability that intervals cover what they estimate.
    pub confidence: f64,
    /// Threads.
    pub threads: usize,
    /// The instructions that rays were traced with, as this crate calls them.
    pub simd: String,
    /// Lights of the scene.
    pub lights: usize,
    /// Warnings about the scene.
    pub warnings: usize,
}

/// What a study has found.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// `luz`
    pub program: &'static str,
    /// Its version.
    pub version: &'static str,
    /// How it was done.
    pub setup: Setup,
    /// Was it stopped before all of it was done?
    pub interrupted: bool,
    /// What was varied.
    pub axes: Vec<Axis>,
    /// What the variants were compared with.
    pub reference: ReferenceSummary,
    /// The variants; efficiencies are relative to the first.
    pub variants: Vec<VariantOutcome>,
    /// Where the time went.
    pub seconds: Seconds,
    #[serde(skip)]
    pub(super) target: Reference,
}

impl Outcome {
    pub(super) fn new(
        study: &Study,
        prepared: &Prepared,
        reference: Reference,
        runs: Vec<Vec<SeedRun>>,
        accumulators: Vec<Accumulator>,
        technique_images: Option<Vec<Image>>,
        seconds: Seconds,
        interrupted: bool,
    ) -> Self {
        let settings = &prepared.base.settings;
        let world = prepared.base_world();
        let setup = Setup {
            scene: study.scene.clone(),
            resolution: settings.resolution,
            bounds: settings.bounds,
            sampler: settings.sampler.to_string(),
            max_depth: settings.integrator.max_depth(),
            samples_per_pixel: settings.samples_per_pixel,
            seed: settings.seed,
            seconds_budget: match study.budget {
                Budget::Samples => None,
                Budget::Seconds { seconds, .. } => Some(seconds),
            },
            seeds: study.seeds,
            confidence: CONFIDENCE,
            threads: rayon::current_num_threads(),
            simd: format!("{:?}", world.accelerator().simd()).to_lowercase(),
            lights: world.lights().len(),
            warnings: prepared.warnings,
        };
        let mut images = technique_images.into_iter().flatten();
        let first = runs.first().cloned().unwrap_or_default();
        let variants = study.variants.iter().zip(runs).zip(accumulators).map(|((variant, runs), accumulator)| {
            let summary = summarize(&runs, &first, &accumulator, &reference);
            let relative_errors = accumulator.relative_errors();
            let pictures = Pictures { first: accumulator.first, relative_errors, techniques: images.next() };
            VariantOutcome { name: variant.name.clone(), values: variant.values.clone(), summary, runs, pictures }
        });
        let variants = variants.collect();
        Self {
            program: "luz",
            version: env!("CARGO_PKG_VERSION"),
            setup,
            interrupted,
            axes: study.axes.clone(),
            reference: reference.summary(),
            variants,
            seconds,
            target: reference,
        }
    }

    /// All numbers, as JSON.
    ///
    /// # Errors
    /// None that can be expected.
    pub fn to_json(&self) -> Result<Vec<u8>, serde_json::Error> {
        let mut bytes = serde_json::to_vec_pretty(self)?;
        bytes.push(b'\n');
        Ok(bytes)
    }

    /// The reference, to be kept.
    ///
    /// # Errors
    /// If it does not fit in memory.
    pub fn reference_image(&self) -> Result<Image, luz_image::ImageError> {
        self.target.to_image()
    }

    /// Renders with different seeds that all variants have.
    pub fn seeds_done(&self) -> usize {
        self.variants.first().map_or(0, |variant| variant.runs.len())
    }

    /// Seconds of rendering variants, per render.
    pub fn seconds_per_render(&self) -> f64 {
        self.seconds.variants / (self.variants.len() * self.seeds_done()).max(1) as f64
    }
}

/// Which of both errors.
pub(super) type Measure = fn(&Errors) -> f64;

/// MSE and relMSE.
pub(super) const MEASURES: [(&str, Measure); 2] = [("MSE", |e| e.mse), ("relMSE", |e| e.rel_mse)];

/// relMSE without the worst pixels.
const TRIMMED_REL_MSE: Measure = |e| e.trimmed_rel_mse;

fn summarize(runs: &[SeedRun], first: &[SeedRun], accumulator: &Accumulator, reference: &Reference) -> VariantSummary {
    let count = runs.len().max(1) as f64;
    let total = |f: &dyn Fn(&RenderCost) -> f64| runs.iter().map(|run| f(&run.cost)).sum::<f64>();
    let (seconds, paths) = (total(&|c| c.seconds), total(&|c| c.paths as f64));
    let (closest, shadow) = (total(&|c| c.rays as f64), total(&|c| c.shadow_rays as f64));
    let per = |amount: f64, of: f64| if of > 0.0 { amount / of } else { 0.0 };
    let last = |run: &SeedRun, measure: Measure| run.checkpoints.last().map_or(f64::NAN, |c| measure(&c.errors));
    let at_end = |measure: Measure| mean_interval(&runs.iter().map(|run| last(run, measure)).collect::<Vec<_>>());
    let costs = |runs: &[SeedRun], measure: Measure| {
        runs.iter().map(|run| last(run, measure) * run.cost.seconds).collect::<Vec<_>>()
    };
    let efficiency = |measure: Measure| ratio_interval(&costs(first, measure), &costs(runs, measure));
    let median_efficiency = |measure: Measure| {
        let [a, b] = [first, runs].map(|runs| median(&costs(runs, measure)).filter(|m| *m > 0.0 && m.is_finite()));
        Some(a? / b?)
    };
    let slopes = |x: fn(&Checkpoint) -> f64| MEASURES.map(|(_, measure)| slope(runs, x, measure));
    VariantSummary {
        samples: runs.iter().filter_map(|run| run.checkpoints.last()).map(|c| c.samples).sum::<f64>() / count,
        seconds: seconds / count,
        paths_per_second: per(paths, seconds),
        rays_per_second: per(closest + shadow, seconds),
        closest_rays_per_path: per(closest, paths),
        shadow_rays_per_path: per(shadow, paths),
        mse: at_end(MEASURES[0].1),
        rel_mse: at_end(MEASURES[1].1),
        trimmed_rel_mse: at_end(TRIMMED_REL_MSE),
        efficiency: efficiency(MEASURES[0].1),
        rel_efficiency: efficiency(MEASURES[1].1),
        trimmed_rel_efficiency: efficiency(TRIMMED_REL_MSE),
        median_efficiency: median_efficiency(MEASURES[0].1),
        median_rel_efficiency: median_efficiency(MEASURES[1].1),
        slopes_by_samples: slopes(|c| c.samples),
        slopes_by_seconds: slopes(|c| c.seconds),
        brightness: brightness(&accumulator.means, reference),
        squared_bias: accumulator.squared_bias(reference),
        dropped_samples: accumulator.dropped,
    }
}

/// The power law of each seed's errors.
pub(super) fn power_laws(runs: &[SeedRun], x: fn(&Checkpoint) -> f64, measure: Measure) -> Vec<PowerLaw> {
    let points = |run: &SeedRun| run.checkpoints.iter().map(|c| [x(c), measure(&c.errors)]).collect::<Vec<_>>();
    runs.iter().filter_map(|run| fit_power_law(&points(run))).collect()
}

/// The mean of the slopes of the seeds, with Student's interval; points of one seed share their samples and are no independent
/// repetitions, seeds are.
fn slope(runs: &[SeedRun], x: fn(&Checkpoint) -> f64, measure: Measure) -> Option<Interval> {
    mean_interval(&power_laws(runs, x, measure).iter().map(|law| law.slope).collect::<Vec<_>>())
}

/// The pictures' mean over the reference's, less one.
fn brightness(means: &[f64], reference: &Reference) -> Option<Interval> {
    let target = reference.whole_mean();
    let interval = mean_interval(means).filter(|_| target > 0.0)?;
    let summary = reference.summary();
    let quantile = match summary.origin {
        ReferenceOrigin::Rendered { parts, .. } => {
            student_t_quantile(0.5 + 0.5 * CONFIDENCE, f64::from(parts.max(2) - 1))
        }
        ReferenceOrigin::File { .. } => student_t_quantile(0.5 + 0.5 * CONFIDENCE, 1e6),
    };
    let half = (interval.high - interval.value).hypot(quantile * summary.mean_error.unwrap_or(0.0)) / target;
    let value = interval.value / target - 1.0;
    Some(Interval { value, low: value - half, high: value + half })
}

/// A point of the curve of the mean error over the seeds.
pub(super) struct CurvePoint {
    /// Samples per pixel.
    pub samples: f64,
    /// Seconds of rendering.
    pub seconds: f64,
    /// The mean error with its interval.
    pub error: Interval,
}

/// The mean error over the seeds at the checkpoints that all of them have, and at the end, where each has as many samples as fitted.
pub(super) fn curve(runs: &[SeedRun], measure: Measure) -> Vec<CurvePoint> {
    let Some(first) = runs.first() else { return Vec::new() };
    let at = |rounds: u32| -> Option<Vec<&Checkpoint>> {
        runs.iter().map(|run| run.checkpoints.iter().find(|c| c.rounds == rounds)).collect()
    };
    let mut groups: Vec<Vec<&Checkpoint>> = first.checkpoints.iter().filter_map(|c| at(c.rounds)).collect();
    if let Some(ends) = runs.iter().map(|run| run.checkpoints.last()).collect::<Option<Vec<_>>>() {
        let samples = |group: &[&Checkpoint]| group.iter().map(|c| c.samples).sum::<f64>();
        // The end takes the place of those that it is hardly further than.
        while groups.last().is_some_and(|last| samples(&ends) < 1.15 * samples(last)) {
            groups.pop();
        }
        groups.push(ends);
    }
    let point = |group: Vec<&Checkpoint>| {
        let mean = |f: fn(&Checkpoint) -> f64| group.iter().map(|c| f(c)).sum::<f64>() / group.len() as f64;
        let error = mean_interval(&group.iter().map(|c| measure(&c.errors)).collect::<Vec<_>>())?;
        Some(CurvePoint { samples: mean(|c| c.samples), seconds: mean(|c| c.seconds), error })
    };
    groups.into_iter().filter_map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(seed: u64, points: &[(u32, f64)]) -> SeedRun {
        let checkpoint = |&(rounds, mse): &(u32, f64)| Checkpoint {
            rounds,
            samples: f64::from(rounds),
            seconds: 0.1 * f64::from(rounds),
            errors: Errors { mse, rel_mse: 2.0 * mse, trimmed_rel_mse: mse },
        };
        let checkpoints: Vec<Checkpoint> = points.iter().map(checkpoint).collect();
        let rounds = points.last().map_or(0, |p| p.0);
        let cost = RenderCost { paths: u64::from(rounds), rays: 0, shadow_rays: 0, seconds: 0.1 * f64::from(rounds) };
        SeedRun { seed, rounds, cost, checkpoints }
    }

    #[test]
    fn curves_have_the_points_of_all_seeds_and_the_end() {
        let runs = [run(0, &[(1, 8.0), (2, 4.0), (4, 2.0), (7, 1.0)]), run(1, &[(1, 6.0), (2, 3.0), (3, 2.5)])];
        let points = curve(&runs, |e| e.mse);
        let samples: Vec<f64> = points.iter().map(|p| p.samples).collect();
        assert_eq!(samples, [1.0, 2.0, 5.0]);
        assert_eq!(points[0].error.value, 7.0);
        assert_eq!(points[2].error.value, 1.75);
        assert!(points[0].error.is_bounded() && points[0].error.covers(7.0));
        let near = [run(0, &[(1, 8.0), (16, 4.0), (17, 4.0)])];
        assert_eq!(curve(&near, |e| e.rel_mse).len(), 2);
        assert!(curve(&[], |e| e.mse).is_empty());
    }

    #[test]
    fn slopes_come_from_the_scatter_between_seeds() {
        let law = |slope: f64| (0..6).map(|i| (1 << i, 3.0 * 2f64.powi(i).powf(slope))).collect::<Vec<_>>();
        let runs = [run(0, &law(-1.0)), run(1, &law(-1.1)), run(2, &law(-1.2))];
        let interval = slope(&runs, |c| c.samples, |e| e.mse).unwrap();
        assert!((interval.value + 1.1).abs() < 1e-9);
        // t of two degrees of freedom, 4.303, times 0.1 / √3.
        assert!((interval.high - interval.value - 4.302_652_7 * 0.1 / 3f64.sqrt()).abs() < 1e-6);
        assert!(slope(&[run(0, &[(1, 2.0)])], |c| c.samples, |e| e.mse).is_none());
    }
}
