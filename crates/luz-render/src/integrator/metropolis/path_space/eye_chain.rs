//! What lens and multi-chain perturbations have in common: a move of the path's place on the film, followed through specular chains of
//! the same kinds as before, one or several, up to a vertex that is connected with the rest of the path.

use super::mutation::{Attempt, Kept, is_connected};
use crate::transport::{Bounce, Node, Path, PathSpace, PerturbationSpace, Range, Side, SpecularKind};
use luz_sample::Samples;

/// A path's suffix, as far as such a perturbation replaces it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct EyeChains {
    /// The number of vertices that are kept at the light's end: the suffix begins with the vertex behind them.
    pub kept: usize,
    /// How many chains it has.
    pub chains: usize,
}

/// The suffix of a path from the eye to the first two vertices that scatter into solid angles one after the other, or to a light that
/// is seen through specular scattering only, or directly; `None` if such a light cannot be come upon.
pub(super) fn eye_chains<P: PathSpace>(space: &P, path: &Path<P::Vertex>) -> Option<EyeChains> {
    let nodes = path.nodes();
    let mut chains = 1;
    let mut i = nodes.len().checked_sub(2)?;
    loop {
        // Through the chain.
        while i > 0 && nodes[i].bounce.is_specular() {
            i -= 1;
        }
        if i == 0 || i == 1 || !nodes[i - 1].bounce.is_specular() {
            let can_be_found = i > 0 || space.can_be_hit(&nodes[0].vertex);
            return can_be_found.then_some(EyeChains { kept: i, chains });
        }
        chains += 1;
        i -= 1;
    }
}

/// How far the first move and the turns between chains go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moves {
    /// On the film, in pixels.
    pub film: Range,
    /// At vertices between chains, in radians.
    pub turn: Range,
}

pub(super) fn propose<P: PerturbationSpace>(
    space: &P,
    moves: Moves,
    EyeChains { kept, .. }: EyeChains,
    x: &Path<P::Vertex>,
    y: &mut Path<P::Vertex>,
    samples: &mut impl Samples,
) -> Attempt {
    let mut walk = y.lend();
    let made = replace(space, moves, kept, x, y, &mut walk, samples);
    y.give_back(walk);
    match made {
        Some(()) => Attempt::Proposed(Kept { light: kept, eye: 1 }),
        None => Attempt::Failed,
    }
}

fn replace<P: PerturbationSpace>(
    space: &P,
    moves: Moves,
    kept: usize,
    x: &Path<P::Vertex>,
    y: &mut Path<P::Vertex>,
    walk: &mut Vec<Node<P::Vertex>>,
    samples: &mut impl Samples,
) -> Option<()> {
    let old = x.nodes();
    let eye = old.len() - 1;
    // From the eye on, in the order of the walk.
    walk.push(old[eye].clone());
    for i in (kept..eye).rev() {
        let as_end = i == 0;
        let at = &walk[walk.len() - 1].vertex;
        let next = match old[i + 1].bounce {
            _ if i + 1 == eye => space.shift(at, &old[i].vertex, moves.film, as_end, samples)?,
            Bounce::Specular(kind) => follow(space, walk, kind, as_end)?,
            Bounce::Spread => space.turn(at, (&old[i + 1].vertex, &old[i].vertex), moves.turn, samples)?,
        };
        let next = if as_end { space.as_light(&space.choose_end(at, next, samples.next_1d()))? } else { next };
        walk.push(Node { bounce: old[i].bounce, ..Node::unknown(&next) });
    }
    y.clear();
    y.extend_from(&old[..kept]);
    y.extend_from_reversed(walk);
    y.evaluate(space, kept.saturating_sub(1)..y.len());
    let is_made = kept == 0 || space.is_connectable(&y.nodes()[kept].vertex) && is_connected(space, y, kept - 1);
    is_made.then_some(())
}

fn follow<P: PerturbationSpace>(
    space: &P,
    walk: &[Node<P::Vertex>],
    kind: SpecularKind,
    as_end: bool,
) -> Option<P::Vertex> {
    let [.., previous, at] = walk else { return None };
    space.follow(Side::Eye, &previous.vertex, &at.vertex, kind, as_end)
}

pub(super) fn ln_density<P: PerturbationSpace>(
    space: &P,
    moves: Moves,
    found: EyeChains,
    x: &Path<P::Vertex>,
    y: &Path<P::Vertex>,
    kept: Kept,
) -> f64 {
    let (old, new) = (x.nodes(), y.nodes());
    let is_this_move = kept == Kept { light: found.kept, eye: 1 } && old.len() == new.len();
    if !is_this_move {
        return f64::NEG_INFINITY;
    }
    let eye = old.len() - 1;
    let mut sum = match kept.light {
        0 => f64::from(space.end_probability(&new[1].vertex, &new[0].vertex)).ln(),
        _ => 0.0,
    };
    for i in (kept.light..eye).rev() {
        if old[i].bounce != new[i].bounce {
            return f64::NEG_INFINITY;
        }
        let onward = match old[i + 1].bounce {
            _ if i + 1 == eye => space.shift_density(&new[eye].vertex, &old[i].vertex, &new[i].vertex, moves.film),
            Bounce::Specular(_) => new[i + 1].scattering.compelled(Side::Eye),
            Bounce::Spread => {
                let (from, to) = ((&old[i + 1].vertex, &old[i].vertex), (&new[i + 1].vertex, &new[i].vertex));
                space.turn_density(from, to, moves.turn)
            }
        };
        sum += f64::from(onward * new[i].geometry).ln();
    }
    sum
}
