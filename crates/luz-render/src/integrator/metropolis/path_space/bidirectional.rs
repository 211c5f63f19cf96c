//! The bidirectional mutation (Veach 1997, section 11.4.1): deletes a part of the path, anywhere, and puts new vertices in its place,
//! as many or more or fewer, some by a walk from the light's end and some from the eye's.
//!
//! It can replace the whole path by any other, and makes chains ergodic; most of the time it changes little. All the ways in which
//! the new vertices could have been divided between the two walks count in `T`.

use super::mutation::{Attempt, Kept, Mutation, draw, is_connected};
use crate::transport::{Bounce, Extension, Node, Path, PathSpace, Side};
use luz_sample::Samples;

/// The bidirectional mutation, by Veach 1997, section 11.4.1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bidirectional {
    /// The fewest vertices that paths have, at least 2.
    pub fewest: usize,
    /// The most.
    pub most: usize,
}

/// Numbers of vertices change by so many at most, at once.
const LARGEST_CHANGE: usize = 8;

/// `2⁻ⁿ`, for what is not negligible.
fn half_to(n: usize) -> f64 {
    1.0 / (1u64 << n.min(60)) as f64
}

/// The relative probability of deleting a part of `vertices` vertices: short ones for acceptance, that of a single vertex most of all
/// (the thesis's p_{d,1}, over the number of edges).
fn deletion_weight(vertices: usize) -> f64 {
    match vertices {
        0 => 0.25,
        1 => 0.5,
        _ => half_to(vertices + 1),
    }
}

/// The relative probability of adding `added` vertices where `deleted` were (p_{a,1}).
fn addition_weight(deleted: usize, added: usize) -> f64 {
    match deleted.abs_diff(added) {
        0 => 0.5,
        1 => 0.15,
        difference if difference <= LARGEST_CHANGE => 0.2 * half_to(difference),
        _ => 0.0,
    }
}

/// The logarithm of a sum of numbers of which the logarithms are given.
#[derive(Clone, Copy)]
struct LnSum {
    largest: f64,
    /// In units of the largest.
    sum: f64,
}

impl LnSum {
    const ZERO: Self = Self { largest: f64::NEG_INFINITY, sum: 0.0 };

    fn add(&mut self, term: f64) {
        if term > self.largest {
            self.sum = self.sum * (self.largest - term).exp() + 1.0;
            self.largest = term;
        } else if term > f64::NEG_INFINITY {
            self.sum += (term - self.largest).exp();
        }
    }

    fn ln(self) -> f64 {
        if self.sum > 0.0 { self.largest + self.sum.ln() } else { f64::NEG_INFINITY }
    }
}

impl Bidirectional {
    /// How many places there are for a deletion of so many of a path's `n` vertices, not all of them. An end that is kept stays an end.
    fn placements(n: usize, deleted: usize) -> usize {
        if deleted == 0 { n - 1 } else { n - deleted + 1 }
    }

    /// The parts that can be deleted of a path of `n` vertices have up to `n − 1`.
    fn deletions(n: usize) -> impl Iterator<Item = f64> + Clone {
        (0..n).map(deletion_weight)
    }

    /// The probability of deleting just the part between what is kept, of `n` vertices.
    fn deletion_probability(n: usize, kept: Kept) -> f64 {
        let Some(deleted) = n.checked_sub(kept.light + kept.eye) else { return 0.0 };
        if deleted >= n || deleted == 0 && (kept.light == 0 || kept.eye == 0) {
            return 0.0;
        }
        deletion_weight(deleted) / Self::deletions(n).sum::<f64>() / Self::placements(n, deleted) as f64
    }

    /// The numbers of vertices that may be added between what is kept, as relative probabilities from none on.
    fn additions(&self, kept: Kept, deleted: usize) -> impl Iterator<Item = f64> + Clone {
        let rest = kept.light + kept.eye;
        let needed = usize::from(kept.light == 0) + usize::from(kept.eye == 0);
        let (fewest, most) = (self.fewest.saturating_sub(rest).max(needed), self.most.saturating_sub(rest));
        let most = most.min(deleted + LARGEST_CHANGE);
        (0..=most).map(move |added| if added < fewest { 0.0 } else { addition_weight(deleted, added) })
    }

    fn addition_probability(&self, kept: Kept, deleted: usize, added: usize) -> f64 {
        let total: f64 = self.additions(kept, deleted).sum();
        match self.additions(kept, deleted).nth(added) {
            Some(weight) if weight > 0.0 => weight / total,
            _ => 0.0,
        }
    }

    /// How many of the added vertices the light's walk can make: from none to this. The eye is always made by its own.
    fn most_from_light(kept: Kept, added: usize) -> usize {
        added - usize::from(kept.eye == 0)
    }

