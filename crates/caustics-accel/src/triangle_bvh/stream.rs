//! Neighbouring rays that share their way through the tree.

use caustics_geometry::{Hit, Ray};

use super::bundle::{Bundle, Hull, greatest};
use super::gather::{Gathered, Together, are_compact};
use super::layout::{Child, Node};
use super::stage::{Stage, closest_hit};
use super::traverse::{InPlace, STACK, Tree, child_of, entry, near_of, search};
use crate::simd::{Lanes, Stack, WIDTH, next_lane, prefetch};
use crate::triangles::{Block, ClosestRow, ShearedRow, WIDEN};

/// Rows of rays in a large bundle, for rays that follow each other in squares ...
const LARGE: usize = 8;
/// ... and in a small one.
const SMALL: usize = 2;

/// When no more than this many rays meet a node, each goes on alone: then it is no more work.
const ALONE: u32 = 3;

/// When no more than this many rays of a row come to a leaf, each is tested alone against all of
/// its triangles.
const ALONE_IN_LEAF: u32 = 2;

/// Traces the rays in as large bundles as keep together.
#[inline(always)]
pub(crate) fn trace_all<L: Lanes>(
    lanes: L,
    stage: &impl Stage,
    rays: &[Ray],
    hits: &mut [Option<Hit>],
) {
    let mut large = Gathered::<LARGE>::new();
    let mut small = Gathered::<SMALL>::new();
    let size = LARGE * WIDTH;
    for (rays, hits) in rays.chunks(size).zip(hits.chunks_mut(size)) {
        if are_compact(rays) && trace_bundle(lanes, stage, &mut large, rays, hits) {
            continue;
        }
        let size = SMALL * WIDTH;
        for (rays, hits) in rays.chunks(size).zip(hits.chunks_mut(size)) {
            if !trace_bundle(lanes, stage, &mut small, rays, hits) {
                for (ray, hit) in rays.iter().zip(hits) {
                    *hit = closest_hit(lanes, stage, ray);
                }
            }
        }
    }
}

/// Traces the rays if they keep together, and tells whether they do.
#[inline(always)]
fn trace_bundle<L: Lanes, const ROWS: usize>(
    lanes: L,
    stage: &impl Stage,
    gathered: &mut Gathered<ROWS>,
    rays: &[Ray],
    hits: &mut [Option<Hit>],
) -> bool {
    if !gathered.take(lanes, rays) {
        return false;
    }
    let Gathered {
        world,
        bundle,
        sheared,
        closest,
    } = gathered;
    let leaves = stage.together::<L, ROWS>(Together {
        rays,
        world,
        bundle,
        sheared,
    });
    search_together(lanes, stage.nodes(), stage.root(), bundle, &leaves, closest);
    for (hits, closest) in hits.chunks_mut(WIDTH).zip(&*closest) {
        for (lane, hit) in hits.iter_mut().enumerate() {
            *hit = closest.hit(lane);
        }
    }
    true
}

/// A bundle as the leaves of a tree meet it. Rays are numbered throughout all rows; a set of them
/// has a bit for each.
pub(crate) trait MeetTogether<L: Lanes, const ROWS: usize> {
    /// Has the processor fetch what is read in a leaf.
    fn fetch(&self, leaf: Child);

    /// Looks for something closer in a leaf.
    fn find_closest(&self, lanes: L, leaf: Child, active: u64, closest: &mut [ClosestRow; ROWS]);

    /// Looks for something closer below a node, for one ray.
    fn search_alone(&self, lanes: L, node: Child, ray: usize, closest: &mut ClosestRow);
}

/// A bundle and the triangles of a tree, both where the caller has them.
pub(super) struct InPlaceTogether<'a, const ROWS: usize> {
    pub(super) tree: Tree<'a>,
    pub(super) rays: Together<'a, ROWS>,
}

impl<L: Lanes, const ROWS: usize> MeetTogether<L, ROWS> for InPlaceTogether<'_, ROWS> {
    #[inline(always)]
    fn fetch(&self, leaf: Child) {
        fetch(self.tree.blocks, leaf);
    }

    #[inline(always)]
    fn find_closest(&self, lanes: L, leaf: Child, active: u64, closest: &mut [ClosestRow; ROWS]) {
        let Together { rays, sheared, .. } = self.rays;
        for block in &self.tree.blocks[leaf.blocks()] {
            find_closest(lanes, block, 0, rays, sheared, active, closest);
        }
    }

    #[inline(always)]
    fn search_alone(&self, lanes: L, node: Child, ray: usize, closest: &mut ClosestRow) {
        let Together {
            rays,
            bundle,
            sheared,
            ..
        } = self.rays;
        let (row, lane) = (ray / WIDTH, ray % WIDTH);
        let in_place = InPlace {
            slabs: bundle.rows[row].slabs(lanes, bundle.sides.near, lane),
            sheared: sheared[row].ray(lane),
            blocks: self.tree.blocks,
            ray: &rays[ray],
        };
        let mut alone = closest.get(lane, 0);
        search(lanes, self.tree.nodes, node, &in_place, &mut alone);
        closest.set(lane, &alone);
    }
}

