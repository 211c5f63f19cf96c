//! Metropolis light transport in primary sample space.
//!
//! Kelemen, Szirmay-Kalos, Antal and Csonka 2002, "A Simple and Robust Mutation Strategy for the Metropolis Light Transport Algorithm":
//! the state of a chain is the point of the unit cube that drives an estimator. Film position, lens, time and wavelengths are coordinates
//! like all others.
//!
//! Over bidirectional path tracing, a point makes many paths, which arrive at several places of the film; the target density is the sum
//! of the magnitudes of all that arrives.

use super::primary_chain::{Arrival, MUTATIONS, PrimaryState, Steps};
use super::{
    ChainContext, ChainProcess, Importance, MutationStatistics, PrimaryEstimator, PrimarySpaceIntegrator, count_rays,
};
use crate::camera::Camera;
use crate::film::FilmWindow;
use crate::integrator::walks::{Walks, camera_start};
use crate::integrator::{
    BidirectionalIntegrator, BidirectionalTechniques, BidirectionalTracer, PathCost, PathEvent, PathIntegrator,
    PathObserver, PathTracer, Technique, Unwatched,
};
use crate::light::Combination;
use crate::render::RenderCost;
use crate::settings::Settings;
use crate::transport::SceneSpace;
use crate::world::World;
use glam::Vec2;
use luz_color::{SampledSpectrum, Wavelengths};
use luz_sample::Samples;
use luz_sample::markov::{Chain, PrimarySamples};
use luz_sample::mis::Heuristic;
use luz_sample::random::{Random, hash};
use luz_sample::roulette::Roulette;

/// Primary-space Metropolis over a path tracer, or a bidirectional one.
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

