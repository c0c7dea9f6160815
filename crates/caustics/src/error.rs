use caustics_accel::AccelError;
use caustics_render::RenderError;
use caustics_scene::SceneError;
use caustics_trace::TraceError;
use thiserror::Error;

/// What can go wrong between a scene and a picture.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CausticsError {
    /// The scene cannot be flattened to world space.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The acceleration structure cannot be built.
    #[error(transparent)]
    Accel(#[from] AccelError),
    /// The tracing options are out of range.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// The picture or the estimate is out of range.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The scene has no light.
    #[error("the scene has no light: no punctual light and no emissive surface")]
    NoLight,
}
