//! To be written.

mod caustics;
mod error;

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

/// What most programs need.
pub mod prelude {
    pub use crate::{Caustics, CausticsError, CausticsOptions};
    pub use caustics_filter::{Image, Kernel};
    pub use caustics_render::{Estimate, NearestOptions, Picture, PictureOptions, Visibility};
    pub use caustics_scene::{Camera, Light, Material, Scene, Surface, World};
    pub use caustics_trace::{Aim, Branching, Fate, Photon, TraceOptions};
}
