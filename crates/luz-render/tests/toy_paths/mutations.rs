//! The mutations that are tested, in one type, and what they are deliberately broken by.

use crate::paths::{Paths, contribution, deltas};
use crate::toy::Toy;
use luz_render::integrator::metropolis::path_space::{
    Attempt, Bidirectional, CausticPerturbation, Kept, LensPerturbation, LensSubpath, MultiChainPerturbation, Mutation,
};
use luz_render::transport::{Path, Range};
use luz_sample::Samples;
use luz_sample::markov::{Log, Proposal};

/// A mutation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Bidirectional(Bidirectional),
    /// The bidirectional one that replaces the whole path.
    Renewal(Bidirectional),
    LensSubpath(LensSubpath),
    Lens(LensPerturbation),
    MultiChain(MultiChainPerturbation),
    Caustic(CausticPerturbation),
}

/// All of them, for paths of up to so many vertices.
pub fn all(most: usize) -> [Kind; 6] {
    // Ranges stand for kernels of the toy space: 1 for the film, 2 for turns, the caustic perturbation's depend on the path.
    let range = |smallest: f64| Range { smallest, largest: 2.0 * smallest };
    let bidirectional = Bidirectional { fewest: 2, most };
    [
        Kind::Bidirectional(bidirectional),
        Kind::Renewal(bidirectional),
        Kind::LensSubpath(LensSubpath { fewest: 2, most }),
        Kind::Lens(LensPerturbation { film: range(1.0) }),
        Kind::MultiChain(MultiChainPerturbation { film: range(1.0), turn: range(2.0) }),
        Kind::Caustic(CausticPerturbation { pixels: range(1.0) }),
    ]
}

impl Kind {
    pub fn propose(&self, space: &Toy, x: &Path<usize>, y: &mut Path<usize>, samples: &mut impl Samples) -> Attempt {
        match self {
            Self::Bidirectional(mutation) => mutation.propose(space, x, y, samples),
            Self::Renewal(mutation) => mutation.renew(space, x.len(), y, samples),
            Self::LensSubpath(mutation) => mutation.propose(space, x, y, samples),
            Self::Lens(mutation) => mutation.propose(space, x, y, samples),
            Self::MultiChain(mutation) => mutation.propose(space, x, y, samples),
            Self::Caustic(mutation) => mutation.propose(space, x, y, samples),
        }
    }

    pub fn ln_density(&self, space: &Toy, x: &Path<usize>, y: &Path<usize>, kept: Kept) -> f64 {
        match self {
            Self::Bidirectional(mutation) => mutation.ln_density(space, x, y, kept),
            Self::Renewal(_) if kept != (Kept { light: 0, eye: 0 }) => f64::NEG_INFINITY,
            Self::Renewal(mutation) => mutation.ln_density_of_renewal(space, x.len(), y),
            Self::LensSubpath(mutation) => mutation.ln_density(space, x, y, kept),
            Self::Lens(mutation) => mutation.ln_density(space, x, y, kept),
            Self::MultiChain(mutation) => mutation.ln_density(space, x, y, kept),
            Self::Caustic(mutation) => mutation.ln_density(space, x, y, kept),
        }
    }

    /// May kept vertices beside new ones scatter in another way than before?
    fn may_change_bounces(&self) -> bool {
        matches!(self, Self::Bidirectional(_) | Self::LensSubpath(_))
    }

    /// Is the mutation for a path like this? Tries it.
    pub fn applies(&self, space: &Toy, x: &Path<usize>) -> bool {
        let mut random = luz_sample::random::Random::new(0, 0, 0);
        self.propose(space, x, &mut Path::default(), &mut random) != Attempt::Inapplicable
    }
}

/// What is wrong with the density that a mutation takes its proposals to have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    None,
    /// Walks from the eye that hit the light do not count as a way to make a path.
    ForgetsHits,
    /// Next-event estimation is taken for emission.
    ForgetsDirect,
    /// The number of ways to divide new vertices between the walks, one of which is chosen.
    ForgetsChoices,
    /// The number of vertices to delete, and which, is taken for a matter of indifference.
    ForgetsDeletion,
    /// Points of the lens are taken for equally likely.
    ForgetsLens,
    /// Perturbations have the ranges of an average path.
    ForgetsRanges,
    /// Perturbations are taken for symmetric.
    ForgetsKernels,
    /// Specular scattering counts as a random choice where there is none.
    ForgetsCompulsion,
    /// The geometry of edges is left out.
    ForgetsGeometry,
}

/// A mutation whose density is computed with a fault. The space that densities are computed in is not the one in which proposals
/// are made.
pub struct Faulty {
    pub kind: Kind,
    fault: Fault,
    space: Toy,
}

