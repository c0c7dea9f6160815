//! Tests of estimates from photons.
//!
//! One program, which takes less time to build than one for each file.

mod corner_light;
mod direct_light;
mod footprint_gather;
mod footprint_truncation;
mod glossy_receivers;
mod receiver_gates;
