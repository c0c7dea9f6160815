//! Photons from every light through glass, liquids and off mirrors, each with the differential that
//! says how far its neighbours landed, and a ledger of where all the energy went.
//!
//! A caustic is light that met at least one smooth dielectric or metal before a receiver, `L S+ D`.
//! [`trace_photons`] follows it from the lights, through any [`Intersect`](caustics_accel::Intersect),
//! and returns a [`PhotonMap`]: the [`Photon`]s that landed and an [`EnergyLedger`].
//!
//! ```
//! use caustics_geometry::shapes::quad;
//! use caustics_scene::{BvhOptions, Instance, Light, Material, Scene, Shape, World};
//! use caustics_trace::glam::Vec3;
//! use caustics_trace::{Fate, TraceOptions, trace_photons};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A lamp over a ball of glass over a floor.
//! let mut scene = Scene::new();
//! let glass = scene.add_material(Material::dielectric("glass", 1.5))?;
//! let white = scene.add_material(Material::diffuse("white", [0.8; 3]))?;
//! let ball = Shape::Sphere { center: Vec3::Y, radius: 0.5 };
//! scene.add_instance(Instance::new("ball", ball, glass))?;
//! let floor = scene.add_mesh(quad([-5.0, 0.0, 5.0], [10.0, 0.0, 0.0], [0.0, 0.0, -10.0])?);
//! scene.add_instance(Instance::new("floor", Shape::Mesh(floor), white))?;
//! scene.add_light(Light::point([0.0, 6.0, 0.0], [10.0; 3])?)?;
//!
//! let world = World::new(&scene)?;
//! let rays = world.intersector(&BvhOptions::default())?;
//! let options = TraceOptions { photons: 10_000, ..TraceOptions::default() };
//! let map = trace_photons(&world, &rays, &options, &|_finished| {})?;
//!
//! // All photons lie on the floor, and most of the light in the bright spot under the ball.
//! let stored = map.ledger.entry(Fate::Stored).flux;
//! let spot = map.photons.iter().filter(|photon| photon.position.length() < 0.5);
//! let in_spot: f32 = spot.map(|photon| photon.flux.x).sum();
//! assert!(map.photons.iter().all(|photon| photon.position.y.abs() < 1e-5));
//! assert!(f64::from(in_spot) > 0.7 * stored.x);
//!
//! // A photon's flux over the parallelogram of its neighbours is the irradiance that it brings:
//! // brighter than the bare lamp's 10 W/sr over 36 m² where the ball gathers it.
//! let photon = map.photons.iter().find(|it| it.events == 2 && it.position.length() < 0.1);
//! let photon = photon.ok_or("light goes straight through the ball")?;
//! let irradiance = photon.flux.x / photon.axes[0].cross(photon.axes[1]).length();
//! assert!(irradiance > 10.0 / 36.0);
//!
//! // Every watt is accounted for.
//! assert!(map.ledger.imbalance() < 1e-6);
//! # Ok(())
//! # }
//! ```
//!
//! Start with [`trace_photons`]; take the rest, piece by piece, for a tracer of your own. For
//! pictures from photons see the crate `caustics-render`; for scenes, `caustics-scene`.
//!
//! # What is where
//!
//! | to | take | from |
//! | --- | --- | --- |
//! | trace photons | [`trace_photons`], [`TraceOptions`] | Jensen 1996 |
//! | choose where they go at a surface of glass | [`Branching`] | Arvo, Kirk 1990 |
//! | aim lights at what makes caustics | [`Aim`], [`Casters`], [`Emitter`], [`EmissionDomain`], [`AreaSurface`], [`LightSource`] | |
//! | share photons among lights and casters, the same in every frame | [`EmissionPlan`], [`EmissionBatch`], [`trace_plan`], [`trace_part`] | |
//! | keep photons from frame to frame, and trace anew what a change demands | [`LivePhotons`], [`Change`] | |
//! | trace them in parts | [`PhotonStream`] | |
//! | trace only what could meet a caster | [`ProjectionMap`] | Jensen 1996 |
//! | make a photon from a sample | [`EmissionSample`], [`Emission`] | |
//! | send photons where their footprints would be wide | [`TraceOptions::guide_emission`], [`EmissionBatch::density`] | Peter, Pietrek 1998 |
//! | divide photons at the edges of sheets of light | [`TraceOptions::divide_edges`] | |
//! | give back what footprints spread beyond the ends of receivers | [`TraceOptions::reflect_at_boundaries`], [`Boundaries`], [`BoundaryEdge`], [`Coverage`] | Silverman 1986 |
//! | know what landed, and how large its footprint is | [`PhotonMap`], [`Photon`] | |
//! | leave out what a host can do without | [`Culling`], [`ViewVolume`], [`SolidAngleLimit`] | |
//! | store photons, or hand them to a graphics processor | [`CompactPhoton`], [`CompactFootprint`] | Cigolle et al. 2014; Ward 1991 |
//! | know where the rest went | [`EnergyLedger`], [`Fate`], [`LedgerEntry`] | |
//! | carry derivatives along any path, from a light or the eye | [`RayDifferential`] | Igehy 1999 |
//! | reflect, refract, and weigh the two | [`reflect`], [`refract`], [`fresnel_dielectric`], [`fresnel_schlick`] | Born, Wolf, section 1.5; Schlick 1994 |
//! | do it at a [`SurfacePoint`](caustics_scene::SurfacePoint), with all exceptions | [`scatter`], [`Scattering`], [`Outgoing`], [`Event`] | |
//! | find the medium in nested and overlapping bodies | [`MediumStack`], [`Crossing`] | Schmidt, Budge 2002 |
//! | absorb | [`beer_lambert`] | Beer and Lambert |
//! | split colours | [`dispersed_ior`], [`CHANNEL_WAVELENGTHS`] | `KHR_materials_dispersion` |
//!
//! # Conventions
//!
//! Metres, radians, watts, linear RGB. Directions are those of travel, and unit vectors. `eta` is
//! the refractive index that light leaves over the one that it enters. A differential is the
//! derivative in the emission's parameters times the spacing of photons there, so that its end on a
//! receiver spans one photon's share. Directions and Fresnel terms follow interpolated normals,
//! inside and outside the geometric one; where the two disagree about the side on which light goes
//! on, the geometric normal serves, and [`EnergyLedger::normal_fallbacks`] counts it.
//!
//! # Accuracy
//!
//! Arithmetic is f32, sums of energy are f64. The tests hold every operation on differentials, and
//! chains of up to six of them over planes, spheres and triangles with interpolated normals, to
//! central differences in f64: within 10⁻³, from 0.2 degrees off critical angles and silhouettes,
//! wherever rounding leaves the answer determined. On those limits the true derivative is
//! infinite: there it is bounded, so that nothing is ever infinite or NaN, and
//! [`EnergyLedger::bounded_differentials`] counts it. The ledger closes to 10⁻⁶.
//!
//! The same options give the same bits, on any number of threads.
//!
//! # Limits
//!
//! Surfaces are smooth dielectrics, smooth metals, or receivers; nothing scatters inside a body.
//! First derivatives say nothing about folds, where a footprint's area vanishes, or about
//! neighbours that take another way at an edge. Eight bodies may enclose a point.
//!
//! # Features
//!
//! `parallel` (default): several threads, by rayon.
//!
//! # References
//!
//! - Arvo, Kirk, *Particle Transport and Image Synthesis*, SIGGRAPH 1990 (Russian roulette).
//! - Born, Wolf, *Principles of Optics*, section 1.5 (Snell's law, Fresnel's formulae).
//! - Cigolle et al., *A Survey of Efficient Representations for Independent Unit Vectors*, Journal of
//!   Computer Graphics Techniques 2014.
//! - Igehy, *Tracing Ray Differentials*, SIGGRAPH 1999 (transfer, reflection, refraction).
//! - Jensen, *Global Illumination using Photon Maps*, Rendering Techniques 1996.
//! - Peter, Pietrek, *Importance Driven Construction of Photon Maps*, Rendering Techniques 1998.
//! - Schlick, *An Inexpensive BRDF Model for Physically-based Rendering*, Eurographics 1994.
//! - Schmidt, Budge, *Simple Nested Dielectrics in Ray Traced Images*, Journal of Graphics Tools
//!   2002.
//! - Silverman, *Density Estimation for Statistics and Data Analysis*, 1986, section 2.10 (reflection).

