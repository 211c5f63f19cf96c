//! Rendering as a sequence of passes.
//!
//! After every pass the film is consistent: it can be shown, saved, or left as it is. What a pixel receives is a pure
//! function of scene, seed, pixel and sample number, or of the numbers of a Markov chain and its step. Each pixel's sums run in the
//! order of its samples, and those of splats are exact; so neither the number of threads nor the size of the passes changes
//! a single bit of the result.
//!
//! Two engines take part in a pass, alone or together: samples of pixels ([`pixels`]), which may splat light elsewhere, and Markov
//! chains ([`chains`]).

pub mod adaptive;
mod chains;
mod cost;
mod incident;
mod optimal;
mod part;
mod pixels;
mod sample;
mod shard;
mod splatting;

pub use chains::ChainReport;
pub use cost::RenderCost;
pub use incident::{Failure, Incident, Incidents};
pub use part::{Part, PartError, PartHeader};
pub use shard::Shard;

use crate::camera::Camera;
use crate::film::Film;
use crate::integrator::metropolis::path_space::PathSpaceMetropolis;
use crate::integrator::metropolis::{DirectLight, Multiplexed, PrimarySpace};
use crate::integrator::{BidirectionalTracer, Integrator, PathIntegrator, PathObserver, Technique};
use crate::settings::Settings;
use crate::world::World;
use chains::{ChainRounds, Chains};
use luz_sample::mis::Heuristic;
use luz_sample::roulette::Roulette;
use pixels::{Estimator, PixelRounds};
use std::time::{Duration, Instant};

/// How long a pass should take, if nothing else is said: whoever watches or interrupts is answered soon.
pub const PASS_TIME: Duration = Duration::from_millis(700);

/// Rounds of mutations for each sample of direct light, where that is separate: it is the easier part of the picture.
const ROUNDS_PER_SAMPLE: u32 = 4;

/// A render in progress.
pub struct Renderer<'a> {
    settings: &'a Settings,
    film: Film,
    /// Samples of pixels, where there are any.
    pixels: Option<PixelRounds<'a>>,
    /// Markov chains, where there are any.
    chains: Option<Box<dyn Chains + 'a>>,
    /// First those in which the chains are prepared, then those in which pixels are sampled and chains advance.
    rounds_done: u32,
    pass_time: Duration,
    /// Rounds and seconds, since the last round was of another kind than the next one.
    pace: (u32, f64),
    cost: RenderCost,
    incidents: Incidents,
    shard: Shard,
}

