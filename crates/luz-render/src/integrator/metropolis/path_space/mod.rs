//! Metropolis light transport over paths (Veach and Guibas 1997; Veach 1997, chapter 11).
//!
//! The state of a chain is a path, with its wavelengths and its moment. Each step asks one of several mutations for a proposal; every
//! mutation is in detailed balance by itself.
//!
//! To add a mutation: add a file with a [`Mutation`], a probability to
//! [`MutationProbabilities`], and a variant here.

mod bidirectional;
mod caustic;
mod eye_chain;
mod lens;
mod lens_subpath;
mod multi_chain;
mod mutation;
mod state;
mod wavelength;

pub use bidirectional::Bidirectional;
pub use caustic::CausticPerturbation;
pub use lens::LensPerturbation;
pub use lens_subpath::LensSubpath;
pub use multi_chain::MultiChainPerturbation;
pub use mutation::{Attempt, Kept, Mutation};
pub use state::State;

use super::{
    ChainContext, ChainProcess, Importance, MutationProbabilities, MutationStatistics, PathSpaceIntegrator, StepWatch,
    count_rays,
};
use crate::camera::Camera;
use crate::integrator::walks::{Found, Interleaved, Walks};
use crate::integrator::{BidirectionalIntegrator, BidirectionalTechniques, BidirectionalTracer, CameraStart};
use crate::render::RenderCost;
use crate::settings::Settings;
use crate::transport::{Path, Range, SceneSpace, SceneVertex};
use crate::world::World;
use glam::Vec2;
use luz_sample::markov::{Chain, Density, Log, Proposal};
use luz_sample::mis::Heuristic;
use luz_sample::random::{Random, hash};
use luz_sample::{ONE_MINUS_EPSILON, Sampler, SamplerConfig, SamplerKind, Samples};
use mutation::draw;
use serde::{Deserialize, Serialize};
use state::{Conditions, Measure, SavedState};
use std::f64::consts::PI;

/// The streams of seeds: what candidates, chains and their places on the film draw are different numbers.
const CANDIDATE_STREAM: u64 = 0x766c_7431;
const CHAIN_STREAM: u64 = 0x766c_7432;
const CHOICE_STREAM: u64 = 0x766c_7433;
const FILM_STREAM: u64 = 0x766c_7434;

/// The share of bidirectional mutations that replace the whole path, its wavelengths and its moment included.
const RENEWALS: f64 = 0.1;

/// The step of wavelengths on the circle, at most.
const COLOUR_STEP: f32 = 0.25;

/// The share of perturbations that give a path which prisms bend another colour.
const RECOLOURED: f64 = 0.5;

/// Path-space Metropolis.
pub struct PathSpaceMetropolis<'a> {
    measure: Measure<'a>,
    seed: u64,
    batches: u64,
    candidates: u64,
    tracer: BidirectionalIntegrator,
    fewest_vertices: usize,
    probabilities: [f64; MutationProbabilities::NAMES.len()],
    bidirectional: Bidirectional,
    lens_subpath: LensSubpath,
    lens: LensPerturbation,
    caustic: CausticPerturbation,
    multi_chain: MultiChainPerturbation,
    /// Places on the film for lens subpath mutations.
    film_points: Sampler,
}

/// A chain.
pub struct PathChain<'a> {
    chain: Chain<State<'a>, Log>,
    /// How many lens subpath mutations have been proposed.
    lens_subpaths: u64,
}

/// Memory that steps are made in.
#[derive(Default)]
pub struct Workspace<'a> {
    proposed: State<'a>,
    recoloured: Path<SceneVertex<'a>>,
    walks: Walks<'a>,
}

/// A chain as it is kept in files.
#[derive(Serialize, Deserialize)]
struct SavedChain {
    chain: Chain<SavedState, Log>,
    lens_subpaths: u64,
}

/// Numbers of which the second pair, a place on the film, is given.
struct WithFilm<'a> {
    random: &'a mut Random,
    film: Vec2,
    pairs: u32,
}

