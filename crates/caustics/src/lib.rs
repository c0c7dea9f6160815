//! Real caustics, calibrated in watts: the light that glass, water and metal throw.
//!
//! Light is traced forward from the lights as photons. Each carries a differential, which says how
//! far its neighbours landed, and its flux is spread over exactly that footprint: sharp where
//! the light is focused, smooth where it is not, without a radius to tune. Every watt is booked:
//! what is not in the picture was absorbed, escaped, or lost by a named cause.
//!
//! Start with [`Caustics`], which does it all in two calls: photons once, then pictures from any
//! camera.
//!
//! ```
//! use caustics::geometry::shapes;
//! use caustics::prelude::*;
//!
//! // A glass ball of 10 cm over a floor, under the sun.
//! let mut scene = Scene::new();
//! let glass = scene.add_material(Material::dielectric("glass", 1.5))?;
//! let grey = scene.add_material(Material::diffuse("grey", [0.7; 3]))?;
//! let quad = shapes::quad([-1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0])?;
//! let floor = scene.add_mesh(quad);
//! let ball = Shape::Sphere { center: [0.0, 0.15, 0.0].into(), radius: 0.1 };
//! scene.add_instance(Instance::new("floor", Shape::Mesh(floor), grey))?;
//! scene.add_instance(Instance::new("ball", ball, glass))?;
//! scene.add_light(Light::directional([0.0, -1.0, 0.0], [1.0; 3])?)?;
//!
//! let mut options = CausticsOptions::default();
//! options.trace.photons = 10_000;
//! let caustics = Caustics::new(&scene, &options)?;
//!
//! // All the light of the sun on the scene is accounted for.
//! let ledger = &caustics.map().ledger;
//! assert!(ledger.imbalance() < 1e-4);
//! // The ball has a cross-section of pi 0.1^2 square metres, in which the sun's 1 W/m^2 falls; most
//! // of that light arrives on the floor.
//! let stored = ledger.entry(Fate::Stored).flux.x;
//! assert!((0.026..0.0315).contains(&stored), "{stored} W");
//!
//! let camera = Camera::look_at("camera", [0.4, 0.5, 0.6], [0.0; 3], [0.0, 1.0, 0.0], 0.5)?;
//! let size = PictureOptions { width: 64, height: 48, ..PictureOptions::default() };
//! let picture = caustics.render(&camera, &size)?;
//! // Its focus outshines the sunlit floor by far.
//! let brightest = |image: &Image| image.pixels().iter().map(|it| it[1]).fold(0.0, f32::max);
//! assert!(brightest(&picture.caustics) > 5.0 * brightest(&picture.direct));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A file instead: `scene::gltf::load_path` reads glTF 2.0 and lists what of it is not modelled.
//! `filter::write_png` and `filter::write_exr` write pictures.
//!
//! # Modules
//!
//! Each is a crate of its own, for hosts that want one part. This crate owns no algorithm.
//!
//! | module | what it is for |
//! | --- | --- |
//! | [`prelude`] | what most programs need |
//! | [`render`] | camera, direct light, radiance estimates, pictures |
//! | [`trace`] | optics, ray differentials, emission, photon tracing, the energy ledger |
//! | [`scene`] | materials, lights, cameras, glTF, the scene flattened for tracing |
//! | [`accel`] | triangle hierarchies and photon trees; the trait [`Intersect`](accel::Intersect) |
//! | [`geometry`] | rays, triangles, spheres, meshes, and how to leave a surface |
//! | [`sampling`] | low-discrepancy points and area-preserving warps |
//! | [`filter`] | kernels, images and their files, error metrics |
//! | [`glam`] | the vectors that cross the interface |
//!
//! # Frame by frame
//!
//! [`Progressive`] makes one picture better for as long as there is time. For scenes that move,
//! [`LivePhotons`](trace::LivePhotons) keeps what a change does not reach.
//!
//! # Parts instead of the whole
//!
//! A host with a ray tracer of its own implements [`Intersect`](accel::Intersect) and calls
//! [`trace_photons`](trace::trace_photons) and [`render()`](render::render()) with it; one with a
//! renderer of its own takes the [`Photon`](trace::Photon) records and looks light up with a
//! [`FootprintGather`](render::FootprintGather).
//!
//! # Conventions
//!
//! Right-handed, +Y up, metres; cameras look along -Z. Linear RGB; flux in W, irradiance in W/m²,
//! radiance in W/(sr m²). A caustic is light that met at least one mirror or glass before its first
//! diffuse surface. The same seed gives the same bits on any number of threads.
//!
//! # What it does not do
//!
//! Diffuse interreflection, participating media, rough mirrors and rough glass, textures, and
//! polarisation are not modelled. Dispersion is that of three wavelengths, one for each
//! channel.
//!
//! # Features
//!
//! All on by default: `gltf` loads files, `png` and `exr` write pictures, `parallel` uses all
//! processors.
//!
//! # Sources
//!
//! Each module names the papers of its equations; the frame is photon mapping (Jensen 2001) with
//! ray differentials (Igehy 1999).

mod caustics;
mod error;
mod progressive;

pub use caustics_accel as accel;
pub use caustics_filter as filter;
pub use caustics_geometry as geometry;
pub use caustics_render as render;
pub use caustics_sampling as sampling;
pub use caustics_scene as scene;
pub use caustics_trace as trace;
pub use glam;

pub use crate::caustics::{Caustics, CausticsOptions, Progress, Stage, StageSeconds};
pub use error::CausticsError;
pub use progressive::{Progressive, Quantum};

/// What most programs need.
pub mod prelude {
    pub use crate::{Caustics, CausticsError, CausticsOptions};
    pub use caustics_filter::{Image, Kernel};
    pub use caustics_render::{Estimate, NearestOptions, Picture, PictureOptions, Visibility};
    pub use caustics_scene::{Camera, Instance, Light, Material, Scene, Shape, Surface, World};
    pub use caustics_trace::{Aim, Branching, Fate, Photon, TraceOptions};
}

/// The quick start of the readme, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
