//! Scenes of the gallery, drawn by the default estimate and held to the independent tracer's pictures.

use caustics_accel::BvhOptions;
use caustics_filter::{Comparison, Image};
use caustics_render::{FootprintOptions, GBuffer, splat};
use caustics_scene::{SceneIntersector, World};
use caustics_trace::{Photon, PhotonMap, TraceOptions, trace_photons};

use crate::{TestError, gallery};

/// A scene as its first camera sees it, at the reference's size.
pub struct ScoredScene {
    world: World,
    rays: SceneIntersector,
    buffer: GBuffer,
    /// The caustic alone, on receivers that the camera sees directly.
    pub reference: Image,
}

impl ScoredScene {
    /// The scene of this name, such as `p03_cognac`.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn load(name: &str) -> Result<Self, TestError> {
        let scene = gallery::load(name)?;
        let reference = gallery::reference(name, 1)?;
        let world = World::new(&scene)?;
        let rays = world.intersector(&BvhOptions::default())?;
        let camera = &scene.cameras()[0];
        let buffer = GBuffer::new(&world, &rays, camera, reference.width(), reference.height())?;
        Ok(Self {
            world,
            rays,
            buffer,
            reference,
        })
    }

    /// Traces photons.
    ///
    /// # Errors
    /// If the options are out of range.
    pub fn trace(&self, options: &TraceOptions) -> Result<PhotonMap, TestError> {
        Ok(trace_photons(&self.world, &self.rays, options, &|_| {})?)
    }

    /// What the default estimate makes of photons.
    ///
    /// # Errors
    /// If a photon is not finite.
    pub fn picture(&self, photons: &[Photon]) -> Result<Image, TestError> {
        Ok(splat(&self.buffer, photons, &FootprintOptions::default())?.0)
    }

    /// How far a picture is from the reference.
    ///
    /// # Errors
    /// If it has another size.
    pub fn score(&self, picture: &Image) -> Result<Comparison, TestError> {
        Ok(Comparison::new(picture, &self.reference)?)
    }
}