impl Samples for WithFilm<'_> {
    fn next_1d(&mut self) -> f32 {
        self.random.next_1d()
    }

    fn next_2d(&mut self) -> Vec2 {
        self.pairs += 1;
        if self.pairs == 2 { self.film } else { self.random.next_2d() }
    }

    fn set_dimension(&mut self, dimension: u32) {
        self.random.set_dimension(dimension);
    }
}

/// What a mutation has done.
struct Proposed {
    density: Log,
    /// `T(y→x) / T(x→y)`.
    ratio: f64,
}

impl<'a> PathSpaceMetropolis<'a> {
    /// Over the paths of a world.
    pub fn new(world: &'a World, camera: &'a Camera, settings: &'a Settings, options: PathSpaceIntegrator) -> Self {
        let window = camera.window_of_paths(settings.film_window());
        let ranges = options.ranges;
        // The radius of a disk that has this share of the film.
        let radius = |share: f64| (share * f64::from(window.area()) / PI).sqrt();
        let pixels = |smallest: f64, share: f64| Range { smallest, largest: radius(share).max(2.0 * smallest) };
        let film = pixels(ranges.lens_smallest, ranges.lens_area);
        let most = (options.max_depth as usize).saturating_add(2);
        let fewest = options.metropolis.direct_light.min_depth() as usize + 2;
        let seed = hash(settings.seed, FILM_STREAM, 0, 0);
        let total: f64 = options.mutations.as_array().iter().sum();
        Self {
            measure: Measure { world, camera, window, sensor: &settings.sensor },
            seed: settings.seed,
            batches: u64::from(options.metropolis.batches.max(1)),
            candidates: options.metropolis.bootstrap_samples,
            tracer: BidirectionalIntegrator {
                max_depth: options.max_depth,
                techniques: BidirectionalTechniques::All,
                heuristic: Heuristic::default(),
            },
            fewest_vertices: fewest,
            probabilities: options.mutations.as_array().map(|p| p / total),
            bidirectional: Bidirectional { fewest, most },
            lens_subpath: LensSubpath { fewest, most },
            lens: LensPerturbation { film },
            caustic: CausticPerturbation { pixels: pixels(ranges.caustic_smallest, ranges.caustic_area) },
            multi_chain: MultiChainPerturbation {
                film,
                turn: Range { smallest: ranges.multi_chain_smallest, largest: ranges.multi_chain_largest },
            },
            film_points: Sampler::new(
                SamplerKind::Sobol,
                SamplerConfig { samples_per_pixel: 1 << 16, resolution: [1, 1], seed },
            ),
        }
    }

    /// All paths of a candidate, with their film positions and weights.
    fn visit_candidate(
        &self,
        number: u64,
        stage: u64,
        importance: &Importance,
        walks: &mut Walks<'a>,
        cost: &mut RenderCost,
        mut visit: impl FnMut(Found<'_, 'a>, Vec2, f64),
    ) -> Conditions {
        let Measure { world, camera, window, sensor } = self.measure;
        let mut random = Random::new(hash(self.seed, CANDIDATE_STREAM, stage, 0), number, 0);
        let conditions = Conditions::new(random.next_1d(), random.next_1d());
        let time_u = conditions.time_u;
        let start = CameraStart { film: window.at(random.next_2d()), lens_u: random.next_2d(), time_u };
        let space = self.measure.space(&conditions);
        let tracer = BidirectionalTracer { settings: self.tracer, world, camera, window };
        tracer.visit(&space, &start, walks, &mut Interleaved(&mut random), |found| {
            let vertices = found.vertices();
            if let Some(film) =
                found.film(&space, &start).filter(|&film| vertices >= self.fewest_vertices && window.contains(film))
            {
                let rgb = found.rgb(&space, sensor);
                let weight = super::scalar_contribution(rgb) / importance.at(film);
                if weight > 0.0 && weight.is_finite() {
                    visit(found, film, weight);
                }
            }
        });
        cost.paths += 1;
        count_rays(&space, cost);
        conditions
    }

