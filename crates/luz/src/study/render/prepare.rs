//! The scene as every variant wants it.

use super::schedule::Job;
use super::{Budget, Monitor, Progress, Study, StudyError, Work};
use crate::OpenTimes;
use luz_image::Image;
use luz_render::camera::Camera;
use luz_render::world::{self, Loaded, World};
use luz_render::{Overrides, Renderer, Settings};
use luz_scene::{Description, Diagnostics, SceneErrors};
use std::time::Instant;

/// How long a variant is tried before it is timed, at least, in seconds, if one round does not take longer: so that the first passes
/// are not those that meet cold caches, and for an estimate of how many samples fit into a time.
const TRIAL: f64 = 0.25;
/// Samples per pixel that a trial ends with at the latest.
const TRIAL_SAMPLES: u32 = 4096;
/// Samples that a scene cannot have.
const MOST_SAMPLES: f64 = 1e9;

/// A scene as one variant wants it.
#[derive(Debug)]
pub(super) struct Entry {
    world: usize,
    pub camera: Camera,
    pub settings: Settings,
    /// Samples per pixel that a render of the study is expected to have.
    expected: u32,
}

/// A scene as all variants want it. Worlds are shared as far as possible.
#[derive(Debug)]
pub(super) struct Prepared {
    worlds: Vec<World>,
    /// Without any axis.
    pub base: Entry,
    pub variants: Vec<Entry>,
    pub times: OpenTimes,
    pub warnings: usize,
}

impl Prepared {
    /// Opens the scene.
    pub fn open(study: &Study, monitor: &mut dyn Monitor) -> Result<Self, StudyError> {
        let start = Instant::now();
        let refuse = |errors, variant| StudyError::Scene { errors, variant };
        let (description, mut diagnostics) = luz_scene::read(&study.scene).map_err(|errors| refuse(errors, None))?;
        let read = start.elapsed().as_secs_f64();
        let building = Instant::now();
        let build = |overrides: &Overrides, diagnostics: &mut Diagnostics| {
            let overrides = Overrides { technique_images: false, ..overrides.clone() };
            world::build(&description, &overrides, study.simd, diagnostics)
        };
        let Some(base) = build(&study.base, &mut diagnostics) else {
            return Err(refuse(errors(diagnostics, description), None));
        };
        let entry = |world, camera, settings: Settings| {
            let expected = settings.sample_limit;
            Entry { world, camera, settings, expected }
        };
        let mut keys = vec![""];
        let mut worlds = vec![base.world];
        let base = entry(0, base.camera, base.settings);
        let mut variants = Vec::with_capacity(study.variants.len());
        for variant in &study.variants {
            let mut found = Diagnostics::default();
            let Some(Loaded { world, camera, settings }) = build(&variant.overrides, &mut found) else {
                return Err(refuse(errors(found, description), Some(variant.name.clone())));
            };
            let index = keys.iter().position(|key| *key == variant.world).unwrap_or_else(|| {
                keys.push(&variant.world);
                worlds.push(world);
                worlds.len() - 1
            });
            variants.push(entry(index, camera, settings));
        }
        monitor.opened(&diagnostics, &description.sources);
        let times = OpenTimes { read, build: building.elapsed().as_secs_f64() };
        Ok(Self { worlds, base, variants, times, warnings: diagnostics.warning_count() })
    }

    pub fn world(&self, entry: &Entry) -> &World {
        &self.worlds[entry.world]
    }

    /// The world of the scene as it stands.
    pub fn base_world(&self) -> &World {
        self.world(&self.base)
    }

    /// The most samples per pixel that a render is expected to have.
    pub fn longest(&self) -> u32 {
        self.variants.iter().map(|entry| entry.expected).max().unwrap_or(1)
    }

