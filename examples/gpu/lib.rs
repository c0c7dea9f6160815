//! A small engine with a rasteriser of its own, and caustics put into its frame.
//!
//! [`engine`] stands for whatever a host already has: it fills a G-buffer with depth, normals,
//! albedo and objects, and shades it with one light and a shadow map. [`stage`] is where the two
//! meet: it prepares the caustics from the G-buffer and draws them into the engine's lighting pass.
//! [`picture`] takes one frame and reads it back. The programs `embed` and `viewer` use it without and with a window.

pub mod engine;
pub mod headless;
pub mod picture;
pub mod stage;

/// Whatever may go wrong in an example.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;
