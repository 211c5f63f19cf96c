//! The way of a ray down the tree.

use std::mem::MaybeUninit;

use super::super::binary::MAX_DEPTH;
use super::super::instance::Instance;
use super::super::node::{Child, LANES, Other, Tree, WIDTH};
use super::kernel::{Distances, Kernel, PacketHits, Slabs};
use crate::Accelerator;
use crate::shape::triangle::Shear;
use crate::{Hit, PrimitiveId, Ray};

/// Which hits count.
pub(in super::super) trait Filter {
    /// Whether anything is ever rejected: if not, the filter costs nothing.
    const ACTIVE: bool;

    fn accept(&mut self, hit: &Hit) -> bool;
}

/// Every hit counts.
pub(in super::super) struct All;

impl Filter for All {
    const ACTIVE: bool = false;

    #[inline(always)]
    fn accept(&mut self, _: &Hit) -> bool {
        true
    }
}

impl<F: FnMut(&Hit) -> bool> Filter for F {
    const ACTIVE: bool = true;

    #[inline(always)]
    fn accept(&mut self, hit: &Hit) -> bool {
        self(hit)
    }
}

/// The depth of the tree bounds the stack: each level leaves at most seven siblings behind.
const STACK: usize = (WIDTH - 1) * MAX_DEPTH + 1;

/// A child that waits, and where the ray enters its box: the distance's bits above the child's. Distances are not
/// negative, so that entries are ordered as their distances are.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Entry(u64);

impl Entry {
    #[inline(always)]
    fn new(child: Child, distance: f32) -> Self {
        Self(u64::from(distance.to_bits()) << 32 | u64::from(child.bits()))
    }

    #[inline(always)]
    fn child(self) -> Child {
        Child::from_bits(self.0 as u32)
    }

    #[inline(always)]
    fn distance(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }
}

/// One query on one tree.
pub(in super::super) struct Traversal<'a, F> {
    pub accelerator: &'a Accelerator,
    pub filter: &'a mut F,
    pub instance: u32,
}

/// The order among hits at the same distance, so that the answer does not depend on the order of the tree.
#[inline(always)]
fn key(hit: &Hit) -> (u32, u32, u32) {
    (hit.instance, hit.shape, hit.primitive)
}

