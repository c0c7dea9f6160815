use caustics::accel::BvhOptions;
use caustics::filter::Image;
use caustics::geometry::shapes::quad;
use caustics::prelude::*;
use caustics::render::{FootprintOptions, GBuffer, splat};
use caustics::scene::SceneIntersector;
use caustics_benches::stage::Failure;
use glam::Vec3;

/// A scene ready to be traced and seen.
pub(crate) struct View {
    pub(crate) world: World,
    pub(crate) rays: SceneIntersector,
    buffer: GBuffer,
}

impl View {
    pub(crate) fn new(scene: &Scene, camera: &Camera, size: u32) -> Result<Self, Failure> {
        let world = World::new(scene)?;
        let rays = world.intersector(&BvhOptions::default())?;
        let buffer = GBuffer::new(&world, &rays, camera, size, size)?;
        Ok(Self {
            world,
            rays,
            buffer,
        })
    }

    /// The caustics that photons make, as far as the camera sees them directly.
    pub(crate) fn caustics(&self, photons: &[Photon]) -> Result<Image, Failure> {
        Ok(splat(&self.buffer, photons, &FootprintOptions::default())?.0)
    }
}

/// A floor of 4 m with glass balls over it, and a camera that looks at the first one's caustic.
pub(crate) fn balls(centers: &[Vec3], radius: f32, lights: &[Light]) -> Result<Scene, Failure> {
    let mut scene = Scene::new();
    let glass = scene.add_material(Material::dielectric("glass", 1.5))?;
    let white = scene.add_material(Material::diffuse("white", [0.8; 3]))?;
    for &center in centers {
        // A floor for each.
        let corner = [center.x - 2.0, 0.0, center.z + 2.0];
        let floor = scene.add_mesh(quad(corner, [4.0, 0.0, 0.0], [0.0, 0.0, -4.0])?);
        scene.add_instance(Instance::new("floor", Shape::Mesh(floor), white))?;
        let ball = Shape::Sphere { center, radius };
        scene.add_instance(Instance::new("ball", ball, glass))?;
    }
    for light in lights {
        scene.add_light(*light)?;
    }
    Ok(scene)
}

/// Looks down at the floor beside a point.
pub(crate) fn camera_over(target: Vec3) -> Result<Camera, Failure> {
    let eye = target + Vec3::new(0.0, 2.2, 2.6);
    Ok(Camera::look_at(
        "camera",
        eye,
        target,
        [0.0, 1.0, 0.0],
        0.6,
    )?)
}

/// The mean of the channels' absolute values over all pixels.
pub(crate) fn mean_absolute(pixels: impl Iterator<Item = [f32; 3]>) -> f64 {
    let (mut sum, mut count) = (0.0, 0u64);
    for pixel in pixels {
        sum += pixel.iter().map(|it| f64::from(it.abs())).sum::<f64>() / 3.0;
        count += 1;
    }
    sum / count.max(1) as f64
}

/// The pixels of one picture less those of another.
pub(crate) fn difference<'a>(a: &'a Image, b: &'a Image) -> impl Iterator<Item = [f32; 3]> + 'a {
    a.pixels()
        .iter()
        .zip(b.pixels())
        .map(|(a, b)| std::array::from_fn(|channel| a[channel] - b[channel]))
}
