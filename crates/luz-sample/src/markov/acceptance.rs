//! What became of proposals.

use serde::{Deserialize, Serialize};

/// What became of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Outcome {
    /// It is the chain's state now.
    Accepted,
    /// It was possible, and declined.
    Rejected,
    /// Its density was zero, or it could not have been undone.
    Impossible,
    /// Its density, or the ratio of the proposals' densities, was negative, infinite or NaN.
    Invalid,
    /// There was nothing that could be proposed from the state.
    Inapplicable,
}

/// Counts of what became of proposals; a chain has one over all, and whoever mixes kinds of proposals keeps one for each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Acceptance {
    accepted: u64,
    rejected: u64,
    impossible: u64,
    invalid: u64,
    inapplicable: u64,
    /// The sum of acceptance probabilities.
    probability: f64,
}

impl Acceptance {
    /// Takes in what became of a step, which was accepted with `probability`.
    #[inline]
    pub fn record(&mut self, outcome: Outcome, probability: f64) {
        let count = match outcome {
            Outcome::Accepted => &mut self.accepted,
            Outcome::Rejected => &mut self.rejected,
            Outcome::Impossible => &mut self.impossible,
            Outcome::Invalid => &mut self.invalid,
            Outcome::Inapplicable => &mut self.inapplicable,
        };
        *count += 1;
        self.probability += probability;
    }

    /// Takes in all that `other` has counted.
    pub fn merge(&mut self, other: &Self) {
        self.accepted += other.accepted;
        self.rejected += other.rejected;
        self.impossible += other.impossible;
        self.invalid += other.invalid;
        self.inapplicable += other.inapplicable;
        self.probability += other.probability;
    }

    /// Steps, of whatever outcome.
    pub fn steps(&self) -> u64 {
        self.proposals() + self.inapplicable
    }

    /// Steps in which something was proposed.
    pub fn proposals(&self) -> u64 {
        self.accepted + self.rejected + self.impossible + self.invalid
    }

    /// Steps of an outcome.
    pub fn count(&self, outcome: Outcome) -> u64 {
        match outcome {
            Outcome::Accepted => self.accepted,
            Outcome::Rejected => self.rejected,
            Outcome::Impossible => self.impossible,
            Outcome::Invalid => self.invalid,
            Outcome::Inapplicable => self.inapplicable,
        }
    }

    /// The fraction of proposals that were accepted, by their probabilities, which is less noisy than by what was drawn; 0
    /// without proposals.
    pub fn rate(&self) -> f64 {
        if self.proposals() == 0 { 0.0 } else { self.probability / self.proposals() as f64 }
    }

    /// The fraction of steps in which something could be proposed; 0 without steps.
    pub fn applicability(&self) -> f64 {
        if self.steps() == 0 { 0.0 } else { self.proposals() as f64 / self.steps() as f64 }
    }
}