impl<F: Filter> Traversal<'_, F> {
    /// Takes a candidate if it beats `best` and the filter lets it pass. Candidates have `t ≤ best.t`.
    #[inline(always)]
    fn offer(&mut self, hit: Hit, best: &mut Hit) -> bool {
        if hit.t == best.t && key(&hit) >= key(best) {
            return false;
        }
        if F::ACTIVE && self.accelerator.filtered[hit.shape as usize] && !self.filter.accept(&hit) {
            return false;
        }
        *best = hit;
        true
    }

    /// Walks the tree; true where `best` was improved. With `ANY`, ends at the first hit.
    ///
    /// # Safety
    /// The instruction set of `K` must be present, and `tree` one that [`Tree::build`] made: its indices are in range and
    /// its depth at most [`MAX_DEPTH`].
    #[inline(always)]
    pub(super) unsafe fn walk<K: Kernel, const ANY: bool>(&mut self, tree: &Tree, ray: &Ray, best: &mut Hit) -> bool {
        if tree.nodes.is_empty() {
            return false;
        }
        // SAFETY: the caller vouches for the instruction set.
        let shear = Shear::new(ray);
        // SAFETY: the caller vouches for the instruction set.
        let (box_ray, triangle_ray) = unsafe { (K::box_ray(&Slabs::new(ray, tree.reach)), K::triangle_ray(&shear)) };
        let leaves = match ray.leaves {
            PrimitiveId { shape, primitive, instance } if instance == self.instance => [shape, primitive],
            _ => [u32::MAX; 2],
        };
        let mut found = false;
        let mut stack = [MaybeUninit::<Entry>::uninit(); STACK];
        let mut height = 0usize;
        let mut distances = Distances([0.0; WIDTH]);
        let mut hits = PacketHits { t: [0.0; LANES], u: [0.0; LANES], v: [0.0; LANES] };
        let mut current = Child::node(0);
        loop {
            while !current.is_leaf() {
                // SAFETY: inner children index nodes of this tree; the caller vouches for the instruction set.
                let (node, mut mask) = unsafe {
                    let node = tree.nodes.get_unchecked(current.index());
                    (node, K::test_boxes(&box_ray, node, best.t, &mut distances))
                };
                if mask == 0 {
                    current = Child::EMPTY;
                    break;
                }
                let mut take = || {
                    let i = mask.trailing_zeros() as usize & (WIDTH - 1);
                    mask &= mask - 1;
                    (Entry::new(node.children[i], distances.0[i]), mask)
                };
                // The nearest is gone down to, the others wait, farther ones deeper.
                let (a, rest) = take();
                if rest == 0 {
                    current = a.child();
                    continue;
                }
                let (b, rest) = take();
                let (a, b) = (a.min(b), a.max(b));
                if rest == 0 {
                    stack[height] = MaybeUninit::new(b);
                    height += 1;
                    current = a.child();
                    continue;
                }
                let (c, mut rest) = take();
                let (b, c) = (b.min(c), b.max(c));
                let (a, b) = (a.min(b), a.max(b));
                let bottom = height;
                stack[height] = MaybeUninit::new(c);
                stack[height + 1] = MaybeUninit::new(b);
                height += 2;
                let mut nearest = a;
                while rest != 0 {
                    let (entry, left) = take();
                    rest = left;
                    let falling = entry.max(nearest);
                    nearest = entry.min(nearest);
                    // Down to its place among those that wait.
                    let mut at = height;
                    while at > bottom {
                        // SAFETY: entries below `height` are written.
                        let below = unsafe { stack[at - 1].assume_init() };
                        if below >= falling {
                            break;
                        }
                        stack[at] = MaybeUninit::new(below);
                        at -= 1;
                    }
                    stack[at] = MaybeUninit::new(falling);
                    height += 1;
                }
                current = nearest.child();
            }
            if current != Child::EMPTY {
                if current.is_other() {
                    for other in &tree.others[current.range()] {
                        if self.other::<ANY>(other, ray, best) {
                            if ANY {
                                return true;
                            }
                            found = true;
                        }
                    }
                } else {
                    for packet in &tree.packets[current.range()] {
                        // SAFETY: the caller vouches for the instruction set.
                        let mut mask =
                            unsafe { K::test_packet(&triangle_ray, &shear, leaves, packet, best.t, &mut hits) };
                        while mask != 0 {
                            let lane = mask.trailing_zeros() as usize & (LANES - 1);
                            mask &= mask - 1;
                            if hits.t[lane] > best.t {
                                continue;
                            }
                            let hit = Hit {
                                t: hits.t[lane],
                                u: hits.u[lane],
                                v: hits.v[lane],
                                shape: packet.shape[lane],
                                primitive: packet.primitive[lane],
                                instance: self.instance,
                            };
                            if self.offer(hit, best) {
                                if ANY {
                                    return true;
                                }
                                found = true;
                            }
                        }
                    }
                }
            }
            loop {
                if height == 0 {
                    return found;
                }
                height -= 1;
                // SAFETY: entries below `height` are written.
                let entry = unsafe { stack[height].assume_init() };
                if entry.distance() <= best.t {
                    current = entry.child();
                    break;
                }
            }
        }
    }

    /// Tests what is not a triangle.
    #[inline(never)]
    fn other<const ANY: bool>(&mut self, other: &Other, ray: &Ray, best: &mut Hit) -> bool {
        match *other {
            Other::Primitive { shape, primitive } => {
                let found = self.accelerator.shapes[shape as usize].intersect(ray, best.t, primitive as usize);
                found.is_some_and(|(t, u, v)| {
                    let hit = Hit { t, u, v, shape, primitive, instance: self.instance };
                    t <= best.t && self.offer(hit, best)
                })
            }
            Other::Instance(index) => {
                let Instance { group, placement } = &self.accelerator.instances[index as usize];
                let (local, skipped) = placement.to_object(ray);
                let mut local_best = Hit { t: best.t - skipped, ..*best };
                let tree = &self.accelerator.trees[*group as usize];
                let accelerator = self.accelerator;
                let mut inner = Traversal { accelerator, filter: &mut *self.filter, instance: index };
                let found = accelerator.level.walk::<F, ANY>(&mut inner, tree, &local, &mut local_best);
                if found {
                    *best = Hit { t: local_best.t + skipped, ..local_best };
                }
                found
            }
        }
    }
}
