//! A scene, its photons by the CPU, and what a camera sees of it, on both sides.

use std::path::PathBuf;

use caustics_filter::Image;
use caustics_gpu_readback::{read_buffer, read_texture, uploaded_buffer, uploaded_texture};
use caustics_render::{FootprintOptions, GBuffer, splat};
use caustics_scene::{BvhOptions, Camera, Scene, SceneIntersector, Surface, World, gltf};
use caustics_trace::{Photon, TraceOptions, trace_photons};
use caustics_wgpu::glam::Vec3;
use caustics_wgpu::{
    CausticsRenderer, FootprintBatch, FootprintRecord, FrameLight, FrameParams, RendererOptions,
    SplatStats, SurfaceInput, ViewParams, camera_matrix, wgpu,
};

pub(crate) type TestError = Box<dyn std::error::Error + Send + Sync>;

/// A device as a host makes it, with the required limits and these features; `None`, and a printed
/// word, where the machine has no adapter for it.
///
/// # Panics
/// Without an adapter where `CI` is set, and on any error that nobody asks for.
pub(crate) fn device_with(features: wgpu::Features) -> Option<(wgpu::Device, wgpu::Queue)> {
    let made = pollster::block_on(async {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::VULKAN,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let adapter = instance
            .request_adapter(&wgpu::RequestAdapterOptions::default())
            .await
            .map_err(|error| error.to_string())?;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("host"),
            required_features: CausticsRenderer::required_features() | features,
            required_limits: CausticsRenderer::required_limits(),
            ..wgpu::DeviceDescriptor::default()
        };
        let made = adapter.request_device(&descriptor).await;
        made.map_err(|error| error.to_string())
    });
    match made {
        Ok((device, queue)) => {
            device.on_uncaptured_error(std::sync::Arc::new(|error| panic!("{error}")));
            Some((device, queue))
        }
        Err(error) => {
            assert!(std::env::var_os("CI").is_none(), "no GPU device: {error}");
            println!("skipped: no GPU device: {error}");
            None
        }
    }
}

/// A receiver that a pixel sees.
#[derive(Clone, Copy)]
pub(crate) struct Seen {
    pub(crate) position: Vec3,
    pub(crate) normal: Vec3,
    pub(crate) albedo: Vec3,
    pub(crate) object: u32,
}

/// What a camera sees at the middle of each pixel.
pub(crate) struct Picture {
    pub(crate) camera: Camera,
    pub(crate) size: [u32; 2],
    pub(crate) seen: Vec<Option<Seen>>,
    /// Pixels that the CPU divides, because an edge goes through them.
    pub(crate) is_edge: Vec<bool>,
}

/// A scene and its photons.
pub(crate) struct Stage {
    pub(crate) world: World,
    pub(crate) rays: SceneIntersector,
    pub(crate) photons: Vec<Photon>,
    pub(crate) camera: Camera,
}

impl Stage {
    /// The file of this name among the scenes of the workspace's tests.
    pub(crate) fn load(name: &str, photons: u32) -> Result<Self, TestError> {
        let path: PathBuf = [
            env!("CARGO_MANIFEST_DIR"),
            "../../tests/scenes",
            &format!("{name}.glb"),
        ]
        .iter()
        .collect();
        Self::of(&gltf::load_path(path)?.scene, photons)
    }

    /// A scene with a camera.
    pub(crate) fn of(scene: &Scene, photons: u32) -> Result<Self, TestError> {
        let world = World::new(scene)?;
        let rays = world.intersector(&BvhOptions::default())?;
        let options = TraceOptions {
            photons,
            ..TraceOptions::default()
        };
        let photons = trace_photons(&world, &rays, &options, &|_| {})?.photons;
        let camera = scene.cameras().first().ok_or("no camera")?.clone();
        Ok(Self {
            world,
            rays,
            photons,
            camera,
        })
    }

