//! Multiplexed Metropolis light transport.
//!
//! Hachisuka, Kaplanyan and Dachsbacher 2014, "Multiplexed Metropolis Light Transport": a chain in primary sample space whose paths
//! all scatter equally often, and whose technique, of those of bidirectional path tracing, is one of the coordinates. So the chain spends its
//! time on those techniques that find much. (pbrt-v4's integrator `mlt` is this one.)

use super::primary::{Contribution, Estimators, PrimaryState};
use super::{ChainContext, ChainProcess, Importance, MultiplexedIntegrator, MutationStatistics};
use crate::camera::Camera;
use crate::render::RenderCost;
use crate::settings::Settings;
use crate::world::World;
use glam::Vec2;
use luz_sample::Samples;
use luz_sample::markov::{Chain, PrimarySamples, Proposal};
use luz_sample::random::{Random, hash};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Multiplexed Metropolis.
pub struct Multiplexed<'a> {
    estimators: Estimators<'a>,
    options: MultiplexedIntegrator,
    /// The fewest scatterings, and how many numbers of them there are.
    min_depth: u32,
    depths: u32,
    seed: u64,
}

/// The streams of seeds: what candidates and chains draw are different numbers.
const CANDIDATE_STREAM: u64 = 0x6d6d_6c31;
const CHAIN_STREAM: u64 = 0x6d6d_6c32;

/// The kinds of mutations, and their places.
const MUTATIONS: [&str; 2] = ["large step", "small step"];
const LARGE: usize = 0;
const SMALL: usize = 1;

/// The stream of the coordinate that chooses the technique; all others are in stream 0.
const TECHNIQUE_STREAM: usize = 1;

/// A chain, and how often its paths scatter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MultiplexedChain {
    depth: u32,
    chain: Chain<PrimaryState>,
}

impl<'a> Multiplexed<'a> {
    /// Over the paths of a world.
    pub fn new(world: &'a World, camera: &'a Camera, settings: &'a Settings, options: MultiplexedIntegrator) -> Self {
        let min_depth = options.metropolis.direct_light.min_depth();
        let estimators = Estimators::new(world, camera, settings, [min_depth, options.max_depth]);
        // No depth at all is no light: the candidates of the fewest scatterings are then left out.
        let depths = (options.max_depth + 1).saturating_sub(min_depth);
        Self { estimators, options, min_depth, depths, seed: settings.seed }
    }

    /// The path of a point of primary sample space that scatters so often, over the probability of its technique.
    fn evaluate(
        &self,
        depth: u32,
        mut samples: PrimarySamples<'_>,
        found: &mut Vec<Contribution>,
        cost: &mut RenderCost,
    ) {
        // A path of n vertices has n techniques: from none to all but one of them are made from the light.
        let vertices = depth as usize + 2;
        samples.set_stream(TECHNIQUE_STREAM);
        let s = ((samples.next_1d() * vertices as f32) as usize).min(vertices - 1);
        samples.set_stream(0);
        self.estimators.technique((s, vertices - s), &mut samples, found, cost);
        found.iter_mut().for_each(|contribution| contribution.scale(vertices as f32));
    }

    /// How many candidates each depth has.
    fn candidates_each(&self) -> u64 {
        self.options.metropolis.bootstrap_samples.div_ceil(u64::from(self.depths.max(1)))
    }

    /// How often the path of a candidate scatters. Depths follow one another, so that chains, which are spread evenly over the candidates'
    /// weights, are spread evenly over depths.
    fn depth_of(&self, candidate: u64) -> u32 {
        let place = (candidate / self.candidates_each().max(1)).min(u64::from(self.depths.saturating_sub(1)));
        self.min_depth + place as u32
    }

    /// A candidate, made from its number.
    fn candidate_state(&self, number: u64, stage: u64, state: &mut PrimaryState, cost: &mut RenderCost) {
        let PrimaryState { sample, contributions } = state;
        contributions.clear();
        if self.depths == 0 {
            return;
        }
        let mut random = Random::new(hash(self.seed, CANDIDATE_STREAM, stage, 0), number, 0);
        self.evaluate(self.depth_of(number), PrimarySamples::large(sample, &mut random), contributions, cost);
    }
}

impl ChainProcess for Multiplexed<'_> {
    type Chain = MultiplexedChain;
    type Scratch = PrimaryState;

    fn scratch(&self) -> PrimaryState {
        PrimaryState::default()
    }

    fn mutations(&self) -> &'static [&'static str] {
        &MUTATIONS
    }

    fn candidates(&self) -> u64 {
        self.candidates_each() * u64::from(self.depths.max(1))
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
        // Each depth has its share of the candidates, and b is the sum over depths.
        let share = f64::from(self.depths);
        for contribution in &scratch.contributions {
            splat(contribution.film(), contribution.density(importance) * share);
        }
        scratch.density(importance) * share
    }

    fn begin(
        &self,
        chain: u64,
        candidate: u64,
        context: ChainContext<'_>,
        _: &mut PrimaryState,
        cost: &mut RenderCost,
    ) -> Option<MultiplexedChain> {
        let mut state = PrimaryState::default();
        self.candidate_state(candidate, 0, &mut state, cost);
        let density = state.density(context.importance);
        let seed = hash(self.seed, CHAIN_STREAM, 0, 0);
        let depth = self.depth_of(candidate);
        (density > 0.0).then(|| MultiplexedChain { depth, chain: Chain::new(seed, chain, state, density) })
    }

    fn advance(
        &self,
        MultiplexedChain { depth, chain }: &mut MultiplexedChain,
        steps: u64,
        context: ChainContext<'_>,
        spare: &mut PrimaryState,
        splat: &mut impl FnMut(Vec2, [f32; 3], f64),
        statistics: &mut MutationStatistics,
        cost: &mut RenderCost,
    ) {
        let MultiplexedIntegrator { large_step_probability, kernel, .. } = self.options;
        for _ in 0..steps {
            let begun = MutationStatistics::is_timed(chain.steps()).then(Instant::now);
            let before = *cost;
            let mut is_large = false;
            let step = chain.step(spare, |current, proposed, random| {
                is_large = random.next_f64() < large_step_probability;
                let PrimaryState { sample, contributions } = &mut *proposed;
                let samples = if is_large {
                    PrimarySamples::large(sample, random)
                } else {
                    PrimarySamples::small(&current.sample, sample, kernel, random)
                };
                self.evaluate(*depth, samples, contributions, cost);
                Some(Proposal::symmetric(proposed.density(context.importance)))
            });
            // Large steps are independent samples of one depth, whose own b is not known well enough for them to be used twice.
            for (state, density, weight) in [
                (step.current, step.current_density, step.current_weight),
                (step.proposed, step.proposed_density, step.proposed_weight),
            ] {
                if weight > 0.0 && density > 0.0 {
                    state.contributions.iter().for_each(|found| splat(found.film(), found.color(density), weight));
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

    fn longest_stay(&self, chain: &MultiplexedChain) -> u64 {
        chain.chain.longest_stay()
    }

    fn save(&self, chain: &MultiplexedChain, out: &mut Vec<u8>) {
        // Numbers, and lists of them, always have such a form.
        out.extend(postcard::to_allocvec(chain).unwrap_or_default());
    }

    fn restore(&self, bytes: &[u8]) -> Option<MultiplexedChain> {
        let (chain, rest) = postcard::take_from_bytes::<MultiplexedChain>(bytes).ok()?;
        let is_ours = (self.min_depth..=self.options.max_depth).contains(&chain.depth);
        (rest.is_empty() && is_ours).then_some(chain)
    }
}
