//! The lens perturbation (Veach 1997, section 11.4.3.1): moves the path's place on the film a little, follows it through a chain of
//! specular scattering as long and of the same kinds as before, and connects what is seen there with the rest of the path.
//!
//! It is for paths that end with `(D|L) D S* E`, in Heckbert's letters from light to eye, and for `L S* E`.

use super::eye_chain::{self, Moves, eye_chains};
use super::mutation::{Attempt, Kept, Mutation};
use crate::transport::{Path, PerturbationSpace, Range};
use luz_sample::Samples;

/// The lens perturbation, by Veach 1997, section 11.4.3.1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensPerturbation {
    /// How far the path moves on the film, in pixels.
    pub film: Range,
}

impl LensPerturbation {
    fn moves(&self) -> Moves {
        // There is no vertex between chains.
        Moves { film: self.film, turn: self.film }
    }
}

impl<P: PerturbationSpace> Mutation<P> for LensPerturbation {
    fn propose(&self, space: &P, x: &Path<P::Vertex>, y: &mut Path<P::Vertex>, samples: &mut impl Samples) -> Attempt {
        match eye_chains(space, x) {
            Some(found) if found.chains == 1 => eye_chain::propose(space, self.moves(), found, x, y, samples),
            _ => Attempt::Inapplicable,
        }
    }

    fn ln_density(&self, space: &P, x: &Path<P::Vertex>, y: &Path<P::Vertex>, kept: Kept) -> f64 {
        match eye_chains(space, x) {
            Some(found) if found.chains == 1 => eye_chain::ln_density(space, self.moves(), found, x, y, kept),
            _ => f64::NEG_INFINITY,
        }
    }
}