    /// Renders every variant a little, and sets the samples that fit into a budget of time.
    ///
    /// Samplers want to know for how many samples to lay out their points; the clock ends a render.
    pub fn calibrate(&mut self, budget: Budget) {
        let per_sample: Vec<f64> = self.variants.iter().map(|entry| self.seconds_per_sample(entry, budget)).collect();
        let Budget::Seconds { seconds, at_most_samples } = budget else { return };
        for (entry, per_sample) in self.variants.iter_mut().zip(per_sample) {
            let settings = &mut entry.settings;
            let fitting = (seconds / per_sample.max(1e-12)).round().clamp(1.0, MOST_SAMPLES);
            let limit = if at_most_samples { settings.sample_limit } else { u32::MAX };
            entry.expected = (fitting as u32).min(limit);
            settings.samples_per_pixel = entry.expected;
            // Adaptive sampling deals out a number of samples and not a time.
            settings.sample_limit = if settings.adaptive.is_some() { entry.expected } else { limit };
        }
    }

    fn seconds_per_sample(&self, entry: &Entry, budget: Budget) -> f64 {
        let trial = match budget {
            // One pass, to warm up.
            Budget::Samples => 0.0,
            Budget::Seconds { seconds, .. } => TRIAL.min(0.2 * seconds),
        };
        let settings = Settings { sample_limit: TRIAL_SAMPLES, adaptive: None, ..entry.settings.clone() };
        let mut renderer = Renderer::new(self.world(entry), &entry.camera, &settings);
        let pixels = settings.bounds.area() as f64;
        // The fastest pass: what else the machine does makes others slower.
        let mut fastest = f64::INFINITY;
        let mut passes = 0;
        while passes == 0 || (renderer.cost().seconds < trial && !renderer.is_finished()) {
            let before = *renderer.cost();
            renderer.pass(renderer.next_pass().min(64));
            let cost = renderer.cost();
            let samples = (cost.paths - before.paths) as f64 / pixels;
            fastest = fastest.min((cost.seconds - before.seconds) / samples.max(f64::MIN_POSITIVE));
            passes += 1;
        }
        fastest
    }

    /// The settings of all variants with a seed: seeds count up from that of the scene.
    pub fn settings_of_seed(&self, seed: u32) -> Vec<Settings> {
        let with_seed = |entry: &Entry| {
            let settings = entry.settings.clone();
            Settings { seed: settings.seed.wrapping_add(u64::from(seed)), ..settings }
        };
        self.variants.iter().map(with_seed).collect()
    }

    /// A render of each variant, of which no pass is done.
    pub fn jobs<'a>(&'a self, settings: &'a [Settings]) -> Vec<Job<'a>> {
        let entries = self.variants.iter().zip(settings);
        entries.map(|(entry, settings)| Job::new(Renderer::new(self.world(entry), &entry.camera, settings))).collect()
    }

    /// Pictures of what each technique finds, of the first seed again, with as many rounds of samples as each variant had; `None` if
    /// it was stopped.
    pub fn technique_images(
        &self,
        study: &Study,
        rounds: &[u32],
        monitor: &mut dyn Monitor,
        work: &mut Work,
    ) -> Option<Vec<Image>> {
        let mut images = Vec::with_capacity(self.variants.len());
        for ((entry, variant), &rounds) in self.variants.iter().zip(&study.variants).zip(rounds) {
            let settings = Settings { technique_images: true, ..entry.settings.clone() };
            // What has no such techniques stays black.
            let rounds = if settings.integrator.path().is_some() { rounds } else { 0 };
            let mut renderer = Renderer::new(self.world(entry), &entry.camera, &settings);
            let mut done = 0;
            while done < rounds && !renderer.is_finished() {
                let pass = renderer.next_pass().min(rounds - done);
                renderer.pass(pass);
                done += pass;
                if monitor.is_stopped() {
                    return None;
                }
                let share = f64::from(done) / f64::from(rounds);
                let doing = format!("techniques of {}", variant.name);
                monitor.progress(&Progress { doing, done: work.share(share) });
            }
            work.done += 1.0;
            // A picture that does not fit in memory is not worth losing the study.
            images.push(renderer.film().to_image().ok()?);
        }
        Some(images)
    }
}

fn errors(diagnostics: Diagnostics, description: Description) -> SceneErrors {
    SceneErrors { diagnostics, sources: description.sources }
}
