//! Finding what a ray hits, and which photons lie near a point: the two questions that tracing
//! caustics asks over and over.
//!
//! ```
//! use caustics_accel::{BvhOptions, Intersect, NearestScratch, PhotonTree, TriangleBvh};
//! use caustics_geometry::{Ray, glam::Vec3};
//!
//! // A floor of two triangles, and photons that fall on it along a line.
//! let corners = [[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]];
//! let floor = TriangleBvh::new(&corners, &[[0, 2, 1], [0, 3, 2]], &BvhOptions::default())?;
//! let photons: Vec<Vec3> = (0..100)
//!     .filter_map(|i| {
//!         let ray = Ray::new(Vec3::new(i as f32 / 100.0, 2.0, 0.25), Vec3::NEG_Y);
//!         floor.closest_hit(&ray).map(|hit| ray.at(hit.t))
//!     })
//!     .collect();
//! assert_eq!(photons.len(), 100);
//!
//! // The five photons nearest to a point of the floor, at most 10 cm away.
//! let tree = PhotonTree::new(&photons)?;
//! let mut scratch = NearestScratch::new();
//! let found = tree.nearest(Vec3::new(0.5, 0.0, 0.25), 5, 0.1, &mut scratch);
//! let mut indices: Vec<u32> = found.iter().map(|neighbour| neighbour.index).collect();
//! indices.sort_unstable();
//! assert_eq!(indices, [48, 49, 50, 51, 52]);
//! # Ok::<(), caustics_accel::AccelError>(())
//! ```
//!
//! # Which one to take
//!
//! | structure | for |
//! | --- | --- |
//! | [`TriangleBvh`] | rays against triangles: one at a time, or [many](TriangleBvh::closest_hits) that keep together; start with this one |
//! | [`InstanceBvh`] | meshes that move, or that stand in many places, without building them again |
//! | [`TriangleKdTree`] | the classic rival, by the surface area heuristic or spatial medians, with a short stack or without any: to compare on a scene |
//! | [`Intersect`] | the trait behind which an engine's own ray tracer can stand in |
//! | [`PhotonTree`] | the k nearest photons, or all within a radius, of one point or of [many in order](PhotonTree::nearest_of_each): start with this one |
//! | [`HashGrid`] | all photons within a radius known beforehand, rebuilt in every frame |
//! | [`LeftBalancedTree`] | the classic photon map, without pointers, as a GPU would walk it; 16 bytes a photon |
//! | [`BoxTree`] | all boxes that hold a point or overlap a box: footprints of photons, of any sizes |
//!
//! # Watertight
//!
//! A ray aimed at an edge or a vertex that triangles share always hits one of them; for photons a
//! miss would be light that leaks out of a lens. The triangle test is Woop, Benthin and Wald's
//! (*Watertight Ray/Triangle Intersection*, JCGT 2013) in single precision without contraction,
//! and boxes are widened by more than rounding can amount to (after Ize, *Robust BVH Ray
//! Traversal*, JCGT 2013). The tests send a million rays at the edges and a million at the
//! vertices of a closed sphere of 20480 triangles from inside it, and none gets through; the same
//! was seen of 10^8 rays at edges and 10^8 at vertices, each asked for its closest hit and for
//! occlusion (`cargo test --release -p caustics-accel -- --ignored`, some minutes), and likewise of
//! the kd-tree and of instances. The control in those tests, a test after Möller and Trumbore, does
//! let rays through.
//!
//! # Deterministic
//!
//! The same input gives the same result on any number of threads and with any instruction set.
//! Ties are broken by the index: of hits at the same parameter, and of photons at the same
//! distance, the lower index comes first. So it does not matter to the result which structure, or
//! which way of calling it, found it.
//!
//! # Limits
//!
//! Structures are built once; photons and triangles are not added to them later, though a tree can
//! [follow](TriangleBvh::refit) a mesh that deforms, and instances [move](InstanceBvh::set_transforms). Coordinates must
//! be finite, and those of triangles no larger than [`TriangleBvh::MAX_COORDINATE`]: both are
//! checked. `NaN` and infinite rays and queries find nothing.
//!
//! # Speed
//!
//! `docs/acceleration.md` in the repository has what rays, builds and searches take, beside other
//! libraries, and the command that measures it.
//!
//! # Features
//!
//! - `parallel` (default): builds and refits on all threads of the current rayon pool.
//!
//! # Sources
//!
//! Binary trees: PLOC and parallel reinsertion (Meister and Bittner 2018), by the crate obvhs.
//! Collapse to eight children: Ylitie, Karras and Laine 2017. Kd-tree over triangles: built after
//! Wald and Havran 2006; traversed with a short stack (Horn et al. 2007) or restarts (Foley and
//! Sugerman 2005), guided by a trail of bits (Laine 2010). Photon trees: Jensen, *Realistic
//! Image Synthesis Using Photon Mapping* (2001); Wald 2022 on the left-balanced layout; splits by
//! voxel volumes after Wald, Günther and Slusallek 2004. Hash grid: Teschner et al. 2003.

mod box_tree;
mod error;
mod hash_grid;
mod instance_bvh;
mod intersect;
mod left_balanced_tree;
mod neighbour;
mod photon_tree;
mod simd;
mod triangle_bvh;
mod triangle_kd_tree;
mod triangles;

pub use box_tree::BoxTree;
pub use error::AccelError;
pub use hash_grid::HashGrid;
pub use instance_bvh::{BvhInstance, InstanceBvh};
pub use intersect::Intersect;
pub use left_balanced_tree::LeftBalancedTree;
pub use neighbour::{NearestScratch, Neighbour};
pub use photon_tree::{PhotonSplits, PhotonTree, PhotonTreeOptions};
pub use simd::Instructions;
pub use triangle_bvh::{BvhOptions, BvhPreset, TriangleBvh};
pub use triangle_kd_tree::{
    KdTreeOptions, KdTreeSplit, KdTreeTraversal, TraversedKdTree, TriangleKdTree,
};
