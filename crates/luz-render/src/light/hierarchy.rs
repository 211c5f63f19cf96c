//! A tree over lights, by which one is chosen as it matters where it is asked from.
//!
//! Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting", without splitting:
//! one light is chosen, by a walk from the root that takes each child in proportion to its importance.

use super::bounds::{Beacons, LANES, LightBounds};
use luz_geometry::{Bounds3, Reference};
use luz_sample::ONE_MINUS_EPSILON;

/// Marks a child that is a light.
const LEAF: u32 = 1 << 31;
/// Splits tried along each axis.
const BUCKETS: usize = 12;
/// From how many lights on both halves are built at once.
const PARALLEL_FROM: usize = 4096;

/// An inner node: what its children hold.
#[derive(Clone, Debug, Default)]
struct Node {
    beacons: Beacons,
    /// Nodes, or lights with [`LEAF`].
    children: [u32; LANES],
}

/// Which child of which node something is.
#[derive(Clone, Copy, Debug, Default)]
struct Place {
    node: u32,
    lane: u32,
}

/// A tree over lights that have a place, up to eight children to a node.
#[derive(Clone, Debug, Default)]
pub struct LightHierarchy {
    /// The first is the root.
    nodes: Vec<Node>,
    /// Where each node but the first hangs.
    places: Vec<Place>,
    /// Where each light hangs; of lights that are not in the tree nothing is said.
    leaves: Vec<Place>,
}

/// A light that waits to be placed.
#[derive(Clone, Copy, Debug)]
struct Entry {
    light: u32,
    bounds: LightBounds,
}

/// A node of the binary tree that is built first.
#[derive(Clone, Copy, Debug)]
struct Fork {
    bounds: [LightBounds; 2],
    /// Forks, or lights with [`LEAF`].
    children: [u32; 2],
}

impl LightHierarchy {
    /// The tree over lights, each with its number below `count` and its bounds. Lights without strength, or whose bounds
    /// are not finite, are left out.
    pub fn new(lights: impl IntoIterator<Item = (u32, LightBounds)>, count: usize) -> Self {
        let usable =
            |bounds: &LightBounds| bounds.strength > 0.0 && bounds.strength.is_finite() && bounds.bounds.is_finite();
        let mut entries: Vec<Entry> = lights
            .into_iter()
            .filter(|(_, bounds)| usable(bounds))
            .map(|(light, bounds)| Entry { light, bounds })
            .collect();
        let Some(first) = entries.first() else { return Self::default() };
        let blank = Fork { bounds: [first.bounds; 2], children: [0; 2] };
        let mut forks = vec![blank; entries.len() - 1];
        let root = fork(&mut entries, &mut forks, 0);
        let (nodes, places) = collapse(root, &forks);
        let mut leaves = vec![Place::default(); count];
        for (node, Node { beacons, children }) in nodes.iter().enumerate() {
            for (lane, child) in children.iter().enumerate().filter(|(lane, _)| beacons.has(*lane)) {
                if child & LEAF != 0 {
                    leaves[(child & !LEAF) as usize] = Place { node: node as u32, lane: lane as u32 };
                }
            }
        }
        Self { nodes, places, leaves }
    }

    /// The lights as they are seen from `reference`.
    #[inline]
    pub fn seen_from<'a>(&'a self, reference: &'a Reference) -> LightsSeen<'a> {
        let root = self.nodes.first().map_or([0.0; LANES], |root| root.beacons.importances(reference));
        LightsSeen { tree: self, reference, root, importance: root.iter().sum() }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.nodes.len() * (size_of::<Node>() + size_of::<Place>()) + self.leaves.len() * size_of::<Place>()
    }
}

/// The lights of a tree as they are seen from a point, which asks those at the root but once.
#[derive(Clone, Copy, Debug)]
pub struct LightsSeen<'a> {
    tree: &'a LightHierarchy,
    reference: &'a Reference,
    /// What the children of the root give.
    root: [f32; LANES],
    importance: f32,
}

