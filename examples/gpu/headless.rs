//! A device without a window, and pictures read back from it.

use caustics_wgpu::CausticsRenderer;

use crate::Failure;

/// Asks for a device as an engine does: what caustics require, and what they make use of where the
/// adapter has it.
///
/// # Errors
/// If there is no adapter, or it lacks the limits.
pub fn device(
    instance: &wgpu::Instance,
    surface: Option<&wgpu::Surface<'_>>,
) -> Result<(wgpu::Adapter, wgpu::Device, wgpu::Queue), Failure> {
    let options = wgpu::RequestAdapterOptions {
        compatible_surface: surface,
        ..wgpu::RequestAdapterOptions::default()
    };
    let adapter = pollster::block_on(instance.request_adapter(&options))?;
    let used = CausticsRenderer::used_features() & adapter.features();
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        label: Some("engine"),
        required_features: CausticsRenderer::required_features() | used,
        required_limits: CausticsRenderer::required_limits(),
        ..wgpu::DeviceDescriptor::default()
    }))?;
    Ok((adapter, device, queue))
}

/// The texels of a texture, `texel_bytes` each, row by row, once the GPU is done.
///
/// # Errors
/// If the device is lost.
pub fn read_texture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
    texel_bytes: u32,
) -> Result<Vec<u8>, Failure> {
    let row = texture.width() * texel_bytes;
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let target = reading_buffer(device, u64::from(padded * texture.height()));
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &target,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded),
                rows_per_image: None,
            },
        },
        texture.size(),
    );
    queue.submit([encoder.finish()]);
    let bytes = read(device, &target)?;
    let rows = bytes.chunks_exact(padded as usize);
    Ok(rows.flat_map(|it| &it[..row as usize]).copied().collect())
}

/// A buffer to copy to and to [`read`].
#[must_use]
pub fn reading_buffer(device: &wgpu::Device, size: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("reading"),
        size,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// The bytes of a buffer that was copied to, once the GPU is done.
///
/// # Errors
/// If the device is lost.
pub fn read(device: &wgpu::Device, buffer: &wgpu::Buffer) -> Result<Vec<u8>, Failure> {
    let (sender, receiver) = std::sync::mpsc::channel();
    buffer
        .slice(..)
        .map_async(wgpu::MapMode::Read, move |result| {
            // Nobody waits any more: nothing to tell.
            let _ = sender.send(result);
        });
    device.poll(wgpu::PollType::wait_indefinitely())?;
    receiver.recv()??;
    let bytes = buffer.slice(..).get_mapped_range()?.to_vec();
    buffer.unmap();
    Ok(bytes)
}
