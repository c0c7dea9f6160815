//! The public scenes, loaded and made ready to trace.

use std::path::PathBuf;
use std::time::Instant;

use caustics::accel::BvhOptions;
use caustics::filter::{Image, read_exr};
use caustics::render::{GBuffer, RenderError};
use caustics::scene::{Camera, SceneIntersector, World, gltf};

/// Why a program of this package stops: one line for its user.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// The scenes, by the names of their files.
pub const SCENES: [&str; 10] = [
    "p01_sphere",
    "p02_sphere_box",
    "p03_cognac",
    "p04_sphere_in_box",
    "p05_brass_ring",
    "p06_wave_plane",
    "p07_pool",
    "p08_square",
    "p09_cornell",
    "p10_torus_cube",
];

/// A scene in world space, with its reference: the caustic alone, on receivers that the camera
/// sees directly.
#[derive(Debug)]
pub struct Stage {
    /// Its file's name without the extension.
    pub name: String,
    /// The scene in world space.
    pub world: World,
    /// What rays are shot at.
    pub intersector: SceneIntersector,
    /// The scene's first camera.
    pub camera: Camera,
    /// The reference, linear radiance in W/(sr m²).
    pub reference: Image,
    /// Seconds from the file to the intersector, the reference not among them.
    pub load_seconds: f64,
}

/// The folder of the scenes.
#[must_use]
pub fn scene_folder() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/scenes"))
}

impl Stage {
    /// Loads a scene and its reference.
    ///
    /// # Errors
    /// If a file is missing or malformed.
    pub fn load(name: &str) -> Result<Self, Failure> {
        let folder = scene_folder();
        let start = Instant::now();
        let loaded = gltf::load_path(folder.join(format!("{name}.glb")))?;
        let world = World::new(&loaded.scene)?;
        let intersector = world.intersector(&BvhOptions::default())?;
        let load_seconds = start.elapsed().as_secs_f64();
        let camera = loaded
            .scene
            .cameras()
            .first()
            .cloned()
            .ok_or(format!("{name} has no camera"))?;
        let reference = read_exr(folder.join("reference").join(format!("{name}.exr")))?;
        Ok(Self {
            name: name.to_owned(),
            world,
            intersector,
            camera,
            reference,
            load_seconds,
        })
    }

    /// What the camera sees, in the reference's pixels.
    ///
    /// # Errors
    /// If the reference has more pixels than a picture may.
    pub fn g_buffer(&self) -> Result<GBuffer, RenderError> {
        let (width, height) = (self.reference.width(), self.reference.height());
        GBuffer::new(&self.world, &self.intersector, &self.camera, width, height)
    }
}