impl LightsSeen<'_> {
    /// About the irradiance of all lights; 0 where none can arrive.
    #[inline]
    pub fn importance(&self) -> f32 {
        self.importance
    }

    /// A light, its probability, and a number in `[0, 1)` made of what choosing has left of `u`; `None` where no light
    /// arrives.
    #[inline]
    pub fn sample(&self, mut u: f32) -> Option<(usize, f32, f32)> {
        let mut node = self.tree.nodes.first()?;
        let (mut importances, mut total) = (self.root, self.importance);
        let mut probability = 1.0;
        loop {
            if total.is_nan() || total <= 0.0 {
                return None;
            }
            let target = u * total;
            let (mut lane, mut before) = (0, 0.0);
            // Rounding may go beyond the last: it stays with the last that has any importance.
            let (mut sum, mut last) = (0.0, None);
            for (i, importance) in importances.iter().enumerate().filter(|(_, importance)| **importance > 0.0) {
                (lane, before) = (i, sum);
                last = Some(i);
                sum += importance;
                if target < sum {
                    break;
                }
            }
            last?;
            probability *= importances[lane] / total;
            u = ((target - before) / importances[lane]).clamp(0.0, ONE_MINUS_EPSILON);
            let child = node.children[lane];
            if child & LEAF != 0 {
                return (probability > 0.0).then_some(((child & !LEAF) as usize, probability, u));
            }
            node = &self.tree.nodes[child as usize];
            importances = node.beacons.importances(self.reference);
            total = importances.iter().sum();
        }
    }

    /// The probability with which [`sample`](Self::sample) chooses a light that is in the tree.
    #[inline]
    pub fn probability(&self, light: usize) -> f32 {
        let Some(mut place) = self.tree.leaves.get(light).copied() else { return 0.0 };
        let mut probability = 1.0;
        while place.node != 0 && probability > 0.0 {
            let importances = self.tree.nodes[place.node as usize].beacons.importances(self.reference);
            probability *= share(importances[place.lane as usize], importances.iter().sum());
            place = self.tree.places[place.node as usize];
        }
        if probability > 0.0 { probability * share(self.root[place.lane as usize], self.importance) } else { 0.0 }
    }
}

/// What a part is of a sum that may be zero.
#[inline(always)]
fn share(part: f32, sum: f32) -> f32 {
    if sum > 0.0 { part / sum } else { 0.0 }
}

/// Builds the binary tree over `entries` into `forks`, one fewer, of which the first is number `base`. Returns what it
/// holds and where it begins.
fn fork(entries: &mut [Entry], forks: &mut [Fork], base: u32) -> (LightBounds, u32) {
    // One fork fewer than entries: there is a first unless there is but one entry.
    let Some((here, rest)) = forks.split_first_mut() else { return (entries[0].bounds, entries[0].light | LEAF) };
    let middle = partition(entries);
    let (left, right) = entries.split_at_mut(middle);
    let (left_forks, right_forks) = rest.split_at_mut(middle - 1);
    let (left_base, right_base) = (base + 1, base + middle as u32);
    let (a, b) = if left.len() + right.len() >= PARALLEL_FROM {
        rayon::join(|| fork(left, left_forks, left_base), || fork(right, right_forks, right_base))
    } else {
        (fork(left, left_forks, left_base), fork(right, right_forks, right_base))
    };
    *here = Fork { bounds: [a.0, b.0], children: [a.1, b.1] };
    (a.0.union(&b.0), base)
}

/// Makes nodes of up to eight children of a binary tree, in order of depth: those that cost most are opened first.
fn collapse(root: (LightBounds, u32), forks: &[Fork]) -> (Vec<Node>, Vec<Place>) {
    let mut nodes = vec![Node::default()];
    let mut places = vec![Place::default()];
    let mut open = std::collections::VecDeque::from([(0, vec![root])]);
    while let Some((index, mut children)) = open.pop_front() {
        while children.len() < LANES {
            let worth = |(bounds, child): &(LightBounds, u32)| if child & LEAF != 0 { -1.0 } else { cost(bounds, 1.0) };
            let dearest =
                (0..children.len()).fold(0, |a, b| if worth(&children[b]) > worth(&children[a]) { b } else { a });
            if children[dearest].1 & LEAF != 0 {
                break;
            }
            let Fork { bounds: [a, b], children: [first, second] } = forks[children[dearest].1 as usize];
            children[dearest] = (a, first);
            children.push((b, second));
        }
        for (lane, (bounds, child)) in children.into_iter().enumerate() {
            nodes[index].beacons.set(lane, &bounds);
            nodes[index].children[lane] = if child & LEAF != 0 {
                child
            } else {
                let Fork { bounds: [a, b], children: [first, second] } = forks[child as usize];
                open.push_back((nodes.len(), vec![(a, first), (b, second)]));
                nodes.push(Node::default());
                places.push(Place { node: index as u32, lane: lane as u32 });
                nodes.len() as u32 - 1
            };
        }
    }
    (nodes, places)
}

