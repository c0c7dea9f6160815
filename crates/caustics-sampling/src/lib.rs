//! Low-discrepancy points and area-preserving warps for photon emission.
//!
//! A light emits photon `i` by mapping point `i` of the unit square to a ray. This crate has both
//! halves: points that spread evenly at any count ([`PointSet`]), and maps of constant density that
//! come with their derivatives ([`warp`]), from which a photon knows how far its neighbours are.
//! Start with [`PointSet`] and one of the warps:
//!
//! ```
//! use caustics_sampling::{PointSet, Sequence, warp::Cone};
//!
//! // 1000 photons of a spot light, half angle 0.4 radians, on a lattice.
//! let points = PointSet::new(Sequence::Fibonacci, 1000, 0);
//! let spot = Cone::from_half_angle(0.4)?;
//! let mut solid_angle = 0.0;
//! for index in 0..points.count() {
//!     let sample = spot.sample_concentric(points.point(index));
//!     assert!(spot.contains(sample.value));
//!     // The parallelogram of directions that this photon stands for.
//!     let [edge_a, edge_b] = points.spacing(index);
//!     let across_a = sample.d_du * edge_a.x + sample.d_dv * edge_a.y;
//!     let across_b = sample.d_du * edge_b.x + sample.d_dv * edge_b.y;
//!     solid_angle += across_a.cross(across_b).length();
//! }
//! // Together they tile the cone.
//! assert!((solid_angle / spot.solid_angle() - 1.0).abs() < 1e-4);
//! # Ok::<(), caustics_sampling::warp::ConeError>(())
//! ```
//!
//! Every sample lies in `[0, 1)`: one itself is never returned. Everything is deterministic: the
//! same seed gives the same numbers in any order and on any number of threads.
//!
//! | module or type | what it is for |
//! | --- | --- |
//! | [`PointSet`], [`Sequence`] | any of the sequences below by one interface, with the spacing of its points |
//! | [`halton()`], [`sobol()`] | low-discrepancy sequences in many dimensions, plain or Owen-scrambled |
//! | [`Grid`], [`Rank1Lattice`], [`kronecker()`] | lattices: neighbours at even distances, so that footprints tile |
//! | [`Rotation`] | randomises a lattice without changing its distances |
//! | [`CounterRng`] | random numbers by seed, stream and counter, for Russian roulette |
//! | [`warp`] | disc, sphere, cone, cosine-weighted hemisphere and triangle |
//! | [`warp::DensityTable`] | more points where more are wanted, by a table of densities |
//! | [`DiscreteDistribution`] | picks an entry by weight, such as a triangle by area |
//! | [`apportion()`] | shares a number of photons exactly among lights |
//!
//! # References
//!
//! Sequences: Halton 1960; Owen 1995; Joe and Kuo 2008; Burley 2020; Roberts 2018. Warps: Shirley
//! and Chiu 1997; Clarberg 2008; Heitz 2019. Each item names what it took.

mod apportion;
mod counter_rng;
mod discrete;
mod grid;
mod halton;
mod kronecker;
mod point_set;
mod rank1_lattice;
mod rotation;
mod sequence;
mod sobol;
mod unit_interval;
pub mod warp;

pub use apportion::{ApportionError, apportion, apportion_with_floor};
pub use counter_rng::CounterRng;
pub use discrete::{DiscreteDistribution, DiscreteError, DiscreteSample};
pub use glam;
pub use grid::{Grid, GridCell};
pub use halton::{HALTON_DIMENSIONS, halton, halton_scrambled, radical_inverse};
pub use kronecker::kronecker;
pub use point_set::PointSet;
pub use rank1_lattice::Rank1Lattice;
pub use rotation::Rotation;
pub use sequence::{Sequence, UnknownSequence};
pub use sobol::sobol;
