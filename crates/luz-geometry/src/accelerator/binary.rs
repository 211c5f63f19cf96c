//! The binary tree that is built first: binned surface-area heuristic (Wald 2007, "On fast Construction of SAH-based
//! Bounding Volume Hierarchies").

use bytemuck::Zeroable;
use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::node::{LANES, LEAF_MAX};
use crate::Bounds3;

/// A primitive as the builder sees it: its box, and two words that say what it is in the fourth coordinates.
#[derive(Clone, Copy, Debug, Zeroable)]
pub(super) struct Primitive {
    min: Vec4,
    max: Vec4,
}

impl Primitive {
    /// [`Self::shape`] of an instance.
    pub const INSTANCE: u32 = u32::MAX;
    /// Set in `primitive` of what is not a triangle.
    const OTHER: u32 = 1 << 31;

    pub fn triangle(bounds: &Bounds3, shape: u32, primitive: u32) -> Self {
        Self { min: bounds.min.extend(f32::from_bits(shape)), max: bounds.max.extend(f32::from_bits(primitive)) }
    }

    pub fn other(bounds: &Bounds3, shape: u32, primitive: u32) -> Self {
        Self::triangle(bounds, shape, primitive | Self::OTHER)
    }

    pub fn shape(&self) -> u32 {
        self.min.w.to_bits()
    }

    pub fn primitive(&self) -> u32 {
        self.max.w.to_bits() & !Self::OTHER
    }

    pub fn is_other(&self) -> bool {
        self.max.w.to_bits() & Self::OTHER != 0
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

/// Cost of testing one node, relative to that of one packet of triangles.
pub(super) const NODE_COST: f32 = 1.0;
/// Cost of one primitive that is not a triangle, relative to that of one packet of triangles.
const OTHER_COST: f32 = 2.0;
const BINS: usize = 16;
/// Below this depth splits are by the heuristic, beyond by halves, so that depth is bounded whatever the input.
const HEURISTIC_DEPTH: u32 = 48;
/// The greatest depth of a tree of less than 2³² primitives.
pub(super) const MAX_DEPTH: usize = HEURISTIC_DEPTH as usize + 33;
/// Ranges larger than this are worked on in parallel.
const PARALLEL: usize = 1 << 13;
const PARALLEL_BINNING: usize = 1 << 17;

/// Builds a tree over `primitives`, which it reorders. The result depends on nothing but the input.
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
        let sequential = |chunk: &[Primitive]| {
            chunk.iter().fold(Self::EMPTY, |e, p| {
                let c = p.centroid();
                Self {
                    min: e.min.min(p.min),
                    max: e.max.max(p.max),
                    centroid_min: e.centroid_min.min(c),
                    centroid_max: e.centroid_max.max(c),
                }
            })
        };
        if primitives.len() < PARALLEL_BINNING {
            return sequential(primitives);
        }
        primitives.par_chunks(1 << 15).map(sequential).reduce(|| Self::EMPTY, Self::union)
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
    triangles: u32,
    others: u32,
}

impl Bin {
    const EMPTY: Self = Self { min: Vec4::INFINITY, max: Vec4::NEG_INFINITY, triangles: 0, others: 0 };

    fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            triangles: self.triangles + other.triangles,
            others: self.others + other.others,
        }
    }

    fn is_empty(&self) -> bool {
        self.triangles + self.others == 0
    }

    fn leaf_cost(&self) -> f32 {
        self.triangles.div_ceil(LANES as u32) as f32 + self.others as f32 * OTHER_COST
    }
}

type Bins = [[Bin; BINS]; 3];

/// From centroids to bins on all three axes.
#[derive(Clone, Copy)]
struct Binning {
    from: Vec4,
    scale: Vec4,
}

impl Binning {
    fn new(extent: &Extent) -> Self {
        let size = extent.centroid_max - extent.centroid_min;
        let scale = size.to_array().map(|s| {
            let scale = BINS as f32 * 0.9999 / s;
            if s > 0.0 && scale.is_finite() { scale } else { 0.0 }
        });
        Self { from: extent.centroid_min, scale: Vec4::from_array(scale) }
    }

