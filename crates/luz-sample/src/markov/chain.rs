//! The Metropolis–Hastings algorithm.

use serde::{Deserialize, Serialize};

use super::acceptance::{Acceptance, Outcome};
use super::density::Density;
use crate::random::{Random, unit_f64};

/// The dimension of a step's random numbers that decides on acceptance, out of the way of those that proposals draw.
const DECISION: u32 = u32::MAX;

/// What is known of a proposed state `y`, made from the current state `x`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proposal<D = f64> {
    /// The target density at `y`, not normalised.
    pub density: D,
    /// `T(y → x) / T(x → y)`: how densely the proposals made from `y` lie at `x`, over how densely those made from `x` lie
    /// at `y`. Zero if the way back is impossible, in which case the proposal is never accepted.
    pub ratio: f64,
}

impl<D> Proposal<D> {
    /// A proposal that is made as often from `y` as from `x`.
    pub const fn symmetric(density: D) -> Self {
        Self { density, ratio: 1.0 }
    }
}

/// A Markov chain that visits states `S` with a frequency in proportion to a target density of type `D`, which is `f64` or
/// [`Log`](super::Log).
///
/// It is plain data. Two chains of different numbers, or under different seeds, are independent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chain<S, D = f64> {
    seed: u64,
    number: u64,
    steps: u64,
    state: S,
    density: D,
    stay: u64,
    longest_stay: u64,
    acceptance: Acceptance,
}

/// What happened in a step, with the two states to be weighted in an estimate.
///
/// Taking both states by their weights, rather than only the one where the chain is next, leaves the expectation as it is and
/// takes the chance of acceptance out of the variance ("expected values", Veach and Guibas 1997, section 5.2).
#[derive(Debug)]
pub struct Step<'a, S, D = f64> {
    /// The state before the step.
    pub current: &'a S,
    /// Its density.
    pub current_density: D,
    /// The probability with which the chain stayed, `1 − a`.
    pub current_weight: f64,
    /// The state that was proposed. If none was, it means nothing, and its weight is zero.
    pub proposed: &'a S,
    /// Its density; that of the current state if none was proposed.
    pub proposed_density: D,
    /// The probability with which the chain went there, `a`.
    pub proposed_weight: f64,
    /// What became of the proposal.
    pub outcome: Outcome,
}

impl<S, D: Density> Chain<S, D> {
    /// Chain `number` under a seed, in its first state, of which the density is given.
    ///
    /// If that density is zero, the first proposal of a positive one is accepted.
    pub fn new(seed: u64, number: u64, state: S, density: D) -> Self {
        Self { seed, number, steps: 0, state, density, stay: 0, longest_stay: 0, acceptance: Acceptance::default() }
    }

    /// Makes one step.
    ///
    /// `propose` is given the current state and writes a proposal over what is in `spare`, whatever that is, with numbers
    /// drawn from `random` (any but its very last dimension), which are the step's own. It returns `None` if there is nothing
    /// to propose, and the chain stays. Afterwards `spare` holds the state that is not the chain's, to be written over in
    /// the next step of this or any other chain; states with allocated memory are never allocated anew.
    ///
    /// The proposal is accepted with probability `a = min(1, f(y) T(y → x) / (f(x) T(x → y)))` (Hastings 1970).
    #[inline]
    pub fn step<'a>(
        &'a mut self,
        spare: &'a mut S,
        propose: impl FnOnce(&S, &mut S, &mut Random) -> Option<Proposal<D>>,
    ) -> Step<'a, S, D> {
        let mut random = Random::new(self.seed, self.number, self.steps);
        let decision = unit_f64(random.at(DECISION));
        self.steps += 1;
        let proposal = propose(&self.state, spare, &mut random);
        let (probability, declined) = proposal.as_ref().map_or((0.0, Outcome::Inapplicable), |p| self.judge(p));
        let accepted = decision < probability;
        let outcome = if accepted { Outcome::Accepted } else { declined };
        self.acceptance.record(outcome, probability);
        let current_density = self.density;
        let proposed_density = proposal.map_or(current_density, |p| p.density);
        let (current, proposed) = if accepted {
            std::mem::swap(&mut self.state, spare);
            self.density = proposed_density;
            self.stay = 0;
            (&*spare, &self.state)
        } else {
            self.stay += 1;
            self.longest_stay = self.longest_stay.max(self.stay);
            (&self.state, &*spare)
        };
        Step {
            current,
            current_density,
            current_weight: 1.0 - probability,
            proposed,
            proposed_density,
            proposed_weight: probability,
            outcome,
        }
    }

    /// The probability of acceptance, and what a proposal is if it is not accepted.
    #[inline]
    fn judge(&self, proposal: &Proposal<D>) -> (f64, Outcome) {
        if !(proposal.density.is_valid() && (0.0..f64::INFINITY).contains(&proposal.ratio)) {
            return (0.0, Outcome::Invalid);
        }
        if !proposal.density.is_possible() || proposal.ratio == 0.0 {
            return (0.0, Outcome::Impossible);
        }
        if !self.density.is_possible() {
            return (1.0, Outcome::Rejected);
        }
        let probability = proposal.density.ratio(self.density) * proposal.ratio;
        // An overflow is a certainty. Infinity by zero is not possible, but min() would take it for one.
        if probability.is_nan() { (0.0, Outcome::Invalid) } else { (probability.min(1.0), Outcome::Rejected) }
    }
}

impl<S, D: Copy> Chain<S, D> {
    /// The same chain with its state in another form, if there is one: as it is kept in files, say.
    pub fn map<T>(&self, form: impl FnOnce(&S) -> Option<T>) -> Option<Chain<T, D>> {
        let Self { seed, number, steps, ref state, density, stay, longest_stay, acceptance } = *self;
        Some(Chain { seed, number, steps, state: form(state)?, density, stay, longest_stay, acceptance })
    }

    /// Where the chain is.
    pub fn state(&self) -> &S {
        &self.state
    }

    /// The density there.
    pub fn density(&self) -> D {
        self.density
    }

    /// Its number.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The steps that it made.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// What became of its proposals.
    pub fn acceptance(&self) -> &Acceptance {
        &self.acceptance
    }

    /// How many steps it has been where it is.
    pub fn stay(&self) -> u64 {
        self.stay
    }

    /// The longest that it ever stayed.
    pub fn longest_stay(&self) -> u64 {
        self.longest_stay
    }

    /// Whether it has stayed for more than `limit` steps now: a state that its proposals can hardly leave.
    pub fn is_stuck(&self, limit: u64) -> bool {
        self.stay > limit
    }
}
