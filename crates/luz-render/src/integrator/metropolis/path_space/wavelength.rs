//! Mutations of wavelengths: the path is looked at in another light.
//!
//! A path that prisms bend goes another way at other wavelengths; it can be seen in another light only while it is perturbed.

use super::mutation::{Attempt, Kept, Mutation};
use crate::transport::{Bounce, Node, Path, SceneSpace, SceneVertex, SpecularKind};
use luz_sample::Samples;

/// Would light of another colour go another way at this vertex?
fn bends(node: &Node<SceneVertex<'_>>) -> bool {
    node.bounce == Bounce::Specular(SpecularKind::Transmission)
        && node.vertex.surface().is_some_and(|surface| surface.disperses)
}

/// Would light of another colour go another way?
pub fn is_bent(path: &Path<SceneVertex<'_>>) -> bool {
    path.nodes().iter().any(bends)
}

/// The vertices of `x` as they are at the wavelengths of `space`, in `y`. Every path can be made so from every other set of wavelengths
/// as densely: `T(x→y) = T(y→x)`.
pub fn recolour<'w>(space: &SceneSpace<'w>, x: &Path<SceneVertex<'w>>, y: &mut Path<SceneVertex<'w>>) -> Option<()> {
    y.clear();
    for node in x.nodes() {
        let vertex = match &node.vertex {
            SceneVertex::Surface(surface) => space.find_again(surface.found_by)?,
            end => end.clone(),
        };
        y.push(vertex, node.bounce);
    }
    y.evaluate(space, 0..y.len());
    Some(())
}

/// A perturbation of `x` which at the same time gives it the wavelengths of `space`. `recoloured` is written over with `x` at these.
///
/// Fails where vertices that bend light would have to stay in their places.
pub fn perturb_recoloured<'w, M: Mutation<SceneSpace<'w>>>(
    mutation: &M,
    space: &SceneSpace<'w>,
    x: &Path<SceneVertex<'w>>,
    recoloured: &mut Path<SceneVertex<'w>>,
    y: &mut Path<SceneVertex<'w>>,
    samples: &mut impl Samples,
) -> Attempt {
    if recolour(space, x, recoloured).is_none() {
        return Attempt::Failed;
    }
    match mutation.propose(space, recoloured, y, samples) {
        Attempt::Proposed(kept) if keeps_bends(y, kept) => Attempt::Failed,
        attempt => attempt,
    }
}

fn keeps_bends(path: &Path<SceneVertex<'_>>, kept: Kept) -> bool {
    let nodes = path.nodes();
    nodes[..kept.light].iter().chain(&nodes[nodes.len() - kept.eye..]).any(bends)
}
