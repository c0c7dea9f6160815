//! To be written.

mod columns;
mod direct;
mod error;
mod estimate;
mod eye;
mod footprint;
mod footprint_gather;
mod footprint_piece;
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
pub use footprint_gather::{FootprintGather, GatherStats};
pub use gbuffer::{GBuffer, Texel};
pub use glam;
pub use nearest::{NearestEstimate, NearestOptions};
pub use splat::{SplatStats, splat};
pub use picture::{CausticSource, Picture, PictureOptions, Visibility, render};
