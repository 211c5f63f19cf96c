//! The binary tree that is built first: binned surface-area heuristic (Wald 2007, "On fast Construction of SAH-based
//! Bounding Volume Hierarchies").

use bytemuck::Zeroable;
use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::node::LANES;
use crate::Bounds3;

/// A primitive as the builder sees it: its box, and two words that say what it is in the fourth coordinates.
#[derive(Clone, Copy, Debug, Zeroable)]
pub(super) struct Primitive {
    min: Vec4,
    max: Vec4,
}

impl Primitive {
    /// Shapes and primitives have numbers below this.
    pub const LIMIT: u32 = (1 << 30) - 1;
    /// [`Self::shape`] of an instance.
    pub const INSTANCE: u32 = Self::LIMIT;
    /// Set in the fourth coordinates, so that, taken for numbers, they are not subnormal: arithmetic on those is slow, and
    /// some is done on all four.
    const NORMAL: u32 = 1 << 30;
    /// Set in `max` of what is not a triangle.
    const OTHER: u32 = 1 << 31;

    /// `shape` and `primitive` are below [`Self::LIMIT`].
    pub fn triangle(bounds: &Bounds3, shape: u32, primitive: u32) -> Self {
        let word = |n: u32| f32::from_bits(n | Self::NORMAL);
        Self { min: bounds.min.extend(word(shape)), max: bounds.max.extend(word(primitive)) }
    }

    pub fn other(bounds: &Bounds3, shape: u32, primitive: u32) -> Self {
        Self::triangle(bounds, shape, primitive | Self::OTHER)
    }

    pub fn shape(&self) -> u32 {
        self.min.w.to_bits() & !Self::NORMAL
    }

    pub fn primitive(&self) -> u32 {
        self.max.w.to_bits() & !(Self::OTHER | Self::NORMAL)
    }

    pub fn is_other(&self) -> bool {
        self.max.w.to_bits() & Self::OTHER != 0
    }

    /// One triangle, or 2³² for something else: sums count both.
    #[inline(always)]
    fn weight(&self) -> Weight {
        Weight(1 << (u64::from(self.max.w.to_bits() >> 31) * 32))
    }

    /// The centre; halved first, so that nothing overflows.
    #[inline(always)]
    fn centroid(&self) -> Vec4 {
        self.min * 0.5 + self.max * 0.5
    }
}

/// A node of the binary tree over the primitives `first..first + count`. Its children, if any, are at the next place and
/// at `right`.
#[derive(Clone, Copy, Debug, Zeroable)]
pub(super) struct BinaryNode {
    pub min: Vec3,
    pub first: u32,
    pub max: Vec3,
    pub count: u32,
    /// Relative to this node; 0 for leaves.
    pub right: u32,
}

impl BinaryNode {
    pub fn is_leaf(&self) -> bool {
        self.right == 0
    }

    pub fn bounds(&self) -> Bounds3 {
        Bounds3 { min: self.min, max: self.max }
    }
}

/// How many triangles, and other things.
#[derive(Clone, Copy, Default)]
pub(super) struct Weight(u64);

impl Weight {
    /// Cost of testing one node, relative to that of one packet of triangles.
    pub const NODE_COST: f32 = 0.7;
    /// Cost of one primitive that is not a triangle, relative to that of one packet of triangles.
    const OTHER_COST: f32 = 2.0;

    pub fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }

    pub fn of(primitives: &[Primitive]) -> Self {
        primitives.iter().fold(Self::default(), |w, p| w.add(p.weight()))
    }

    pub fn triangles(self) -> u32 {
        self.0 as u32
    }

    pub fn others(self) -> u32 {
        (self.0 >> 32) as u32
    }

    /// The cost of testing all.
    #[inline(always)]
    pub fn cost(self) -> f32 {
        self.triangles().div_ceil(LANES as u32) as f32 + self.others() as f32 * Self::OTHER_COST
    }
}

/// Below this depth splits are by the heuristic, beyond by halves, so that depth is bounded whatever the input.
const HEURISTIC_DEPTH: u32 = 48;
/// The greatest depth of a tree of less than 2³² primitives.
pub(super) const MAX_DEPTH: usize = HEURISTIC_DEPTH as usize + 33;
/// Ranges larger than this are worked on in parallel.
const PARALLEL: usize = 1 << 13;
const PARALLEL_BINNING: usize = 1 << 17;
const CHUNK: usize = 1 << 15;

