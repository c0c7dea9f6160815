//! Tests of scenes and what is read into them.
//!
//! One program, which takes less time to build than one for each file.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod brdf;
#[cfg(feature = "gltf")]
mod gltf_errors;
#[cfg(feature = "gltf")]
mod gltf_features;
#[cfg(feature = "gltf")]
mod gltf_materials;
#[cfg(feature = "gltf")]
mod gltf_robustness;
mod instanced;
mod world;
mod writer;