    #[inline(always)]
    fn bins(&self, p: &Primitive) -> [usize; 3] {
        let b = (p.centroid() - self.from) * self.scale;
        [b.x, b.y, b.z].map(|b| (b as i32 as usize).min(BINS - 1))
    }

    fn fill(&self, primitives: &[Primitive]) -> Bins {
        let sequential = |chunk: &[Primitive]| {
            let mut bins = [[Bin::EMPTY; BINS]; 3];
            for p in chunk {
                let at = self.bins(p);
                let other = u32::from(p.is_other());
                for axis in 0..3 {
                    let bin = &mut bins[axis][at[axis]];
                    bin.min = bin.min.min(p.min);
                    bin.max = bin.max.max(p.max);
                    bin.triangles += 1 - other;
                    bin.others += other;
                }
            }
            bins
        };
        if primitives.len() < PARALLEL_BINNING {
            return sequential(primitives);
        }
        primitives.par_chunks(1 << 15).map(sequential).reduce(
            || [[Bin::EMPTY; BINS]; 3],
            |a, b| std::array::from_fn(|axis| std::array::from_fn(|i| a[axis][i].union(b[axis][i]))),
        )
    }
}

/// A way to cut a range in two.
struct Cut {
    axis: usize,
    /// The first bin of the right part.
    bin: usize,
    cost: f32,
}

fn best_cut(bins: &Bins, binning: &Binning) -> Option<Cut> {
    let mut best: Option<Cut> = None;
    for axis in 0..3 {
        if binning.scale[axis] == 0.0 {
            continue;
        }
        let bins = &bins[axis];
        let mut right_costs = [0.0; BINS];
        let mut right = Bin::EMPTY;
        for i in (1..BINS).rev() {
            right = right.union(bins[i]);
            right_costs[i] =
                if right.is_empty() { f32::INFINITY } else { half_area(right.min, right.max) * right.leaf_cost() };
        }
        let mut left = Bin::EMPTY;
        for i in 1..BINS {
            left = left.union(bins[i - 1]);
            if left.is_empty() {
                continue;
            }
            let cost = half_area(left.min, left.max) * left.leaf_cost() + right_costs[i];
            if cost < best.as_ref().map_or(f32::INFINITY, |b| b.cost) {
                best = Some(Cut { axis, bin: i, cost });
            }
        }
    }
    best
}

/// Moves what belongs to the left to the front; returns how many, and the extents of both parts.
fn partition(primitives: &mut [Primitive], goes_left: impl Fn(&Primitive) -> bool) -> usize {
    let (mut i, mut j) = (0, primitives.len());
    loop {
        while i < j && goes_left(&primitives[i]) {
            i += 1;
        }
        while i < j && !goes_left(&primitives[j - 1]) {
            j -= 1;
        }
        if i >= j {
            return i;
        }
        primitives.swap(i, j - 1);
        i += 1;
        j -= 1;
    }
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
    if count == 1 {
        return;
    }
    let others = if count <= LANES * LEAF_MAX { primitives.iter().filter(|p| p.is_other()).count() } else { 0 };
    let pure = others == 0 || others == count;
    let fits = pure && if others == 0 { count <= LANES * LEAF_MAX } else { count <= LEAF_MAX };
    if fits && others == 0 && count <= LANES {
        return;
    }

    let mut middle = 0;
    if depth < HEURISTIC_DEPTH {
        let binning = Binning::new(&extent);
        let bins = binning.fill(primitives);
        if let Some(cut) = best_cut(&bins, &binning) {
            if fits {
                let leaf = Bin { others: others as u32, triangles: (count - others) as u32, ..Bin::EMPTY }.leaf_cost();
                let area = half_area(extent.min, extent.max);
                if leaf * area <= NODE_COST * area + cut.cost {
                    return;
                }
            }
            middle = partition(primitives, |p| binning.bins(p)[cut.axis] < cut.bin);
        } else if fits {
            return;
        }
    }
    if middle == 0 || middle == count {
        // No cut, or too deep: triangles from other things first, then by halves.
        middle = if pure { 0 } else { partition(primitives, |p| !p.is_other()) };
        if middle == 0 || middle == count {
            middle = count / 2;
        }
    }

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
