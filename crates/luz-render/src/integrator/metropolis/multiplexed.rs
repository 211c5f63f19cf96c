//! Multiplexed Metropolis light transport (Hachisuka, Kaplanyan and Dachsbacher 2014).
//!
//! A chain is of paths of one length, and in primary sample space; one more coordinate chooses the technique `(s, t)` of bidirectional
//! path tracing by which a path is made. Of a state only that one path is made. With `N` techniques of the length, each chosen with
//! probability `1 / N`, the estimator is
//!
//! ```text
//! F(u) = N w_{s,t}(x) f(x) / p_{s,t}(x),
//! ```
//!
//! with the weight `w` of multiple importance sampling. Small steps move within a technique most of the time; a chain spends its time
//! in techniques in proportion to what they contribute, as importance sampling of techniques would.
//!
//! Lengths are kept apart. Candidates are of one length each, all those of a length one after the other, and the mean of
//! what they contribute is that length's part `b_d` of `b`. Chains are spread evenly over the candidates' weights, so that the share
//! `b_d / b` of all chains is of that length, up to one chain.

use super::primary_chain::{Arrival, MUTATIONS, PrimaryState, Steps};
use super::{ChainContext, ChainProcess, Importance, MultiplexedIntegrator, MutationStatistics, count_rays};
use crate::camera::Camera;
use crate::film::FilmWindow;
use crate::integrator::walks::{Walks, camera_start};
use crate::render::RenderCost;
use crate::settings::Settings;
use crate::transport::SceneSpace;
use crate::world::World;
use glam::Vec2;
use luz_color::Wavelengths;
use luz_sample::Samples;
use luz_sample::markov::{Chain, PrimarySamples};
use luz_sample::mis::Heuristic;
use luz_sample::random::{Random, hash};
use serde::{Deserialize, Serialize};

/// Multiplexed Metropolis.
pub struct Multiplexed<'a> {
    world: &'a World,
    camera: &'a Camera,
    settings: &'a Settings,
    options: MultiplexedIntegrator,
    window: FilmWindow,
}

/// The streams of seeds: what candidates and chains draw are different numbers.
const CANDIDATE_STREAM: u64 = 0x6d6d_6c31;
const CHAIN_STREAM: u64 = 0x6d6d_6c32;

/// Every length has as many candidates as are asked for, as long as there are no more than so many lengths; else they share what
/// so many would have, lest very long paths, which hardly contribute, take all the time.
const MOST_FULL_LENGTHS: u64 = 16;

/// A chain of paths of one length.
#[derive(Serialize, Deserialize)]
pub struct MultiplexedChain {
    chain: Chain<PrimaryState>,
    /// How many times its paths scatter.
    depth: u32,
    /// The integral of the target density over paths of this length, `b_d`.
    normalization: f64,
}

/// Memory for one step after another.
#[derive(Default)]
pub struct MultiplexedScratch<'w> {
    spare: PrimaryState,
    walks: Walks<'w>,
}

impl<'a> Multiplexed<'a> {
    /// Over the paths of a world.
    pub fn new(world: &'a World, camera: &'a Camera, settings: &'a Settings, options: MultiplexedIntegrator) -> Self {
        Self { world, camera, settings, options, window: settings.film_window() }
    }

    /// How many candidates are of one length.
    fn candidates_each(&self) -> u64 {
        let (samples, lengths) = (self.options.metropolis.bootstrap_samples, self.strata());
        samples.saturating_mul(lengths.min(MOST_FULL_LENGTHS)).div_ceil(lengths).max(1)
    }

    /// How many times paths scatter that a candidate is of.
    fn depth(&self, candidate: u64) -> u32 {
        let length = u32::try_from(candidate / self.candidates_each()).unwrap_or(u32::MAX);
        self.options.metropolis.direct_light.min_depth().saturating_add(length)
    }

    /// What a point of primary sample space is, as a path that scatters `depth` times.
    fn evaluate(
        &self,
        depth: u32,
        walks: &mut Walks<'a>,
        samples: &mut PrimarySamples<'_>,
        found: &mut Vec<Arrival>,
        cost: &mut RenderCost,
    ) {
        if depth > self.options.max_depth {
            return;
        }
        let Self { world, camera, window, .. } = *self;
        // Of n vertices, from none to n − 1 are made from the light: as many techniques as vertices.
        let vertices = depth as usize + 2;
        let chosen = (f64::from(samples.next_1d()) * vertices as f64) as usize;
        let technique = (chosen, vertices - chosen);
        let wavelengths = Wavelengths::sample_visible(samples.next_1d());
        let start = camera_start(window, technique.1 > 1, samples);
        let space = SceneSpace::new(world, camera, window, wavelengths, start.time_u);
        let mut rgb = [0.0; 3];
        let mut film = None;
        walks.one_technique(&space, &start, technique, Heuristic::default(), samples, |path, weight| {
            let color = path.rgb(&space, &self.settings.sensor);
            let scale = vertices as f32 * weight;
            rgb = std::array::from_fn(|c| rgb[c] + scale * color[c]);
            film = path.film(&space, &start);
        });
        if let Some(film) = film {
            found.push(Arrival::at(film, rgb));
        }
        cost.paths += 1;
        count_rays(&space, cost);
    }

