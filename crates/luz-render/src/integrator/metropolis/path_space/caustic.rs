//! The caustic perturbation (Veach 1997, section 11.4.3.2): turns the direction in which light leaves a light or a diffuse surface a
//! little, follows it through a chain of specular scattering as long and of the same kinds as before, and connects where it arrives with
//! the eye.
//!
//! It is for paths that end with `(D|L) S* D E`.

use super::mutation::{Attempt, Kept, Mutation, is_connected};
use crate::transport::{Bounce, Path, PerturbationSpace, Range, Side};
use luz_sample::Samples;

/// The caustic perturbation, by Veach 1997, section 11.4.3.2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CausticPerturbation {
    /// How far the path moves on the film, in pixels, about.
    pub pixels: Range,
}

/// The vertex at which directions are turned, counted from the light.
fn turning<V: Clone>(path: &Path<V>) -> Option<usize> {
    let nodes = path.nodes();
    let seen = nodes.len().checked_sub(2).filter(|&i| i > 0)?;
    if nodes[seen].bounce.is_specular() {
        return None;
    }
    nodes[..seen].iter().rposition(|node| !node.bounce.is_specular())
}

impl CausticPerturbation {
    fn replace<P: PerturbationSpace>(
        &self,
        space: &P,
        turning: usize,
        x: &Path<P::Vertex>,
        y: &mut Path<P::Vertex>,
        samples: &mut impl Samples,
    ) -> Option<()> {
        let old = x.nodes();
        let eye = old.len() - 1;
        let range = space.turns_by_pixels(&old[turning..], self.pixels)?;
        y.clear();
        y.extend_from(&old[..=turning]);
        for i in turning + 1..eye {
            let next = match old[i - 1].bounce {
                Bounce::Specular(kind) => {
                    let nodes = y.nodes();
                    space.follow(Side::Light, &nodes[i - 2].vertex, &nodes[i - 1].vertex, kind, false)?
                }
                Bounce::Spread => {
                    let at = &old[turning].vertex;
                    space.turn(at, (at, &old[i].vertex), range, samples)?
                }
            };
            y.push(next, old[i].bounce);
        }
        y.extend_from(&old[eye..]);
        y.evaluate(space, turning..y.len());
        (space.is_connectable(&y.nodes()[eye - 1].vertex) && is_connected(space, y, eye - 1)).then_some(())
    }
}

impl<P: PerturbationSpace> Mutation<P> for CausticPerturbation {
    fn propose(&self, space: &P, x: &Path<P::Vertex>, y: &mut Path<P::Vertex>, samples: &mut impl Samples) -> Attempt {
        let Some(turning) = turning(x) else { return Attempt::Inapplicable };
        match self.replace(space, turning, x, y, samples) {
            Some(()) => Attempt::Proposed(Kept { light: turning + 1, eye: 1 }),
            None => Attempt::Failed,
        }
    }

    fn ln_density(&self, space: &P, x: &Path<P::Vertex>, y: &Path<P::Vertex>, kept: Kept) -> f64 {
        let (old, new) = (x.nodes(), y.nodes());
        let Some(at) = kept.light.checked_sub(1).filter(|&at| [x, y].iter().all(|path| turning(path) == Some(at)))
        else {
            return f64::NEG_INFINITY;
        };
        let Some(range) = space.turns_by_pixels(&old[at..], self.pixels) else { return f64::NEG_INFINITY };
        if kept.eye != 1 || old.len() != new.len() {
            return f64::NEG_INFINITY;
        }
        let (from, to) = ((&old[at].vertex, &old[at + 1].vertex), (&new[at].vertex, &new[at + 1].vertex));
        let turned = space.turn_density(from, to, range);
        let mut sum = f64::from(turned * new[at].geometry).ln();
        for i in at + 1..old.len() - 2 {
            if old[i].bounce != new[i].bounce {
                return f64::NEG_INFINITY;
            }
            sum += f64::from(new[i].scattering.compelled(Side::Light) * new[i].geometry).ln();
        }
        sum
    }
}