/// Sorts entries into two non-empty parts, by the least cost (Conty Estevez and Kulla 2018, section 4.4), and returns
/// the length of the first.
fn partition(entries: &mut [Entry]) -> usize {
    let centers = entries.iter().fold(Bounds3::EMPTY, |b, e| b.with_point(e.bounds.bounds.center()));
    let extent = entries.iter().fold(Bounds3::EMPTY, |b, e| b.union(e.bounds.bounds)).diagonal();
    let widths = centers.diagonal();
    let bucket = |entry: &Entry, axis: usize| {
        let offset = entry.bounds.bounds.center()[axis] - centers.min[axis];
        ((offset / widths[axis] * BUCKETS as f32) as usize).min(BUCKETS - 1)
    };
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in 0..3 {
        if !(widths[axis] > 0.0 && widths[axis].is_finite()) {
            continue;
        }
        let mut filled: [Option<LightBounds>; BUCKETS] = [None; BUCKETS];
        for entry in entries.iter() {
            let bounds = &mut filled[bucket(entry, axis)];
            *bounds = Some(bounds.map_or(entry.bounds, |b| b.union(&entry.bounds)));
        }
        // Thin slices of a long box are bad company.
        let regularity = extent.max_element() / extent[axis];
        let grow = |sum: Option<LightBounds>, next: &Option<LightBounds>| match (sum, next) {
            (Some(a), Some(b)) => Some(a.union(b)),
            (a, b) => a.or(*b),
        };
        let mut from_right = [0.0; BUCKETS];
        let mut sum = None;
        for i in (1..BUCKETS).rev() {
            sum = grow(sum, &filled[i]);
            from_right[i] = sum.as_ref().map_or(0.0, |b| cost(b, regularity));
        }
        sum = None;
        for split in 1..BUCKETS {
            sum = grow(sum, &filled[split - 1]);
            let Some(left) = &sum else { continue };
            if from_right[split] == 0.0 {
                break;
            }
            let total = cost(left, regularity) + from_right[split];
            if best.is_none_or(|(least, ..)| total < least) {
                best = Some((total, axis, split));
            }
        }
    }
    let middle = match best {
        Some((_, axis, split)) => {
            let (mut left, mut right): (Vec<Entry>, Vec<Entry>) =
                entries.iter().partition(|entry| bucket(entry, axis) < split);
            let middle = left.len();
            left.append(&mut right);
            entries.copy_from_slice(&left);
            middle
        }
        None => 0,
    };
    // Lights in one place, or costs that are not numbers: any half will do.
    if middle == 0 || middle == entries.len() { entries.len() / 2 } else { middle }
}

