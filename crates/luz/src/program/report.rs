//! What a render was, cost, and is worth, as JSON.

use super::values::{film_name, sampler_name};
use luz::Scene;
use luz::render::film::{Film, PixelBounds};
use luz::render::integrator::metropolis::Metropolis;
use luz::render::world::WorldStatistics;
use luz::render::{ChainReport, Incident, RenderCost, Renderer};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Why a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stopped {
    /// All samples are done.
    Finished,
    /// The time is over.
    Time,
    /// The error is small enough.
    Error,
    /// Ctrl-C.
    Interrupted,
}

/// What a render was, cost, and is worth.
#[derive(Debug, Serialize)]
pub struct Report<'a> {
    pub program: &'static str,
    pub version: &'static str,
    pub scene: &'a Path,
    pub stopped: Stopped,
    pub settings: SettingsReport,
    /// Per pixel: those done; with adaptive sampling, of the pixels that have got most.
    pub samples: u32,
    /// Per pixel, on average.
    pub mean_samples: f64,
    pub seconds: Seconds,
    pub paths: u64,
    pub paths_per_second: f64,
    /// Those that ask for the closest hit, and those that ask for any.
    pub rays: u64,
    pub closest_hit_rays: u64,
    pub shadow_rays: u64,
    pub rays_per_second: f64,
    /// Samples that were left out.
    pub dropped_samples: DroppedSamples,
    /// What became of the Markov chains; null without any.
    pub chains: Option<ChainReport>,
    /// The mean over pixels of their relative standard errors, the worst hundredth left out; null if unknown.
    pub typical_error: Option<f64>,
    /// √(Σ variance / Σ mean²) over pixels and channels; null if unknown.
    pub relative_error: Option<f64>,
    /// Over all pixels.
    pub mean_rgb: [f64; 3],
    /// Of `mean_rgb`, if pixels were independent; null if unknown.
    pub mean_rgb_standard_error: Option<[f64; 3]>,
    pub threads: usize,
    /// The instructions that rays were traced with.
    pub simd: &'static str,
    /// The most memory that the process held, where the system says.
    pub peak_memory_bytes: Option<u64>,
    pub world: &'a WorldStatistics,
    pub warnings: usize,
    pub outputs: &'a [PathBuf],
}

/// How it was rendered.
#[derive(Debug, Serialize)]
pub struct SettingsReport {
    pub resolution: [u32; 2],
    pub bounds: PixelBounds,
    pub film: &'static str,
    pub filter: String,
    pub integrator: &'static str,
    pub max_depth: u32,
    /// Which techniques look for direct light, and how they are combined; null but for path tracing.
    pub technique: Option<String>,
    pub mis: Option<String>,
    pub roulette: Option<String>,
    /// The settings of the chains, as options; null without chains.
    pub metropolis: Option<MetropolisReport>,
    /// The relative error at which a pixel has samples enough.
    pub adaptive: Option<f64>,
    pub sampler: &'static str,
    pub samples_per_pixel: u32,
    /// The most that a pixel gets, if something else says when it is enough.
    pub sample_limit: u32,
    pub seed: u64,
    /// Were coats weighed as in pbrt-v4?
    pub pbrt_coats: bool,
}

/// What chains of every kind have in common.
#[derive(Debug, Serialize)]
pub struct MetropolisReport {
    pub chains: u64,
    pub bootstrap_samples: u64,
    pub batches: u32,
    pub direct_light: String,
    pub two_stage: bool,
}

impl MetropolisReport {
    fn new(settings: &Metropolis) -> Self {
        let Metropolis { chains, bootstrap_samples, batches, direct_light, two_stage } = *settings;
        Self { chains, bootstrap_samples, batches, direct_light: direct_light.to_string(), two_stage }
    }
}

/// Wall-clock seconds.
#[derive(Debug, Serialize)]
pub struct Seconds {
    pub load: f64,
    pub build: f64,
    pub render: f64,
}

