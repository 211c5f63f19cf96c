//! All paths of a toy space.

use crate::toy::{COUNT, EYES, Kind, Toy, kind};
use luz_render::transport::{Bounce, Path, PathSpace, SpecularKind};
use std::collections::HashMap;

/// A path's vertices and kinds of scattering in one number.
pub type Key = u64;

pub fn key(path: &Path<usize>) -> Key {
    path.nodes().iter().fold(1, |key, node| {
        let bounce = match node.bounce {
            Bounce::Spread => 0,
            Bounce::Specular(SpecularKind::Reflection) => 1,
            Bounce::Specular(SpecularKind::Transmission) => 2,
        };
        (key << 6) | ((node.vertex as u64) << 2) | bounce
    })
}

/// `f`, with or without the `δ` of specular vertices.
pub fn contribution(path: &Path<usize>) -> f64 {
    let product = path.contribution();
    f64::from(product.spectrum[0]) * product.ln_scale.exp()
}

/// The product of the `δ` of the specular vertices among some.
pub fn deltas(space: &Toy, path: &Path<usize>, range: std::ops::RangeInclusive<usize>) -> f64 {
    path.nodes()
        .windows(2)
        .enumerate()
        .filter(|(i, pair)| range.contains(i) && pair[0].bounce.is_specular())
        .map(|(_, pair)| space.delta(pair[0].vertex, pair[1].vertex))
        .product()
}

/// Paths of a toy space up to some length that carry light and can be made, by whatever technique.
pub struct Paths {
    pub paths: Vec<Path<usize>>,
    /// What they contribute, `δ` included: it is this that is summed.
    pub contributions: Vec<f64>,
    index: HashMap<Key, usize>,
}

impl Paths {
    /// Those of 2 to `most` vertices.
    pub fn new(space: &Toy, most: usize) -> Self {
        let mut paths = Vec::new();
        for eye in EYES {
            grow(space, &mut vec![(eye, Bounce::Spread)], most, &mut paths);
        }
        let contributions = paths.iter().map(|path| contribution(path) * deltas(space, path, 0..=path.len())).collect();
        let index = paths.iter().enumerate().map(|(i, path)| (key(path), i)).collect();
        Self { paths, contributions, index }
    }

    /// The number of a path, if it is one of these.
    pub fn find(&self, path: &Path<usize>) -> Option<usize> {
        self.index.get(&key(path)).copied()
    }

    pub fn total(&self) -> f64 {
        self.contributions.iter().sum()
    }

    pub fn len(&self) -> usize {
        self.paths.len()
    }
}

/// Adds all paths that end with a walk from the eye.
fn grow(space: &Toy, walk: &mut Vec<(usize, Bounce)>, most: usize, out: &mut Vec<Path<usize>>) {
    let (at, _) = walk[walk.len() - 1];
    let previous = walk.len().checked_sub(2).map(|i| walk[i].0);
    let specular = [SpecularKind::Reflection, SpecularKind::Transmission];
    for next in 0..COUNT {
        if !space.is_visible(&at, &next) || matches!(kind(next), Kind::Eye) {
            continue;
        }
        let goes = |&kind: &SpecularKind| {
            previous.and_then(|previous| space.mate(at, kind, previous)) == Some(space.direction(at, next))
        };
        let bounces = specular.into_iter().filter(goes).map(Bounce::Specular);
        for bounce in space.is_connectable(&at).then_some(Bounce::Spread).into_iter().chain(bounces) {
            let last = walk.len() - 1;
            walk[last].1 = bounce;
            walk.push((next, Bounce::Spread));
            if matches!(kind(next), Kind::Light) {
                let mut path = Path::default();
                walk.iter().rev().for_each(|&(vertex, bounce)| path.push(vertex, bounce));
                path.evaluate(space, 0..path.len());
                if contribution(&path) > 0.0 && can_be_made(space, &path) {
                    out.push(path);
                }
            } else if walk.len() < most {
                grow(space, walk, most, out);
            }
            walk.pop();
        }
    }
}

/// Can a walk hit the light, or is there an edge that can be connected?
pub fn can_be_made(space: &Toy, path: &Path<usize>) -> bool {
    let nodes = path.nodes();
    let connects = |pair: &[luz_render::transport::Node<usize>]| pair.iter().all(|node| !node.bounce.is_specular());
    space.can_be_hit(&nodes[0].vertex) || nodes.len() > 2 && nodes.windows(2).any(connects)
}