impl Faulty {
    pub fn new(space: &Toy, kind: Kind, fault: Fault) -> Self {
        let mut lying = space.clone();
        match fault {
            Fault::ForgetsHits => lying.knows_hits = false,
            Fault::ForgetsDirect => lying.direct = [space.begin_light; crate::toy::COUNT],
            Fault::ForgetsLens => lying.begin_eye = lying.begin_eye.map(|_| 0.45),
            Fault::ForgetsRanges => lying.ranges_vary = false,
            Fault::ForgetsKernels => lying = space.with_symmetric_kernels(),
            Fault::None
            | Fault::ForgetsChoices
            | Fault::ForgetsDeletion
            | Fault::ForgetsCompulsion
            | Fault::ForgetsGeometry => {}
        }
        Self { kind, fault, space: lying }
    }

    /// A mutation without fault.
    pub fn sound(space: &Toy, kind: Kind) -> Self {
        Self::new(space, kind, Fault::None)
    }

    /// `ln T(x→y)`, as the mutation has it, the `δ` of specular vertices left out.
    pub fn ln_density(&self, x: &Path<usize>, y: &Path<usize>, kept: Kept) -> f64 {
        let density = self.kind.ln_density(&self.space, x, y, kept);
        let (added, deleted) = (y.len() - kept.light - kept.eye, x.len() - kept.light - kept.eye);
        let new = kept.light..y.len() - kept.eye;
        match self.fault {
            Fault::ForgetsChoices => density + ((added + usize::from(kept.eye > 0)) as f64).ln(),
            Fault::ForgetsDeletion => density + (deleted as f64 + 1.0) * std::f64::consts::LN_2 + (x.len() as f64).ln(),
            Fault::ForgetsCompulsion => {
                let chosen = |i: usize| match y.nodes()[i] {
                    ref node if node.bounce.is_specular() => f64::from(node.scattering.toward_eye),
                    _ => 1.0,
                };
                density + new.map(chosen).product::<f64>().ln()
            }
            Fault::ForgetsGeometry => {
                // The last vertex has no edge.
                let edges = new.start..new.end.min(y.len() - 1);
                density - edges.map(|i| f64::from(y.nodes()[i].geometry)).product::<f64>().ln()
            }
            _ => density,
        }
    }

    /// `T(x→y)`: the probability of the move.
    pub fn probability(&self, x: &Path<usize>, y: &Path<usize>, kept: Kept) -> f64 {
        let first = kept.light.saturating_sub(1);
        let last = (y.len() - kept.eye).min(y.len() - 1);
        self.ln_density(x, y, kept).exp() * deltas(&self.space, y, first..=last)
    }

    /// Makes a proposal to a chain.
    pub fn propose(
        &self,
        space: &Toy,
        x: &Path<usize>,
        y: &mut Path<usize>,
        samples: &mut impl Samples,
    ) -> Option<Proposal<Log>> {
        let impossible = Some(Proposal::symmetric(Log(f64::NEG_INFINITY)));
        match self.kind.propose(space, x, y, samples) {
            Attempt::Inapplicable => None,
            Attempt::Failed => impossible,
            Attempt::Proposed(kept) => {
                let density = Log(contribution(y).ln());
                if density.0 == f64::NEG_INFINITY {
                    return impossible;
                }
                let (there, back) = (self.ln_density(x, y, kept), self.ln_density(y, x, kept));
                Some(Proposal { density, ratio: (back - there).exp() })
            }
        }
    }
}

/// What a move from one path to another could have kept.
pub fn possible_kept(kind: Kind, x: &Path<usize>, y: &Path<usize>) -> Vec<Kept> {
    let (old, new) = (x.nodes(), y.nodes());
    let shorter = old.len().min(new.len());
    let common = |pairs: &mut dyn Iterator<Item = (usize, usize)>| {
        let mut counts = vec![0];
        for (n, (i, j)) in pairs.enumerate().take(shorter) {
            if old[i].vertex != new[j].vertex {
                break;
            }
            let scatters_alike = old[i].bounce == new[j].bounce;
            if scatters_alike || kind.may_change_bounces() {
                counts.push(n + 1);
            }
            if !scatters_alike {
                break;
            }
        }
        counts
    };
    let from_light = common(&mut (0..shorter).map(|i| (i, i)));
    let from_eye = common(&mut (0..shorter).map(|i| (old.len() - 1 - i, new.len() - 1 - i)));
    let all = from_light.iter().flat_map(|&light| from_eye.iter().map(move |&eye| Kept { light, eye }));
    all.filter(|kept| kept.light + kept.eye <= shorter).collect()
}

/// All moves that a mutation makes from a path: where to, what is kept, and how likely.
pub fn moves(paths: &Paths, mutation: &Faulty, x: &Path<usize>) -> Vec<(usize, Kept, f64)> {
    let mut moves = Vec::new();
    for (i, y) in paths.paths.iter().enumerate() {
        for kept in possible_kept(mutation.kind, x, y) {
            let probability = mutation.probability(x, y, kept);
            if probability > 0.0 {
                moves.push((i, kept, probability));
            }
        }
    }
    moves
}