mod area_emission;
mod between;
mod boundary;
mod casters;
mod compact;
mod culling;
mod differential;
mod direction_cells;
mod domain;
mod domain_reuse;
mod edges;
mod emission;
mod emission_batch;
mod emitter;
mod give_back;
mod grazing;
mod guide;
mod lattice;
mod ledger;
mod live;
mod live_chunk;
mod media;
mod narrow_sheets;
mod neighbours;
mod optics;
mod options;
mod outline;
mod parallel;
mod path_guide;
mod photon;
mod plan;
mod projection_map;
mod scatter;
mod sharp_edges;
mod silhouette;
mod sky_emission;
mod stream;
mod trace;
mod traced;
mod tracer;
mod trail;
mod wave;

pub use area_emission::AreaSurface;
pub use boundary::{Boundaries, BoundaryEdge};
pub use casters::{Casters, MAX_CASTERS};
pub use compact::{CompactFootprint, CompactPhoton};
pub use culling::{Culling, SolidAngleLimit, ViewVolume};
pub use differential::{BLUR_EDGE, RayDifferential};
pub use domain::EmissionDomain;
pub use emission::{Emission, EmissionSample};
pub use emission_batch::EmissionBatch;
pub use emitter::{Emitter, LightSource};
pub use glam;
pub use ledger::{EnergyLedger, Fate, LedgerEntry};
pub use live::{Change, LivePhotons};
pub use media::{Crossing, MediumStack};
pub use optics::{
    CHANNEL_WAVELENGTHS, beer_lambert, dispersed_ior, fresnel_dielectric, fresnel_schlick, reflect,
    refract,
};
pub use options::{Aim, Branching, TraceError, TraceOptions};
pub use photon::{Coverage, FootprintSource, Photon, PhotonMap};
pub use plan::EmissionPlan;
pub use projection_map::ProjectionMap;
pub use scatter::{Event, Outgoing, Scattering, scatter};
pub use stream::PhotonStream;
pub use trace::{PhotonTrail, trace_part, trace_photon, trace_photons, trace_plan};
