//! Low-discrepancy points and area-preserving warps for photon emission.

mod apportion;
mod counter_rng;
mod discrete;
mod halton;
mod unit_interval;
pub mod warp;

pub use apportion::{ApportionError, apportion, apportion_with_floor};
pub use counter_rng::CounterRng;
pub use discrete::{DiscreteDistribution, DiscreteError, DiscreteSample};
pub use glam;
pub use halton::{HALTON_DIMENSIONS, halton, halton_scrambled, radical_inverse};