/// Builds a tree over `primitives`, which it reorders. Leaves have one other thing, or at most four triangles. The result
/// depends on nothing but the input.
pub(super) fn build(primitives: &mut [Primitive]) -> Vec<BinaryNode> {
    if primitives.is_empty() {
        return Vec::new();
    }
    let mut nodes = vec![BinaryNode::zeroed(); 2 * primitives.len() - 1];
    let extent = Extent::of(primitives);
    split(primitives, 0, &mut nodes, extent, 0);
    nodes
}

/// The boxes around some primitives and around their centroids.
#[derive(Clone, Copy)]
struct Extent {
    min: Vec4,
    max: Vec4,
    centroid_min: Vec4,
    centroid_max: Vec4,
}

impl Extent {
    const EMPTY: Self = Self {
        min: Vec4::INFINITY,
        max: Vec4::NEG_INFINITY,
        centroid_min: Vec4::INFINITY,
        centroid_max: Vec4::NEG_INFINITY,
    };

    fn of(primitives: &[Primitive]) -> Self {
        let sequential = |chunk: &[Primitive]| chunk.iter().fold(Self::EMPTY, Self::with);
        if primitives.len() < PARALLEL_BINNING {
            return sequential(primitives);
        }
        primitives.par_chunks(CHUNK).map(sequential).reduce(|| Self::EMPTY, Self::union)
    }

    #[inline(always)]
    fn with(self, p: &Primitive) -> Self {
        let c = p.centroid();
        Self {
            min: self.min.min(p.min),
            max: self.max.max(p.max),
            centroid_min: self.centroid_min.min(c),
            centroid_max: self.centroid_max.max(c),
        }
    }

    fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            centroid_min: self.centroid_min.min(other.centroid_min),
            centroid_max: self.centroid_max.max(other.centroid_max),
        }
    }
}

/// Half the surface area.
#[inline(always)]
fn half_area(min: Vec4, max: Vec4) -> f32 {
    let d = max - min;
    d.x * d.y + d.y * d.z + d.z * d.x
}

#[derive(Clone, Copy)]
struct Bin {
    min: Vec4,
    max: Vec4,
    weight: Weight,
}

impl Bin {
    const EMPTY: Self = Self { min: Vec4::INFINITY, max: Vec4::NEG_INFINITY, weight: Weight(0) };

    #[inline(always)]
    fn union(self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max), weight: self.weight.add(other.weight) }
    }

    /// What it costs to test all that is in it, if a ray meets its box; infinite where it is empty.
    #[inline(always)]
    fn cost(&self) -> f32 {
        if self.weight.0 == 0 { f32::INFINITY } else { half_area(self.min, self.max) * self.weight.cost() }
    }
}

/// From centroids to `B` bins on all three axes; `B` is a power of two.
#[derive(Clone, Copy)]
struct Binning<const B: usize> {
    from: Vec4,
    scale: Vec4,
}

impl<const B: usize> Binning<B> {
    fn new(extent: &Extent) -> Self {
        let size = extent.centroid_max - extent.centroid_min;
        let scale = size.to_array().map(|s| {
            // Rounded to the nearest bin: the last ends at B − 1/2.
            let scale = (B as f32 - 0.51) / s;
            if s > 0.0 && scale.is_finite() { scale } else { 0.0 }
        });
        Self { from: extent.centroid_min, scale: Vec4::from_array(scale) }
    }

    /// The bins, plus 2²³: there the spacing of `f32` is one, so that the sum is rounded to a whole number, which stands
    /// in its low bits.
    #[inline(always)]
    fn place(&self, p: &Primitive) -> Vec4 {
        (p.centroid() - self.from) * self.scale + Vec4::splat(Self::BASE)
    }

    const BASE: f32 = (1 << 23) as f32;

    #[inline(always)]
    fn bins(&self, p: &Primitive) -> [usize; 3] {
        let b = self.place(p);
        [b.x, b.y, b.z].map(|b| b.to_bits() as usize & (B - 1))
    }

    fn fill(&self, primitives: &[Primitive]) -> [[Bin; B]; 3] {
        let sequential = |chunk: &[Primitive]| {
            let mut bins = [[Bin::EMPTY; B]; 3];
            for p in chunk {
                let at = self.bins(p);
                for axis in 0..3 {
                    let bin = &mut bins[axis][at[axis]];
                    bin.min = bin.min.min(p.min);
                    bin.max = bin.max.max(p.max);
                    bin.weight = bin.weight.add(p.weight());
                }
            }
            bins
        };
        if primitives.len() < PARALLEL_BINNING {
            return sequential(primitives);
        }
        primitives.par_chunks(CHUNK).map(sequential).reduce(
            || [[Bin::EMPTY; B]; 3],
            |a, b| std::array::from_fn(|axis| std::array::from_fn(|i| a[axis][i].union(&b[axis][i]))),
        )
    }