    /// A mutation applied within a space that the path is of, and its way back.
    fn mutate<M: Mutation<SceneSpace<'a>>>(
        &self,
        mutation: &M,
        space: &SceneSpace<'a>,
        importance: &Importance,
        x: &State<'a>,
        y: &mut State<'a>,
        samples: &mut impl Samples,
    ) -> Option<Proposed> {
        match mutation.propose(space, &x.path, &mut y.path, samples) {
            Attempt::Inapplicable => None,
            Attempt::Failed => Some(Proposed::IMPOSSIBLE),
            Attempt::Proposed(kept) => {
                let density = self.measure.look(space, importance, y);
                if !density.is_possible() {
                    return Some(Proposed::IMPOSSIBLE);
                }
                let there = mutation.ln_density(space, &x.path, &y.path, kept);
                let back = mutation.ln_density(space, &y.path, &x.path, kept);
                Some(Proposed::of(density, there, back))
            }
        }
    }

    /// Makes a proposal of one kind.
    fn propose(
        &self,
        kind: usize,
        film: Vec2,
        importance: &Importance,
        x: &State<'a>,
        y: &mut State<'a>,
        recoloured: &mut Path<SceneVertex<'a>>,
        random: &mut Random,
        cost: &mut RenderCost,
    ) -> Option<Proposed> {
        let is_renewal = kind == BIDIRECTIONAL && random.next_f64() < RENEWALS;
        y.conditions = if is_renewal {
            Conditions::new(random.next_1d(), random.next_1d())
        } else if kind == WAVELENGTH {
            another_colour(&x.conditions, random)
        } else {
            x.conditions
        };
        let space = self.measure.space(&y.conditions);
        let proposed = match kind {
            BIDIRECTIONAL if is_renewal => self.renew(&space, importance, x, y, random),
            BIDIRECTIONAL => self.mutate(&self.bidirectional, &space, importance, x, y, random),
            LENS_SUBPATH => {
                let samples = &mut WithFilm { random, film, pairs: 0 };
                self.mutate(&self.lens_subpath, &space, importance, x, y, samples)
            }
            LENS => self.perturb(&self.lens, &space, importance, x, y, recoloured, random, cost),
            CAUSTIC => self.perturb(&self.caustic, &space, importance, x, y, recoloured, random, cost),
            MULTI_CHAIN => self.perturb(&self.multi_chain, &space, importance, x, y, recoloured, random, cost),
            _ if wavelength::is_bent(&x.path) => None,
            _ => match wavelength::recolour(&space, &x.path, &mut y.path) {
                Some(()) => Some(Proposed { density: self.measure.look(&space, importance, y), ratio: 1.0 }),
                None => Some(Proposed::IMPOSSIBLE),
            },
        };
        count_rays(&space, cost);
        proposed
    }

    /// A perturbation, in another colour now and then where the path is bent by prisms.
    fn perturb<M: Mutation<SceneSpace<'a>>>(
        &self,
        mutation: &M,
        space: &SceneSpace<'a>,
        importance: &Importance,
        x: &State<'a>,
        y: &mut State<'a>,
        recoloured: &mut Path<SceneVertex<'a>>,
        random: &mut Random,
        cost: &mut RenderCost,
    ) -> Option<Proposed> {
        // The probability of staying with the colour.
        let constancy = |path| if wavelength::is_bent(path) { 1.0 - RECOLOURED } else { 1.0 };
        if random.next_f64() < constancy(&x.path) {
            let mut proposed = self.mutate(mutation, space, importance, x, y, random)?;
            if proposed.density.is_possible() {
                proposed.ratio *= constancy(&y.path) / constancy(&x.path);
            }
            return Some(proposed);
        }
        y.conditions = another_colour(&x.conditions, random);
        let there = self.measure.space(&y.conditions);
        let attempt = wavelength::perturb_recoloured(mutation, &there, &x.path, recoloured, &mut y.path, random);
        let proposed = match attempt {
            Attempt::Inapplicable => None,
            Attempt::Failed => Some(Proposed::IMPOSSIBLE),
            // What is not bent is never given another colour in this way: there would be no way back.
            Attempt::Proposed(_) if !wavelength::is_bent(&y.path) => Some(Proposed::IMPOSSIBLE),
            Attempt::Proposed(kept) => {
                let density = self.measure.look(&there, importance, y);
                let ahead = mutation.ln_density(&there, recoloured, &y.path, kept);
                let back = mutation.ln_density(space, &y.path, &x.path, kept);
                Some(Proposed::of(density, ahead, back))
            }
        };
        count_rays(&there, cost);
        proposed
    }

    /// A whole new path, at wavelengths and a moment of its own.
    fn renew(
        &self,
        space: &SceneSpace<'a>,
        importance: &Importance,
        x: &State<'a>,
        y: &mut State<'a>,
        random: &mut Random,
    ) -> Option<Proposed> {
        let Attempt::Proposed(_) = self.bidirectional.renew(space, x.path.len(), &mut y.path, random) else {
            return Some(Proposed::IMPOSSIBLE);
        };
        let density = self.measure.look(space, importance, y);
        if !density.is_possible() {
            return Some(Proposed::IMPOSSIBLE);
        }
        let there = self.bidirectional.ln_density_of_renewal(space, x.path.len(), &y.path);
        let old = self.measure.space(&x.conditions);
        let back = self.bidirectional.ln_density_of_renewal(&old, y.path.len(), &x.path);
        Some(Proposed::of(density, there, back))
    }

    /// The place on the film that a chain's lens subpath mutation starts from: of a pattern that its batch shares.
    fn film_point(&self, chain: u64, mutation: u64) -> Vec2 {
        let pixel = [mutation as u32, (chain % self.batches) as u32];
        self.film_points.samples(pixel, (chain / self.batches) as u32).next_2d()
    }
}

