//! The mutation of wavelengths: the path stays where it is, and is looked at in another light.

use super::mutation::Attempt;
use crate::transport::{Bounce, Node, Path, SceneSpace, SceneVertex, SpecularKind};

/// The path `x` at the wavelengths of `space`, in `y`. Every path can be made so from every other set of wavelengths as densely: `T(x→y) = T(y→x)`.
///
/// Inapplicable where light of another colour would be refracted another way.
pub fn recolour<'w>(space: &SceneSpace<'w>, x: &Path<SceneVertex<'w>>, y: &mut Path<SceneVertex<'w>>) -> Attempt {
    let is_bent = |node: &Node<SceneVertex<'w>>| {
        node.bounce == Bounce::Specular(SpecularKind::Transmission)
            && node.vertex.surface().is_some_and(|surface| surface.disperses)
    };
    if x.nodes().iter().any(is_bent) {
        return Attempt::Inapplicable;
    }
    y.clear();
    for node in x.nodes() {
        let vertex = match &node.vertex {
            SceneVertex::Surface(surface) => space.find_again(surface.found_by),
            end => Some(end.clone()),
        };
        let Some(vertex) = vertex else { return Attempt::Failed };
        y.push(vertex, node.bounce);
    }
    y.evaluate(space, 0..y.len());
    Attempt::Proposed(super::mutation::Kept { light: 0, eye: 0 })
}
