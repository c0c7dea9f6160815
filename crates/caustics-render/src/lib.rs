//! To be written.

mod columns;
mod direct;
mod error;
mod estimate;
mod eye;
mod footprint;
mod gbuffer;
mod nearest;
mod picture;
mod pixel;
mod screen;
mod splat;

pub use direct::DirectLight;
pub use error::RenderError;
pub use estimate::Estimate;
pub use eye::{EyeTracer, Receiver};
pub use footprint::{FootprintKernel, FootprintOptions};
pub use gbuffer::{GBuffer, Texel};
pub use glam;
pub use nearest::{NearestEstimate, NearestOptions};
pub use splat::{SplatStats, splat};
pub use picture::{Picture, PictureOptions, Visibility, render};
