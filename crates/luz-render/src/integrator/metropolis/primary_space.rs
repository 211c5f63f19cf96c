//! Metropolis light transport in primary sample space.
//!
//! Kelemen, Szirmay-Kalos, Antal and Csonka 2002, "A Simple and Robust Mutation Strategy for the Metropolis Light Transport Algorithm":
//! the state of a chain is the point of the unit cube that drives an estimator. Film position, lens, time and wavelengths are coordinates
//! like all others.

use super::{ChainContext, ChainProcess, Importance, MutationStatistics, PrimarySpaceIntegrator, scalar_contribution};
use crate::camera::Camera;
use crate::film::FilmWindow;
use crate::integrator::{PathCost, PathEvent, PathIntegrator, PathObserver, PathTracer, Technique, Unwatched};
use crate::light::Combination;
use crate::render::RenderCost;
use crate::settings::Settings;
use crate::world::World;
use glam::Vec2;
use luz_color::{SampledSpectrum, Wavelengths};
use luz_sample::Samples;
use luz_sample::markov::{Chain, PrimarySample, PrimarySamples, Proposal, large_step_weights};
use luz_sample::mis::Heuristic;
use luz_sample::random::{Random, hash};
use luz_sample::roulette::Roulette;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Primary-space Metropolis over a path tracer.
pub struct PrimarySpace<'a> {
    world: &'a World,
    camera: &'a Camera,
    settings: &'a Settings,
    options: PrimarySpaceIntegrator,
    path: PathIntegrator,
    window: FilmWindow,
}

/// The streams of seeds: what candidates and chains draw are different numbers.
const CANDIDATE_STREAM: u64 = 0x7073_7331;
const CHAIN_STREAM: u64 = 0x7073_7332;

/// The kinds of mutations, and their places.
const MUTATIONS: [&str; 2] = ["large step", "small step"];
const LARGE: usize = 0;
const SMALL: usize = 1;

/// What the estimator made of a point of primary sample space.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PrimaryState {
    sample: PrimarySample,
    found: Found,
}

/// A contribution to the film.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Found {
    film: [f32; 2],
    /// Over the density of the film position, in the film's RGB.
    rgb: [f32; 3],
}

impl<'a> PrimarySpace<'a> {
    /// Over the paths of a world.
    pub fn new(world: &'a World, camera: &'a Camera, settings: &'a Settings, options: PrimarySpaceIntegrator) -> Self {
        let path = PathIntegrator {
            max_depth: options.max_depth,
            heuristic: Heuristic::Power(2.0),
            technique: Technique::Both,
            roulette: Roulette::default(),
            regularize: false,
        };
        Self { world, camera, settings, options, path, window: settings.film_window() }
    }

    /// The contribution of a point of primary sample space. Its dimensions are the path tracer's.
    fn evaluate(&self, samples: &mut impl Samples, cost: &mut RenderCost) -> Found {
        let mut wavelengths = Wavelengths::sample_visible(samples.next_1d());
        let film = self.window.at(samples.next_2d());
        let (lens_u, time_u) = (samples.next_2d(), samples.next_1d());
        let ray = self.camera.ray(film, lens_u, time_u);
        let differentials = self.world.has_varying_textures().then(|| self.camera.differentials(film, lens_u, time_u));
        let tracer = PathTracer {
            settings: &self.path,
            world: self.world,
            camera: self.camera,
            combination: Combination::WithBsdf,
        };
        let mut path_cost = PathCost::default();
        let (differentials, path_cost_ref) = (differentials.as_ref(), &mut path_cost);
        let min_depth = self.options.metropolis.direct_light.min_depth();
        let radiance = if min_depth == 0 {
            tracer.radiance(ray, differentials, &mut wavelengths, samples, &mut Unwatched, None, path_cost_ref)
        } else {
            let mut deep = Deep { min_depth, radiance: SampledSpectrum::ZERO };
            let all = tracer.radiance(ray, differentials, &mut wavelengths, samples, &mut deep, None, path_cost_ref);
            if all.is_finite() { deep.radiance } else { all }
        };
        cost.paths += 1;
        cost.rays += u64::from(path_cost.rays);
        cost.shadow_rays += u64::from(path_cost.shadow_rays);
        let rgb = self.settings.sensor.to_output_rgb(radiance * self.window.area(), &wavelengths);
        Found { film: film.to_array(), rgb }
    }

    /// The target density at a contribution.
    fn density(found: &Found, importance: &Importance) -> f64 {
        scalar_contribution(found.rgb) / importance.at(Vec2::from_array(found.film))
    }

