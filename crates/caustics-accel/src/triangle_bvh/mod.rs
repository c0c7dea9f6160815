mod binary_tree;
pub(crate) mod bundle;
mod collapse;
pub(crate) mod gather;
pub(crate) mod layout;
mod refit;
pub(crate) mod stage;
pub(crate) mod stream;
pub(crate) mod traverse;

use caustics_geometry::glam::{Vec3, Vec3A};
use caustics_geometry::{Aabb, Hit, Ray};
#[cfg(feature = "parallel")]
use rayon::prelude::*;

use self::binary_tree::{BinaryTree, TriangleBounds};
use self::collapse::{WideTree, collapse};
use self::layout::{Child, Node};
use self::stage::{ClosestHit, ClosestHits, Occlusion};
use self::traverse::{MAX_DEPTH, Tree};
use crate::simd::Dispatch;
use crate::triangles::{self, Block, can_be_hit, corners_of, validate};
use crate::{AccelError, Instructions, Intersect};

/// How much time to spend on building for the sake of tracing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum BvhPreset {
    /// For meshes rebuilt in every frame.
    FastestBuild,
    /// Nearly as fast to build, and faster to trace.
    FastBuild,
    /// What most of the trace speed costs.
    #[default]
    Balanced,
    /// For meshes that never change: several times longer to build, a few per cent to gain.
    FastTrace,
}

/// Settings of [`TriangleBvh::new`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BvhOptions {
    /// Build time against trace time.
    pub preset: BvhPreset,
    /// Processor instructions to trace with.
    pub instructions: Instructions,
}

/// A bounding volume hierarchy over triangles, watertight and fast.
///
/// Each node has up to eight children and each leaf up to eight triangles, so that a ray is tested
/// against eight of them at once, with AVX2 where the processor has it.
///
/// A ray aimed at an edge or a vertex that triangles share hits one of them, always: the triangle
/// test is that of Woop, Benthin and Wald (*Watertight Ray/Triangle Intersection*, JCGT 2013), and
/// no box that holds the triangle is missed by rounding. Triangles have two sides. Of hits at the
/// same parameter the triangle with the lowest index wins.
///
/// # Limits
/// Coordinates of vertices and of ray origins up to [`TriangleBvh::MAX_COORDINATE`]; directions
/// of a length between 1e-10 and 1e10; hits behind the origin never count, also with a negative
/// `t_min`. A ray with a NaN or an infinite coordinate hits nothing.
#[derive(Clone, Debug)]
pub struct TriangleBvh {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    root: Child,
    bounds: Aabb,
    triangles: usize,
    /// Those that can be hit.
    stored: usize,
    /// What a ray may expect to pay now, and when the tree was built.
    cost: f32,
    fresh_cost: f32,
    dispatch: Dispatch,
}

impl TriangleBvh {
    /// The largest magnitude of a vertex coordinate, in metres: products of three of them fit an
    /// f32.
    pub const MAX_COORDINATE: f32 = triangles::MAX_COORDINATE;

    /// The [`cost_ratio`](Self::cost_ratio) above which a refitted tree had better be built anew:
    /// rays then take about a quarter longer.
    pub const REBUILD_RATIO: f32 = 1.5;

    /// The most triangles that a tree takes.
    pub const MAX_TRIANGLES: usize = Child::MAX_BLOCK;

