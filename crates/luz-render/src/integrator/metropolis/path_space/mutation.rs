//! What a mutation of paths is.

use crate::transport::{Path, PathSpace};
use luz_sample::Samples;

/// A way to make a path `y` from a path `x` by replacing some of its vertices.
///
/// A proposal is accepted with probability `min(1, f(y) T(y→x) / (f(x) T(x→y)))`. `T` is the density of replacing just these vertices
/// by just those: paths that can be made from one another by replacing several different parts are no exception, as each such
/// move has its own way back, and each pair of them is in balance by itself.
pub trait Mutation<P: PathSpace> {
    /// Makes a proposal in `y`, whatever that was, with all its factors worked out.
    fn propose(&self, space: &P, x: &Path<P::Vertex>, y: &mut Path<P::Vertex>, samples: &mut impl Samples) -> Attempt;

    /// `ln T(x→y)`: the logarithm of the density with which this mutation, applied to `x`, replaces the given part and makes `y`;
    /// `-∞` if it cannot. Given that it does so from `y` to `x`, it is asked for the way back with the same `kept`.
    fn ln_density(&self, space: &P, x: &Path<P::Vertex>, y: &Path<P::Vertex>, kept: Kept) -> f64;
}

/// What a mutation keeps of a path; all vertices between are replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Kept {
    /// Vertices at the light's end.
    pub light: usize,
    /// Vertices at the eye's end.
    pub eye: usize,
}

/// What came of the wish to mutate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Attempt {
    /// The mutation is not for paths like this.
    Inapplicable,
    /// No path was found: a ray was lost, or something stood in the way.
    Failed,
    /// There is a proposal.
    Proposed(Kept),
}

/// Are vertices `i` and `i + 1` of a path, which are to be connected, in sight of each other, and does light go that way?
pub(super) fn is_connected<P: PathSpace>(space: &P, path: &Path<P::Vertex>, i: usize) -> bool {
    let nodes = path.nodes();
    let Some([a, b]) = nodes.get(i..i + 2) else { return false };
    a.geometry > 0.0
        && !a.scattering.value.is_black()
        && !b.scattering.value.is_black()
        && space.is_visible(&b.vertex, &a.vertex)
}

/// Draws a number of a list with the given relative probabilities, by `u ∈ [0, 1)`; never one whose probability is zero.
pub(super) fn draw(weights: impl Iterator<Item = f64> + Clone, u: f64) -> usize {
    let total: f64 = weights.clone().sum();
    let mut left = u * total;
    let mut last = 0;
    for (i, weight) in weights.enumerate() {
        if weight > 0.0 {
            if left < weight {
                return i;
            }
            last = i;
        }
        left -= weight;
    }
    last
}