fn cost(bounds: &LightBounds, regularity: f32) -> f32 {
    // Points and lines have no surface, but do not come for free.
    let d = bounds.bounds.diagonal();
    let size = bounds.bounds.surface_area() + 1e-6 * d.length_squared() + f32::MIN_POSITIVE;
    bounds.orientation_cost() * regularity * size
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use luz_sample::Samples;
    use luz_sample::random::Random;
    use luz_sample::test_support::chi2;
    use luz_sample::warp::uniform_sphere;

    /// Lights strewn about, of all kinds: points, cones, surfaces on one side and on both, some without light.
    fn lights(count: u32) -> Vec<(u32, LightBounds)> {
        (0..count)
            .map(|light| {
                let mut random = Random::new(9, 0, u64::from(light));
                let position = Vec3::new(random.next_1d(), random.next_1d(), random.next_1d()) * 10.0;
                let axis = uniform_sphere(random.next_2d());
                let strength = if light % 11 == 3 { 0.0 } else { (random.next_1d() * 6.0 - 3.0).exp() };
                let bounds = match light % 4 {
                    0 => LightBounds::point(position, strength),
                    1 => LightBounds::cone(position, axis, 0.7, strength),
                    kind => LightBounds {
                        bounds: Bounds3::from_points([position, position + random.next_1d()]),
                        axis,
                        cos_normals: 0.9,
                        cos_emission: 0.0,
                        strength,
                        two_sided: kind == 2,
                    },
                };
                (light, bounds)
            })
            .collect()
    }

    fn references() -> impl Iterator<Item = Reference> {
        (0..40).map(|i| {
            let mut random = Random::new(10, 1, i);
            let position = Vec3::new(random.next_1d(), random.next_1d(), random.next_1d()) * 12.0 - 1.0;
            let normal = uniform_sphere(random.next_2d());
            if i % 3 == 0 { Reference::point(position) } else { Reference::surface(position, normal) }
        })
    }

    /// The probabilities of all lights sum to one, or to none where nothing arrives; each sample has its own.
    #[test]
    fn probabilities_are_those_of_the_samples() {
        for count in [1, 2, 3, 17, 400] {
            let lights = lights(count);
            let tree = LightHierarchy::new(lights.iter().copied(), lights.len());
            let used: Vec<usize> =
                lights.iter().filter(|(_, b)| b.strength > 0.0).map(|(light, _)| *light as usize).collect();
            for reference in references() {
                let sum: f32 = used.iter().map(|&light| tree.seen_from(&reference).probability(light)).sum();
                let chosen: Vec<_> =
                    (0..64).filter_map(|i| tree.seen_from(&reference).sample((i as f32 + 0.5) / 64.0)).collect();
                // A group may promise what none of its lights keeps; what falls there is lost.
                assert!(sum <= 1.0 + 1e-4, "{count}: {sum}");
                for (light, probability, remapped) in chosen {
                    let again = tree.seen_from(&reference).probability(light);
                    assert!((again / probability - 1.0).abs() < 1e-4, "{count}: {again} {probability}");
                    assert!((0.0..1.0).contains(&remapped) && used.contains(&light));
                }
            }
        }
    }

    /// χ² of choices against probabilities, and of the numbers that choosing leaves; a wrong probability is noticed.
    #[test]
    fn choices_have_their_probabilities() {
        const N: u64 = 200_000;
        let lights = lights(24);
        let tree = LightHierarchy::new(lights.iter().copied(), lights.len());
        let reference = Reference::surface(Vec3::splat(4.0), Vec3::Y);
        let mut observed = vec![0u64; 24 * 4 + 1];
        for i in 0..N {
            let mut random = Random::new(3, 2, i);
            let index = match tree.seen_from(&reference).sample(random.next_1d()) {
                Some((light, _, remapped)) => light * 4 + (remapped * 4.0) as usize,
                None => 24 * 4,
            };
            observed[index] += 1;
        }
        let expected = |wrong: f64| {
            let of = |light: usize| {
                if lights[light].1.strength > 0.0 {
                    f64::from(tree.seen_from(&reference).probability(light))
                } else {
                    0.0
                }
            };
            let mut all: Vec<f64> = (0..24 * 4).map(|i| of(i / 4) * N as f64 / 4.0).collect();
            let lost = N as f64 - all.iter().sum::<f64>();
            all.push(if lost > 1.0 { lost } else { 0.0 });
            let (least, most) = (0, (0..96).fold(0, |m, i| if all[i] > all[m] { i } else { m }));
            all[most] *= 1.0 - wrong;
            all[least] += wrong * all[most];
            all
        };
        assert!(chi2(&observed, &expected(0.0)).passes(1e-3), "{:?}", chi2(&observed, &expected(0.0)));
        assert!(!chi2(&observed, &expected(0.05)).passes(1e-6));
    }

    /// A light that gives something can be chosen: its probability is positive wherever its own importance is.
    #[test]
    fn what_arrives_can_be_chosen() {
        let lights = lights(300);
        let tree = LightHierarchy::new(lights.iter().copied(), lights.len());
        for reference in references() {
            for (light, bounds) in &lights {
                if bounds.importance(&reference) > 1e-4 {
                    assert!(tree.seen_from(&reference).probability(*light as usize) > 0.0, "{light}");
                }
            }
        }
    }

    #[test]
    fn trees_of_nothing_and_of_one_place() {
        let none = LightHierarchy::new([], 0);
        assert!(none.seen_from(&Reference::point(Vec3::ZERO)).sample(0.5).is_none());
        let same: Vec<_> = (0..50).map(|i| (i, LightBounds::point(Vec3::ONE, 1.0))).collect();
        let tree = LightHierarchy::new(same, 50);
        let there = Reference::point(Vec3::ONE);
        let total: f32 = (0..50).map(|light| tree.seen_from(&there).probability(light)).sum();
        assert!((total - 1.0).abs() < 1e-5, "{total}");
    }
}
