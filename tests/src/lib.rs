//! Scenes whose caustics are known exactly, and how far traced photons are from them.
//!
//! Each oracle of [`oracles`] is one arrangement of light, specular body and receiver. It gives the
//! scene for the tracer, and, from equations of its own in f64, the irradiance and the flux that
//! the receiver gets. Nothing of the tracer's code is used on the way, so that an error in one
//! shows as a difference.
//!
//! ```
//! use caustics_tests::oracles::{RadialLens, SphereLens};
//! use caustics_tests::measure::{FluxProbes, Region, trace};
//! use caustics_trace::TraceOptions;
//! use glam::DVec2;
//!
//! let lens = SphereLens { radius: 1.0, ior: 1.5, floor_distance: 1.2, irradiance: 1.0 };
//! // Two refractions and the floor: three surfaces.
//! let options = TraceOptions { photons: 1 << 14, max_depth: 3, ..TraceOptions::default() };
//! let map = trace(&lens.scene()?, &options)?;
//! let region = Region::Disc { center: DVec2::ZERO, radius: 0.3 };
//! let probes = FluxProbes::new([(region, lens.flux_within(0.3))]);
//! assert!(probes.error(map.photons.iter().filter(|photon| photon.events == 2)) < 0.01);
//! # Ok::<(), caustics_tests::TestError>(())
//! ```
//!
//! | module | what it is about |
//! | --- | --- |
//! | [`oracles`] | the arrangements with their closed forms |
//! | [`measure`] | flux of photons in regions, and its error against the oracle |
//! | [`pictures`] | the oracles pixel by pixel, and the default estimate against them |
//! | [`pixel_sum`] | flux of triangles and circles in pixels |
//! | [`gallery`] | the glTF files of this package |
//! | [`stage`] | the parts that the oracles' scenes have in common |
//! | [`optics`] | Snell's and Fresnel's laws in f64 |
//! | [`numerics`] | quadrature and roots in one dimension |

pub mod gallery;
pub mod measure;
pub mod numerics;
pub mod optics;
pub mod oracles;
pub mod pictures;
pub mod pixel_sum;
pub mod scored;
pub mod stage;

/// Whatever may go wrong in a test.
pub type TestError = Box<dyn std::error::Error + Send + Sync>;
