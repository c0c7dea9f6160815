//! What the benchmarks of this workspace have in common: meshes, rays, photons and peers.

pub mod chart;
pub mod command;
pub mod conditions;
pub mod counted;
pub mod document;
#[cfg(feature = "embree")]
pub mod embree;
pub mod fields;
pub mod flip;
pub mod gpu;
pub mod meshes;
#[cfg(feature = "nanoflann-cpp")]
pub mod nanoflann_cpp;
pub mod noise;
pub mod peers;
pub mod photons;
pub mod random;
pub mod rays;
pub mod receivers;
pub mod renderers;
pub mod score;
pub mod stage;
pub mod timing;
