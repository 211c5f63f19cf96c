//! Chains in primary sample space, whatever is made of its points.

use super::{Importance, MutationStatistics, StepWatch, scalar_contribution};
use crate::render::RenderCost;
use glam::Vec2;
use luz_sample::markov::{Chain, Kernel, PrimarySample, PrimarySamples, Proposal, large_step_weights};
use luz_sample::random::Random;
use serde::{Deserialize, Serialize};

/// The kinds of mutations, and their places.
pub(super) const MUTATIONS: [&str; 2] = ["large step", "small step"];
const LARGE: usize = 0;
const SMALL: usize = 1;

/// A point of primary sample space, and what an estimator has made of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PrimaryState {
    pub(super) sample: PrimarySample,
    /// Contributions to the film.
    pub(super) found: Vec<Arrival>,
}

/// Light that arrives at the film.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Arrival {
    /// In pixels from the frame's top left corner.
    pub film: [f32; 2],
    /// Over the density of all numbers that it was made from, in the film's RGB, of all of the film.
    pub rgb: [f32; 3],
}

impl Arrival {
    pub fn at(film: Vec2, rgb: [f32; 3]) -> Self {
        Self { film: film.to_array(), rgb }
    }

    pub fn film(&self) -> Vec2 {
        Vec2::from_array(self.film)
    }

    /// The target density of the point, as far as this contributes to it.
    pub fn density(&self, importance: &Importance) -> f64 {
        scalar_contribution(self.rgb) / importance.at(self.film())
    }
}

impl PrimaryState {
    /// Becomes what `evaluate` makes of an independent point. Returns the target density.
    pub(super) fn draw(
        &mut self,
        random: &mut Random,
        importance: &Importance,
        evaluate: impl FnOnce(&mut PrimarySamples<'_>, &mut Vec<Arrival>),
    ) -> f64 {
        self.found.clear();
        evaluate(&mut PrimarySamples::large(&mut self.sample, random), &mut self.found);
        self.density(importance)
    }

    /// The target density: the sum over all that has been found. One point can contribute to several places of the film.
    pub fn density(&self, importance: &Importance) -> f64 {
        self.found.iter().map(|arrival| arrival.density(importance)).sum()
    }
}

/// How chains go.
pub(super) struct Steps<'a> {
    /// By what the target density is divided.
    pub importance: &'a Importance,
    /// The integral of the target density over the space of this chain.
    pub normalization: f64,
    /// The probability of large steps.
    pub large_step_probability: f64,
    /// How far small ones go.
    pub kernel: Kernel,
}

impl Steps<'_> {
    /// Makes `steps` mutations of a chain. `evaluate` adds what it makes of a point to a list; `splat`, `statistics` and `cost` as in
    /// [`ChainProcess::advance`](super::ChainProcess::advance).
    pub fn advance(
        &self,
        chain: &mut Chain<PrimaryState>,
        steps: u64,
        spare: &mut PrimaryState,
        mut evaluate: impl FnMut(&mut PrimarySamples<'_>, &mut Vec<Arrival>, &mut RenderCost),
        splat: &mut impl FnMut(Vec2, [f32; 3], f64),
        (statistics, cost): (&mut MutationStatistics, &mut RenderCost),
    ) {
        let color = |rgb: [f32; 3]| rgb.map(|v| (f64::from(v) / self.normalization) as f32);
        for _ in 0..steps {
            let watch = StepWatch::start(chain.steps(), cost);
            let mut is_large = false;
            let step = chain.step(spare, |current, proposed, random| {
                is_large = random.next_f64() < self.large_step_probability;
                let PrimaryState { sample, found } = proposed;
                found.clear();
                let mut samples = if is_large {
                    PrimarySamples::large(sample, random)
                } else {
                    PrimarySamples::small(&current.sample, sample, self.kernel, random)
                };
                evaluate(&mut samples, found, cost);
                Some(Proposal::symmetric(proposed.density(self.importance)))
            });
            let [of_current, of_proposed] = large_step_weights(
                step.proposed_weight,
                is_large,
                step.current_density,
                step.proposed_density,
                self.normalization,
                self.large_step_probability,
            );
            for (state, weight) in [(step.current, of_current), (step.proposed, of_proposed)] {
                if weight > 0.0 {
                    state.found.iter().for_each(|found| splat(found.film(), color(found.rgb), weight));
                }
            }
            let kind = if is_large { LARGE } else { SMALL };
            statistics.record(kind, step.outcome, step.proposed_weight, &watch, cost);
        }
    }
}