/// Memory for one step after another.
#[derive(Default)]
pub struct PrimaryScratch<'w> {
    spare: PrimaryState,
    walks: Walks<'w>,
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

    fn is_bidirectional(&self) -> bool {
        self.options.estimator == PrimaryEstimator::Bidirectional
    }

    /// What the estimator makes of a point of primary sample space.
    fn evaluate(
        &self,
        walks: &mut Walks<'a>,
        samples: &mut PrimarySamples<'_>,
        found: &mut Vec<Arrival>,
        cost: &mut RenderCost,
    ) {
        cost.paths += 1;
        match self.options.estimator {
            PrimaryEstimator::Path => found.push(self.trace(samples, cost)),
            PrimaryEstimator::Bidirectional => self.trace_both_ways(walks, samples, found, cost),
        }
    }

    /// What a path tracer makes of it. The dimensions are the path tracer's.
    fn trace(&self, samples: &mut impl Samples, cost: &mut RenderCost) -> Arrival {
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
        cost.rays += u64::from(path_cost.rays);
        cost.shadow_rays += u64::from(path_cost.shadow_rays);
        Arrival::at(film, self.settings.sensor.to_output_rgb(radiance * self.window.area(), &wavelengths))
    }

    /// What a bidirectional path tracer makes of it. Each walk has a stream of its own.
    fn trace_both_ways(
        &self,
        walks: &mut Walks<'a>,
        samples: &mut PrimarySamples<'_>,
        found: &mut Vec<Arrival>,
        cost: &mut RenderCost,
    ) {
        let Self { world, camera, window, .. } = *self;
        let wavelengths = Wavelengths::sample_visible(samples.next_1d());
        let start = camera_start(window, true, samples);
        let space = SceneSpace::new(world, camera, window, wavelengths, start.time_u);
        let settings = BidirectionalIntegrator {
            max_depth: self.options.max_depth,
            techniques: BidirectionalTechniques::All,
            heuristic: Heuristic::default(),
        };
        let tracer = BidirectionalTracer { settings, world, camera, window };
        let fewest_vertices = self.options.metropolis.direct_light.min_depth() as usize + 2;
        let mut seen = [0.0; 3];
        tracer.visit(&space, &start, walks, samples, |path| {
            if path.vertices() < fewest_vertices {
                return;
            }
            let Some(film) = path.film(&space, &start) else { return };
            let rgb = path.rgb(&space, &self.settings.sensor);
            if path.eye.1 > 1 {
                seen = std::array::from_fn(|c| seen[c] + rgb[c]);
            } else {
                found.push(Arrival::at(film, rgb));
            }
        });
        if seen != [0.0; 3] {
            found.push(Arrival::at(start.film, seen));
        }
        count_rays(&space, cost);
    }

    /// A candidate, made from its number. Returns its weight.
    fn draw_candidate(
        &self,
        number: u64,
        stage: u64,
        importance: &Importance,
        PrimaryScratch { spare, walks }: &mut PrimaryScratch<'a>,
        cost: &mut RenderCost,
    ) -> f64 {
        let mut random = Random::new(hash(self.settings.seed, CANDIDATE_STREAM, stage, 0), number, 0);
        spare.draw(&mut random, importance, |samples, found| self.evaluate(walks, samples, found, cost))
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

impl<'a> ChainProcess for PrimarySpace<'a> {
    type Chain = Chain<PrimaryState>;
    type Scratch = PrimaryScratch<'a>;

    fn scratch(&self) -> PrimaryScratch<'a> {
        PrimaryScratch::default()
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
        scratch: &mut PrimaryScratch<'a>,
        splat: &mut impl FnMut(Vec2, f64),
        cost: &mut RenderCost,
    ) -> f64 {
        let weight = self.draw_candidate(number, stage, importance, scratch, cost);
        scratch.spare.found.iter().for_each(|found| splat(found.film(), found.density(importance)));
        weight
    }

    fn begin(
        &self,
        chain: u64,
        candidate: u64,
        context: ChainContext<'_>,
        _: f64,
        scratch: &mut PrimaryScratch<'a>,
        cost: &mut RenderCost,
    ) -> Option<Chain<PrimaryState>> {
        let density = self.draw_candidate(candidate, 0, context.importance, scratch, cost);
        let seed = hash(self.settings.seed, CHAIN_STREAM, 0, 0);
        (density > 0.0).then(|| Chain::new(seed, chain, scratch.spare.clone(), density))
    }

    fn advance(
        &self,
        chain: &mut Chain<PrimaryState>,
        steps: u64,
        ChainContext { normalization, importance }: ChainContext<'_>,
        PrimaryScratch { spare, walks }: &mut PrimaryScratch<'a>,
        splat: &mut impl FnMut(Vec2, [f32; 3], f64),
        statistics: &mut MutationStatistics,
        cost: &mut RenderCost,
    ) {
        let PrimarySpaceIntegrator { large_step_probability, kernel, .. } = self.options;
        let going = Steps { importance, normalization, large_step_probability, kernel };
        let evaluate = |samples: &mut PrimarySamples<'_>, found: &mut Vec<Arrival>, cost: &mut RenderCost| {
            self.evaluate(walks, samples, found, cost);
        };
        going.advance(chain, steps, spare, evaluate, splat, (statistics, cost));
    }

    fn longest_stay(&self, chain: &Chain<PrimaryState>) -> u64 {
        chain.longest_stay()
    }

    fn save(&self, chain: &Chain<PrimaryState>, out: &mut Vec<u8>) {
        // Numbers, and lists of them, always have such a form.
        out.extend(postcard::to_allocvec(&(self.is_bidirectional(), chain)).unwrap_or_default());
    }

    fn restore(&self, bytes: &[u8]) -> Option<Chain<PrimaryState>> {
        type Saved = (bool, Chain<PrimaryState>);
        let ((is_bidirectional, chain), rest) = postcard::take_from_bytes::<Saved>(bytes).ok()?;
        // Points of the other estimator's space look the same, and mean something else.
        (rest.is_empty() && is_bidirectional == self.is_bidirectional()).then_some(chain)
    }
}