    /// Replaces what is not kept of `x` by `added` new vertices.
    fn replace<P: PathSpace>(
        &self,
        space: &P,
        x: &[Node<P::Vertex>],
        kept: Kept,
        added: usize,
        y: &mut Path<P::Vertex>,
        samples: &mut impl Samples,
    ) -> Option<()> {
        let choices = Self::most_from_light(kept, added) + 1;
        let from_light = ((samples.next_1d() * choices as f32) as usize).min(choices - 1);
        let mut walk = y.lend();
        let made = walk_and_connect(space, x, kept, [from_light, added - from_light], y, &mut walk, samples);
        y.give_back(walk);
        made
    }

    /// A whole new path of `added` vertices, which looks at no other, in `y`. Draws from `samples`.
    pub fn renew<P: PathSpace>(
        &self,
        space: &P,
        old_vertices: usize,
        y: &mut Path<P::Vertex>,
        samples: &mut impl Samples,
    ) -> Attempt {
        let kept = Kept { light: 0, eye: 0 };
        let added = draw(self.additions(kept, old_vertices), f64::from(samples.next_1d()));
        match self.replace(space, &[], kept, added, y, samples) {
            Some(()) => Attempt::Proposed(kept),
            None => Attempt::Failed,
        }
    }

    /// `ln T` of [`renew`](Self::renew).
    pub fn ln_density_of_renewal<P: PathSpace>(&self, space: &P, old_vertices: usize, y: &Path<P::Vertex>) -> f64 {
        let kept = Kept { light: 0, eye: 0 };
        self.addition_probability(kept, old_vertices, y.len()).ln() + self.ln_density_of_walks(space, y, kept)
    }

    /// The logarithm of the density with which walks from what is kept of `y`, all divisions of the others between the two of them
    /// together, make these.
    fn ln_density_of_walks<P: PathSpace>(&self, space: &P, y: &Path<P::Vertex>, kept: Kept) -> f64 {
        let (nodes, n) = (y.nodes(), y.len());
        let (start, end) = (kept.light, n - kept.eye);
        let added = end - start;
        let choices = Self::most_from_light(kept, added) + 1;
        let begin = if start == 0 { space.begin_density(Side::Light, &nodes[0].vertex) } else { 0.0 };
        let from_light = |i: usize| f64::from(y.density_from_light(i, begin)).ln();
        let last = nodes.last().map_or(0.0, |node| space.begin_density(Side::Eye, &node.vertex));
        // The eye's walk makes all from `i` on.
        let mut from_eye: f64 = (start..end).map(|i| f64::from(y.density_from_eye(i, last)).ln()).sum();
        let mut light_so_far = 0.0;
        let mut density = LnSum::ZERO;
        for division in 0..choices {
            let meeting = start + division;
            let is_possible = match meeting {
                0 => space.can_be_hit(&nodes[0].vertex),
                _ if !is_on_film(space, y) => false,
                _ => nodes[meeting - 1..=meeting]
                    .iter()
                    .all(|node| !node.bounce.is_specular() && space.is_connectable(&node.vertex)),
            };
            if is_possible {
                let light = match (start, division) {
                    (0, 0) => f64::from(space.end_probability(&nodes[1].vertex, &nodes[0].vertex)).ln(),
                    (0, 1) if n > 2 => f64::from(space.direct_density(&nodes[1].vertex, &nodes[0].vertex)).ln(),
                    _ => light_so_far,
                };
                let rest: f64 = if from_eye.is_finite() {
                    from_eye
                } else {
                    (meeting..end).map(|i| f64::from(y.density_from_eye(i, last)).ln()).sum()
                };
                density.add(light + rest);
            }
            if meeting < end {
                light_so_far += from_light(meeting);
                from_eye -= f64::from(y.density_from_eye(meeting, last)).ln();
            }
        }
        density.ln() - (choices as f64).ln()
    }
}

