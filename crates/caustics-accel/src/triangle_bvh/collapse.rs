//! From a binary tree to one of eight children a node and eight triangles a leaf.

use super::binary_tree::{BinaryNode, BinaryTree};
use super::layout::{Child, Node};
use crate::simd::WIDTH;
use crate::triangles::Block;

/// Cost of testing a node's eight boxes against a ray, in arbitrary units.
const NODE_COST: f32 = 1.0;
/// Cost of testing a block's eight triangles, in the same units.
const BLOCK_COST: f32 = 1.2;

/// The tree as traversal wants it.
pub(super) struct WideTree {
    pub(super) nodes: Vec<Node>,
    pub(super) blocks: Vec<Block>,
    pub(super) root: Child,
    /// Levels of nodes.
    pub(super) depth: usize,
}

/// What a subtree costs at best.
#[derive(Clone, Copy)]
struct Costs {
    /// If its triangles hang below at most 1, 2, ... 7 children of a node above it. Each entry is
    /// a sum over nodes and blocks of cost times the half area of their boxes.
    roots: [f32; WIDTH - 1],
    /// How many triangles it has; none is counted beyond one block's.
    triangles: u32,
}

impl Costs {
    const UNKNOWN: Self = Self {
        roots: [0.0; WIDTH - 1],
        triangles: 0,
    };

    /// The cheapest way to share `roots` between two subtrees: the cost, and the left one's share.
    fn share(left: &Self, right: &Self, roots: usize) -> (f32, usize) {
        let mut best = (f32::INFINITY, 1);
        for left_share in 1..roots {
            let cost = left.roots[left_share - 1] + right.roots[roots - left_share - 1];
            if cost < best.0 {
                best = (cost, left_share);
            }
        }
        best
    }

    /// Cost of making a single leaf of it.
    fn leaf(triangles: u32, half_area: f32) -> f32 {
        if triangles as usize <= WIDTH {
            BLOCK_COST * half_area
        } else {
            f32::INFINITY
        }
    }
}

/// Finds the cheapest tree of eight children a node that the binary one can be collapsed to.
///
/// Dynamic programming over the subtrees, after Ylitie, Karras, Laine, *Efficient Incoherent Ray
/// Traversal on GPUs Through Compressed Wide BVHs* (2017), section 3.1.
fn evaluate(tree: &BinaryTree) -> Vec<Costs> {
    let nodes = &tree.nodes;
    let mut costs = vec![Costs::UNKNOWN; nodes.len()];
    for &index in tree.order.iter().rev() {
        let node = &nodes[index as usize];
        let half_area = node.half_area();
        costs[index as usize] = if node.is_leaf {
            Costs {
                roots: [Costs::leaf(1, half_area); WIDTH - 1],
                triangles: 1,
            }
        } else {
            let (left, right) = (&costs[node.first as usize], &costs[node.first as usize + 1]);
            let triangles = (left.triangles + right.triangles).min(WIDTH as u32 + 1);
            let inner = NODE_COST * half_area + Costs::share(left, right, WIDTH).0;
            let mut roots = [inner.min(Costs::leaf(triangles, half_area)); WIDTH - 1];
            for count in 2..WIDTH {
                roots[count - 1] = roots[count - 2].min(Costs::share(left, right, count).0);
            }
            Costs { roots, triangles }
        };
    }
    costs
}

/// A subtree that has yet to become a child of a wide node.
struct Pending {
    index: u32,
    parent: usize,
    lane: usize,
    depth: usize,
}

pub(super) fn collapse(tree: &BinaryTree, corners: impl Fn(u32) -> [[f32; 3]; 3]) -> WideTree {
    let mut wide = WideTree {
        nodes: Vec::new(),
        blocks: Vec::new(),
        root: Child::EMPTY,
        depth: 0,
    };
    if tree.nodes.is_empty() {
        return wide;
    }
    // More than enough, given back at the end: growing would copy all of it several times.
    let triangles = tree.nodes.len() / 2 + 1;
    wide.blocks.reserve(triangles / 3 + 1);
    wide.nodes.reserve(triangles / 8 + 1);
    let costs = evaluate(tree);
    let mut waiting = Vec::new();
    wide.root = emit(tree, &costs, 0, 1, &mut wide, &mut waiting, &corners);
    while let Some(pending) = waiting.pop() {
        let child = emit(
            tree,
            &costs,
            pending.index,
            pending.depth,
            &mut wide,
            &mut waiting,
            &corners,
        );
        wide.nodes[pending.parent].children[pending.lane] = child;
    }
    wide.blocks.shrink_to_fit();
    wide.nodes.shrink_to_fit();
    wide
}

/// Makes a leaf or a node of one subtree; the node's children join those that wait.
fn emit(
    tree: &BinaryTree,
    costs: &[Costs],
    index: u32,
    depth: usize,
    wide: &mut WideTree,
    waiting: &mut Vec<Pending>,
    corners: &impl Fn(u32) -> [[f32; 3]; 3],
) -> Child {
    let node = &tree.nodes[index as usize];
    let cost = &costs[index as usize];
    if cost.roots[0] == Costs::leaf(cost.triangles, node.half_area()) {
        let block = wide.blocks.len();
        wide.blocks.push(block_of(tree, index, corners));
        return Child::leaf(block, 1);
    }
    let parent = wide.nodes.len();
    wide.depth = wide.depth.max(depth);
    let mut wide_node = Node::EMPTY;
    let mut lane = 0;
    // Subtrees and the number of children that each may become. At most seven wait here.
    let (_, share) = shares(costs, node, WIDTH);
    let mut parts = [(0, 0); WIDTH];
    parts[0] = (node.first + 1, WIDTH - share);
    parts[1] = (node.first, share);
    let mut height = 2;
    while height > 0 {
        height -= 1;
        let (index, roots) = parts[height];
        let part = &tree.nodes[index as usize];
        let part_costs = &costs[index as usize];
        // With fewer children it costs the same: then the box stays whole.
        let mut roots = roots;
        while roots > 1 && part_costs.roots[roots - 1] == part_costs.roots[roots - 2] {
            roots -= 1;
        }
        if roots == 1 {
            wide_node.set(
                lane,
                part.low.to_array(),
                part.high.to_array(),
                Child::EMPTY,
            );
            waiting.push(Pending {
                index,
                parent,
                lane,
                depth: depth + 1,
            });
            lane += 1;
        } else {
            let (_, share) = shares(costs, part, roots);
            parts[height] = (part.first + 1, roots - share);
            parts[height + 1] = (part.first, share);
            height += 2;
        }
    }
    wide.nodes.push(wide_node);
    Child::node(parent)
}

fn shares(costs: &[Costs], node: &BinaryNode, roots: usize) -> (f32, usize) {
    Costs::share(
        &costs[node.first as usize],
        &costs[node.first as usize + 1],
        roots,
    )
}

/// The triangles below a subtree that has no more than a block holds.
fn block_of(tree: &BinaryTree, index: u32, corners: &impl Fn(u32) -> [[f32; 3]; 3]) -> Block {
    let mut block = Block::EMPTY;
    let mut lane = 0;
    let mut waiting = [0; WIDTH];
    let mut height = 1;
    waiting[0] = index;
    while height > 0 {
        height -= 1;
        let node = &tree.nodes[waiting[height] as usize];
        if node.is_leaf {
            block.set(lane, corners(node.first), node.first);
            lane += 1;
        } else {
            waiting[height] = node.first + 1;
            waiting[height + 1] = node.first;
            height += 2;
        }
    }
    block
}