    pub(crate) fn picture(&self, camera: &Camera, size: [u32; 2]) -> Picture {
        let [width, height] = size;
        let seen: Vec<_> = (0..width * height)
            .map(|pixel| {
                let (x, y) = ((pixel % width) as f32, (pixel / width) as f32);
                self.look(camera, size, x + 0.5, y + 0.5)
            })
            .collect();
        let is_smooth = |one: usize, other: usize| match (&seen[one], &seen[other]) {
            (None, None) => true,
            (Some(one), Some(other)) => {
                one.object == other.object && one.normal.dot(other.normal) > 0.98
            }
            _ => false,
        };
        let is_edge = (0..seen.len())
            .map(|pixel| {
                let (x, y) = (pixel as u32 % width, pixel as u32 / width);
                (x > 0 && !is_smooth(pixel, pixel - 1))
                    || (x + 1 < width && !is_smooth(pixel, pixel + 1))
                    || (y > 0 && !is_smooth(pixel, pixel - width as usize))
                    || (y + 1 < height && !is_smooth(pixel, pixel + width as usize))
            })
            .collect();
        Picture {
            camera: camera.clone(),
            size,
            seen,
            is_edge,
        }
    }

    fn look(&self, camera: &Camera, size: [u32; 2], x: f32, y: f32) -> Option<Seen> {
        use caustics_accel::Intersect;
        let ray = camera.ray(x, y, size[0], size[1]);
        let hit = self.rays.closest_hit(&ray)?;
        let point = self.world.surface(&ray, &hit)?;
        let Surface::Diffuse { albedo } = self.world.materials()[point.material as usize].surface
        else {
            return None;
        };
        let side = if point.from_outside { 1.0 } else { -1.0 };
        Some(Seen {
            position: point.spawn.position,
            normal: side * point.geometric_normal,
            albedo,
            object: point.object,
        })
    }

    /// The CPU's splat.
    pub(crate) fn splat(
        &self,
        picture: &Picture,
        options: &FootprintOptions,
    ) -> Result<Image, TestError> {
        let [width, height] = picture.size;
        let buffer = GBuffer::new(&self.world, &self.rays, &picture.camera, width, height)?;
        Ok(splat(&buffer, &self.photons, options)?.0)
    }
}

/// The textures of a picture on the GPU.
pub(crate) struct PictureTextures {
    pub(crate) positions: wgpu::TextureView,
    pub(crate) normals: wgpu::TextureView,
    pub(crate) objects: wgpu::TextureView,
}

impl Picture {
    pub(crate) fn textures(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> PictureTextures {
        let wide = |value: fn(&Seen) -> Vec3| -> Vec<u8> {
            let texel = |seen: &Option<Seen>| seen.as_ref().map_or(Vec3::ZERO, value).extend(0.0);
            let texels: Vec<[f32; 4]> = self.seen.iter().map(|it| texel(it).to_array()).collect();
            bytemuck::cast_slice(&texels).to_vec()
        };
        let objects: Vec<u32> = self
            .seen
            .iter()
            .map(|it| it.map_or(0, |it| it.object))
            .collect();
        let make = |format, bytes: &[u8]| uploaded_texture(device, queue, self.size, format, bytes);
        PictureTextures {
            positions: make(wgpu::TextureFormat::Rgba32Float, &wide(|it| it.position)),
            normals: make(wgpu::TextureFormat::Rgba32Float, &wide(|it| it.normal)),
            objects: make(wgpu::TextureFormat::R32Uint, bytemuck::cast_slice(&objects)),
        }
    }

    pub(crate) fn view<'a>(&self, textures: &'a PictureTextures) -> ViewParams<'a> {
        let matrix = camera_matrix(&self.camera, self.size, 0.01, 100.0);
        let surface = SurfaceInput::Position(&textures.positions);
        ViewParams {
            objects: Some(&textures.objects),
            ..ViewParams::new(self.size, matrix, surface, &textures.normals)
        }
    }

    /// Radiance from irradiance, as the CPU's picture has it.
    pub(crate) fn radiance(&self, irradiance: &[[f32; 4]]) -> Vec<[f32; 3]> {
        self.seen
            .iter()
            .zip(irradiance)
            .map(|(seen, &[r, g, b, _])| {
                let albedo = seen.map_or(Vec3::ZERO, |it| it.albedo);
                (albedo * Vec3::new(r, g, b) / std::f32::consts::PI).to_array()
            })
            .collect()
    }
}

