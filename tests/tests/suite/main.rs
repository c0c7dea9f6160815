//! Tests of pictures and exact oracles.
//!
//! One program, which takes less time to build than one for each file.

mod boundaries;
mod convergence;
mod curved_receivers;
mod determinism;
mod edges;
mod energy;
mod flat_water;
mod guided_emission;
mod mirror_cylinder;
mod parabolic_mirror;
mod plano_convex_lens;
mod reference_energy;
mod sphere_lens;
mod wavy_water;
mod workspace_arrows;