/// Samples that were left out, by the reason.
#[derive(Debug, Serialize)]
pub struct DroppedSamples {
    /// Their radiance was infinite or not a number.
    pub not_finite: u64,
    /// The program failed in them.
    pub panics: u64,
    /// The first of them, by pixel, half of the pixel and sample: `luz trace` follows them.
    pub first: Vec<Incident>,
}

impl<'a> Report<'a> {
    /// The report of a render.
    pub fn new(
        (path, pbrt_coats): (&'a Path, bool),
        scene: &'a Scene,
        renderer: &Renderer<'_>,
        stopped: Stopped,
        outputs: &'a [PathBuf],
    ) -> Self {
        let RenderCost { paths, rays, shadow_rays, seconds } = *renderer.cost();
        let film = renderer.film();
        let settings = &scene.settings;
        let path_tracing = settings.integrator.path();
        let (mean_rgb, standard_error) = mean_with_error(film);
        let per_second = |count: f64| if seconds > 0.0 { count / seconds } else { 0.0 };
        Self {
            program: "luz",
            version: env!("CARGO_PKG_VERSION"),
            scene: path,
            stopped,
            settings: SettingsReport {
                resolution: settings.resolution,
                bounds: settings.bounds,
                film: film_name(settings.film),
                filter: format!("{:?}, radius {:?}", settings.filter.kind(), settings.filter.radius().to_array()),
                integrator: settings.integrator.kind().name(),
                max_depth: settings.integrator.max_depth(),
                technique: path_tracing.map(|path| path.technique.to_string()),
                mis: path_tracing.map(|path| path.heuristic.to_string()),
                roulette: path_tracing.map(|path| path.roulette.to_string()),
                metropolis: settings.integrator.metropolis().map(MetropolisReport::new),
                adaptive: settings.adaptive,
                sampler: sampler_name(settings.sampler),
                samples_per_pixel: settings.samples_per_pixel,
                sample_limit: settings.sample_limit,
                seed: settings.seed,
                pbrt_coats,
            },
            samples: renderer.samples_done(),
            mean_samples: film.samples() as f64 / film.estimates().len().max(1) as f64,
            seconds: Seconds { load: scene.times.read, build: scene.times.build, render: seconds },
            paths,
            paths_per_second: per_second(paths as f64),
            rays: rays + shadow_rays,
            closest_hit_rays: rays,
            shadow_rays,
            rays_per_second: renderer.cost().rays_per_second(),
            dropped_samples: DroppedSamples {
                not_finite: renderer.incidents().not_finite,
                panics: renderer.incidents().panics,
                first: renderer.incidents().first.clone(),
            },
            chains: renderer.chains(),
            typical_error: Some(film.typical_error()).filter(|e| e.is_finite()),
            relative_error: Some(film.relative_error()).filter(|e| e.is_finite()),
            mean_rgb,
            mean_rgb_standard_error: Some(standard_error).filter(|e| e.iter().all(|v| v.is_finite())),
            threads: rayon::current_num_threads(),
            simd: scene.world.accelerator().simd().name(),
            peak_memory_bytes: peak_memory(),
            world: scene.world.statistics(),
            warnings: scene.diagnostics.warning_count(),
            outputs,
        }
    }

    /// The report as text.
    pub fn to_json(&self) -> Result<Vec<u8>, serde_json::Error> {
        let mut bytes = serde_json::to_vec_pretty(self)?;
        bytes.push(b'\n');
        Ok(bytes)
    }
}

/// The mean over all pixels, and its standard error if they are independent.
fn mean_with_error(film: &Film) -> ([f64; 3], [f64; 3]) {
    let (mut sum, mut variance) = ([0.0; 3], [0.0; 3]);
    for pixel in film.estimates().filter(|pixel| pixel.count > 0) {
        for channel in 0..3 {
            sum[channel] += pixel.mean[channel];
            variance[channel] += pixel.variance[channel];
        }
    }
    let count = film.estimates().filter(|pixel| pixel.count > 0).count().max(1) as f64;
    (sum.map(|s| s / count), variance.map(|v| v.sqrt() / count))
}

/// The most memory that this process has held, in bytes; `None` where the system does not say.
pub fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}