/// Photons as the GPU has them: records, and their count.
pub(crate) fn upload(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    photons: &[Photon],
) -> (wgpu::Buffer, wgpu::Buffer) {
    let records: Vec<FootprintRecord> = photons.iter().map(FootprintRecord::from).collect();
    let count = [records.len() as u32];
    (
        uploaded_buffer(device, queue, bytemuck::cast_slice(&records), 16),
        uploaded_buffer(device, queue, bytemuck::cast_slice(&count), 16),
    )
}

/// One view's irradiance, and what became of the footprints.
pub(crate) fn irradiance(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    options: &RendererOptions,
    picture: &Picture,
    batches: &[&[Photon]],
) -> Result<(Vec<[f32; 4]>, SplatStats), TestError> {
    let uploaded: Vec<_> = batches
        .iter()
        .map(|batch| upload(device, queue, batch))
        .collect();
    let footprints: Vec<_> = uploaded
        .iter()
        .map(|(records, count)| FootprintBatch { records, count })
        .collect();
    let light = FrameLight::Footprints(&footprints);
    irradiance_of(device, queue, options, picture, light)
}

/// Likewise, of any light.
pub(crate) fn irradiance_of(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    options: &RendererOptions,
    picture: &Picture,
    light: FrameLight<'_>,
) -> Result<(Vec<[f32; 4]>, SplatStats), TestError> {
    let mut renderer = CausticsRenderer::new(device, options)?;
    let textures = picture.textures(device, queue);
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let frame = FrameParams {
        light,
        views: &[picture.view(&textures)],
    };
    let prepared = renderer.prepare(device, queue, &mut encoder, &frame)?;
    queue.submit([encoder.finish()]);
    let texture = prepared.irradiance(0)?.texture().clone();
    let texels = read_texture(device, queue, &texture, 16)?;
    let stats = read_buffer(device, queue, prepared.stats(0)?, SplatStats::BYTES)?;
    Ok((
        bytemuck::pod_collect_to_vec(&texels),
        SplatStats::from_bytes(&stats).ok_or("too short")?,
    ))
}

/// The sum of the differences over the sum of what is expected, and the part of the lit pixels that
/// are off by more than a hundredth of what is expected there and a thousandth of the mean; both
/// over pixels without an edge.
pub(crate) fn differences(picture: &Picture, found: &[[f32; 3]], expected: &Image) -> (f64, f64) {
    let smooth = picture.is_edge.iter().map(|edge| !edge);
    let pixels: Vec<_> = smooth
        .zip(found.iter().zip(expected.pixels()))
        .filter(|(is_smooth, _)| *is_smooth)
        .map(|(_, (found, expected))| (Vec3::from(*found), Vec3::from(*expected)))
        .collect();
    let sum = |it: Vec3| f64::from(it.x) + f64::from(it.y) + f64::from(it.z);
    let total: f64 = pixels.iter().map(|(_, expected)| sum(*expected)).sum();
    let mean = total / pixels.len() as f64;
    let off: f64 = pixels.iter().map(|(a, b)| sum((*a - *b).abs())).sum();
    let lit = pixels.iter().filter(|(a, b)| sum(*a + *b) > 0.0);
    let is_off = |(a, b): &&(Vec3, Vec3)| sum((*a - *b).abs()) > 0.01 * sum(*b) + 1e-3 * mean;
    let wrong = lit.clone().filter(is_off).count();
    (off / total, wrong as f64 / lit.count() as f64)
}
