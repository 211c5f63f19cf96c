//! What became of mutations, by their kind.

use crate::render::RenderCost;
use luz_sample::markov::{Acceptance, Outcome};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// One mutation in so many is timed: clocks cost more than some mutations' bookkeeping.
const TIMED_EVERY: u64 = 64;

/// What is known of one kind of mutation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MutationRecord {
    /// What became of its proposals.
    pub acceptance: Acceptance,
    /// Rays, of either kind, that were traced for them.
    pub rays: u64,
    /// How many were timed.
    pub timed: u64,
    /// The seconds that those took, of one thread.
    pub seconds: f64,
}

impl MutationRecord {
    /// Seconds of one thread per mutation; 0 as long as none was timed.
    pub fn seconds_each(&self) -> f64 {
        if self.timed == 0 { 0.0 } else { self.seconds / self.timed as f64 }
    }
}

/// What a mutation costs, from its beginning.
#[derive(Clone, Copy, Debug)]
pub struct StepWatch {
    begun: Option<Instant>,
    rays: u64,
}

impl StepWatch {
    /// At the beginning of a chain's step, given what it has cost so far.
    #[inline]
    pub fn start(step: u64, cost: &RenderCost) -> Self {
        Self { begun: step.is_multiple_of(TIMED_EVERY).then(Instant::now), rays: rays(cost) }
    }
}

fn rays(cost: &RenderCost) -> u64 {
    cost.rays + cost.shadow_rays
}

/// What became of mutations, by their kind.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MutationStatistics {
    /// By the kind's place among [`ChainProcess::mutations`](super::ChainProcess::mutations).
    pub kinds: Vec<MutationRecord>,
}

impl MutationStatistics {
    /// Of so many kinds, none of which was proposed.
    pub fn new(kinds: usize) -> Self {
        Self { kinds: vec![MutationRecord::default(); kinds] }
    }

    /// A mutation of a kind was accepted with `probability`, or not, after what has been traced since the watch was started.
    #[inline]
    pub fn record(&mut self, kind: usize, outcome: Outcome, probability: f64, watch: &StepWatch, cost: &RenderCost) {
        if let Some(record) = self.kinds.get_mut(kind) {
            record.acceptance.record(outcome, probability);
            record.rays += rays(cost) - watch.rays;
            if let Some(begun) = watch.begun {
                record.timed += 1;
                record.seconds += begun.elapsed().as_secs_f64();
            }
        }
    }

    /// Takes in all that `other` has counted.
    pub fn merge(&mut self, other: &Self) {
        if self.kinds.len() < other.kinds.len() {
            self.kinds.resize(other.kinds.len(), MutationRecord::default());
        }
        for (ours, theirs) in self.kinds.iter_mut().zip(&other.kinds) {
            ours.acceptance.merge(&theirs.acceptance);
            ours.rays += theirs.rays;
            ours.timed += theirs.timed;
            ours.seconds += theirs.seconds;
        }
    }
}
