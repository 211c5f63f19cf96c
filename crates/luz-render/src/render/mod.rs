//! Rendering as a sequence of passes.
//!
//! After every pass the film is consistent: it can be shown, saved, or left as it is. What a pixel receives is a pure
//! function of scene, seed, pixel and sample number, and each pixel's sums run in the order of its samples; so neither
//! the number of threads nor the size of the passes changes a single bit of the result.

pub mod adaptive;
mod incident;
mod optimal;
mod part;
mod sample;
mod shard;

pub use incident::{Failure, Incident, Incidents};
pub use part::{Part, PartError, PartHeader};
pub use shard::Shard;

use crate::camera::Camera;
use crate::film::{Film, PixelBounds};
use crate::integrator::efficiency::{EfficiencyGuide, Findings, Ledger, PixelRecord};
use crate::integrator::{PathObserver, Technique};
use crate::settings::Settings;
use crate::world::World;
use adaptive::SampleLimits;
use incident::panic_message;
use luz_sample::mis::Heuristic;
use luz_sample::random::hash;
use luz_sample::roulette::Roulette;
use luz_sample::{Sampler, SamplerConfig};
use optimal::OptimalDirect;
use rayon::prelude::*;
use sample::PixelSampler;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

/// What rendering has cost so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
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

    /// Adds what other passes have cost.
    pub fn add(&mut self, other: &Self) {
        self.paths = self.paths.saturating_add(other.paths);
        self.rays = self.rays.saturating_add(other.rays);
        self.shadow_rays = self.shadow_rays.saturating_add(other.shadow_rays);
        self.seconds += other.seconds;
    }
}

/// How long a pass should take, if nothing else is said: whoever watches or interrupts is answered soon.
pub const PASS_TIME: Duration = Duration::from_millis(700);

/// A render in progress.
pub struct Renderer<'a> {
    world: &'a World,
    camera: &'a Camera,
    settings: &'a Settings,
    /// One for each half of the pixels.
    samplers: Vec<Sampler>,
    film: Film,
    /// What each pixel, or each of its halves, has learned of its direct light, where that is wanted.
    optimal: Vec<OptimalDirect>,
    /// What has been learned of how often paths should go on, where that is wanted, and what it knows of each pixel.
    guide: Option<EfficiencyGuide>,
    pixel_records: Vec<PixelRecord>,
    rounds_done: u32,
    pass_time: Duration,
    limits: SampleLimits,
    cost: RenderCost,
    incidents: Incidents,
    shard: Shard,
    /// The pixels to be rendered, in each row of the film: all, or those of the shard.
    columns: Vec<Vec<Range<usize>>>,
}

impl<'a> Renderer<'a> {
    /// A render of which no pass is done.
    pub fn new(world: &'a World, camera: &'a Camera, settings: &'a Settings) -> Self {
        let contents = settings.film_contents();
        let path = settings.integrator.path().copied();
        let (center, radius) = world.bounding_sphere();
        let guide = path
            .is_some_and(|path| path.roulette == Roulette::Efficiency)
            .then(|| EfficiencyGuide::new(center, radius));
        let is_optimal =
            path.is_some_and(|path| path.heuristic == Heuristic::Optimal && path.technique == Technique::Both);
        let buffers = contents.buffers() as u32;
        let samplers = (0..contents.buffers() as u64)
            .map(|half| {
                let config = SamplerConfig {
                    samples_per_pixel: settings.samples_per_pixel.div_ceil(buffers),
                    resolution: settings.resolution,
                    seed: if half == 0 { settings.seed } else { hash(settings.seed, half, 0, 0) },
                };
                Sampler::new(settings.sampler, config)
            })
            .collect();
        Self {
            world,
            camera,
            settings,
            samplers,
            film: Film::new(contents, settings.bounds),
            optimal: vec![
                optimal::estimator();
                if is_optimal { settings.bounds.area() * contents.buffers() } else { 0 }
            ],
            pixel_records: vec![PixelRecord::default(); if guide.is_some() { settings.bounds.area() } else { 0 }],
            guide,
            rounds_done: 0,
            pass_time: PASS_TIME,
            limits: SampleLimits::new(settings.adaptive, settings.sample_limit.div_ceil(buffers)),
            cost: RenderCost::default(),
            incidents: Incidents::default(),
            shard: Shard::WHOLE,
            columns: columns(Shard::WHOLE, settings.bounds),
        }
    }

    /// Lets only a part of the frame be rendered. Roulette by efficiency wants to learn from all of it, and would learn
    /// something else from a part.
    pub fn set_shard(&mut self, shard: Shard) {
        self.shard = shard;
        self.columns = columns(shard, self.film.bounds());
    }

    /// How long passes should take, as far as their samples let them.
    pub fn set_pass_time(&mut self, time: Duration) {
        self.pass_time = time;
    }

    /// The part of the frame that is rendered.
    pub fn shard(&self) -> Shard {
        self.shard
    }

    /// Samples that went wrong.
    pub fn incidents(&self) -> &Incidents {
        &self.incidents
    }

    /// What has been measured so far.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// What has been measured, when no pass is to follow.
    pub fn into_film(self) -> Film {
        self.film
    }

    /// Samples per pixel done, of the pixels that have got most.
    pub fn samples_done(&self) -> u32 {
        self.rounds_done.saturating_mul(self.samplers.len() as u32).min(self.settings.sample_limit)
    }

    /// What it has cost so far.
    pub fn cost(&self) -> &RenderCost {
        &self.cost
    }

    /// True when all samples are done.
    pub fn is_finished(&self) -> bool {
        self.rounds_done >= self.limits.rounds()
    }

    /// The share of the samples that are to be done which is done.
    pub fn progress(&self) -> f64 {
        self.limits.progress(self.rounds_done)
    }

