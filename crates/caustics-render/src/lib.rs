//! Radiance estimates and pictures of caustics on the CPU.
//!
//! Photons have landed; this crate says how bright that makes a surface, and what a camera sees of
//! it. There are two ways. Footprints: each photon spreads its flux over the area that it stands
//! for, which its differential gives. And the nearest photons, over the area of the disc that
//! holds them. Start with [`render()`], which makes a whole picture from either, or with
//! [`FootprintGather`] for the light at any point.
//!
//! ```
//! use caustics_geometry::shapes;
//! use caustics_render::glam::Vec3;
//! use caustics_render::{
//!     CausticSource, FootprintGather, FootprintOptions, PictureOptions, render,
//! };
//! use caustics_scene::{BvhOptions, Camera, Instance, Light, Material, Scene, Shape, World};
//! use caustics_trace::{TraceOptions, trace_photons};
//!
//! // A pool, 20 cm deep, under the sun: a box of water that reaches below its floor.
//! let mut scene = Scene::new();
//! let water = scene.add_material(Material::dielectric("water", 4.0 / 3.0))?;
//! let tiles = scene.add_material(Material::diffuse("tiles", [0.5; 3]))?;
//! let floor = scene.add_mesh(shapes::quad([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0])?);
//! let body = scene.add_mesh(shapes::cuboid([2.0, 0.4, 2.0])?);
//! scene.add_instance(Instance::new("floor", Shape::Mesh(floor), tiles))?;
//! scene.add_instance(Instance::new("water", Shape::Mesh(body), water))?;
//! scene.add_light(Light::directional([0.0, -1.0, 0.0], [1.0; 3])?)?;
//!
//! let world = World::new(&scene)?;
//! let rays = world.intersector(&BvhOptions::default())?;
//! let options = TraceOptions { photons: 4096, ..TraceOptions::default() };
//! let map = trace_photons(&world, &rays, &options, &|_| {})?;
//!
//! // Under flat water the irradiance is what Fresnel lets through: 1 - (1/7)^2. A Gaussian over each
//! // cell of the lattice leaves a ripple of at most one per cent.
//! let footprints = FootprintOptions::default();
//! let light = FootprintGather::new(&map.photons, &footprints)?;
//! let irradiance = light.irradiance(Vec3::new(0.123, 0.0, -0.234), Vec3::Y);
//! assert!((irradiance.x - 48.0 / 49.0).abs() < 0.01, "{irradiance}");
//!
//! // A camera above sees the floor through the water: a caustic seen through a refraction.
//! let camera = Camera::look_at("above", [0.0, 2.0, 0.0], [0.0; 3], [0.0, 0.0, -1.0], 0.4)?;
//! let source = CausticSource::Footprints { photons: &map.photons, options: &footprints };
//! let size = PictureOptions { width: 16, height: 16, ..PictureOptions::default() };
//! let picture = render(&world, &rays, &camera, source, &size, &|_| {})?;
//! // The tiles reflect albedo over pi of it. On its way out 48/49 pass, into a solid angle that is
//! // (4/3)^2 times as large.
//! let center = picture.caustics.pixels()[8 * 16 + 8][0];
//! let inside = irradiance.x * 0.5 / std::f32::consts::PI;
//! let expected = inside * 48.0 / 49.0 / (16.0 / 9.0);
//! assert!((center / expected - 1.0).abs() < 0.02, "{center} against {expected}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What is where
//!
//! | items | what they are for | from |
//! | --- | --- | --- |
//! | [`render()`], [`Picture`], [`PictureOptions`], [`CausticSource`], [`Visibility`] | a picture in two parts: direct light and caustics | |
//! | [`Estimate`] | the ways to turn photons into radiance, by name | |
//! | [`FootprintOptions`], [`FootprintKernel`] | how a photon is spread over its footprint | Igehy 1999; Larsen 2006; Yang and Ouyang 2021 |
//! | [`GBuffer`], [`splat()`] | footprints drawn where the camera sees the receiver itself | |
//! | [`FootprintGather`] | footprints looked up at any point: through glass, in mirrors, for baking | |
//! | [`NearestEstimate`], [`NearestOptions`] | the nearest photons over the area of their disc | Jensen 2001, section 7.2 |
//! | [`DirectLight`] | light that comes straight from the lights, with shadow rays | |
//! | [`EyeTracer`], [`Receiver`] | eye paths through mirrors and glass to what they end on | Whitted 1980 |
//!
//! A splat and a gather spread the same footprints: where both are asked for the same point, they
//! agree.
//!
//! # Conventions
//!
//! Radiance in W/(sr m²), irradiance in W/m², linear RGB; lengths in metres. Receivers are
//! Lambertian or glossy, and reflect each photon's light by its own direction. Everything is deterministic: the same seed gives the same bits on any number of
//! threads.
//!
//! # Limits
//!
//! Footprints are flat: on a receiver that curves within one, light is followed along the photon's
//! direction to the surface, and no farther. A specular object casts a full shadow in direct
//! light, because what comes through it is the caustic's. Lights themselves are seen only where
//! they are emissive surfaces. Glossy receivers show caustics and direct light, but do not mirror
//! other surfaces.
//!
//! # Features
//!
//! `parallel` (default): rows and photons on all processors.

mod columns;
mod covariance;
mod density;
mod direct;
mod error;
mod estimate;
mod extent_bounds;
mod eye;
mod flat_objects;
#[cfg(test)]
mod floor_and_ball;
mod footprint;
mod footprint_gather;
mod footprint_integral;
mod footprint_kernel;
mod footprint_piece;
mod gate;
mod gbuffer;
mod gloss;
#[cfg(test)]
mod landed;
mod nearest;
mod parallel;
mod picture;
mod pixel;
mod pixel_integral;
mod pixel_samples;
mod prepared_splat;
mod screen;
mod splat;
mod splat_band;
mod splat_bounds;
mod splat_level;
mod splat_view;
mod surroundings;
mod texel_level;
mod thinning;
mod truncated_kernel;

pub use direct::DirectLight;
pub use error::RenderError;
pub use estimate::Estimate;
pub use eye::{EyeTracer, Receiver};
pub use footprint::FootprintOptions;
pub use footprint_gather::{FootprintGather, GatherStats};
pub use footprint_kernel::FootprintKernel;
pub use gbuffer::{GBuffer, Texel};
pub use glam;
pub use nearest::{NearestEstimate, NearestOptions};
pub use picture::{CausticSource, Picture, PictureOptions, Visibility, render};
pub use splat::{SplatStats, splat};