/// Puts `from_light` vertices of a walk from the light and `from_eye` of one from the eye in place of what is not kept of `x`, in `y`.
/// The walk from the eye is made in `walk`, which is empty.
fn walk_and_connect<P: PathSpace>(
    space: &P,
    x: &[Node<P::Vertex>],
    kept: Kept,
    [from_light, from_eye]: [usize; 2],
    y: &mut Path<P::Vertex>,
    walk: &mut Vec<Node<P::Vertex>>,
    samples: &mut impl Samples,
) -> Option<()> {
    let kept_eye = &x[x.len() - kept.eye..];
    walk.extend(kept_eye.iter().take(2).rev().cloned());
    let fixed = walk.len();
    let ends_on_light = kept.light == 0 && from_light == 0;
    for i in 0..from_eye {
        if walk.is_empty() {
            walk.push(Node::unknown(&space.begin(Side::Eye, samples)?));
        } else {
            extend(space, Side::Eye, walk, ends_on_light && i + 1 == from_eye, samples)?;
        }
    }
    if ends_on_light && let [.., at, last] = &mut walk[..] {
        let end = space.choose_end(&at.vertex, last.vertex.clone(), samples.next_1d());
        last.vertex = space.as_light(&end)?;
    }

    y.clear();
    y.extend_from(&x[..kept.light]);
    let light = y.nodes_mut();
    for i in 0..from_light {
        if !light.is_empty() {
            extend(space, Side::Light, light, false, samples)?;
        } else if i + 1 == from_light && walk.len() > 1 {
            light.push(Node::unknown(&space.direct(&walk.last()?.vertex, samples)?.0));
        } else {
            light.push(Node::unknown(&space.begin(Side::Light, samples)?));
        }
    }
    // Where the two walks are connected, they scatter into solid angles.
    if !ends_on_light {
        for end in [light.last_mut(), walk.last_mut()] {
            end.into_iter().for_each(|node| node.bounce = Bounce::Spread);
        }
    }
    let meeting = y.len();
    y.extend_from_reversed(&walk[fixed..]);
    let eye_start = y.len();
    y.extend_from(kept_eye);
    if fixed > 0 {
        y.set_bounce(eye_start, walk[fixed - 1].bounce);
    }

    y.evaluate(space, kept.light.saturating_sub(1)..eye_start + 1);
    let is_made = ends_on_light
        || is_on_film(space, y)
            && [meeting - 1, meeting].iter().all(|&i| space.is_connectable(&y.nodes()[i].vertex))
            && is_connected(space, y, meeting - 1);
    is_made.then_some(())
}

/// False for a light without extent in front of the eye: it is on no pixel.
fn is_on_film<P: PathSpace>(space: &P, path: &Path<P::Vertex>) -> bool {
    path.len() > 2 || path.nodes().first().is_some_and(|node| space.can_be_hit(&node.vertex))
}

/// Can what is not kept be made by walks that meet, so that there is a way back from whatever takes its place? A single specular
/// vertex between two that are kept, say, cannot.
fn can_be_restored<P: PathSpace>(space: &P, path: &Path<P::Vertex>, kept: Kept) -> bool {
    let nodes = path.nodes();
    let connects = |pair: &[Node<P::Vertex>]| {
        pair.iter().all(|node| !node.bounce.is_specular() && space.is_connectable(&node.vertex))
    };
    let edges = kept.light.saturating_sub(1)..(nodes.len() - kept.eye + 1).min(nodes.len());
    kept.light == 0 && space.can_be_hit(&nodes[0].vertex)
        || is_on_film(space, path) && nodes.get(edges).is_some_and(|nodes| nodes.windows(2).any(connects))
}

/// Adds a walk's next vertex.
fn extend<P: PathSpace>(
    space: &P,
    side: Side,
    walk: &mut Vec<Node<P::Vertex>>,
    as_end: bool,
    samples: &mut impl Samples,
) -> Option<()> {
    let previous = walk.len().checked_sub(2).map(|i| &walk[i].vertex);
    let Extension { vertex, bounce } = space.extend(side, previous, &walk.last()?.vertex, as_end, samples)?;
    walk.last_mut()?.bounce = bounce;
    walk.push(Node::unknown(&vertex));
    Some(())
}

impl<P: PathSpace> Mutation<P> for Bidirectional {
    fn propose(&self, space: &P, x: &Path<P::Vertex>, y: &mut Path<P::Vertex>, samples: &mut impl Samples) -> Attempt {
        let n = x.len();
        let deleted = draw(Self::deletions(n), f64::from(samples.next_1d()));
        let place =
            ((samples.next_1d() * Self::placements(n, deleted) as f32) as usize).min(Self::placements(n, deleted) - 1);
        let light = place + usize::from(deleted == 0);
        let kept = Kept { light, eye: n - deleted - light };
        if !can_be_restored(space, x, kept) {
            return Attempt::Failed;
        }
        let weights = self.additions(kept, deleted);
        if weights.clone().sum::<f64>() <= 0.0 {
            return Attempt::Failed;
        }
        let added = draw(weights, f64::from(samples.next_1d()));
        match self.replace(space, x.nodes(), kept, added, y, samples) {
            Some(()) => Attempt::Proposed(kept),
            None => Attempt::Failed,
        }
    }

    fn ln_density(&self, space: &P, x: &Path<P::Vertex>, y: &Path<P::Vertex>, kept: Kept) -> f64 {
        let rest = kept.light + kept.eye;
        if x.len() < rest || y.len() < rest || !can_be_restored(space, x, kept) {
            return f64::NEG_INFINITY;
        }
        let choice =
            Self::deletion_probability(x.len(), kept) * self.addition_probability(kept, x.len() - rest, y.len() - rest);
        choice.ln() + self.ln_density_of_walks(space, y, kept)
    }
}