/// Has the processor fetch a leaf's first block; nearly all have no other.
#[inline(always)]
pub(crate) fn fetch(blocks: &[Block], leaf: Child) {
    if let Some(block) = blocks.get(leaf.blocks().start) {
        prefetch(block);
    }
}

/// Looks for something closer in a block, whose primitives are numbered from `first`.
#[inline(always)]
pub(crate) fn find_closest<L: Lanes, const ROWS: usize>(
    lanes: L,
    block: &Block,
    first: u32,
    rays: &[Ray],
    sheared: &[ShearedRow; ROWS],
    active: u64,
    closest: &mut [ClosestRow; ROWS],
) {
    for row in 0..ROWS {
        let mut met = (active >> (row * WIDTH)) as u32 & 255;
        if met == 0 {
            continue;
        }
        let (rays, sheared) = (&rays[row * WIDTH..][..WIDTH], &sheared[row]);
        let closest = &mut closest[row];
        if met.count_ones() > ALONE_IN_LEAF {
            closest.find_closest(lanes, block, first, sheared, rays, met);
            continue;
        }
        while met != 0 {
            let lane = next_lane(&mut met);
            let mut alone = closest.get(lane, first);
            let block = std::slice::from_ref(block);
            let ray = sheared.ray(lane);
            ray.find_closest(lanes, block, 0..1, &rays[lane], &mut alone);
            closest.set(lane, &alone);
        }
    }
}

/// Sends a bundle through what lies below one child.
#[inline(always)]
pub(crate) fn search_together<L: Lanes, const ROWS: usize>(
    lanes: L,
    nodes: &[Node],
    start: Child,
    bundle: &Bundle<ROWS>,
    leaves: &impl MeetTogether<L, ROWS>,
    closest: &mut [ClosestRow; ROWS],
) {
    let hull = Hull::new(lanes, bundle);
    let mut farthest = farthest_limit(lanes, closest);
    let mut stack = Stack::<u64, STACK>::new();
    let mut current = start;
    // Which rays meet the current child.
    let mut active = u64::MAX >> (64 - ROWS * WIDTH);
    loop {
        if current.is_leaf() {
            leaves.find_closest(lanes, current, active, closest);
            farthest = farthest_limit(lanes, closest);
        } else if active.count_ones() <= ALONE {
            while active != 0 {
                let ray = active.trailing_zeros() as usize % (ROWS * WIDTH);
                active &= active - 1;
                leaves.search_alone(lanes, current, ray, &mut closest[ray / WIDTH]);
            }
            farthest = farthest_limit(lanes, closest);
        } else {
            let index = current.index();
            let node = &nodes[index];
            let (near, mut met) = hull.meet(lanes, node, lanes.splat(farthest));
            if met != 0 {
                let near = lanes.store(near);
                let mut pushed = 0;
                while met != 0 {
                    let lane = next_lane(&mut met);
                    // What waits is fetched while others are met: a bundle of rays knows early
                    // what it will need, and that is what pays most in large meshes.
                    let child = node.children[lane];
                    if child.is_leaf() {
                        leaves.fetch(child);
                    } else {
                        prefetch(&nodes[child.index()]);
                    }
                    let place = Child((index * WIDTH + lane) as u32);
                    stack.insert(entry(near[lane], place), pushed);
                    pushed += 1;
                }
            }
        }
        loop {
            let Some(next) = stack.pop() else {
                return;
            };
            if near_of(next) > farthest {
                continue;
            }
            // An entry names the node and the lane: the box is needed once more.
            let place = child_of(next).index();
            let (node, lane) = (&nodes[place / WIDTH], place % WIDTH);
            active = 0;
            for (i, (row, closest)) in bundle.rows.iter().zip(&*closest).enumerate() {
                let met = row.meet(lanes, bundle.sides.near, node, lane, &closest.limit);
                active |= u64::from(met) << (i * WIDTH);
            }
            if active != 0 {
                current = node.children[lane];
                break;
            }
        }
    }
}

/// The largest limit of all, widened.
#[inline(always)]
fn farthest_limit<L: Lanes, const ROWS: usize>(lanes: L, rows: &[ClosestRow; ROWS]) -> f32 {
    let mut all = lanes.load(&rows[0].limit);
    for row in &rows[1..] {
        all = lanes.max(lanes.load(&row.limit), all);
    }
    greatest(lanes.store(all)) * WIDEN
}
