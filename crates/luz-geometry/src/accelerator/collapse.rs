//! From the binary tree to the wide one.

use bytemuck::Zeroable;

use super::binary::{BinaryNode, Primitive, Weight};
use super::node::{Child, LANES, LEAF_MAX, Other, Tree, TrianglePacket, WIDTH, WideNode};
use crate::Shape;

impl Tree {
    /// A tree over `primitives`.
    pub fn build(mut primitives: Vec<Primitive>, shapes: &[Shape]) -> Self {
        let binary = super::binary::build(&mut primitives);
        let Some(root) = binary.first() else { return Self::default() };
        let plans = plan(&binary, &primitives);
        let mut maker = Maker {
            binary: &binary,
            plans: &plans,
            primitives: &primitives,
            shapes,
            nodes: vec![WideNode::EMPTY],
            packets: Vec::new(),
            others: Vec::new(),
        };
        if plans[0].is_leaf() {
            let child = maker.leaf(root);
            maker.nodes[0].set(0, &root.bounds(), child);
        } else {
            maker.node(0, 0);
        }
        let bounds = root.bounds();
        Self {
            nodes: maker.nodes.into(),
            packets: maker.packets.into(),
            others: maker.others,
            bounds,
            reach: bounds.min.abs().max(bounds.max.abs()).max_element(),
        }
    }
}

/// How a binary subtree is best turned into at most 1, 2, … 7 children of a wide node.
#[derive(Clone, Copy, Zeroable)]
struct Plan([Share; WIDTH - 1]);

/// How many pieces a subtree is cut into, and how many of them are the left half's. No pieces: a leaf. Eight: it becomes a
/// wide node, and these are its children.
#[derive(Clone, Copy, Zeroable)]
struct Share {
    pieces: u8,
    left: u8,
}

impl Plan {
    /// Whether the subtree, in one piece, is a leaf.
    fn is_leaf(self) -> bool {
        self.0[0].pieces == 0
    }
}

/// The cheapest plans by the surface-area heuristic, by dynamic programming from the leaves up (Ylitie, Karras, Laine 2017,
/// "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", section 3.2).
fn plan(binary: &[BinaryNode], primitives: &[Primitive]) -> Vec<Plan> {
    let mut plans = vec![Plan::zeroed(); binary.len()];
    plan_subtree(binary, primitives, &mut plans);
    plans
}

/// Fills the plans of a subtree; returns its cost as at most 1, 2, … 7 children, and what it weighs.
fn plan_subtree(binary: &[BinaryNode], primitives: &[Primitive], plans: &mut [Plan]) -> ([f32; WIDTH - 1], Weight) {
    let node = &binary[0];
    let area = node.bounds().surface_area();
    let mut plan = Plan::zeroed();
    if node.is_leaf() {
        let weight = Weight::of(&primitives[..node.count as usize]);
        return ([area * weight.cost(); WIDTH - 1], weight);
    }
    let right_at = node.right as usize;
    let left_count = right_at / 2;
    let ((left, left_weight), (right, right_weight)) = {
        let (left_plans, right_plans) = plans[1..].split_at_mut(right_at - 1);
        let (left_primitives, right_primitives) = primitives.split_at(left_count);
        let mut go_left = || plan_subtree(&binary[1..right_at], left_primitives, left_plans);
        let mut go_right = || plan_subtree(&binary[right_at..], right_primitives, right_plans);
        if node.count > 1 << 13 { rayon::join(go_left, go_right) } else { (go_left(), go_right()) }
    };
    let weight = left_weight.add(right_weight);
    let mut costs = [f32::INFINITY; WIDTH - 1];
    let share = |pieces: usize| {
        let mut best = (f32::INFINITY, Share { pieces: pieces as u8, left: 1 });
        for k in 1..pieces {
            let cost = left[k.min(WIDTH - 1) - 1] + right[(pieces - k).min(WIDTH - 1) - 1];
            if cost < best.0 {
                best = (cost, Share { pieces: pieces as u8, left: k as u8 });
            }
        }
        best
    };
    let (children, whole) = share(WIDTH);
    (costs[0], plan.0[0]) = (area * Weight::NODE_COST + children, whole);
    let packets = weight.triangles().div_ceil(LANES as u32) as usize;
    let fits = (weight.others() == 0 && packets <= LEAF_MAX)
        || (weight.triangles() == 0 && weight.others() as usize <= LEAF_MAX);
    if fits && area * weight.cost() <= costs[0] {
        (costs[0], plan.0[0]) = (area * weight.cost(), Share { pieces: 0, left: 0 });
    }
    for pieces in 2..WIDTH {
        let one_less = (costs[pieces - 2], if pieces == 2 { Share { pieces: 1, left: 0 } } else { plan.0[pieces - 2] });
        let best = share(pieces);
        // More pieces than are of use need not be used.
        (costs[pieces - 1], plan.0[pieces - 1]) = if best.0 < one_less.0 { best } else { one_less };
    }
    plans[0] = plan;
    (costs, weight)
}