impl<'a> Renderer<'a> {
    /// A render of which no pass is done.
    pub fn new(world: &'a World, camera: &'a Camera, settings: &'a Settings) -> Self {
        let pixels = pixel_estimator(world, camera, settings)
            .map(|estimator| PixelRounds::new(estimator, world, camera, settings));
        let chains: Option<Box<dyn Chains + 'a>> = match &settings.integrator {
            Integrator::PrimarySpace(options) => {
                Some(Box::new(ChainRounds::new(PrimarySpace::new(world, camera, settings, *options), settings)))
            }
            Integrator::Multiplexed(options) => {
                Some(Box::new(ChainRounds::new(Multiplexed::new(world, camera, settings, *options), settings)))
            }
            Integrator::PathSpace(options) => {
                Some(Box::new(ChainRounds::new(PathSpaceMetropolis::new(world, camera, settings, *options), settings)))
            }
            _ => None,
        };
        Self {
            settings,
            film: Film::new(settings.film_contents(), settings.bounds),
            pixels,
            chains,
            rounds_done: 0,
            pass_time: PASS_TIME,
            pace: (0, 0.0),
            cost: RenderCost::default(),
            incidents: Incidents::default(),
            shard: Shard::WHOLE,
        }
    }

    /// Lets only a part of the work be done: the pixels of some tiles, and some of the chains. To be said before the first pass.
    /// Roulette by efficiency wants to learn from all of the frame, and would learn something else from a part.
    pub fn set_shard(&mut self, shard: Shard) {
        self.shard = shard;
        if let Some(pixels) = &mut self.pixels {
            pixels.set_shard(shard);
        }
        if let Some(chains) = &mut self.chains {
            chains.set_shard(shard);
        }
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

    /// Samples per pixel done, of the pixels that have got most; mutations per pixel where chains make the picture.
    pub fn samples_done(&self) -> u32 {
        let halves = self.film.contents().buffers() as u32;
        let rounds = self.rounds_done.saturating_sub(self.preparation());
        rounds.saturating_mul(halves).min(self.settings.sample_limit)
    }

    /// What it has cost so far.
    pub fn cost(&self) -> &RenderCost {
        &self.cost
    }

    /// What is known of the Markov chains, where there are any.
    pub fn chains(&self) -> Option<ChainReport> {
        self.chains.as_ref().map(|chains| chains.report())
    }

    /// Are there Markov chains?
    pub fn has_chains(&self) -> bool {
        self.chains.is_some()
    }

    /// Are the Markov chains still being prepared? Their first states are looked for, and what they are scaled by.
    pub fn is_preparing(&self) -> bool {
        self.rounds_done < self.preparation()
    }

    /// True when all samples are done.
    pub fn is_finished(&self) -> bool {
        self.rounds_done >= self.rounds()
    }

    /// The share of the samples that are to be done which is done; while chains are being prepared, the share of that.
    pub fn progress(&self) -> f64 {
        let preparation = self.preparation();
        if self.is_preparing() {
            return f64::from(self.rounds_done) / f64::from(preparation);
        }
        let done = self.rounds_done - preparation;
        match &self.pixels {
            Some(pixels) => pixels.limits.progress(done),
            None => f64::from(done) / f64::from((self.rounds() - preparation).max(1)),
        }
    }

    /// Rounds in which chains are prepared.
    fn preparation(&self) -> u32 {
        self.chains.as_ref().map_or(0, |chains| chains.preparation_rounds())
    }

    /// All rounds, as far as it is known how many there are.
    fn rounds(&self) -> u32 {
        let of_chains = if self.chains.is_some() { self.settings.sample_limit } else { 0 };
        let of_pixels = self.pixels.as_ref().map_or(0, |pixels| pixels.limits.rounds());
        self.preparation().saturating_add(of_chains.max(of_pixels))
    }

    /// How many rounds the next pass should have, for it to take a moment. A round gives every pixel that is still sampled
    /// one sample, or one in each of its halves; or one mutation, on average. Before that, rounds prepare the chains.
    pub fn next_pass(&self) -> u32 {
        let left = self.rounds_until_decision();
        let (rounds, seconds) = self.pace;
        if rounds == 0 || seconds <= 0.0 {
            return left.min(1);
        }
        let per_round = seconds / f64::from(rounds);
        let fitting = (self.pass_time.as_secs_f64() / per_round).clamp(1.0, 65536.0) as u32;
        // Doubling at most: the first passes measure too little to be trusted far ahead.
        left.min(fitting).min(rounds.saturating_mul(2))
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
        let preparation = self.preparation();
        if self.is_preparing() {
            return preparation - self.rounds_done;
        }
        let left = self.rounds().saturating_sub(self.rounds_done);
        match (&self.pixels, &self.chains) {
            // Direct light beside chains is not decided on.
            (Some(pixels), None) => pixels.rounds_until_decision(self.rounds_done),
            _ => left,
        }
    }

    fn pass_between_decisions(&mut self, rounds: u32) {
        let start = Instant::now();
        let preparation = self.preparation();
        let is_preparing = self.is_preparing();
        let Self { film, cost, incidents, .. } = self;
        let mut end = self.rounds_done + rounds;
        if is_preparing {
            if let Some(chains) = &mut self.chains {
                chains.prepare(self.rounds_done..end, film, cost, incidents);
            }
        } else {
            let range = self.rounds_done - preparation..end - preparation;
            if let Some(pixels) = &mut self.pixels {
                let rounds = match self.chains {
                    Some(_) => range.start.div_ceil(ROUNDS_PER_SAMPLE)..range.end.div_ceil(ROUNDS_PER_SAMPLE),
                    None => range.clone(),
                };
                pixels.pass(rounds, film, cost, incidents);
            }
            if let Some(chains) = &mut self.chains {
                chains.advance(range, film, cost, incidents);
            }
        }
        if !self.is_preparing_after(end) && self.pixels.is_none() && self.chains.as_ref().is_some_and(|c| c.is_dark()) {
            // All rounds that are left would be of nothing.
            end = self.rounds();
        }
        let seconds = start.elapsed().as_secs_f64();
        self.rounds_done = end;
        self.cost.seconds += seconds;
        self.pace = if is_preparing != self.is_preparing() {
            (0, 0.0)
        } else {
            (self.pace.0.saturating_add(rounds), self.pace.1 + seconds)
        };
    }

    fn is_preparing_after(&self, rounds: u32) -> bool {
        rounds < self.preparation()
    }

    /// Traces one sample of a half of a pixel of the frame for an observer, and leaves the film alone. Returns its colour. `None`
    /// if there is no such half, or the integrator is no path tracer. (Roulette by efficiency is that by throughput here.)
    pub fn trace(&self, pixel: [u32; 2], half: u32, sample: u32, observer: &mut impl PathObserver) -> Option<[f32; 3]> {
        self.settings.integrator.path()?;
        let pixels = self.pixels.as_ref()?;
        let is_there = (half as usize) < pixels.samplers.len();
        is_there.then(|| pixels.path_sampler()?.trace(pixel, half as usize, sample, observer).into()).flatten()
    }

    /// Renders all passes that are left.
    pub fn finish(&mut self) {
        while !self.is_finished() {
            let rounds = self.next_pass();
            self.pass(rounds);
        }
    }
}

/// Who samples pixels, where anyone does.
fn pixel_estimator<'a>(world: &'a World, camera: &'a Camera, settings: &'a Settings) -> Option<Estimator<'a>> {
    let integrator = &settings.integrator;
    match integrator {
        Integrator::Path(path) => Some(Estimator::Path(*path)),
        Integrator::Light(bidirectional) | Integrator::Bidirectional(bidirectional) => {
            let window = settings.film_window();
            Some(Estimator::splatting(BidirectionalTracer { settings: *bidirectional, world, camera, window }))
        }
        Integrator::PrimarySpace(_) | Integrator::Multiplexed(_) | Integrator::PathSpace(_) => {
            let is_separate = integrator.metropolis().is_some_and(|m| m.direct_light == DirectLight::Separate);
            is_separate.then(|| Estimator::Path(direct_light(integrator.max_depth())))
        }
    }
}

/// A path tracer of what has scattered at most once.
fn direct_light(max_depth: u32) -> PathIntegrator {
    PathIntegrator {
        max_depth: max_depth.min(DirectLight::Separate.min_depth() - 1),
        heuristic: Heuristic::Power(2.0),
        technique: Technique::Both,
        roulette: Roulette::None,
        regularize: false,
    }
}
