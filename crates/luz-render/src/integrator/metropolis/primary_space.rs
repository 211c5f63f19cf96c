//! Metropolis light transport in primary sample space.
//!
//! Kelemen, Szirmay-Kalos, Antal and Csonka 2002, "A Simple and Robust Mutation Strategy for the Metropolis Light Transport Algorithm":
//! the state of a chain is the point of the unit cube that drives an estimator. Film position, lens, time and wavelengths are coordinates
//! like all others.

use super::primary::{Estimators, PrimaryState};
use super::{ChainContext, ChainProcess, Importance, MutationStatistics, PrimaryEstimator, PrimarySpaceIntegrator};
use crate::camera::Camera;
use crate::render::RenderCost;
use crate::settings::Settings;
use crate::world::World;
use glam::Vec2;
use luz_sample::markov::{Chain, PrimarySamples, Proposal, large_step_weights};
use luz_sample::random::{Random, hash};
use std::time::Instant;

/// Primary-space Metropolis over a path tracer, unidirectional or bidirectional.
pub struct PrimarySpace<'a> {
    estimators: Estimators<'a>,
    options: PrimarySpaceIntegrator,
    seed: u64,
}

/// The streams of seeds: what candidates and chains draw are different numbers.
const CANDIDATE_STREAM: u64 = 0x7073_7331;
const CHAIN_STREAM: u64 = 0x7073_7332;

/// The kinds of mutations, and their places.
const MUTATIONS: [&str; 2] = ["large step", "small step"];
const LARGE: usize = 0;
const SMALL: usize = 1;

impl<'a> PrimarySpace<'a> {
    /// Over the paths of a world.
    pub fn new(world: &'a World, camera: &'a Camera, settings: &'a Settings, options: PrimarySpaceIntegrator) -> Self {
        let depths = [options.metropolis.direct_light.min_depth(), options.max_depth];
        Self { estimators: Estimators::new(world, camera, settings, depths), options, seed: settings.seed }
    }

    /// What the estimator makes of a point of primary sample space.
    fn evaluate(
        &self,
        mut samples: PrimarySamples<'_>,
        found: &mut Vec<super::primary::Contribution>,
        cost: &mut RenderCost,
    ) {
        match self.options.estimator {
            PrimaryEstimator::Path => self.estimators.path(&mut samples, found, cost),
            PrimaryEstimator::Bidirectional => self.estimators.bidirectional(&mut samples, found, cost),
        }
    }

    /// A candidate, made from its number.
    fn candidate_state(&self, number: u64, stage: u64, state: &mut PrimaryState, cost: &mut RenderCost) {
        let mut random = Random::new(hash(self.seed, CANDIDATE_STREAM, stage, 0), number, 0);
        let PrimaryState { sample, contributions } = state;
        self.evaluate(PrimarySamples::large(sample, &mut random), contributions, cost);
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
        for contribution in &scratch.contributions {
            splat(contribution.film(), contribution.density(importance));
        }
        scratch.density(importance)
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
        let density = state.density(context.importance);
        let seed = hash(self.seed, CHAIN_STREAM, 0, 0);
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
                self.evaluate(samples, contributions, cost);
                Some(Proposal::symmetric(proposed.density(context.importance)))
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
                    state.contributions.iter().for_each(|found| splat(found.film(), found.color(b), weight));
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
