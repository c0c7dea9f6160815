//! To be written.

mod direct;
mod error;
mod estimate;
mod eye;
mod nearest;
mod picture;
mod pixel;

pub use direct::DirectLight;
pub use error::RenderError;
pub use estimate::Estimate;
pub use eye::{EyeTracer, Receiver};
pub use glam;
pub use nearest::{NearestEstimate, NearestOptions};
pub use picture::{Picture, PictureOptions, Visibility, render};