    /// The axis and the first bin of the right part of the cheapest way to cut a range in two.
    fn best_cut(&self, bins: &[[Bin; B]; 3]) -> Option<(usize, usize)> {
        let mut best = None;
        let mut least = f32::INFINITY;
        for axis in 0..3 {
            if self.scale[axis] == 0.0 {
                continue;
            }
            let bins = &bins[axis];
            let mut right_costs = [0.0; B];
            let mut right = Bin::EMPTY;
            for i in (1..B).rev() {
                right = right.union(&bins[i]);
                right_costs[i] = right.cost();
            }
            let mut left = Bin::EMPTY;
            for i in 1..B {
                left = left.union(&bins[i - 1]);
                let cost = left.cost() + right_costs[i];
                if cost < least {
                    (best, least) = (Some((axis, i)), cost);
                }
            }
        }
        best
    }

    /// Cuts where it is cheapest; `None` where there is nothing to choose between.
    fn cut(primitives: &mut [Primitive], extent: &Extent) -> Option<usize> {
        let binning = Self::new(extent);
        let (axis, bin) = binning.best_cut(&binning.fill(primitives))?;
        let mut limit = Vec4::NEG_INFINITY;
        limit[axis] = Self::BASE + bin as f32;
        let middle = partition(primitives, |p| binning.place(p).cmplt(limit).bitmask() != 0);
        (middle > 0 && middle < primitives.len()).then_some(middle)
    }
}

/// Moves what belongs to the left to the front, without branches (Lomuto's scheme); returns how many.
fn partition(primitives: &mut [Primitive], goes_left: impl Fn(&Primitive) -> bool) -> usize {
    let mut middle = 0;
    for i in 0..primitives.len() {
        primitives.swap(i, middle);
        middle += usize::from(goes_left(&primitives[middle]));
    }
    middle
}

/// Cuts the triangles of one packet in two where that pays: where their boxes together are much smaller than the box
/// around all, as for two walls of a room. Reorders them; returns how many go left.
fn worthwhile_halves(primitives: &mut [Primitive], extent: &Extent) -> Option<usize> {
    /// The largest share of the area that the two halves may have.
    const SHARE: f32 = 0.9;
    let size = (extent.centroid_max - extent.centroid_min).truncate();
    let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b]))?;
    let middle = 0.5 * (extent.centroid_min[axis] + extent.centroid_max[axis]);
    let left = partition(primitives, |p| p.centroid()[axis] < middle);
    if left == 0 || left == primitives.len() {
        return None;
    }
    let area = |part: &[Primitive]| {
        let part = Extent::of(part);
        half_area(part.min, part.max)
    };
    let halves = area(&primitives[..left]) + area(&primitives[left..]);
    (halves < SHARE * half_area(extent.min, extent.max)).then_some(left)
}

fn split(primitives: &mut [Primitive], first: usize, nodes: &mut [BinaryNode], extent: Extent, depth: u32) {
    let count = primitives.len();
    nodes[0] = BinaryNode {
        min: extent.min.truncate(),
        first: first as u32,
        max: extent.max.truncate(),
        count: count as u32,
        right: 0,
    };
    let is_packet = count <= LANES && primitives.iter().all(|p| !p.is_other());
    let halves = if is_packet { worthwhile_halves(primitives, &extent) } else { None };
    if count == 1 || is_packet && (halves.is_none() || depth >= HEURISTIC_DEPTH) {
        return;
    }
    let cut = match count {
        _ if halves.is_some() => halves,
        _ if depth >= HEURISTIC_DEPTH => None,
        ..=24 => Binning::<8>::cut(primitives, &extent),
        _ => Binning::<16>::cut(primitives, &extent),
    };
    let middle = cut.unwrap_or_else(|| {
        // Triangles from other things first, so that leaves are of one kind, then by halves.
        let triangles = partition(primitives, |p| !p.is_other());
        if triangles > 0 && triangles < count { triangles } else { count / 2 }
    });

    nodes[0].right = 2 * middle as u32;
    let (left, right) = primitives.split_at_mut(middle);
    let (left_nodes, right_nodes) = nodes[1..].split_at_mut(2 * middle - 1);
    let mut go_left = || split(left, first, left_nodes, Extent::of(left), depth + 1);
    let mut go_right = || split(right, first + middle, right_nodes, Extent::of(right), depth + 1);
    if count >= PARALLEL {
        rayon::join(go_left, go_right);
    } else {
        go_left();
        go_right();
    }
}
