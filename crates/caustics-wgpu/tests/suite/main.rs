//! Tests of the shaders.
//!
//! One program, which takes less time to build than one for each file.

mod common;
mod device;
mod embedding;
mod environments;
mod gather_parity;
mod large_scenes;
mod splat_energy;
mod splat_parity;
mod stage;
mod trace_kinds;
mod trace_limits;
mod trace_parity;