    /// A candidate, made from its number. Returns its target density.
    fn draw_candidate(
        &self,
        number: u64,
        stage: u64,
        importance: &Importance,
        MultiplexedScratch { spare, walks }: &mut MultiplexedScratch<'a>,
        cost: &mut RenderCost,
    ) -> f64 {
        let mut random = Random::new(hash(self.settings.seed, CANDIDATE_STREAM, stage, 0), number, 0);
        let depth = self.depth(number);
        spare.draw(&mut random, importance, |samples, found| self.evaluate(depth, walks, samples, found, cost))
    }
}

impl<'a> ChainProcess for Multiplexed<'a> {
    type Chain = MultiplexedChain;
    type Scratch = MultiplexedScratch<'a>;

    fn scratch(&self) -> MultiplexedScratch<'a> {
        MultiplexedScratch::default()
    }

    fn mutations(&self) -> &'static [&'static str] {
        &MUTATIONS
    }

    fn candidates(&self) -> u64 {
        self.candidates_each().saturating_mul(self.strata())
    }

    /// One for each length. At least one, of which no candidate finds anything, where all paths are too short for the chains.
    fn strata(&self) -> u64 {
        let min_depth = self.options.metropolis.direct_light.min_depth();
        u64::from(self.options.max_depth.saturating_sub(min_depth)) + 1
    }

    fn candidate(
        &self,
        number: u64,
        stage: u64,
        importance: &Importance,
        scratch: &mut MultiplexedScratch<'a>,
        splat: &mut impl FnMut(Vec2, f64),
        cost: &mut RenderCost,
    ) -> f64 {
        // Each length has its share of all candidates.
        let lengths = self.strata() as f64;
        let weight = lengths * self.draw_candidate(number, stage, importance, scratch, cost);
        scratch.spare.found.iter().for_each(|found| splat(found.film(), lengths * found.density(importance)));
        weight
    }

    fn begin(
        &self,
        chain: u64,
        candidate: u64,
        context: ChainContext<'_>,
        stratum_normalization: f64,
        scratch: &mut MultiplexedScratch<'a>,
        cost: &mut RenderCost,
    ) -> Option<MultiplexedChain> {
        let density = self.draw_candidate(candidate, 0, context.importance, scratch, cost);
        let seed = hash(self.settings.seed, CHAIN_STREAM, 0, 0);
        (density > 0.0).then(|| MultiplexedChain {
            chain: Chain::new(seed, chain, scratch.spare.clone(), density),
            depth: self.depth(candidate),
            normalization: stratum_normalization,
        })
    }

    fn advance(
        &self,
        MultiplexedChain { chain, depth, normalization }: &mut MultiplexedChain,
        steps: u64,
        ChainContext { importance, .. }: ChainContext<'_>,
        MultiplexedScratch { spare, walks }: &mut MultiplexedScratch<'a>,
        splat: &mut impl FnMut(Vec2, [f32; 3], f64),
        statistics: &mut MutationStatistics,
        cost: &mut RenderCost,
    ) {
        let MultiplexedIntegrator { large_step_probability, kernel, .. } = self.options;
        // The share b_d / b of all chains is of this length, so that what the engine scales by b is scaled by b_d in the end.
        let going = Steps { importance, normalization: *normalization, large_step_probability, kernel };
        let evaluate = |samples: &mut PrimarySamples<'_>, found: &mut Vec<Arrival>, cost: &mut RenderCost| {
            self.evaluate(*depth, walks, samples, found, cost);
        };
        going.advance(chain, steps, spare, evaluate, splat, (statistics, cost));
    }

    fn longest_stay(&self, chain: &MultiplexedChain) -> u64 {
        chain.chain.longest_stay()
    }

    fn save(&self, chain: &MultiplexedChain, out: &mut Vec<u8>) {
        // Numbers, and lists of them, always have such a form.
        out.extend(postcard::to_allocvec(chain).unwrap_or_default());
    }

    fn restore(&self, bytes: &[u8]) -> Option<MultiplexedChain> {
        let (chain, rest) = postcard::take_from_bytes::<MultiplexedChain>(bytes).ok()?;
        let is_sound = rest.is_empty()
            && chain.depth <= self.options.max_depth
            && chain.normalization > 0.0
            && chain.normalization.is_finite();
        is_sound.then_some(chain)
    }
}