struct Maker<'a> {
    binary: &'a [BinaryNode],
    plans: &'a [Plan],
    primitives: &'a [Primitive],
    shapes: &'a [Shape],
    nodes: Vec<WideNode>,
    packets: Vec<TrianglePacket>,
    others: Vec<Other>,
}

impl Maker<'_> {
    /// Fills the wide node at `place` from the binary subtree at `from`, which is not to be a leaf.
    fn node(&mut self, from: usize, place: usize) {
        let mut open = [0usize; WIDTH];
        let mut count = 0;
        self.open(from, self.plans[from].0[0], &mut open, &mut count);
        let first = self.nodes.len();
        let inner = open[..count].iter().filter(|&&at| !self.plans[at].is_leaf()).count();
        self.nodes.resize(first + inner, WideNode::EMPTY);
        let mut next = first;
        for (i, &at) in open[..count].iter().enumerate() {
            let node = self.binary[at];
            let child = if self.plans[at].is_leaf() {
                self.leaf(&node)
            } else {
                next += 1;
                self.node(at, next - 1);
                Child::node(next - 1)
            };
            self.nodes[place].set(i, &node.bounds(), child);
        }
    }

    /// Collects the pieces of a subtree.
    fn open(&self, at: usize, share: Share, open: &mut [usize; WIDTH], count: &mut usize) {
        let (left_at, right_at) = (at + 1, at + self.binary[at].right as usize);
        for (half, pieces) in [(left_at, share.left), (right_at, share.pieces - share.left)] {
            let pieces = usize::from(pieces).min(WIDTH - 1);
            let share = self.plans[half].0[pieces - 1];
            if pieces == 1 || share.pieces <= 1 {
                open[*count] = half;
                *count += 1;
            } else {
                self.open(half, share, open, count);
            }
        }
    }

    fn leaf(&mut self, node: &BinaryNode) -> Child {
        let range = node.first as usize..(node.first + node.count) as usize;
        let primitives = &self.primitives[range];
        if primitives.iter().all(Primitive::is_other) {
            let first = self.others.len();
            self.others.extend(primitives.iter().map(|p| match p.shape() {
                Primitive::INSTANCE => Other::Instance(p.primitive()),
                shape => Other::Primitive { shape, primitive: p.primitive() },
            }));
            return Child::others(first, primitives.len());
        }
        let first = self.packets.len();
        for four in primitives.chunks(LANES) {
            let mut packet = TrianglePacket::zeroed();
            for lane in 0..LANES {
                // Places left over repeat the last triangle: nothing then needs to know that they are left over.
                let p = four[lane.min(four.len() - 1)];
                if let Shape::Triangles(mesh) = &self.shapes[p.shape() as usize] {
                    packet.set(lane, mesh.corners(p.primitive() as usize), p.shape(), p.primitive());
                }
            }
            self.packets.push(packet);
        }
        Child::packets(first, primitives.len().div_ceil(LANES))
    }
}
