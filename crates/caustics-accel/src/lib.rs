//! Triangle and photon acceleration structures.

mod box_tree;
mod error;
mod hash_grid;
mod intersect;
mod left_balanced_tree;
mod neighbour;
mod photon_tree;
mod simd;
mod triangle_bvh;

pub use box_tree::BoxTree;
pub use error::AccelError;
pub use hash_grid::HashGrid;
pub use intersect::Intersect;
pub use left_balanced_tree::LeftBalancedTree;
pub use neighbour::{NearestScratch, Neighbour};
pub use photon_tree::PhotonTree;
pub use simd::Instructions;
pub use triangle_bvh::{BvhOptions, BvhPreset, TriangleBvh};
