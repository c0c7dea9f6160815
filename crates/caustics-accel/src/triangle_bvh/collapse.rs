//! From a binary tree to one of eight children a node and eight triangles a leaf.

#[cfg(feature = "parallel")]
use rayon::prelude::*;

use super::binary_tree::BinaryNode;
use super::layout::{Child, Node};
use crate::simd::WIDTH;
use crate::triangles::Block;

/// Cost of testing a node's eight boxes against a ray, in arbitrary units.
const NODE_COST: f32 = 1.0;
/// Cost of testing a block's eight triangles, in the same units.
const BLOCK_COST: f32 = 1.2;

/// Subtrees of more binary nodes than this are divided among threads. What is divided depends on
/// this alone, so that the result does not depend on how many threads there are.
const PARALLEL_NODES: usize = 16_384;
/// Levels that are divided at most: a tree may be a chain.
const PARALLEL_LEVELS: u32 = 24;

/// The tree as traversal wants it: parents before their children.
pub(super) struct WideTree {
    pub(super) nodes: Vec<Node>,
    pub(super) blocks: Vec<Block>,
    pub(super) root: Child,
    /// Levels of nodes.
    pub(super) depth: usize,
}

impl WideTree {
    fn new() -> Self {
        Self {
            nodes: Vec::new(),
            blocks: Vec::new(),
            root: Child::EMPTY,
            depth: 0,
        }
    }

    /// Adds another tree and returns its root.
    fn graft(&mut self, tree: &Self) -> Child {
        let (nodes, blocks) = (self.nodes.len(), self.blocks.len());
        self.nodes.extend(tree.nodes.iter().map(|node| {
            let children = node.children.map(|child| child.shifted(nodes, blocks));
            Node { children, ..*node }
        }));
        self.blocks.extend_from_slice(&tree.blocks);
        tree.root.shifted(nodes, blocks)
    }
}

/// What a subtree costs at best.
#[derive(Clone, Copy)]
pub(super) struct Costs {
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

/// Computes a node's box and costs, given those of the nodes behind it.
fn combine(nodes: &mut [BinaryNode], costs: &mut [Costs], index: usize) {
    if nodes[index].is_leaf() {
        let cost = Costs::leaf(1, nodes[index].half_area());
        costs[index] = Costs {
            roots: [cost; WIDTH - 1],
            triangles: 1,
        };
        return;
    }
    let [left, right] = [index + 1, index + nodes[index].right as usize];
    nodes[index].low = nodes[left].low.min(nodes[right].low);
    nodes[index].high = nodes[left].high.max(nodes[right].high);
    let half_area = nodes[index].half_area();
    let [left, right] = [costs[left], costs[right]];
    let triangles = (left.triangles + right.triangles).min(WIDTH as u32 + 1);
    let inner = NODE_COST * half_area + Costs::share(&left, &right, WIDTH).0;
    let mut roots = [inner.min(Costs::leaf(triangles, half_area)); WIDTH - 1];
    for count in 2..WIDTH {
        roots[count - 1] = roots[count - 2].min(Costs::share(&left, &right, count).0);
    }
    costs[index] = Costs { roots, triangles };
}

/// Finds the boxes of inner nodes, and the cheapest tree of eight children a node that the binary
/// one can be collapsed to.
///
/// Dynamic programming over the subtrees, after Ylitie, Karras, Laine, *Efficient Incoherent Ray
/// Traversal on GPUs Through Compressed Wide BVHs* (2017), section 3.1.
fn evaluate(nodes: &mut [BinaryNode], costs: &mut [Costs], levels: u32) {
    #[cfg(feature = "parallel")]
    if nodes.len() > PARALLEL_NODES && levels > 0 {
        let right = nodes[0].right as usize;
        let (left_nodes, right_nodes) = nodes.split_at_mut(right);
        let (left_costs, right_costs) = costs.split_at_mut(right);
        rayon::join(
            || evaluate(&mut left_nodes[1..], &mut left_costs[1..], levels - 1),
            || evaluate(right_nodes, right_costs, levels - 1),
        );
        combine(nodes, costs, 0);
        return;
    }
    #[cfg(not(feature = "parallel"))]
    let _ = levels;
    for index in (0..nodes.len()).rev() {
        combine(nodes, costs, index);
    }
}

/// Collapses a binary tree, given the corners of triangles by number.
pub(super) fn collapse(
    nodes: &mut [BinaryNode],
    corners: &(impl Fn(u32) -> [[f32; 3]; 3] + Sync),
) -> WideTree {
    if nodes.is_empty() {
        return WideTree::new();
    }
    let mut costs = vec![Costs::UNKNOWN; nodes.len()];
    evaluate(nodes, &mut costs, PARALLEL_LEVELS);
    let source = Source {
        nodes,
        costs: &costs,
        corners,
    };
    let mut wide = source.grow(0, nodes.len(), PARALLEL_LEVELS);
    wide.blocks.shrink_to_fit();
    wide.nodes.shrink_to_fit();
    wide
}

/// A subtree that has yet to become a child of a wide node.
struct Pending {
    index: usize,
    parent: usize,
    lane: usize,
    depth: usize,
}

/// What the wide tree is made from.
struct Source<'a, C> {
    nodes: &'a [BinaryNode],
    costs: &'a [Costs],
    corners: &'a C,
}

