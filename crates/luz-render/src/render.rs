//! Rendering as a sequence of passes.
//!
//! After every pass the film is consistent: it can be shown, saved, or left as it is. What a pixel receives is a pure
//! function of scene, seed, pixel and sample number, and each pixel's sums run in the order of its samples; so neither
//! the number of threads nor the size of the passes changes a single bit of the result.

use crate::camera::Camera;
use crate::film::{Features, Film, FilmKind, FilmRow};
use crate::integrator::{FeatureSink, PathCost};
use crate::settings::Settings;
use crate::world::World;
use glam::Vec2;
use luz_color::{SampledSpectrum, Wavelengths};
use luz_sample::{Sampler, SamplerConfig, Samples};
use rayon::prelude::*;
use serde::Serialize;
use std::time::{Duration, Instant};

/// What rendering has cost so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RenderCost {
    /// Camera samples: one path each.
    pub paths: u64,
    /// Rays that asked for the closest hit.
    pub rays: u64,
    /// Rays that asked for any hit.
    pub shadow_rays: u64,
    /// Wall-clock seconds spent in passes.
    pub seconds: f64,
}

impl RenderCost {
    /// All rays per second.
    pub fn rays_per_second(&self) -> f64 {
        if self.seconds > 0.0 { (self.rays + self.shadow_rays) as f64 / self.seconds } else { 0.0 }
    }

    fn add(&mut self, other: &Self) {
        self.paths += other.paths;
        self.rays += other.rays;
        self.shadow_rays += other.shadow_rays;
    }
}

/// How long a pass should take, so that whoever watches or interrupts is answered soon.
const PASS_TIME: Duration = Duration::from_millis(700);

/// A render in progress.
pub struct Renderer<'a> {
    world: &'a World,
    camera: &'a Camera,
    settings: &'a Settings,
    sampler: Sampler,
    film: Film,
    samples_done: u32,
    cost: RenderCost,
}

impl<'a> Renderer<'a> {
    /// A render of which no pass is done.
    pub fn new(world: &'a World, camera: &'a Camera, settings: &'a Settings) -> Self {
        let sampler = Sampler::new(
            settings.sampler,
            SamplerConfig {
                samples_per_pixel: settings.samples_per_pixel,
                resolution: settings.resolution,
                seed: settings.seed,
            },
        );
        Self {
            world,
            camera,
            settings,
            sampler,
            film: Film::new(settings.film, settings.bounds),
            samples_done: 0,
            cost: RenderCost::default(),
        }
    }

    /// What has been measured so far.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// What has been measured, when no pass is to follow.
    pub fn into_film(self) -> Film {
        self.film
    }

    /// Samples per pixel done.
    pub fn samples_done(&self) -> u32 {
        self.samples_done
    }

    /// What it has cost so far.
    pub fn cost(&self) -> &RenderCost {
        &self.cost
    }

    /// True when all samples are done.
    pub fn is_finished(&self) -> bool {
        self.samples_done >= self.settings.samples_per_pixel
    }

    /// How many samples per pixel the next pass should have, for it to take a moment.
    pub fn next_pass(&self) -> u32 {
        let left = self.settings.samples_per_pixel.saturating_sub(self.samples_done);
        if self.samples_done == 0 || self.cost.seconds <= 0.0 {
            return left.min(1);
        }
        let per_sample = self.cost.seconds / f64::from(self.samples_done);
        let fitting = (PASS_TIME.as_secs_f64() / per_sample).clamp(1.0, 65536.0) as u32;
        // Doubling at most: the first passes measure too little to be trusted far ahead.
        left.min(fitting).min(self.samples_done.saturating_mul(2))
    }

    /// Adds `samples` samples to every pixel.
    pub fn pass(&mut self, samples: u32) {
        let start = Instant::now();
        let range = self.samples_done..self.samples_done.saturating_add(samples);
        let (world, camera, settings, sampler) = (self.world, self.camera, self.settings, &self.sampler);
        let task = PassTask { world, camera, settings, sampler, samples: range.clone() };
        let y0 = self.film.bounds().y0;
        let costs: Vec<RenderCost> = self
            .film
            .rows_mut()
            .into_par_iter()
            .enumerate()
            .map(|(row, mut pixels)| task.row(y0 + row as u32, &mut pixels))
            .collect();
        costs.iter().for_each(|cost| self.cost.add(cost));
        self.samples_done = range.end;
        self.cost.seconds += start.elapsed().as_secs_f64();
    }

    /// Renders all passes that are left.
    pub fn finish(&mut self) {
        while !self.is_finished() {
            let samples = self.next_pass();
            self.pass(samples);
        }
    }
}

/// What a pass does to each row.
struct PassTask<'a> {
    world: &'a World,
    camera: &'a Camera,
    settings: &'a Settings,
    sampler: &'a Sampler,
    samples: std::ops::Range<u32>,
}

impl PassTask<'_> {
    fn row(&self, y: u32, row: &mut FilmRow<'_>) -> RenderCost {
        let mut cost = RenderCost::default();
        let bounds = self.settings.bounds;
        for x in bounds.x0..bounds.x1 {
            for sample in self.samples.clone() {
                self.sample([x, y], sample, row, &mut cost);
            }
        }
        cost
    }

    fn sample(&self, pixel: [u32; 2], index: u32, row: &mut FilmRow<'_>, cost: &mut RenderCost) {
        let settings = self.settings;
        let mut samples = self.sampler.samples(pixel, index);
        let mut wavelengths = Wavelengths::sample_visible(samples.next_1d());
        let filtered = settings.filter.sample(samples.next_2d());
        let film = Vec2::new(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5) + filtered.offset;
        let lens_u = samples.next_2d();
        let time_u = samples.next_1d();
        let ray = self.camera.ray(film, lens_u, time_u);
        let differentials = self.world.has_varying_textures().then(|| self.camera.differentials(film, lens_u, time_u));

        let mut features = Features::default();
        let to_rgb = |s: SampledSpectrum, w: &Wavelengths| reflectance_rgb(settings, s, w);
        let mut sink = FeatureSink::new(&mut features, &to_rgb);
        let sink = (settings.film == FilmKind::GBuffer).then_some(&mut sink);

        let mut path_cost = PathCost::default();
        let radiance = settings.integrator.radiance(
            self.world,
            self.camera,
            ray,
            differentials.as_ref(),
            &mut wavelengths,
            &mut samples,
            sink,
            &mut path_cost,
        );
        cost.paths += 1;
        cost.rays += u64::from(path_cost.rays);
        cost.shadow_rays += u64::from(path_cost.shadow_rays);

        let mut rgb = settings.sensor.to_output_rgb(radiance, &wavelengths);
        let largest = rgb.into_iter().fold(f32::NEG_INFINITY, f32::max);
        if largest > settings.max_component {
            rgb = rgb.map(|v| v * (settings.max_component / largest));
        }
        let x = (pixel[0] - settings.bounds.x0) as usize;
        row.pixels[x].add(rgb, filtered.sign);
        if settings.film == FilmKind::GBuffer {
            row.add_features(x, &features);
        }
    }
}

/// A reflectance as the colour that it gives white light.
fn reflectance_rgb(settings: &Settings, reflectance: SampledSpectrum, wavelengths: &Wavelengths) -> [f32; 3] {
    let white = settings.white.sample(wavelengths);
    settings.sensor.to_output_rgb(reflectance * white, wavelengths)
}