/// The kinds of mutations, by their places among [`MutationProbabilities::NAMES`].
const BIDIRECTIONAL: usize = 0;
const LENS_SUBPATH: usize = 1;
const LENS: usize = 2;
const CAUSTIC: usize = 3;
const MULTI_CHAIN: usize = 4;
const WAVELENGTH: usize = 5;

impl Proposed {
    /// A proposal that cannot be.
    const IMPOSSIBLE: Self = Self { density: Log(f64::NEG_INFINITY), ratio: 1.0 };

    /// A proposal of which `ln T(x→y)` and `ln T(y→x)` are known. One that lies, by rounding, beyond what can be proposed is none: it
    /// is declined, and so is the way back, in which `x` lies there.
    fn of(density: Log, there: f64, back: f64) -> Self {
        if there > f64::NEG_INFINITY { Self { density, ratio: (back - there).exp() } } else { Self::IMPOSSIBLE }
    }
}

/// The same moment in the light of another colour nearby.
fn another_colour(conditions: &Conditions, random: &mut Random) -> Conditions {
    let moved = conditions.colour_u + COLOUR_STEP * (2.0 * random.next_1d() - 1.0);
    conditions.recoloured((moved - moved.floor()).min(ONE_MINUS_EPSILON))
}

impl<'a> ChainProcess for PathSpaceMetropolis<'a> {
    type Chain = PathChain<'a>;
    type Scratch = Workspace<'a>;

