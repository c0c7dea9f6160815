//! From triangles to cells.

use super::KdTreeSplit;
use super::clip::{Bounds, bounds_of, bounds_within};
use super::events::{Events, merge, push, triangles};
use super::layout::Node;
use super::split::{Plane, Side, cheapest, classify, middle};
use crate::simd::WIDTH;
use crate::triangles::Block;

/// Cells of more triangles than this are built as two tasks.
const PARALLEL_TRIANGLES: usize = 16_384;

/// The deepest that any tree may be: the traversal keeps a bit for each level.
pub(super) const MAX_DEPTH: u32 = 60;

/// Times that the average triangle may occur in leaves, at most.
const MAX_COPIES: usize = 6;

/// The tree as traversal wants it; the root comes first.
pub(super) struct Cells {
    pub(super) nodes: Vec<Node>,
    pub(super) blocks: Vec<Block>,
}

/// Builds the tree over the triangles listed, whose corners are given by number.
///
/// Returns it with the box of its root. The events are sorted once, and from then on parted and
/// merged, as Wald and Havran (2006) do; triangles that a plane cuts are clipped to both sides, so
/// that each cell has boxes that fit ("perfect splits").
pub(super) fn build(
    listed: &[u32],
    corners: &(impl Fn(u32) -> [[f32; 3]; 3] + Sync),
    split: KdTreeSplit,
) -> (Cells, Bounds) {
    let mut events = Events::default();
    let mut cell = Bounds::EMPTY;
    for &triangle in listed {
        let bounds = bounds_of(corners(triangle));
        cell = cell.union(&bounds);
        push(&mut events, &bounds, triangle);
    }
    for events in &mut events {
        events.sort_unstable();
    }
    let count = listed.len();
    let task = Task {
        events,
        count,
        cell,
        levels: (10 + count.max(1).ilog2() * 3 / 2).min(MAX_DEPTH),
        budget: MAX_COPIES * count + 64,
    };
    let highest = listed.iter().max().map_or(0, |&highest| highest + 1);
    let mut grower = Grower {
        corners,
        split,
        sides: vec![Side::Both; highest as usize],
        cells: Cells {
            nodes: vec![Node::EMPTY],
            blocks: Vec::new(),
        },
    };
    grower.grow(task, 0);
    let mut cells = grower.cells;
    cells.nodes.shrink_to_fit();
    cells.blocks.shrink_to_fit();
    (cells, cell)
}

/// A cell that is to be filled.
struct Task {
    events: Events,
    /// Triangles in it.
    count: usize,
    cell: Bounds,
    /// Levels that may still follow.
    levels: u32,
    /// The most that splits and copies of triangles in this cell may come to: it bounds the
    /// tree's memory however the triangles lie.
    budget: usize,
}

struct Grower<'a, C> {
    corners: &'a C,
    split: KdTreeSplit,
    /// By triangle, for the split at hand.
    sides: Vec<Side>,
    cells: Cells,
}

