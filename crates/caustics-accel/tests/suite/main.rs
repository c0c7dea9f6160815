//! Tests of hierarchies and photon searches.
//!
//! One program, which takes less time to build than one for each file.

mod box_search;
mod common;
mod instance_bvh;
mod photon_search;
#[cfg(feature = "parallel")]
mod threads;
mod triangle_bvh;
mod triangle_kd_tree;
mod watertight;
