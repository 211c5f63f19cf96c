//! The lens subpath mutation (Veach 1997, section 11.4.4): a new way from the eye to the first surface that can be connected with the
//! rest of the path, which is kept. So all pixels are visited, evenly.
//!
//! Places on the film are stratified among chains: the numbers that a chain is given for its `i`-th mutation of this kind are one of a
//! pattern that all chains of a batch share.

use super::mutation::{Attempt, Kept, Mutation, is_connected};
use crate::transport::{Bounce, Extension, Node, Path, PathSpace, Side};
use luz_sample::Samples;

/// The lens subpath mutation, by Veach 1997, section 11.4.4.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LensSubpath {
    /// The fewest vertices that paths have.
    pub fewest: usize,
    /// The most.
    pub most: usize,
}

/// The number of vertices before the lens subpath, if the path has one: behind it, towards the eye, stand only surfaces that cannot be
/// connected with anything, and it is connected to the rest by an edge between two that can.
fn kept_vertices<P: PathSpace>(space: &P, path: &Path<P::Vertex>) -> Option<usize> {
    let (_, surfaces) = path.nodes().split_last()?;
    let first = surfaces.iter().rposition(|node| space.is_connectable(&node.vertex))?;
    let is_spread = |i: usize| !surfaces[i].bounce.is_specular() && space.is_connectable(&surfaces[i].vertex);
    (first > 0 && is_spread(first) && is_spread(first - 1)).then_some(first)
}

impl LensSubpath {
    fn replace<P: PathSpace>(
        &self,
        space: &P,
        x: &Path<P::Vertex>,
        light: usize,
        y: &mut Path<P::Vertex>,
        walk: &mut Vec<Node<P::Vertex>>,
        samples: &mut impl Samples,
    ) -> Option<()> {
        walk.push(Node::unknown(&space.begin(Side::Eye, samples)?));
        loop {
            if light + walk.len() >= self.most {
                return None;
            }
            let previous = walk.len().checked_sub(2).map(|i| &walk[i].vertex);
            let last = walk.len() - 1;
            let Extension { vertex, bounce } = space.extend(Side::Eye, previous, &walk[last].vertex, false, samples)?;
            walk[last].bounce = bounce;
            let ends = space.is_connectable(&vertex);
            walk.push(Node::unknown(&vertex));
            if ends {
                break;
            }
        }
        // Shorter paths may be left to others, who find direct light.
        if light + walk.len() < self.fewest {
            return None;
        }
        y.clear();
        y.extend_from(&x.nodes()[..light]);
        y.set_bounce(light - 1, Bounce::Spread);
        y.extend_from_reversed(walk);
        y.evaluate(space, light - 1..y.len());
        is_connected(space, y, light - 1).then_some(())
    }
}

impl<P: PathSpace> Mutation<P> for LensSubpath {
    /// The first numbers drawn are the point of the lens and the place on the film.
    fn propose(&self, space: &P, x: &Path<P::Vertex>, y: &mut Path<P::Vertex>, samples: &mut impl Samples) -> Attempt {
        let Some(light) = kept_vertices(space, x) else { return Attempt::Inapplicable };
        let mut walk = y.lend();
        let made = self.replace(space, x, light, y, &mut walk, samples);
        y.give_back(walk);
        match made {
            Some(()) => Attempt::Proposed(Kept { light, eye: 0 }),
            None => Attempt::Failed,
        }
    }

    fn ln_density(&self, space: &P, x: &Path<P::Vertex>, y: &Path<P::Vertex>, kept: Kept) -> f64 {
        let applies = |path: &Path<P::Vertex>| kept_vertices(space, path) == Some(kept.light) && kept.eye == 0;
        if !applies(x) || !applies(y) || !(self.fewest..=self.most).contains(&y.len()) {
            return f64::NEG_INFINITY;
        }
        let Some(eye) = y.nodes().last() else { return f64::NEG_INFINITY };
        let last = space.begin_density(Side::Eye, &eye.vertex);
        (kept.light..y.len()).map(|i| f64::from(y.density_from_eye(i, last)).ln()).sum()
    }
}
