//! Caustics on the GPU, inside a host's own wgpu frame.
//!
//! The host owns instance, device, queue, encoder and surface; what is here records compute and
//! render passes into the host's encoder, and submits, polls and presents nothing.
//!
//! ```
//! use caustics_trace::Photon;
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
//! };
//! let record = FootprintRecord::from(&photon);
//! assert_eq!(record.flux(), photon.flux);
//! assert_eq!(size_of_val(&record), 80);
//! ```
//!
//! # What is where
//!
//! | to | take |
//! | --- | --- |
//! | keep a photon where both sides can read it | [`FootprintRecord`] |
//! | know what went wrong | [`GpuError`] |

mod body_order;
mod camera_matrix;
mod capabilities;
mod composite;
mod error;
mod error_scope;
mod footprint_record;
mod gather;
mod gpu_scene;
mod pass_layout;
mod pass_times;
mod photon_buffers;
mod photon_tracer;
mod prefix_sum;
mod recorder;
mod renderer;
mod renderer_error;
mod scene_buffers;
mod scene_hierarchy;
mod scene_refit;
mod shader;
mod splat;
mod splat_options;
mod splat_quads;
mod splat_scratch;
mod splat_stats;
mod splat_targets;
mod splat_tiles;
mod splat_view;
mod trace_counters;
mod trace_params;
mod trace_plan;
mod view_params;

pub use camera_matrix::camera_matrix;
pub use capabilities::Capabilities;
pub use composite::CompositeTarget;
pub use error::GpuError;
pub use footprint_record::FootprintRecord;
pub use gather::{Gather, GatherCounts, GatherOptions, GatherPoint};
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
pub use view_params::{NormalEncoding, SurfaceInput, ViewParams};
pub use wgpu;