    /// How many rounds the next pass should have, for it to take a moment. A round gives every pixel that is still sampled
    /// one sample, or one in each of its halves.
    pub fn next_pass(&self) -> u32 {
        let left = self.rounds_until_decision();
        if self.rounds_done == 0 || self.cost.seconds <= 0.0 {
            return left.min(1);
        }
        let per_round = self.cost.seconds / f64::from(self.rounds_done);
        let fitting = (self.pass_time.as_secs_f64() / per_round).clamp(1.0, 65536.0) as u32;
        // Doubling at most: the first passes measure too little to be trusted far ahead.
        left.min(fitting).min(self.rounds_done.saturating_mul(2))
    }

    /// Does the next `rounds` rounds.
    pub fn pass(&mut self, rounds: u32) {
        let end = self.rounds_done.saturating_add(rounds);
        // Decisions on the way can bring the end nearer.
        while self.rounds_done < end && !self.is_finished() {
            self.pass_between_decisions((end - self.rounds_done).min(self.rounds_until_decision()));
        }
    }

    /// How many rounds may follow before something is decided or learned from all that is known by then.
    fn rounds_until_decision(&self) -> u32 {
        let of_limits = self.limits.rounds_until_decision(self.rounds_done);
        self.guide.as_ref().map_or(of_limits, |guide| of_limits.min(guide.epoch_end().saturating_sub(self.rounds_done)))
    }

    fn pass_between_decisions(&mut self, rounds: u32) {
        let start = Instant::now();
        let range = self.rounds_done..self.rounds_done + rounds;
        let bounds = self.film.bounds();
        let Some(path) = self.settings.integrator.path() else { return };
        let task = PixelSampler::new(path, self.world, self.camera, self.settings, &self.samplers);
        let limits = &self.limits;
        let width = bounds.width() as usize * task.halves();
        let mut estimators = self.optimal.chunks_exact_mut(width.max(1));
        let mut records = self.pixel_records.chunks_exact_mut((bounds.width() as usize).max(1));
        let rows: Vec<_> = self
            .film
            .rows_mut()
            .into_iter()
            .map(|pixels| (pixels, estimators.next().unwrap_or_default(), records.next().unwrap_or_default()))
            .collect();
        let guide = self.guide.as_ref();
        let columns = &self.columns;
        let done: Vec<(RenderCost, Incidents, Findings)> = rows
            .into_par_iter()
            .enumerate()
            .map(|(row, (mut pixels, estimators, records))| {
                let (mut cost, mut incidents) = (RenderCost::default(), Incidents::default());
                let mut findings = Findings::default();
                for column in columns[row].iter().cloned().flatten() {
                    let pixel = [bounds.x0 + column as u32, bounds.y0 + row as u32];
                    let number = row * bounds.width() as usize + column;
                    for half in 0..task.halves() {
                        for sample in range.start..range.end.min(limits.of(number, half)) {
                            let optimal = estimators.get_mut(column * task.halves() + half);
                            let ledger = guide
                                .zip(records.get_mut(column))
                                .map(|(g, record)| Ledger::new(g, record, &mut findings));
                            let went = catch_unwind(AssertUnwindSafe(|| {
                                task.sample(pixel, half, sample, &mut pixels, column, optimal, ledger, &mut cost)
                            }));
                            let failure = match went {
                                Ok(true) => continue,
                                Ok(false) => Failure::NotFinite,
                                // One sample lost is better than all: it is reported, and counts as black.
                                Err(payload) => {
                                    pixels.add(column, half, [f32::NAN; 3], 1.0);
                                    Failure::Panic(panic_message(&*payload))
                                }
                            };
                            incidents.push(Incident { pixel, half: half as u32, sample, failure });
                        }
                    }
                }
                (cost, incidents, findings)
            })
            .collect();
        for (cost, incidents, findings) in done {
            if let Some(guide) = &mut self.guide {
                guide.take(&findings);
            }
            self.cost.add(&cost);
            self.incidents.merge(incidents);
        }
        self.rounds_done = range.end;
        self.limits.decide(self.rounds_done, &self.film);
        if let Some(guide) = &mut self.guide
            && self.rounds_done >= guide.epoch_end()
        {
            guide.learn(self.rounds_done, &mut self.pixel_records, bounds.width() as usize);
        }
        self.cost.seconds += start.elapsed().as_secs_f64();
    }

    /// Traces one sample of a half of a pixel of the frame for an observer, and leaves the film alone. Returns its colour. `None`
    /// if there is no such half. (Roulette by efficiency is that by throughput here.)
    pub fn trace(&self, pixel: [u32; 2], half: u32, sample: u32, observer: &mut impl PathObserver) -> Option<[f32; 3]> {
        let path = self.settings.integrator.path()?;
        let task = PixelSampler::new(path, self.world, self.camera, self.settings, &self.samplers);
        ((half as usize) < task.halves()).then(|| task.trace(pixel, half as usize, sample, observer))
    }

    /// Renders all passes that are left.
    pub fn finish(&mut self) {
        while !self.is_finished() {
            let rounds = self.next_pass();
            self.pass(rounds);
        }
    }
}

/// The pixels of a shard in each row of the film.
fn columns(shard: Shard, bounds: PixelBounds) -> Vec<Vec<Range<usize>>> {
    let width = bounds.width() as usize;
    let mut rows = vec![Vec::new(); bounds.height() as usize];
    for run in shard.runs(bounds) {
        let mut start = run.start;
        // A run may go on in the next row.
        while start < run.end {
            let row = start / width;
            let end = run.end.min((row + 1) * width);
            rows[row].push(start - row * width..end - row * width);
            start = end;
        }
    }
    rows
}