impl<C: Fn(u32) -> [[f32; 3]; 3] + Sync> Grower<'_, C> {
    /// Fills a cell; its node is at a place of its own already.
    fn grow(&mut self, task: Task, place: usize) {
        let Some((plane, lower, upper)) = self.part(&task) else {
            self.make_leaf(&task, place);
            return;
        };
        let is_large = task.count > PARALLEL_TRIANGLES;
        drop(task);
        let first = self.cells.nodes.len();
        self.cells.nodes.extend([Node::EMPTY; 2]);
        self.cells.nodes[place] = Node::inner(plane.axis, plane.position, first);
        if is_large {
            let (lower, upper) = self.grow_both(lower, upper);
            self.graft(&lower, first);
            self.graft(&upper, first + 1);
        } else {
            self.grow(lower, first);
            self.grow(upper, first + 1);
        }
    }

    /// Grows two trees of their own, on two threads if there are. How large a cell is decides on
    /// this, not how many threads there are, so that the tree is the same.
    fn grow_both(&self, lower: Task, upper: Task) -> (Cells, Cells) {
        let alone = |task: Task| {
            let mut grower = Grower {
                corners: self.corners,
                split: self.split,
                sides: vec![Side::Both; self.sides.len()],
                cells: Cells {
                    nodes: vec![Node::EMPTY],
                    blocks: Vec::new(),
                },
            };
            grower.grow(task, 0);
            grower.cells
        };
        #[cfg(feature = "parallel")]
        return rayon::join(|| alone(lower), || alone(upper));
        #[cfg(not(feature = "parallel"))]
        (alone(lower), alone(upper))
    }

    /// Adds a tree of its own, its root at a given place.
    fn graft(&mut self, tree: &Cells, place: usize) {
        // The root leaves its place, and the others move up.
        let nodes = self.cells.nodes.len() - 1;
        let blocks = self.cells.blocks.len();
        let mut moved = tree.nodes.iter().map(|node| node.shifted(nodes, blocks));
        if let Some(root) = moved.next() {
            self.cells.nodes[place] = root;
        }
        self.cells.nodes.extend(moved);
        self.cells.blocks.extend_from_slice(&tree.blocks);
    }

    fn make_leaf(&mut self, task: &Task, place: usize) {
        let first = self.cells.blocks.len();
        for (position, triangle) in triangles(&task.events).enumerate() {
            let lane = position % WIDTH;
            if lane == 0 {
                self.cells.blocks.push(Block::EMPTY);
            }
            if let Some(block) = self.cells.blocks.last_mut() {
                block.set(lane, (self.corners)(triangle), triangle);
            }
        }
        self.cells.nodes[place] = Node::leaf(first, self.cells.blocks.len() - first);
    }

    /// Splits a cell in two, unless a leaf is better.
    fn part(&mut self, task: &Task) -> Option<(Plane, Task, Task)> {
        if task.levels == 0 {
            return None;
        }
        let plane = match self.split {
            KdTreeSplit::SurfaceArea => cheapest(&task.events, task.count, &task.cell),
            KdTreeSplit::SpatialMedian => middle(task.count, &task.cell),
        }?;
        let (below, above) = classify(&task.events, plane, &mut self.sides);
        // Before anything is clipped, for a cell that has no budget left.
        let budget = task.budget - 1;
        if below + above + 2 * (task.count - below - above) > budget {
            return None;
        }
        let (lower_cell, upper_cell) = task.cell.cut(plane.axis, plane.position);
        let (mut lower_cut, mut upper_cut) = (Events::default(), Events::default());
        let mut counts = [below, above];
        for triangle in triangles(&task.events) {
            if self.sides[triangle as usize] == Side::Both {
                let corners = (self.corners)(triangle);
                if let Some(bounds) = bounds_within(corners, &lower_cell) {
                    push(&mut lower_cut, &bounds, triangle);
                    counts[0] += 1;
                }
                if let Some(bounds) = bounds_within(corners, &upper_cell) {
                    push(&mut upper_cut, &bounds, triangle);
                    counts[1] += 1;
                }
            }
        }
        let sides = &self.sides;
        let kept = |side: Side, axis: usize| {
            let events = task.events[axis].iter().copied();
            events.filter(move |event| sides[event.triangle() as usize] == side)
        };
        let [lower, upper] =
            [(Side::Below, lower_cut), (Side::Above, upper_cut)].map(|(side, mut cut)| -> Events {
                std::array::from_fn(|axis| {
                    let cut = std::mem::take(&mut cut[axis]);
                    merge(kept(side, axis).collect(), cut)
                })
            });
        let sum = (counts[0] + counts[1]).max(1) as u64;
        let lower_budget = (budget as u64 * counts[0] as u64 / sum) as usize;
        let task_of = |events, count, cell, budget| Task {
            events,
            count,
            cell,
            levels: task.levels - 1,
            budget,
        };
        Some((
            plane,
            task_of(lower, counts[0], lower_cell, lower_budget),
            task_of(upper, counts[1], upper_cell, budget - lower_budget),
        ))
    }
}