    /// Builds a tree over triangles given as three indices into `positions` each.
    ///
    /// A hit's `primitive` is an index into `triangles`. The result does not depend on the number
    /// of threads.
    ///
    /// # Errors
    /// [`AccelError::NonFiniteVertex`], [`AccelError::VertexTooFar`],
    /// [`AccelError::VertexOutOfRange`] or [`AccelError::TooManyTriangles`].
    pub fn new<P: Copy + Into<Vec3> + Sync>(
        positions: &[P],
        triangles: &[[u32; 3]],
        options: &BvhOptions,
    ) -> Result<Self, AccelError> {
        validate(positions, triangles, Self::MAX_TRIANGLES)?;
        let corners = |triangle: u32| corners_of(positions, triangles, triangle);
        let bounds_of = |triangle: u32| {
            let [a, b, c] = corners(triangle).map(Vec3A::from);
            TriangleBounds {
                low: a.min(b).min(c),
                high: a.max(b).max(c),
                triangle,
            }
        };
        let all = 0..triangles.len() as u32;
        #[cfg(feature = "parallel")]
        let mut boxes: Vec<TriangleBounds> = all
            .into_par_iter()
            .with_min_len(4096)
            .map(bounds_of)
            .collect();
        #[cfg(not(feature = "parallel"))]
        let mut boxes: Vec<TriangleBounds> = all.map(bounds_of).collect();
        boxes.retain(|bounds| can_be_hit(bounds.low, bounds.high));
        let mut binary = BinaryTree::clustered(&boxes, options.preset);
        let mut wide = collapse(&mut binary.nodes, &corners);
        if wide.depth > MAX_DEPTH {
            wide = collapse(&mut BinaryTree::halved(&boxes).nodes, &corners);
        }
        let bounds = boxes.iter().fold(Aabb::EMPTY, |all, bounds| {
            all.extend(Vec3::from(bounds.low))
                .extend(Vec3::from(bounds.high))
        });
        let WideTree {
            nodes,
            blocks,
            root,
            depth: _,
        } = wide;
        let mut tree = Self {
            nodes,
            blocks,
            root,
            bounds,
            triangles: triangles.len(),
            stored: boxes.len(),
            cost: 0.0,
            fresh_cost: 0.0,
            dispatch: Dispatch::new(options.instructions),
        };
        tree.fresh_cost = tree.expected_cost();
        tree.cost = tree.fresh_cost;
        debug_assert!(tree.is_valid());
        Ok(tree)
    }

    /// How many triangles the tree holds.
    #[must_use]
    pub fn len(&self) -> usize {
        self.triangles
    }

    /// Whether the tree holds no triangle.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.triangles == 0
    }

    /// The box around all triangles that can be hit: those of no area may lie outside.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Memory that the tree occupies, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>()
            + self.nodes.capacity() * size_of::<Node>()
            + self.blocks.capacity() * size_of::<Block>()
    }

    pub(crate) fn tree(&self) -> Tree<'_> {
        Tree {
            nodes: &self.nodes,
            blocks: &self.blocks,
            root: self.root,
        }
    }

    /// Whether every triangle that can be hit occurs once and lies within all the boxes above it.
    fn is_valid(&self) -> bool {
        let mut seen = vec![false; self.triangles];
        let mut waiting = vec![(self.root, self.bounds)];
        while let Some((child, bounds)) = waiting.pop() {
            if child.is_leaf() {
                for block in &self.blocks[child.blocks()] {
                    for (lane, &primitive) in block.primitives.iter().enumerate() {
                        if primitive == u32::MAX {
                            continue;
                        }
                        let inside = block.vertices.iter().all(|rows| {
                            bounds.contains(Vec3::from_array(rows.map(|row| row[lane])))
                        });
                        if !inside || std::mem::replace(&mut seen[primitive as usize], true) {
                            return false;
                        }
                    }
                }
            } else {
                let node = &self.nodes[child.index()];
                for (lane, &child) in node.children.iter().enumerate() {
                    let side =
                        |side: usize| Vec3::from_array(node.bounds.map(|axis| axis[side][lane]));
                    let child_bounds = Aabb {
                        min: side(0),
                        max: side(1),
                    };
                    if child != Child::EMPTY {
                        if bounds.union(&child_bounds) != bounds {
                            return false;
                        }
                        waiting.push((child, child_bounds));
                    }
                }
            }
        }
        seen.into_iter().filter(|seen| *seen).count() == self.stored
    }
}

impl Intersect for TriangleBvh {
    #[inline]
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.dispatch.run(ClosestHit { stage: self, ray })
    }

    /// Worth it where rays that follow each other lie close together, as those from a lattice over
    /// a light do: in Morton order 64 at a time share their way through the tree, in rows sixteen.
    /// Rays that do not keep together are traced one by one. The shorter of the two
    /// slices says how many there are.
    fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.dispatch.run(ClosestHits {
            stage: self,
            rays,
            hits,
        });
    }

    #[inline]
    fn is_occluded(&self, ray: &Ray) -> bool {
        self.dispatch.run(Occlusion { stage: self, ray })
    }
}
