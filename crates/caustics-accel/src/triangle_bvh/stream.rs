//! Neighbouring rays that share their way through the tree.

use caustics_geometry::{Hit, Ray};

use super::bundle::{Gathered, Hull, highest};
use super::layout::Child;
use super::traverse::{
    InPlace, STACK, Tree, child_of, closest_hit, entry, near_of, search,
};
use crate::simd::{Kernel, Lanes, Stack, WIDTH, next_lane};
use crate::triangles::{ClosestRow, WIDEN};

/// When no more than this many rays meet a node, each goes on alone: then it is no more work.
const ALONE: u32 = 3;

const ROWS: usize = 2;

/// The closest hit of each ray.
pub(super) struct ClosestHits<'a> {
    pub(super) tree: Tree<'a>,
    pub(super) rays: &'a [Ray],
    pub(super) hits: &'a mut [Option<Hit>],
}

impl Kernel for ClosestHits<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let all = self.rays.chunks(ROWS * WIDTH).zip(self.hits.chunks_mut(ROWS * WIDTH));
        for (rays, hits) in all {
            if rays.len() == ROWS * WIDTH && hits.len() == ROWS * WIDTH
                && let Some(mut gathered) = Gathered::<ROWS>::new(lanes, rays)
            {
                trace(lanes, self.tree, rays, &mut gathered);
                for (lane, hit) in hits.iter_mut().enumerate() {
                    *hit = gathered.closest[lane / WIDTH].hit(lane % WIDTH);
                }
            } else {
                for (ray, hit) in rays.iter().zip(hits) {
                    *hit = closest_hit(lanes, self.tree, ray);
                }
            }
        }
    }
}

/// Sends a bundle through the tree.
#[inline(always)]
fn trace<L: Lanes, const ROWS: usize>(
    lanes: L,
    tree: Tree<'_>,
    rays: &[Ray],
    gathered: &mut Gathered<ROWS>,
) {
    let Gathered {
        bundle,
        sheared,
        closest,
    } = gathered;
    let hull = Hull::new(lanes, bundle);
    let mut farthest = farthest_limit(lanes, closest);
    let mut stack = Stack::<u64, STACK>::new();
    let mut current = tree.root;
    // Which rays meet the current child, a bit for each.
    let mut active = u64::MAX >> (64 - ROWS * WIDTH);
    loop {
        if current.is_leaf() {
            for row in 0..ROWS {
                let mut met = (active >> (row * WIDTH)) as u32 & 255;
                if met == 0 {
                    continue;
                }
                let rays = &rays[row * WIDTH..][..WIDTH];
                if met.count_ones() > LEAF_ALONE {
                    for block in &tree.blocks[current.blocks()] {
                        closest[row].find_closest(lanes, block, 0, &sheared[row], rays);
                    }
                } else {
                    while met != 0 {
                        let lane = next_lane(&mut met);
                        let mut alone = closest[row].get(lane, 0);
                        sheared[row].ray(lane).find_closest(
                            lanes,
                            tree.blocks,
                            current.blocks(),
                            &rays[lane],
                            &mut alone,
                        );
                        closest[row].set(lane, &alone);
                    }
                }
            }
            farthest = farthest_limit(lanes, closest);
        } else if active.count_ones() <= ALONE {
            while active != 0 {
                let at = active.trailing_zeros() as usize % (ROWS * WIDTH);
                active &= active - 1;
                let (row, lane) = (at / WIDTH, at % WIDTH);
                let mut alone = closest[row].get(lane, 0);
                let in_place = InPlace {
                    slabs: bundle.slabs[row].slabs(lanes, bundle.near_side, lane),
                    sheared: &sheared[row].ray(lane),
                    blocks: tree.blocks,
                    ray: &rays[at],
                };
                search(lanes, tree.nodes, current, &in_place, &mut alone);
                closest[row].set(lane, &alone);
            }
            farthest = farthest_limit(lanes, closest);
        } else {
            let index = current.index();
            let node = &tree.nodes[index];
            let (near, mut met) = hull.meet(lanes, node, lanes.splat(farthest));
            if met != 0 {
                let near = lanes.store(near);
                let mut pushed = 0;
                while met != 0 {
                    let lane = next_lane(&mut met);
                    let child = node.children[lane];
                    if child.is_leaf() {
                        if let Some(block) = tree.blocks.get(child.blocks().start) {
                            crate::simd::prefetch(block);
                        }
                    } else {
                        crate::simd::prefetch(&tree.nodes[child.index()]);
                    }
                    stack.insert(
                        entry(near[lane], Child((index * WIDTH + lane) as u32)),
                        pushed,
                    );
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
            let node = &tree.nodes[place / WIDTH];
            let lane = place % WIDTH;
            active = 0;
            for (i, row) in bundle.slabs.iter().enumerate() {
                let met = row.meet(lanes, bundle.near_side, node, lane, &closest[i].limit);
                active |= u64::from(met) << (i * WIDTH);
            }
            if active != 0 {
                current = node.children[lane];
                break;
            }
        }
    }
}

/// Leaf test of rays alone up to so many.
const LEAF_ALONE: u32 = 2;

/// The largest limit of all, widened.
#[inline(always)]
fn farthest_limit<L: Lanes, const ROWS: usize>(lanes: L, rows: &[ClosestRow; ROWS]) -> f32 {
    let mut all = lanes.load(&rows[0].limit);
    for row in &rows[1..] {
        all = lanes.max(lanes.load(&row.limit), all);
    }
    highest(lanes.store(all)) * WIDEN
}
