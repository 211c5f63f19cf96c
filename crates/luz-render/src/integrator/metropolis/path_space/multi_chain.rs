//! The multi-chain perturbation (Veach 1997, section 11.4.3.3): as the lens perturbation, for caustics that are seen through specular
//! surfaces. Where one chain of specular scattering ends and the next begins, the direction is turned a little.
//!
//! It is for paths that end with `(D|L) D S+ D S* E`, or with more such chains. (The thesis wants the last to be `S+`; nothing stands
//! against caustics that are seen directly.)

use super::eye_chain::{self, Moves, eye_chains};
use super::mutation::{Attempt, Kept, Mutation};
use crate::transport::{Path, PerturbationSpace, Range};
use luz_sample::Samples;

/// The multi-chain perturbation, by Veach 1997, section 11.4.3.3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MultiChainPerturbation {
    /// How far the path moves on the film, in pixels.
    pub film: Range,
    /// How far directions turn between chains, in radians.
    pub turn: Range,
}

impl MultiChainPerturbation {
    fn moves(&self) -> Moves {
        Moves { film: self.film, turn: self.turn }
    }
}

impl<P: PerturbationSpace> Mutation<P> for MultiChainPerturbation {
    fn propose(&self, space: &P, x: &Path<P::Vertex>, y: &mut Path<P::Vertex>, samples: &mut impl Samples) -> Attempt {
        match eye_chains(space, x) {
            Some(found) if found.chains > 1 => eye_chain::propose(space, self.moves(), found, x, y, samples),
            _ => Attempt::Inapplicable,
        }
    }

    fn ln_density(&self, space: &P, x: &Path<P::Vertex>, y: &Path<P::Vertex>, kept: Kept) -> f64 {
        match eye_chains(space, x) {
            Some(found) if found.chains > 1 => eye_chain::ln_density(space, self.moves(), found, x, y, kept),
            _ => f64::NEG_INFINITY,
        }
    }
}
