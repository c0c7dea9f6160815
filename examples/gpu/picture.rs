//! One frame without a window, and what can be said of it.

use std::path::Path;

use caustics::filter::{Display, Image, write_png as write};
use caustics::prelude::{Light, Scene, TraceOptions};
use caustics_gpu_readback::{read, read_texture, reading_buffer};
use caustics_wgpu::{Capabilities, PreparedFrame, RecordedWork, SplatOptions, SplatStats};

use crate::Failure;
use crate::engine::Look;
use crate::headless::device;
use crate::stage::Stage;

/// Passes by name, and the milliseconds that each took.
pub type PassMilliseconds = Vec<(&'static str, f64)>;

/// A frame, read back.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Four bytes a pixel: red, green, blue, as sRGB, and 255.
    pub pixels: Vec<u8>,
    /// Irradiance of the caustics in W/m², and one more number.
    pub irradiance: Vec<[f32; 4]>,
    /// The adapter's name.
    pub adapter: String,
    /// What the renderer chose.
    pub capabilities: Capabilities,
    /// What became of the footprints.
    pub stats: SplatStats,
    /// What was recorded for the caustics.
    pub work: RecordedWork,
    /// Milliseconds of each of their passes, where the device can tell; passes of one name together.
    pub times: PassMilliseconds,
}

impl Snapshot {
    /// Draws one frame on a device of its own.
    ///
    /// # Errors
    /// No adapter, or whatever the scene or the device are wrong with.
    pub fn take(
        scene: Scene,
        look: &Look,
        size: [u32; 2],
        trace: TraceOptions,
        splat: SplatOptions,
    ) -> Result<Self, Failure> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let (adapter, device, queue) = device(&instance, None)?;
        let format = wgpu::TextureFormat::Rgba8UnormSrgb;
        let mut stage = Stage::new(&device, &queue, scene, size, format, trace)?;
        stage.set_splat(&device, splat)?;
        let texture = offscreen(&device, size, format);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let prepared = stage.draw(&device, &queue, &mut encoder, look, &view)?;
        let notes = FrameNotes::record(&device, &mut encoder, &prepared)?;
        queue.submit([encoder.finish()]);
        let (stats, times) = notes.read(&device, &prepared)?;
        let irradiance = prepared.irradiance(0)?.texture().clone();
        let irradiance = read_texture(&device, &queue, &irradiance, 16)?;
        Ok(Self {
            pixels: read_texture(&device, &queue, &texture, 4)?,
            irradiance: bytemuck::pod_collect_to_vec(&irradiance),
            adapter: adapter.get_info().name,
            capabilities: stage.caustics().capabilities(),
            stats,
            work: prepared.work(),
            times,
        })
    }
}

/// Copies of what a frame leaves in buffers.
#[derive(Debug)]
pub struct FrameNotes {
    stats: wgpu::Buffer,
    times: Option<wgpu::Buffer>,
}

impl FrameNotes {
    /// Records the copies, after the frame and before the next.
    ///
    /// # Errors
    /// If the frame has no view.
    pub fn record(
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        frame: &PreparedFrame,
    ) -> Result<Self, Failure> {
        let stats = reading_buffer(device, SplatStats::BYTES);
        encoder.copy_buffer_to_buffer(frame.stats(0)?, 0, &stats, 0, SplatStats::BYTES);
        let times = frame.timestamps().map(|timestamps| {
            let times = reading_buffer(device, timestamps.bytes());
            let bytes = timestamps.bytes();
            encoder.copy_buffer_to_buffer(timestamps.buffer(), 0, &times, 0, bytes);
            times
        });
        Ok(Self { stats, times })
    }

    /// Waits for the GPU and reads them: what became of the footprints, and the milliseconds of
    /// each pass.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn read(
        &self,
        device: &wgpu::Device,
        frame: &PreparedFrame,
    ) -> Result<(SplatStats, PassMilliseconds), Failure> {
        let stats = SplatStats::from_bytes(&read(device, &self.stats)?).ok_or("no stats")?;
        let mut sums = PassMilliseconds::new();
        if let (Some(times), Some(timestamps)) = (&self.times, frame.timestamps()) {
            for time in timestamps.pass_times(&read(device, times)?) {
                let milliseconds = 1e-6 * time.nanoseconds;
                match sums.iter_mut().find(|(pass, _)| *pass == time.pass) {
                    Some((_, sum)) => *sum += milliseconds,
                    None => sums.push((time.pass, milliseconds)),
                }
            }
        }
        Ok((stats, sums))
    }
}

/// A texture to draw into and to read back.
#[must_use]
pub fn offscreen(
    device: &wgpu::Device,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("offscreen"),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

/// The light that the engine shades with: the first, if there is one that is not a surface.
#[must_use]
pub fn main_light(scene: &Scene) -> Option<Light> {
    scene.lights().first().copied()
}

/// Writes pixels of four bytes as a PNG.
///
/// # Errors
/// If the file cannot be written.
pub fn write_png(path: &Path, [width, height]: [u32; 2], pixels: &[u8]) -> Result<(), Failure> {
    let linear = |byte: u8| {
        let value = f32::from(byte) / 255.0;
        if value <= 0.04045 {
            value / 12.92
        } else {
            ((value + 0.055) / 1.055).powf(2.4)
        }
    };
    let pixels = pixels
        .chunks_exact(4)
        .map(|it| [linear(it[0]), linear(it[1]), linear(it[2])])
        .collect();
    let image = Image::from_pixels(width, height, pixels)?;
    write(path, &image, &Display::default())?;
    Ok(())
}
