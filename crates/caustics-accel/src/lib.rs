//! Triangle and photon acceleration structures.

mod error;
mod intersect;
mod left_balanced_tree;
mod neighbour;
mod triangle_bvh;

pub use error::AccelError;
pub use intersect::Intersect;
pub use left_balanced_tree::LeftBalancedTree;
pub use left_balanced_tree::LeftBalancedTree as PhotonTree;
pub use neighbour::{NearestScratch, Neighbour};
pub use triangle_bvh::{BvhOptions, BvhPreset, Instructions, TriangleBvh};
