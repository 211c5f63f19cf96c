//! From the binary tree to the wide one.

use bytemuck::Zeroable;

use super::binary::{BinaryNode, Primitive};
use super::node::{Child, LANES, Other, Tree, TrianglePacket, WIDTH, WideNode};
use crate::Shape;

/// Makes the eight-wide tree: the children of a node are found by opening, again and again, the inner child of the
/// largest surface.
pub(super) fn collapse(binary: &[BinaryNode], primitives: &[Primitive], shapes: &[Shape]) -> Tree {
    let mut tree = Tree::default();
    let Some(root) = binary.first() else { return tree };
    tree.bounds = root.bounds();
    tree.reach = tree.bounds.min.abs().max(tree.bounds.max.abs()).max_element();
    let mut maker = Maker { binary, primitives, shapes, tree };
    maker.tree.nodes.push(WideNode::EMPTY);
    if root.is_leaf() {
        let child = maker.leaf(root);
        maker.tree.nodes[0].set(0, &root.bounds(), child);
    } else {
        maker.node(0, 0);
    }
    maker.tree.nodes.shrink_to_fit();
    maker.tree.packets.shrink_to_fit();
    maker.tree.others.shrink_to_fit();
    maker.tree
}

struct Maker<'a> {
    binary: &'a [BinaryNode],
    primitives: &'a [Primitive],
    shapes: &'a [Shape],
    tree: Tree,
}

impl Maker<'_> {
    /// Fills the wide node at `place` from the inner binary node `from`.
    fn node(&mut self, from: usize, place: usize) {
        let mut open = [0usize; WIDTH];
        let children = |at: usize| [at + 1, at + self.binary[at].right as usize];
        [open[0], open[1]] = children(from);
        let mut count = 2;
        while count < WIDTH {
            let largest = (0..count).filter(|&i| !self.binary[open[i]].is_leaf()).max_by(|&i, &j| {
                let area = |i: usize| self.binary[open[i]].bounds().surface_area();
                area(i).total_cmp(&area(j))
            });
            let Some(i) = largest else { break };
            [open[i], open[count]] = children(open[i]);
            count += 1;
        }
        let first = self.tree.nodes.len();
        let inner = open[..count].iter().filter(|&&at| !self.binary[at].is_leaf()).count();
        self.tree.nodes.resize(first + inner, WideNode::EMPTY);
        let mut next = first;
        for (i, &at) in open[..count].iter().enumerate() {
            let node = self.binary[at];
            let child = if node.is_leaf() {
                self.leaf(&node)
            } else {
                next += 1;
                self.node(at, next - 1);
                Child::node(next - 1)
            };
            self.tree.nodes[place].set(i, &node.bounds(), child);
        }
    }

    fn leaf(&mut self, node: &BinaryNode) -> Child {
        let range = node.first as usize..(node.first + node.count) as usize;
        let primitives = &self.primitives[range];
        if primitives.iter().all(Primitive::is_other) {
            let first = self.tree.others.len();
            self.tree.others.extend(primitives.iter().map(|p| match p.shape() {
                Primitive::INSTANCE => Other::Instance(p.primitive()),
                shape => Other::Primitive { shape, primitive: p.primitive() },
            }));
            return Child::others(first, primitives.len());
        }
        let first = self.tree.packets.len();
        for four in primitives.chunks(LANES) {
            let mut packet = TrianglePacket::zeroed();
            for lane in 0..LANES {
                // Places left over repeat the last triangle: nothing then needs to know that they are left over.
                let p = four[lane.min(four.len() - 1)];
                if let Shape::Triangles(mesh) = &self.shapes[p.shape() as usize] {
                    packet.set(lane, mesh.corners(p.primitive() as usize), p.shape(), p.primitive());
                }
            }
            self.tree.packets.push(packet);
        }
        Child::packets(first, primitives.len().div_ceil(LANES))
    }
}

impl Tree {
    /// A tree over `primitives`.
    pub fn build(mut primitives: Vec<Primitive>, shapes: &[Shape]) -> Self {
        let binary = super::binary::build(&mut primitives);
        collapse(&binary, &primitives, shapes)
    }
}