impl<C: Fn(u32) -> [[f32; 3]; 3] + Sync> Source<'_, C> {
    /// The tree of the subtree of so many nodes.
    fn grow(&self, root: usize, count: usize, levels: u32) -> WideTree {
        let mut wide = WideTree::new();
        if count <= PARALLEL_NODES || levels == 0 || self.is_leaf(root) {
            // More than enough, given back at the end: growing would copy all of it several times.
            let triangles = count / 2 + 1;
            wide.blocks.reserve(triangles / 3 + 1);
            wide.nodes.reserve(triangles / 8 + 1);
            self.grow_alone(root, &mut wide);
            return wide;
        }
        let mut node = Node::EMPTY;
        let mut parts = [0; WIDTH];
        let lanes = self.part(root, &mut node, &mut parts);
        let parts = &parts[..lanes];
        let of_part = |&part: &usize| self.grow(part, self.size(part), levels - 1);
        #[cfg(feature = "parallel")]
        let subtrees: Vec<WideTree> = parts.par_iter().map(of_part).collect();
        #[cfg(not(feature = "parallel"))]
        let subtrees: Vec<WideTree> = parts.iter().map(of_part).collect();
        wide.nodes.push(node);
        wide.root = Child::node(0);
        for (lane, subtree) in subtrees.iter().enumerate() {
            wide.nodes[0].children[lane] = wide.graft(subtree);
            wide.depth = wide.depth.max(subtree.depth + 1);
        }
        wide
    }

    /// The same on one thread.
    fn grow_alone(&self, root: usize, wide: &mut WideTree) {
        let mut waiting = Vec::new();
        wide.root = self.emit(root, 1, wide, &mut waiting);
        while let Some(pending) = waiting.pop() {
            let child = self.emit(pending.index, pending.depth, wide, &mut waiting);
            wide.nodes[pending.parent].children[pending.lane] = child;
        }
    }

    /// How many nodes a subtree has: each right child ends where it does.
    fn size(&self, root: usize) -> usize {
        let mut last = root;
        while !self.nodes[last].is_leaf() {
            last += self.nodes[last].right as usize;
        }
        last + 1 - root
    }

    /// Whether a subtree becomes a single leaf.
    fn is_leaf(&self, index: usize) -> bool {
        let cost = &self.costs[index];
        cost.roots[0] == Costs::leaf(cost.triangles, self.nodes[index].half_area())
    }

    /// Makes a leaf or a node of one subtree; the node's children join those that wait.
    fn emit(
        &self,
        index: usize,
        depth: usize,
        wide: &mut WideTree,
        waiting: &mut Vec<Pending>,
    ) -> Child {
        if self.is_leaf(index) {
            let block = wide.blocks.len();
            wide.blocks.push(self.block_of(index));
            return Child::leaf(block, 1);
        }
        let parent = wide.nodes.len();
        wide.depth = wide.depth.max(depth);
        let mut node = Node::EMPTY;
        let mut parts = [0; WIDTH];
        let lanes = self.part(index, &mut node, &mut parts);
        for (lane, &index) in parts[..lanes].iter().enumerate() {
            waiting.push(Pending {
                index,
                parent,
                lane,
                depth: depth + 1,
            });
        }
        wide.nodes.push(node);
        Child::node(parent)
    }

    /// Chooses the subtrees that become a wide node's children, and sets their boxes; returns how
    /// many there are.
    fn part(&self, index: usize, wide: &mut Node, parts: &mut [usize; WIDTH]) -> usize {
        let mut lane = 0;
        // Subtrees and the number of children that each may become. At most seven wait here.
        let mut waiting = [(0, 0); WIDTH];
        self.divide(index, WIDTH, &mut waiting, 0);
        let mut height = 2;
        while height > 0 {
            height -= 1;
            let (index, mut roots) = waiting[height];
            let cost = &self.costs[index];
            // With fewer children it costs the same: then the box stays whole.
            while roots > 1 && cost.roots[roots - 1] == cost.roots[roots - 2] {
                roots -= 1;
            }
            if roots == 1 {
                let node = &self.nodes[index];
                wide.set(
                    lane,
                    node.low.to_array(),
                    node.high.to_array(),
                    Child::EMPTY,
                );
                parts[lane] = index;
                lane += 1;
            } else {
                self.divide(index, roots, &mut waiting, height);
                height += 2;
            }
        }
        lane
    }

    /// Puts both children of a node, and the children that each may become, on a stack.
    fn divide(
        &self,
        index: usize,
        roots: usize,
        waiting: &mut [(usize, usize); WIDTH],
        height: usize,
    ) {
        let (left, right) = (index + 1, index + self.nodes[index].right as usize);
        let (_, share) = Costs::share(&self.costs[left], &self.costs[right], roots);
        waiting[height] = (right, roots - share);
        waiting[height + 1] = (left, share);
    }

    /// The triangles below a subtree that has no more than a block holds.
    fn block_of(&self, index: usize) -> Block {
        let mut block = Block::EMPTY;
        let leaves = self.nodes[index..]
            .iter()
            .filter(|node| node.is_leaf())
            .take(self.costs[index].triangles as usize);
        for (lane, leaf) in leaves.enumerate() {
            block.set(lane, (self.corners)(leaf.triangle), leaf.triangle);
        }
        block
    }
}