    /// A candidate, made from its number.
    fn candidate_state(&self, number: u64, stage: u64, state: &mut PrimaryState, cost: &mut RenderCost) {
        let seed = hash(self.settings.seed, CANDIDATE_STREAM, stage, 0);
        let mut random = Random::new(seed, number, 0);
        state.found = self.evaluate(&mut PrimarySamples::large(&mut state.sample, &mut random), cost);
    }
}

/// Light of paths that have scattered often enough.
struct Deep {
    min_depth: u32,
    radiance: SampledSpectrum,
}

impl PathObserver for Deep {
    #[inline]
    fn wants_vertex(&self) -> bool {
        false
    }

    #[inline]
    fn observe(&mut self, event: PathEvent<'_>, _: &Wavelengths) {
        if let PathEvent::Light(light) = event
            && light.depth >= self.min_depth
        {
            self.radiance += light.alone * light.weight;
        }
    }
}

impl ChainProcess for PrimarySpace<'_> {
    type Chain = Chain<PrimaryState>;
    type Scratch = PrimaryState;

    fn scratch(&self) -> PrimaryState {
        PrimaryState::default()
    }

    fn mutations(&self) -> &'static [&'static str] {
        &MUTATIONS
    }

    fn candidates(&self) -> u64 {
        self.options.metropolis.bootstrap_samples
    }

    fn candidate(
        &self,
        number: u64,
        stage: u64,
        importance: &Importance,
        scratch: &mut PrimaryState,
        splat: &mut impl FnMut(Vec2, f64),
        cost: &mut RenderCost,
    ) -> f64 {
        self.candidate_state(number, stage, scratch, cost);
        let weight = Self::density(&scratch.found, importance);
        splat(Vec2::from_array(scratch.found.film), weight);
        weight
    }

    fn begin(
        &self,
        chain: u64,
        candidate: u64,
        context: ChainContext<'_>,
        _: &mut PrimaryState,
        cost: &mut RenderCost,
    ) -> Option<Chain<PrimaryState>> {
        let mut state = PrimaryState::default();
        self.candidate_state(candidate, 0, &mut state, cost);
        let density = Self::density(&state.found, context.importance);
        let seed = hash(self.settings.seed, CHAIN_STREAM, 0, 0);
        (density > 0.0).then(|| Chain::new(seed, chain, state, density))
    }

    fn advance(
        &self,
        chain: &mut Chain<PrimaryState>,
        steps: u64,
        context: ChainContext<'_>,
        spare: &mut PrimaryState,
        splat: &mut impl FnMut(Vec2, [f32; 3], f64),
        statistics: &mut MutationStatistics,
        cost: &mut RenderCost,
    ) {
        let PrimarySpaceIntegrator { large_step_probability, kernel, .. } = self.options;
        let b = context.normalization;
        let color = |found: &Found| found.rgb.map(|v| (f64::from(v) / b) as f32);
        for _ in 0..steps {
            let begun = MutationStatistics::is_timed(chain.steps()).then(Instant::now);
            let before = *cost;
            let mut is_large = false;
            let step = chain.step(spare, |current, proposed, random| {
                is_large = random.next_f64() < large_step_probability;
                let mut samples = if is_large {
                    PrimarySamples::large(&mut proposed.sample, random)
                } else {
                    PrimarySamples::small(&current.sample, &mut proposed.sample, kernel, random)
                };
                proposed.found = self.evaluate(&mut samples, cost);
                Some(Proposal::symmetric(Self::density(&proposed.found, context.importance)))
            });
            let [of_current, of_proposed] = large_step_weights(
                step.proposed_weight,
                is_large,
                step.current_density,
                step.proposed_density,
                b,
                large_step_probability,
            );
            for (state, weight) in [(step.current, of_current), (step.proposed, of_proposed)] {
                if weight > 0.0 {
                    splat(Vec2::from_array(state.found.film), color(&state.found), weight);
                }
            }
            let kind = if is_large { LARGE } else { SMALL };
            let rays = cost.rays + cost.shadow_rays - before.rays - before.shadow_rays;
            statistics.record(kind, step.outcome, step.proposed_weight, rays);
            if let Some(begun) = begun {
                statistics.time(kind, begun.elapsed());
            }
        }
    }

    fn longest_stay(&self, chain: &Chain<PrimaryState>) -> u64 {
        chain.longest_stay()
    }

    fn save(&self, chain: &Chain<PrimaryState>, out: &mut Vec<u8>) {
        // Numbers, and lists of them, always have such a form.
        out.extend(postcard::to_allocvec(chain).unwrap_or_default());
    }

    fn restore(&self, bytes: &[u8]) -> Option<Chain<PrimaryState>> {
        let (chain, rest) = postcard::take_from_bytes::<Chain<PrimaryState>>(bytes).ok()?;
        rest.is_empty().then_some(chain)
    }
}
