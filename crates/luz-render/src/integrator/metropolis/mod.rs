//! Metropolis light transport: Markov chains over paths, or over the numbers that paths are made from.
//!
//! All kinds share one engine (`render`), which draws candidates, starts chains, advances them, and puts the
//! picture together; a kind is a [`ChainProcess`].

mod importance;
mod multiplexed;
pub mod path_space;
mod primary_chain;
mod primary_space;
mod settings;
mod statistics;

pub use importance::Importance;
pub(crate) use importance::cell_at;
pub use multiplexed::{Multiplexed, MultiplexedChain, MultiplexedScratch};
pub use primary_chain::PrimaryState;
pub use primary_space::{PrimaryScratch, PrimarySpace};
pub use settings::{
    DirectLight, Metropolis, MultiplexedIntegrator, MutationProbabilities, PathSpaceIntegrator, PerturbationRanges,
    PrimaryEstimator, PrimarySpaceIntegrator,
};
pub use statistics::{MutationRecord, MutationStatistics, StepWatch};

use crate::render::RenderCost;
use crate::transport::SceneSpace;
use glam::Vec2;

/// The magnitude of a contribution, which target densities are in proportion to: the mean magnitude of its components in the film's
/// RGB.
///
/// Not its luminance, as in the literature: paths of few wavelengths at the ends of the visible have hardly any, but much red or
/// blue, and the weight of such a state, `F / f`, would be without bounds. By this one a component is at most 3.
#[inline]
pub fn scalar_contribution(rgb: [f32; 3]) -> f64 {
    rgb.iter().map(|v| f64::from(v.abs())).sum::<f64>() / 3.0
}

fn count_rays(space: &SceneSpace<'_>, cost: &mut RenderCost) {
    let (rays, shadow_rays) = space.rays();
    cost.rays += u64::from(rays);
    cost.shadow_rays += u64::from(shadow_rays);
}

/// What all chains of a process share once they begin.
#[derive(Clone, Copy, Debug)]
pub struct ChainContext<'a> {
    /// The estimate of `b = ∫ f`, positive.
    pub normalization: f64,
    /// The importance of film positions, by which the target density is divided.
    pub importance: &'a Importance,
}

/// A kind of Metropolis light transport: how states are first found, and how they move.
///
/// With the contribution `F(x)` of a path to the film position `film(x)`, a density in px², the *target density* is
/// `f(x) = |F(x)| / importance(film(x))`, with [`scalar_contribution`] for the magnitude, over all paths of any film position within the
/// [`film window`](crate::Settings::film_window), which is wider than the frame by the pixel filter; its integral is `b`. The
/// engine scales: a pixel's value is `b` times the mean over all mutations of what is splatted, so that a state is splatted as
/// `F(x) / f(x)` times its weight, which is of the order of one. (Weights that have `b` in them, as
/// [`large_step_weights`](luz_sample::markov::large_step_weights) have, are divided by it.)
///
/// All that happens is a pure function of (scene, settings, seed, number of candidate or chain, number of step): a chain advanced by 3
/// steps and then 4 is the chain advanced by 7.
pub trait ChainProcess: Sync {
    /// A chain: its present state, and what it has counted.
    type Chain: Send + Sync;
    /// Memory that is used again from step to step, by one thread at a time.
    type Scratch: Send;

    /// New scratch memory.
    fn scratch(&self) -> Self::Scratch;

    /// The names of the kinds of mutations, in the order in which the statistics count them.
    fn mutations(&self) -> &'static [&'static str];

    /// How many candidates the chains are started from.
    fn candidates(&self) -> u64;

    /// Kinds of candidates, between which chains never move: equally many of each kind, one kind after the other.
    fn strata(&self) -> u64 {
        1
    }

    /// The weight `f(x) / p(x)` of an independent candidate: its mean over candidates is `b`. If a candidate is several paths, or
    /// one of several lengths, it is the sum of their weights, and [`begin`](Self::begin) chooses. `splat` is given each path's
    /// film position and weight, for a first image of the importance. `stage` is 0, or 1 where candidates are drawn for that
    /// image alone: the two have different numbers.
    fn candidate(
        &self,
        number: u64,
        stage: u64,
        importance: &Importance,
        scratch: &mut Self::Scratch,
        splat: &mut impl FnMut(Vec2, f64),
        cost: &mut RenderCost,
    ) -> f64;

    /// Chain `chain` in its first state, which is one of candidate `candidate` of stage 0, made again from its number and chosen
    /// in proportion to its share of the weight. `None` if it has none after all; the chain is then left out, and that is reported.
    /// `stratum_normalization` is the part of `b` that candidates of its kind have: all, where there is one kind.
    fn begin(
        &self,
        chain: u64,
        candidate: u64,
        context: ChainContext<'_>,
        stratum_normalization: f64,
        scratch: &mut Self::Scratch,
        cost: &mut RenderCost,
    ) -> Option<Self::Chain>;

    /// Makes `steps` mutations. `splat` is given a film position, the colour `F(x) / f(x)` in the film's RGB, and a weight, for
    /// the current and the proposed state of each.
    fn advance(
        &self,
        chain: &mut Self::Chain,
        steps: u64,
        context: ChainContext<'_>,
        scratch: &mut Self::Scratch,
        splat: &mut impl FnMut(Vec2, [f32; 3], f64),
        statistics: &mut MutationStatistics,
        cost: &mut RenderCost,
    );

    /// The most mutations that a chain has been in one state for.
    fn longest_stay(&self, chain: &Self::Chain) -> u64;

    /// Appends the chain as bytes.
    fn save(&self, chain: &Self::Chain, out: &mut Vec<u8>);

    /// The chain that was saved; `None` if the bytes are of none.
    fn restore(&self, bytes: &[u8]) -> Option<Self::Chain>;
}
