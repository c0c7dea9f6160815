//! Caustics on the GPU, inside a host's own wgpu frame.
//!
//! The host owns instance, device, queue, encoder and surface; what is here records compute and
//! render passes into the host's encoder, and submits, polls and presents nothing.
//!
//! ```
//! use caustics_trace::{Coverage, FootprintSource, Photon};
//! use caustics_wgpu::FootprintRecord;
//! use caustics_wgpu::glam::Vec3;
//!
//! // The same landing of light, as the CPU keeps it and as the GPU does.
//! let photon = Photon {
//!     position: Vec3::ZERO,
//!     incoming: Vec3::NEG_Y,
//!     flux: Vec3::new(1.0, 2.0, 3.0),
//!     normal: Vec3::Y,
//!     axes: [0.1 * Vec3::X, 0.2 * Vec3::Z],
//!     object: 7,
//!     events: 2,
//!     source: FootprintSource::Differential,
//!     coverage: Coverage::Cell,
//! };
//! let record = FootprintRecord::from(&photon);
//! assert_eq!(record.flux(), photon.flux);
//! assert_eq!(size_of_val(&record), 80);
//! ```
//!
//! # A frame
//!
//! Start with [`CausticsRenderer`]. It needs WebGPU's default limits and no feature; it makes use of
//! [more](CausticsRenderer::used_features) where the host asks for it, and says what it chose in
//! [`Capabilities`].
//!
//! ```no_run
//! use caustics_wgpu::{
//!     CausticsRenderer, CompositeTarget, FrameLight, FrameParams, RendererOptions, SceneBuffers,
//!     SurfaceInput, TracePlan, ViewParams, wgpu,
//! };
//! # fn host(device: &wgpu::Device, queue: &wgpu::Queue, depth: &wgpu::TextureView,
//! #     normals: &wgpu::TextureView, albedo: &wgpu::TextureView, lit: &wgpu::TextureView,
//! #     scene: &caustics_scene::Scene, matrix: [[f32; 4]; 4],
//! # ) -> Result<(), Box<dyn std::error::Error>> {
//! // Once.
//! let target = CompositeTarget::new(wgpu::TextureFormat::Rgba16Float);
//! let options = RendererOptions { targets: vec![target], ..RendererOptions::default() };
//! let mut caustics = CausticsRenderer::new(device, &options)?;
//! let world = caustics_scene::World::new(scene)?;
//! let rays = world.intersector(&caustics_scene::BvhOptions::default())?;
//! let buffers = SceneBuffers::new(device, &world)?;
//! let plan = TracePlan::new(&world, &rays, &caustics_trace::TraceOptions::default())?;
//!
//! // Each frame, after the host's depth and normals are drawn, in the host's encoder.
//! let mut encoder = device.create_command_encoder(&Default::default());
//! let view = ViewParams {
//!     albedo: Some(albedo),
//!     ..ViewParams::new([1280, 720], matrix, SurfaceInput::Depth(depth), normals)
//! };
//! let light = FrameLight::Traced { scene: &buffers, plan: &plan };
//! let frame = FrameParams { light, views: &[view] };
//! let prepared = caustics.prepare(device, queue, &mut encoder, &frame)?;
//!
//! // In the host's own pass, after its opaque surfaces are lit.
//! let attachment = wgpu::RenderPassColorAttachment {
//!     view: lit,
//!     depth_slice: None,
//!     resolve_target: None,
//!     ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
//! };
//! let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
//!     color_attachments: &[Some(attachment)],
//!     ..Default::default()
//! });
//! caustics.draw(&mut pass, &prepared, 0, &target)?;
//! # Ok(())
//! # }
//! ```
//!
//! # What is where
//!
//! | to | take |
//! | --- | --- |
//! | have caustics in a frame | [`CausticsRenderer`], [`RendererOptions`], [`FrameParams`], [`ViewParams`] |
//! | say where light comes from | [`FrameLight`]; [`SceneBuffers`] and [`TracePlan`], or [`FootprintBatch`]es |
//! | choose how footprints become pixels | [`SplatOptions`], [`SplatMethod`], [`SplatKernel`] |
//! | know the light at any point, in a shader of one's own or from a buffer | [`Gather`] |
//! | trace photons alone | [`PhotonTracer`], [`Hierarchy`], [`PhotonBuffers`], [`TraceCounters`] |
//! | let the scene move without building it anew | [`SceneRefit`] |
//! | keep a photon where both sides can read it | [`FootprintRecord`] |
//! | know what became of footprints, and how long passes took | [`PreparedFrame`], [`SplatStats`], [`PassTime`] |
//! | know what went wrong | [`RendererError`], [`GpuError`] |
//!
//! # How a photon is traced
//!
//! One invocation follows one photon and all its branches, from the point of its lattice to its
//! landings: the same light, hits, events and random numbers as
//! [`trace_photons`](caustics_trace::trace_photons) has for the same number, from every kind of light.
//! Its operations stand in
//! the order of their CPU twins, so that an adapter that rounds each of them, as software ones do,
//! gives the same bits: on the ten scenes of the tests all 10⁵ photons each, with their footprints.
//! Only absorption and the places on exact spheres that shine differ, in the last digits. Adapters
//! that fuse or approximate differ where rounding is amplified, most after many inner reflections.
//! Triangles stay watertight on all of them; products whose rounding matters are hidden from the
//! optimiser, and exact spheres are met in pairs of floats.
//!
//! Photons land in any order; then their records are put in that of the photons, by a prefix sum over
//! how many each has. On the way, each footprint of a lattice is checked against where the photons
//! beside it landed on the same path, as
//! [`check_footprints`](caustics_trace::TraceOptions::check_footprints) says, and the last one before
//! a silhouette gets the light up to it: so the records are those of the CPU's photons, in their
//! order, the same bits in every run. Sums of energy are integers and do not depend on any order.
//!
//! # How a splat is made
//!
//! The host's depth and normals are read into receivers, and halved six times; a pyramid of boxes says
//! what each tile of the picture shows. Each footprint gets its covariance, the pixel's added; the
//! level at which it is at least two pixels wide; and the tiles in which there is anything for it to
//! light. If it is as small as pixels, its flux is [integrated](SplatOptions::integrate_pixels) over
//! each. What stands before a plane that is seen edge-on is splatted for itself. Then tiles sum in
//! fixed point, whose unit is chosen by the sum of the footprints' peaks on the tile, or quads are
//! blended: a sixteenth first, by which each pixel gets a unit that all are rounded to, up or down such
//! that the mean is right, so that no addition rounds; in half floats what that rounds off is kept in a
//! second target. Coarse levels are added to finer ones, interpolated over pixels that see the same surface.
//!
//! Every gate is that of the CPU's `splat`, and so are the sums: over the pixels without an edge, on
//! the ten scenes of the tests, within 0.03 % by tiles and by 32-bit quads, within 0.2 % by half
//! floats. Tiles give the same bits in every run; quads and gathers differ in the last bits, since
//! they add in any order. A gather keeps every footprint, however many lie on a point, as the CPU's
//! does where `FootprintOptions::max_overlaps` is infinite, its default.
//!
//! # Limits
//!
//! The tracer numbers at most 2¹⁶ dielectrics, and binds each kind of data whole: two million triangles
//! in 128 MiB, which the texels of an environment share, 16 bytes each. Where there is no room for all
//! records of a batch, which of them are lost is another matter in every run; a photon whose parts have
//! none is [not divided](caustics_trace::TraceOptions::divide_edges) at the edge of a sheet of light.
//! Footprints that
//! [may be reflected](caustics_trace::TraceOptions::reflect_at_boundaries) are tried at every end of
//! their receiver: one with thousands of ends takes its time. Batches that are
//! smaller than all photons trace a row of the lattice on either side again, for the check of
//! footprints. 28 branches of a photon may wait; beyond 24 it goes one way at each surface. They take 3
//! to 5 KB of an invocation's memory. A pixel has one receiver: at edges pictures are as jagged as the
//! host's depth. Footprints of one batch fit one binding, 0.8 million in 128 MiB; more are several
//! batches. A view takes 70 bytes a pixel, 92 where tiles sum several batches, 76 where quads are
//! blended in 32 bits, and 140 in half floats and four layers, at 1920 by 1080; and a footprint of the
//! largest batch 272. On a browser's device, errors arrive after the call that caused them, and
//! go to the host's handlers.
//!
//! What is summed is irradiance: enough for a matt receiver, but not for a glossy one, whose light
//! depends on where each footprint's came from. A traced scene with glossy receivers is refused
//! ([`GpuError::Unsupported`]) unless they [may be taken as matt](RendererOptions::glossy_as_matt).
//!
//! # Sources
//!
//! Woop, Benthin, Wald 2013 and Haines, Günther, Akenine-Möller 2019 for hits, Jarzynski, Olano 2020
//! for random numbers, Dekker 1971 for pairs of floats, Meister, Bittner 2018 (by obvhs) for the
//! hierarchy, whose nodes are quantised after Ylitie, Karras, Laine 2017; Abramowitz and Stegun 1964 for
//! the error function; Igehy 1999 for footprints; Yang and Ouyang 2021 for splats of ellipses; Duff et al. 2017 for
//! frames. The rest is this workspace's own, and is derived where it stands.

