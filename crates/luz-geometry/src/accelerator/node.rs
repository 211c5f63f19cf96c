//! How a tree lies in memory.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::pages::Pages;
use crate::Bounds3;

/// How many children a node has.
pub(super) const WIDTH: usize = 8;
/// How many triangles a packet has.
pub(super) const LANES: usize = 4;
/// The most packets, or other things, in one leaf.
pub(super) const LEAF_MAX: usize = 8;

/// A node of eight children with their boxes, axis by axis, so that one SIMD load takes one plane of all eight.
///
/// Empty places have the box `+∞ … −∞`, which no ray hits.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct WideNode {
    /// `planes[axis]` are the lower planes of the children, `planes[3 + axis]` the upper ones.
    pub planes: [[f32; WIDTH]; 6],
    pub children: [Child; WIDTH],
    /// To four cache lines.
    _unused: [u32; 8],
}

impl WideNode {
    pub const EMPTY: Self = {
        let (low, high) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
        Self { planes: [low, low, low, high, high, high], children: [Child::EMPTY; WIDTH], _unused: [0; 8] }
    };

    pub fn set(&mut self, place: usize, bounds: &Bounds3, child: Child) {
        for axis in 0..3 {
            self.planes[axis][place] = bounds.min[axis];
            self.planes[3 + axis][place] = bounds.max[axis];
        }
        self.children[place] = child;
    }
}

/// What a node points to: another node, or a leaf of 1 to 8 triangle packets, or of 1 to 8 other things.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(super) struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    const OTHER: u32 = 1 << 30;
    const COUNT_SHIFT: u32 = 27;
    const INDEX: u32 = (1 << Self::COUNT_SHIFT) - 1;

    /// How many packets, and how many other things, one tree can hold.
    pub const LIMIT: usize = Self::INDEX as usize;
    pub const EMPTY: Self = Self(u32::MAX);

    pub fn node(index: usize) -> Self {
        Self(index as u32)
    }

    pub fn packets(first: usize, count: usize) -> Self {
        debug_assert!((1..=LEAF_MAX).contains(&count) && first < Self::LIMIT);
        Self(Self::LEAF | (count as u32 - 1) << Self::COUNT_SHIFT | first as u32)
    }

    pub fn others(first: usize, count: usize) -> Self {
        Self(Self::packets(first, count).0 | Self::OTHER)
    }

    #[inline(always)]
    pub fn bits(self) -> u32 {
        self.0
    }

    #[inline(always)]
    pub fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    #[inline(always)]
    pub fn is_other(self) -> bool {
        self.0 & Self::OTHER != 0
    }

    #[inline(always)]
    pub fn index(self) -> usize {
        self.0 as usize
    }

    #[inline(always)]
    pub fn range(self) -> std::ops::Range<usize> {
        let first = (self.0 & Self::INDEX) as usize;
        first..first + ((self.0 >> Self::COUNT_SHIFT) & 7) as usize + 1
    }
}

/// Four triangles, coordinate by coordinate. Where there are fewer, the last is repeated.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct TrianglePacket {
    /// `corners[corner][axis][lane]`.
    pub corners: [[[f32; LANES]; 3]; 3],
    pub shape: [u32; LANES],
    pub primitive: [u32; LANES],
    /// To three cache lines.
    _unused: [u32; 4],
}

impl TrianglePacket {
    pub fn set(&mut self, lane: usize, corners: [Vec3; 3], shape: u32, primitive: u32) {
        for (to, from) in self.corners.iter_mut().zip(corners) {
            for axis in 0..3 {
                to[axis][lane] = from[axis];
            }
        }
        self.shape[lane] = shape;
        self.primitive[lane] = primitive;
    }

    /// Whether the triangle of a lane is this one.
    #[inline(always)]
    pub fn is(&self, lane: usize, [shape, primitive]: [u32; 2]) -> bool {
        self.shape[lane] == shape && self.primitive[lane] == primitive
    }

    /// The corners of one lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> [Vec3; 3] {
        self.corners.map(|c| Vec3::new(c[0][lane], c[1][lane], c[2][lane]))
    }
}

/// Something that is not a triangle: a primitive of another shape, or an instance.
#[derive(Clone, Copy, Debug, Hash)]
pub(super) enum Other {
    Primitive { shape: u32, primitive: u32 },
    Instance(u32),
}

/// One level: a tree over triangles and other things.
#[derive(Debug, Default)]
pub(super) struct Tree {
    pub nodes: Pages<WideNode>,
    pub packets: Pages<TrianglePacket>,
    pub others: Vec<Other>,
    pub bounds: Bounds3,
    /// The largest absolute coordinate of the bounds.
    pub reach: f32,
}

impl Tree {
    /// Feeds every byte to a hasher.
    pub fn hash_into(&self, hasher: &mut impl std::hash::Hasher) {
        hasher.write(bytemuck::cast_slice(&self.nodes[..]));
        hasher.write(bytemuck::cast_slice(&self.packets[..]));
        for other in &self.others {
            std::hash::Hash::hash(other, hasher);
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.packets[..]) + size_of_val(&self.others[..])
    }
}
