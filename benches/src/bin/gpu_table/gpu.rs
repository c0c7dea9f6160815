//! A device, what is sent to it and what is read from it.

use caustics::accel::Intersect;
use caustics::prelude::Surface;
use caustics_benches::stage::{Failure, Stage};
use caustics_wgpu::{CausticsRenderer, SurfaceInput, ViewParams, camera_matrix};

/// A device with all that a renderer makes use of.
pub(crate) struct Gpu {
    pub(crate) name: String,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
}

impl Gpu {
    pub(crate) fn new() -> Result<Self, Failure> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..wgpu::RequestAdapterOptions::default()
        };
        let adapter = pollster::block_on(instance.request_adapter(&options))?;
        let descriptor = wgpu::DeviceDescriptor {
            required_features: CausticsRenderer::used_features() & adapter.features(),
            required_limits: CausticsRenderer::required_limits(),
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))?;
        let info = adapter.get_info();
        let kind = if info.device_type == wgpu::DeviceType::Cpu {
            "a software adapter"
        } else {
            "a GPU"
        };
        Ok(Self {
            name: format!("{}, {kind}", info.name),
            device,
            queue,
        })
    }

    /// Runs what is recorded, and waits until the GPU has done it.
    pub(crate) fn run<T>(
        &self,
        record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let descriptor = wgpu::CommandEncoderDescriptor::default();
        let mut encoder = self.device.create_command_encoder(&descriptor);
        let value = record(&mut encoder)?;
        self.queue.submit([encoder.finish()]);
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(value)
    }

    pub(crate) fn read(&self, source: &wgpu::Buffer, bytes: u64) -> Result<Vec<u8>, Failure> {
        let target = self.target(bytes);
        self.run(|encoder| {
            encoder.copy_buffer_to_buffer(source, 0, &target, 0, bytes);
            Ok(())
        })?;
        self.map(&target)
    }

    /// The texels of a texture of four floats.
    pub(crate) fn read_texture(&self, texture: &wgpu::Texture) -> Result<Vec<[f32; 4]>, Failure> {
        let row = 16 * texture.width();
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let target = self.target(u64::from(padded * texture.height()));
        self.run(|encoder| {
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded),
                rows_per_image: None,
            };
            let into = wgpu::TexelCopyBufferInfo {
                buffer: &target,
                layout,
            };
            encoder.copy_texture_to_buffer(texture.as_image_copy(), into, texture.size());
            Ok(())
        })?;
        let bytes = self.map(&target)?;
        let rows = bytes.chunks_exact(padded as usize);
        let texels: Vec<u8> = rows.flat_map(|it| &it[..row as usize]).copied().collect();
        Ok(bytemuck::pod_collect_to_vec(&texels))
    }

    fn target(&self, size: u64) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("reading"),
            size,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    fn map(&self, target: &wgpu::Buffer) -> Result<Vec<u8>, Failure> {
        let (sender, receiver) = std::sync::mpsc::channel();
        let range = target.slice(..);
        range.map_async(wgpu::MapMode::Read, move |result| {
            // Nobody waits any more: nothing to tell.
            let _ = sender.send(result);
        });
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        receiver.recv()??;
        Ok(target.slice(..).get_mapped_range()?.to_vec())
    }

    pub(crate) fn buffer<T: bytemuck::NoUninit>(&self, values: &[T]) -> wgpu::Buffer {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("uploaded"),
            size: bytes.len().max(80) as u64,
            usage: wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::COPY_DST
                | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        self.queue.write_buffer(&buffer, 0, bytes);
        buffer
    }

    fn texture<T: bytemuck::NoUninit>(
        &self,
        [width, height]: [u32; 2],
        format: wgpu::TextureFormat,
        texels: &[T],
    ) -> wgpu::TextureView {
        let size = wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        };
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("receivers"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let bytes: &[u8] = bytemuck::cast_slice(texels);
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(bytes.len() as u32 / height),
            rows_per_image: None,
        };
        self.queue
            .write_texture(texture.as_image_copy(), bytes, layout, size);
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    }
}

/// What a scene's camera sees, for the GPU and to compare with.
pub(crate) struct Receivers {
    pub(crate) size: [u32; 2],
    /// Positions and normals; a normal of 0 where no receiver is seen.
    pub(crate) points: Vec<[[f32; 3]; 2]>,
    pub(crate) albedo: Vec<[f32; 3]>,
    objects: Vec<u32>,
    textures: [wgpu::TextureView; 3],
}

impl Receivers {
    pub(crate) fn new(gpu: &Gpu, stage: &Stage) -> Self {
        let size @ [width, height] = [stage.reference.width(), stage.reference.height()];
        let count = (width * height) as usize;
        let mut points = vec![[[0.0; 3]; 2]; count];
        let mut albedo = vec![[0.0; 3]; count];
        let mut objects = vec![0; count];
        for (pixel, number) in (0..count).zip(0u32..) {
            let (x, y) = ((number % width) as f32, (number / width) as f32);
            let ray = stage.camera.ray(x + 0.5, y + 0.5, width, height);
            let hit = stage.intersector.closest_hit(&ray);
            let Some(point) = hit.and_then(|hit| stage.world.surface(&ray, &hit)) else {
                continue;
            };
            let surface = stage.world.materials()[point.material as usize].surface;
            if let Surface::Diffuse { albedo: reflected } = surface {
                let side = if point.from_outside { 1.0 } else { -1.0 };
                let normal = side * point.geometric_normal;
                points[pixel] = [point.spawn.position, normal].map(|it| it.to_array());
                objects[pixel] = point.object;
                albedo[pixel] = reflected.to_array();
            }
        }
        let wide = wgpu::TextureFormat::Rgba32Float;
        let part = |index: usize| -> Vec<[f32; 4]> {
            let four = |[x, y, z]: [f32; 3]| [x, y, z, 0.0];
            points.iter().map(|it: &[_; 2]| four(it[index])).collect()
        };
        let textures = [
            gpu.texture(size, wide, &part(0)),
            gpu.texture(size, wide, &part(1)),
            gpu.texture(size, wgpu::TextureFormat::R32Uint, &objects),
        ];
        Self {
            size,
            points,
            albedo,
            objects,
            textures,
        }
    }

    pub(crate) fn view(&self, stage: &Stage) -> ViewParams<'_> {
        let matrix = camera_matrix(&stage.camera, self.size, 0.01, 100.0);
        let [positions, normals, objects] = &self.textures;
        let surface = SurfaceInput::Position(positions);
        ViewParams {
            objects: Some(objects),
            ..ViewParams::new(self.size, matrix, surface, normals)
        }
    }

    /// Whether the four pixels beside a pixel see the same object as it does.
    pub(crate) fn is_inside(&self, pixel: usize) -> bool {
        let width = self.size[0] as usize;
        let kind = |at: usize| (self.points[at][1] == [0.0; 3], self.objects[at]);
        let around = [
            pixel.checked_sub(1),
            Some(pixel + 1),
            pixel.checked_sub(width),
            Some(pixel + width),
        ];
        around
            .into_iter()
            .all(|it| it.is_some_and(|it| it < self.points.len() && kind(it) == kind(pixel)))
    }
}