mod body_order;
mod buffers;
mod camera_matrix;
mod capabilities;
mod composite;
mod emitter_mirror;
mod error;
mod error_scope;
mod footprint_record;
mod gather;
mod gather_counts;
mod gather_options;
mod gpu_scene;
mod pass_layout;
mod pass_times;
mod photon_buffers;
mod photon_order;
mod photon_tracer;
mod prefix_sum;
mod recorder;
mod renderer;
mod renderer_error;
mod scene_buffers;
mod scene_hierarchy;
mod scene_refit;
mod shader;
mod sky_tables;
mod splat;
mod splat_options;
mod splat_quads;
mod splat_receivers;
mod splat_scratch;
mod splat_stats;
mod splat_steps;
mod splat_targets;
mod splat_tiles;
mod splat_view;
mod trace_counters;
mod trace_dispatch;
mod trace_params;
mod trace_plan;
mod tracer_shaders;
mod truncation;
mod view_params;
mod wide_hierarchy;

pub use camera_matrix::camera_matrix;
pub use capabilities::Capabilities;
pub use composite::CompositeTarget;
pub use error::GpuError;
pub use footprint_record::FootprintRecord;
pub use gather::{Gather, GatherPoint};
pub use gather_counts::GatherCounts;
pub use gather_options::GatherOptions;
pub use glam;
pub use pass_times::{FrameTimestamps, PassTime};
pub use photon_buffers::PhotonBuffers;
pub use photon_tracer::PhotonTracer;
pub use recorder::RecordedWork;
pub use renderer::{CausticsRenderer, FrameLight, FrameParams, PreparedFrame, RendererOptions};
pub use renderer_error::{MissingLimit, RendererError};
pub use scene_buffers::SceneBuffers;
pub use scene_refit::SceneRefit;
pub use splat_options::{SplatKernel, SplatMethod, SplatOptions};
pub use splat_scratch::FootprintBatch;
pub use splat_stats::SplatStats;
pub use trace_counters::TraceCounters;
pub use trace_plan::TracePlan;
pub use tracer_shaders::Hierarchy;
pub use view_params::{NormalEncoding, SurfaceInput, ViewParams};
pub use wgpu;