    fn scratch(&self) -> Workspace<'a> {
        Workspace::default()
    }

    fn mutations(&self) -> &'static [&'static str] {
        &MutationProbabilities::NAMES
    }

    fn candidates(&self) -> u64 {
        self.candidates
    }

    fn candidate(
        &self,
        number: u64,
        stage: u64,
        importance: &Importance,
        Workspace { walks, .. }: &mut Workspace<'a>,
        splat: &mut impl FnMut(Vec2, f64),
        cost: &mut RenderCost,
    ) -> f64 {
        let mut sum = 0.0;
        self.visit_candidate(number, stage, importance, walks, cost, |_, film, weight| {
            sum += weight;
            splat(film, weight);
        });
        sum
    }

    fn begin(
        &self,
        chain: u64,
        candidate: u64,
        context: ChainContext<'_>,
        _: f64,
        Workspace { walks, .. }: &mut Workspace<'a>,
        cost: &mut RenderCost,
    ) -> Option<PathChain<'a>> {
        let mut random = Random::new(hash(self.seed, CHOICE_STREAM, 0, 0), chain, candidate);
        let mut path: Path<SceneVertex<'a>> = Path::default();
        let mut sum = 0.0;
        let conditions = self.visit_candidate(candidate, 0, context.importance, walks, cost, |found, _, weight| {
            // Each path so far has been kept with a probability in proportion to its weight.
            sum += weight;
            if random.next_f64() * sum < weight {
                path.join(found.light, found.eye, found.x0);
            }
        });
        let space = self.measure.space(&conditions);
        path.evaluate(&space, 0..path.len());
        let mut state = State { path, conditions, ..State::default() };
        let density = self.measure.look(&space, context.importance, &mut state);
        let seed = hash(self.seed, CHAIN_STREAM, 0, 0);
        density.is_possible().then(|| PathChain { chain: Chain::new(seed, chain, state, density), lens_subpaths: 0 })
    }

    fn advance(
        &self,
        PathChain { chain, lens_subpaths }: &mut PathChain<'a>,
        steps: u64,
        context: ChainContext<'_>,
        Workspace { proposed, recoloured, .. }: &mut Workspace<'a>,
        splat: &mut impl FnMut(Vec2, [f32; 3], f64),
        statistics: &mut MutationStatistics,
        cost: &mut RenderCost,
    ) {
        let number = chain.number();
        for _ in 0..steps {
            let watch = StepWatch::start(chain.steps(), cost);
            let mut kind = 0;
            let step = chain.step(proposed, |x, y, random| {
                kind = draw(self.probabilities.iter().copied(), random.next_f64());
                let mut film = Vec2::ZERO;
                if kind == LENS_SUBPATH {
                    film = self.film_point(number, *lens_subpaths);
                    *lens_subpaths += 1;
                }
                self.propose(kind, film, context.importance, x, y, recoloured, random, cost)
                    .map(|Proposed { density, ratio }| Proposal { density, ratio })
            });
            for (state, weight) in [(step.current, step.current_weight), (step.proposed, step.proposed_weight)] {
                if weight > 0.0 {
                    splat(state.film, state.rgb, weight);
                    let repeated = self.measure.camera.repeated_films(state.film, f32::INFINITY);
                    repeated.into_iter().for_each(|film| splat(film, state.rgb, weight));
                }
            }
            statistics.record(kind, step.outcome, step.proposed_weight, &watch, cost);
        }
    }

    fn longest_stay(&self, chain: &PathChain<'a>) -> u64 {
        chain.chain.longest_stay()
    }

    fn save(&self, PathChain { chain, lens_subpaths }: &PathChain<'a>, out: &mut Vec<u8>) {
        let saved = chain.map(|state| Some(state.save()));
        let saved = saved.map(|chain| SavedChain { chain, lens_subpaths: *lens_subpaths });
        // Numbers, and lists of them, always have such a form.
        out.extend(postcard::to_allocvec(&saved).unwrap_or_default());
    }

    fn restore(&self, bytes: &[u8]) -> Option<PathChain<'a>> {
        let (saved, rest) = postcard::take_from_bytes::<Option<SavedChain>>(bytes).ok()?;
        let SavedChain { chain, lens_subpaths } = saved.filter(|_| rest.is_empty())?;
        let chain = chain.map(|state| State::restore(state, &self.measure))?;
        Some(PathChain { chain, lens_subpaths })
    }
}
